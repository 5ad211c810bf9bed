//! The plan of a module's code: functions with machine code of their own, and functions that are lowered where they are
//! used.

use crate::ir::{FunctionId, Module, Op};

/// Bodies of branches and loops are lowered in place unless they are used in several places and larger than this.
const SMALL: usize = 16;

/// Bodies within bodies that are lowered in place at most: lowering recurses that deep.
const NESTING: usize = 32;

/// For every function of a module, how bodies that name it are lowered.
pub(super) struct Plan {
    functions: Vec<Placement>,
}

#[derive(Clone, Copy, Default)]
struct Placement {
    /// Bodies that name it.
    uses: usize,
    /// Nodes, with those of the bodies that are lowered within it.
    size: usize,
    /// Levels of bodies that are lowered within it.
    nesting: usize,
    /// The function, or one that it uses, loops or calls.
    counts_steps: bool,
    /// The visit has reached it.
    entered: bool,
    /// All of the above are final.
    done: bool,
    /// The function is its own ancestor, which no valid module has.
    cyclic: bool,
}

impl Plan {
    pub(super) fn new(module: &Module) -> Plan {
        let mut plan = Plan { functions: vec![Placement::default(); module.functions.len()] };
        for op in module.functions.iter().flat_map(|f| &f.nodes).map(|n| &n.op) {
            bodies(op).for_each(|f| plan.functions[f.0 as usize].uses += 1);
        }
        for id in 0..module.functions.len() {
            plan.visit(module, id);
        }
        plan
    }

    /// Whether a branch or loop with this body calls it instead of having it in place.
    pub(super) fn is_called(&self, body: FunctionId) -> bool {
        let placement = &self.functions[body.0 as usize];
        placement.cyclic || placement.nesting >= NESTING || (placement.uses > 1 && placement.size > SMALL)
    }

    /// Nodes of the bodies of an operation that are lowered in place.
    pub(super) fn size_in_place(&self, op: &Op) -> usize {
        bodies(op).filter(|f| !self.is_called(*f)).map(|f| self.functions[f.0 as usize].size).sum()
    }

    /// Whether a function loops or calls, so that its steps need counting.
    pub(super) fn counts_steps(&self, function: FunctionId) -> bool {
        self.functions[function.0 as usize].counts_steps
    }

    /// Depth-first over bodies, without recursion (a hostile module may nest deeply): a function is finished after the
    /// bodies that it names.
    fn visit(&mut self, module: &Module, root: usize) {
        let mut stack = vec![(root, false)];
        while let Some((id, children_done)) = stack.pop() {
            if children_done {
                self.finish(module, id);
            } else if !self.functions[id].entered {
                self.functions[id].entered = true;
                stack.push((id, true));
                let nodes = &module.functions[id].nodes;
                stack.extend(nodes.iter().flat_map(|n| bodies(&n.op)).map(|f| (f.0 as usize, false)));
            }
        }
    }

    fn finish(&mut self, module: &Module, id: usize) {
        let nodes = &module.functions[id].nodes;
        let mut placement = Placement { size: nodes.len(), done: true, ..self.functions[id] };
        for op in nodes.iter().map(|n| &n.op) {
            placement.counts_steps |= matches!(op, Op::Loop { .. } | Op::Call { .. });
            for body in bodies(op) {
                self.functions[body.0 as usize].cyclic |= !self.functions[body.0 as usize].done;
                let inner = self.functions[body.0 as usize];
                placement.counts_steps |= inner.counts_steps;
                if !self.is_called(body) {
                    placement.size = placement.size.saturating_add(inner.size);
                    placement.nesting = placement.nesting.max(inner.nesting + 1);
                }
            }
        }
        placement.cyclic = self.functions[id].cyclic;
        self.functions[id] = placement;
    }
}

/// The functions that are bodies of a branch or loop.
fn bodies(op: &Op) -> impl Iterator<Item = FunctionId> {
    let (a, b) = match op {
        Op::If { then, otherwise, .. } => (Some(*then), Some(*otherwise)),
        Op::Loop { body, .. } => (Some(*body), None),
        _ => (None, None),
    };
    a.into_iter().chain(b)
}
