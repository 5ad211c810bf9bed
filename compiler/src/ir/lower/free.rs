//! Which locals an expression uses, in the order of their first use.

use crate::check::typed::{Call, Expr, ExprKind, LocalId, Statement};
use crate::ir::hash::HashSet;

/// The locals used so far. Locals are unique in a model, so that those bound inside can be told from those used from
/// outside by having been bound.
#[derive(Default)]
pub(super) struct Free {
    /// Used and not bound inside.
    pub(super) locals: HashSet<LocalId>,
    /// The same, in order.
    pub(super) order: Vec<LocalId>,
    bound: HashSet<LocalId>,
}

impl Free {
    /// The locals that an expression uses from outside.
    pub(super) fn of(exprs: &[&Expr], bound: &[LocalId]) -> Vec<LocalId> {
        let mut free = Free { bound: bound.iter().copied().collect(), ..Free::default() };
        exprs.iter().for_each(|e| free.expr(e));
        free.order
    }

    pub(super) fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Real(_) | ExprKind::Int(_) | ExprKind::Bool(_) | ExprKind::Text(_) => {}
            ExprKind::Local(local) => {
                if !self.bound.contains(local) && self.locals.insert(*local) {
                    self.order.push(*local);
                }
            }
            ExprKind::Convert(a) | ExprKind::Unary(_, a) | ExprKind::Element(a, _) => self.expr(a),
            ExprKind::Binary(_, a, b) | ExprKind::Index(a, b) => {
                self.expr(a);
                self.expr(b);
            }
            ExprKind::If(c, a, b) => [c, a, b].into_iter().for_each(|e| self.expr(e)),
            ExprKind::Aggregate(items) => items.iter().for_each(|e| self.expr(e)),
            ExprKind::Block(statements, value) => {
                for statement in statements {
                    match statement {
                        Statement::Let(local, value) => {
                            self.expr(value);
                            self.bound.insert(*local);
                        }
                        Statement::Require { condition, .. } => self.expr(condition),
                    }
                }
                self.expr(value);
            }
            ExprKind::Call(call) | ExprKind::Derivative { call, .. } => self.call(call),
            ExprKind::Fold { from, to, init, index, accumulator, body } => {
                [from, to, init].into_iter().for_each(|e| self.expr(e));
                self.bound.extend([*index, *accumulator]);
                self.expr(body);
            }
        }
    }

    fn call(&mut self, call: &Call) {
        call.closure.iter().for_each(|e| self.expr(e));
        call.args.iter().for_each(|e| self.expr(e));
    }
}
