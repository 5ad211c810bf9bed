//! Free variables: the locals that an expression uses from outside, in the order of their first use.

use crate::check::typed::{Expr, ExprKind, LocalId, Statement};
use crate::ir::hash::HashSet;

/// The locals used so far. Locals are unique in a model: one that is bound inside of the expressions is never used
/// outside.
#[derive(Default)]
pub(super) struct Free {
    seen: HashSet<LocalId>,
    /// The locals that are used and not bound inside, in order.
    order: Vec<LocalId>,
}

impl Free {
    /// The locals that expressions use from outside, except those that the caller binds.
    pub(super) fn of(exprs: &[&Expr], bound: &[LocalId]) -> Vec<LocalId> {
        let mut free = Free { seen: bound.iter().copied().collect(), order: Vec::new() };
        exprs.iter().for_each(|e| free.expr(e));
        free.order
    }

    fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Local(local) if self.seen.insert(*local) => self.order.push(*local),
            // A local is used only after its binding.
            ExprKind::Block(statements, _) => self.seen.extend(statements.iter().filter_map(|s| match s {
                Statement::Let(local, _) => Some(*local),
                Statement::Require { .. } => None,
            })),
            ExprKind::Fold { index, accumulator, .. } => self.seen.extend([*index, *accumulator]),
            _ => {}
        }
        expr.for_each_child(&mut |e| self.expr(e));
    }
}
