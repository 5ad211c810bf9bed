//! Rules for truth values, comparisons and selection.

use crate::ir::scalar::Scalar;
use crate::ir::{Binary, Compare, FunctionBuilder, Op, Type, Unary, Value};

impl FunctionBuilder {
    pub(super) fn simpler_logic(&mut self, op: Binary, a: Value, b: Value) -> Option<Value> {
        if a == b {
            return Some(a);
        }
        for (x, y) in [(a, b), (b, a)] {
            if let Some(Scalar::Bool(c)) = self.constant(x) {
                // true and y, false or y are y; false and y, true or y are the constant.
                return Some(if c == (op == Binary::And) { y } else { x });
            }
        }
        None
    }

    pub(super) fn simpler_not(&mut self, a: Value) -> Option<Value> {
        match *self.op(a) {
            Op::Unary(Unary::Not, x) => Some(x),
            // Exact for NaN as well: Ne is the one comparison that holds there.
            Op::Compare(Compare::Eq, x, y) => Some(self.compare(Compare::Ne, x, y)),
            Op::Compare(Compare::Ne, x, y) => Some(self.compare(Compare::Eq, x, y)),
            Op::Compare(op, x, y) if self.ty(x) == Type::Int => {
                let opposite = match op {
                    Compare::Lt => Compare::Ge,
                    Compare::Le => Compare::Gt,
                    Compare::Gt => Compare::Le,
                    Compare::Ge => Compare::Lt,
                    Compare::Eq | Compare::Ne => return None,
                };
                Some(self.compare(opposite, x, y))
            }
            _ => None,
        }
    }

    /// A comparison that cannot be folded, in one of the forms =, !=, <, <=.
    pub(super) fn simple_compare(&mut self, op: Compare, a: Value, b: Value) -> Value {
        // What is not a number equals nothing, not even itself, but is neither below nor above itself either.
        let strict = matches!(op, Compare::Lt | Compare::Gt);
        if a == b && (strict || self.is_number(a)) {
            return self.bool(matches!(op, Compare::Eq | Compare::Le | Compare::Ge));
        }
        let (op, a, b) = match op {
            Compare::Gt => (Compare::Lt, b, a),
            Compare::Ge => (Compare::Le, b, a),
            Compare::Eq | Compare::Ne if b < a => (op, b, a),
            _ => (op, a, b),
        };
        self.node(Op::Compare(op, a, b), Type::Bool)
    }

    /// Whether a value is known not to be NaN. (Finite operands do not suffice: a difference of what overflowed is
    /// NaN.)
    fn is_number(&self, value: Value) -> bool {
        self.ty(value) != Type::Real || matches!(self.op(value), Op::Unary(Unary::ToReal, _))
    }

    pub(super) fn simpler_select(&mut self, condition: Value, a: Value, b: Value) -> Option<Value> {
        if a == b {
            return Some(a);
        }
        match *self.op(condition) {
            Op::Bool(c) => return Some(if c { a } else { b }),
            Op::Unary(Unary::Not, c) => return Some(self.select(c, b, a)),
            _ => {}
        }
        if let (Some(Scalar::Bool(x)), Some(Scalar::Bool(_))) = (self.constant(a), self.constant(b)) {
            return Some(if x { condition } else { self.unary(Unary::Not, condition) });
        }
        // An arm that selects by the same condition.
        if let Op::Select(c, x, _) = *self.op(a)
            && c == condition
        {
            return Some(self.select(condition, x, b));
        }
        if let Op::Select(c, _, y) = *self.op(b)
            && c == condition
        {
            return Some(self.select(condition, a, y));
        }
        None
    }
}
