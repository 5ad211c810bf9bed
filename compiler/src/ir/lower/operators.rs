//! Operators.

use super::{Frame, SizeError};
use crate::check::typed::{Expr, Type};
use crate::ir::scalar::Scalar;
use crate::ir::{self, Binary, Compare, Failure, Unary, Value};
use crate::source::Span;

impl Frame<'_, '_> {
    pub(super) fn unary(&mut self, op: Unary, a: Value) -> Value {
        let value = match op {
            // Only reals have a derivative to stop.
            Unary::Stop if self.b.ty(a) != ir::Type::Real => return a,
            op => self.b.unary(op, a),
        };
        // The typed tree rounds to ints.
        let rounds = matches!(op, Unary::Floor | Unary::Ceil | Unary::Round);
        if rounds { self.b.unary(Unary::ToInt, value) } else { value }
    }

    pub(super) fn binary(&mut self, op: Binary, a: &Expr, b: &Expr, span: Span) -> Result<Vec<Value>, SizeError> {
        let (xs, ys) = (self.expr(a)?, self.expr(b)?);
        self.b.set_span(span);
        if op == Binary::Pow {
            return Ok(vec![self.pow(xs[0], ys[0], &b.ty)]);
        }
        // A tuple with a number: the number with each component.
        let count = xs.len().max(ys.len());
        let nth = |values: &[Value], i: usize| if values.len() == 1 { values[0] } else { values[i] };
        let mut combine = |i: usize| {
            let (a, b) = (nth(&xs, i), nth(&ys, i));
            if op == Binary::Rem && self.b.ty(a) == ir::Type::Int {
                return self.int_remainder(a, b, span);
            }
            self.b.binary(op, a, b)
        };
        Ok((0..count).map(&mut combine).collect())
    }

    pub(super) fn compare(&mut self, op: Compare, a: &Expr, b: &Expr, span: Span) -> Result<Value, SizeError> {
        let (a, b) = (self.scalar(a)?, self.scalar(b)?);
        self.b.set_span(span);
        Ok(self.b.compare(op, a, b))
    }

    fn int_remainder(&mut self, a: Value, b: Value, span: Span) -> Value {
        let zero = self.b.int(0);
        let fine = self.b.compare(Compare::Ne, b, zero);
        let remainder = self.b.binary(Binary::Rem, a, b);
        if self.b.constant(fine) == Some(Scalar::Bool(true)) {
            return remainder;
        }
        let message = "division by zero: the remainder of a division by 0 has no value".to_owned();
        let failure = self.lowerer.module.fail(Failure { span, message });
        self.b.guard(remainder, fine, failure)
    }

    /// The exponent is a real, or an int known to the checker.
    fn pow(&mut self, x: Value, y: Value, exponent: &Type) -> Value {
        let known = match (exponent, self.b.constant(y)) {
            (Type::Int(Some(n)), _) => Some(*n),
            (_, Some(Scalar::Int(n))) => Some(n),
            _ => None,
        };
        if let Some(n) = known.and_then(|n| i32::try_from(n).ok()) {
            return self.b.pow_int(x, n);
        }
        let y = if self.b.ty(y) == ir::Type::Int { self.b.unary(Unary::ToReal, y) } else { y };
        self.b.pow(x, y)
    }
}
