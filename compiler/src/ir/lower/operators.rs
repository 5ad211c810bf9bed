//! Operators.

use super::{Frame, TooLarge};
use crate::check::typed::{self, Expr, Type};
use crate::ir::scalar::Scalar;
use crate::ir::{self, Binary, Compare, Failure, Unary, Value};
use crate::source::Span;

impl Frame<'_, '_> {
    pub(super) fn unary(&mut self, op: typed::Unary, a: Value) -> Value {
        let op = match op {
            typed::Unary::Neg => Unary::Neg,
            typed::Unary::Abs => Unary::Abs,
            typed::Unary::Sign => Unary::Sign,
            typed::Unary::Sqrt => Unary::Sqrt,
            typed::Unary::Exp => Unary::Exp,
            typed::Unary::Ln => Unary::Ln,
            typed::Unary::Sin => Unary::Sin,
            typed::Unary::Cos => Unary::Cos,
            typed::Unary::Tan => Unary::Tan,
            typed::Unary::Asin => Unary::Asin,
            typed::Unary::Acos => Unary::Acos,
            typed::Unary::Atan => Unary::Atan,
            typed::Unary::Sinh => Unary::Sinh,
            typed::Unary::Cosh => Unary::Cosh,
            typed::Unary::Tanh => Unary::Tanh,
            typed::Unary::Not => Unary::Not,
            typed::Unary::Truncate => Unary::ToInt,
            typed::Unary::Floor => return self.round_to_int(Unary::Floor, a),
            typed::Unary::Ceil => return self.round_to_int(Unary::Ceil, a),
            typed::Unary::Round => return self.round_to_int(Unary::Round, a),
            // Of what is no real there is no derivative to stop.
            typed::Unary::Stop if self.b.ty(a) != ir::Type::Real => return a,
            typed::Unary::Stop => Unary::Stop,
        };
        self.b.unary(op, a)
    }

    fn round_to_int(&mut self, rounding: Unary, a: Value) -> Value {
        let whole = self.b.unary(rounding, a);
        self.b.unary(Unary::ToInt, whole)
    }

    pub(super) fn binary(&mut self, op: typed::Binary, a: &Expr, b: &Expr, span: Span) -> Result<Vec<Value>, TooLarge> {
        let (xs, ys) = (self.expr(a)?, self.expr(b)?);
        self.b.set_span(span);
        if op == typed::Binary::Pow {
            return Ok(vec![self.pow(xs[0], ys[0], &b.ty)]);
        }
        // A tuple with a number: the number with each component.
        let count = xs.len().max(ys.len());
        let nth = |values: &[Value], i: usize| if values.len() == 1 { values[0] } else { values[i] };
        Ok((0..count).map(|i| self.scalar_binary(op, nth(&xs, i), nth(&ys, i), span)).collect())
    }

    fn scalar_binary(&mut self, op: typed::Binary, a: Value, b: Value, span: Span) -> Value {
        let op = match op {
            typed::Binary::Add => Binary::Add,
            typed::Binary::Sub => Binary::Sub,
            typed::Binary::Mul => Binary::Mul,
            typed::Binary::Div => Binary::Div,
            typed::Binary::Rem if self.b.ty(a) == ir::Type::Int => return self.int_remainder(a, b, span),
            typed::Binary::Rem => Binary::Rem,
            typed::Binary::Pow => Binary::Pow,
            typed::Binary::Atan2 => Binary::Atan2,
            typed::Binary::Min => Binary::Min,
            typed::Binary::Max => Binary::Max,
            typed::Binary::Eq => return self.compare(Compare::Eq, a, b),
            typed::Binary::Ne => return self.compare(Compare::Ne, a, b),
            typed::Binary::Lt => return self.compare(Compare::Lt, a, b),
            typed::Binary::Le => return self.compare(Compare::Le, a, b),
            typed::Binary::Gt => return self.compare(Compare::Gt, a, b),
            typed::Binary::Ge => return self.compare(Compare::Ge, a, b),
        };
        self.b.binary(op, a, b)
    }

    /// Comparisons of bools are selections, because the IR compares only numbers.
    fn compare(&mut self, op: Compare, a: Value, b: Value) -> Value {
        if self.b.ty(a) != ir::Type::Bool {
            return self.b.compare(op, a, b);
        }
        let not_b = self.b.unary(Unary::Not, b);
        match op {
            Compare::Eq => self.b.select(a, b, not_b),
            _ => self.b.select(a, not_b, b),
        }
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
