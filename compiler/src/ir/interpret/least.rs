//! The least number of steps that a function takes, so that what cannot end within a limit need not begin.

use crate::ir::hash::HashMap;
use crate::ir::{FunctionId, Module, Op};

/// Functions within functions that are looked into; what is deeper counts as nothing.
const DEPTH: usize = 40;

/// The least steps of the functions of a module that were asked for.
#[derive(Default)]
pub(super) struct LeastSteps {
    known: HashMap<FunctionId, u64>,
}

impl LeastSteps {
    /// The steps of one run: no fewer can be taken, unless it fails.
    pub(super) fn steps(&mut self, module: &Module, function: FunctionId) -> u64 {
        self.within(module, function, DEPTH)
    }

    fn within(&mut self, module: &Module, id: FunctionId, depth: usize) -> u64 {
        let Some(depth) = depth.checked_sub(1) else { return 0 };
        if let Some(steps) = self.known.get(&id) {
            return *steps;
        }
        // A function that calls itself counts as nothing there.
        self.known.insert(id, 0);
        let function = module.function(id);
        let mut steps = function.nodes.len() as u64;
        for node in &function.nodes {
            let inner = match &node.op {
                Op::Call { function, .. } => self.within(module, *function, depth),
                Op::If { then, otherwise, .. } => {
                    self.within(module, *then, depth).min(self.within(module, *otherwise, depth))
                }
                Op::Loop { count, body, .. } => match function.op(*count) {
                    Op::Int(n) if *n > 0 => {
                        n.unsigned_abs().saturating_mul(self.within(module, *body, depth).saturating_add(1))
                    }
                    _ => 0,
                },
                _ => 0,
            };
            steps = steps.saturating_add(inner);
        }
        self.known.insert(id, steps);
        steps
    }
}
