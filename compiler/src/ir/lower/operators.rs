//! Operators. What has no value fails, the operations of the IR themselves being total: an evaluator that heeds guards
//! thus agrees with all others about whole numbers that are too large.

use super::{Frame, SizeError};
use crate::check::typed::{Expr, Type};
use crate::ir::scalar::Scalar;
use crate::ir::{self, Binary, Compare, Failure, Op, Unary, Value};
use crate::source::Span;

const TOO_LARGE: &str = "this whole number is too large: it has more than 64 bits";
const NO_WHOLE_NUMBER: &str = "this is no whole number of 64 bits: it is too large, or not a number";

/// Bits of an int that may be any.
const UNKNOWN: u32 = 64;
/// Bits of the index of a loop: nobody waits for 2^48 iterations.
const INDEX: u32 = 48;
/// Bits of the ints that reals hold exactly.
const EXACT: u32 = 53;
/// Operations behind each other that are looked at for the size of an int.
const ANALYSED: usize = 8;

impl<'m> Frame<'_, 'm> {
    pub(super) fn unary(&mut self, op: Unary, a: Value) -> Value {
        let value = match op {
            // Only reals have a derivative to stop.
            Unary::Stop if self.b.ty(a) != ir::Type::Real => return a,
            Unary::Neg | Unary::Abs if self.b.ty(a) == ir::Type::Int && self.magnitude(a, ANALYSED) == UNKNOWN => {
                let least = self.b.int(i64::MIN);
                let fine = self.b.compare(Compare::Ne, a, least);
                let value = self.b.unary(op, a);
                return self.guard(value, fine, TOO_LARGE);
            }
            Unary::ToInt => a,
            op => self.b.unary(op, a),
        };
        // The typed tree rounds to ints.
        match op {
            Unary::Floor | Unary::Ceil | Unary::Round | Unary::ToInt if self.b.ty(a) == ir::Type::Real => {
                self.truncated(value)
            }
            _ => value,
        }
    }

    /// A real, towards zero, as an int; a failure where there is none.
    fn truncated(&mut self, value: Value) -> Value {
        // The ends are exact, and NaN lies between no two numbers.
        let (from, to) = (self.b.real(-(2f64.powi(63))), self.b.real(2f64.powi(63)));
        let (above, below) = (self.b.compare(Compare::Ge, value, from), self.b.compare(Compare::Lt, value, to));
        let fine = self.b.binary(Binary::And, above, below);
        let value = self.guard(value, fine, NO_WHOLE_NUMBER);
        self.b.unary(Unary::ToInt, value)
    }

    fn guard(&mut self, value: Value, fine: Value, message: &str) -> Value {
        if self.b.constant(fine) == Some(Scalar::Bool(true)) {
            return value;
        }
        let failure = self.lowerer.module.fail(Failure { span: self.b.span(), message: message.to_owned() });
        self.b.guard(value, fine, failure)
    }

    /// A sum, difference or product of ints; a failure where it has more than 64 bits.
    fn int_arithmetic(&mut self, op: Binary, a: Value, b: Value) -> Value {
        let value = self.b.binary(op, a, b);
        // By the operands: a constant that wrapped around is small itself.
        if self.magnitude_of(op, a, b, ANALYSED) < UNKNOWN {
            return value;
        }
        // A result that wrapped around is off by 2^64 or a multiple; in doubles the two differ by less than 2^14.
        let [x, y, wrapped] = [a, b, value].map(|v| self.b.unary(Unary::ToReal, v));
        let exact = self.b.binary(op, x, y);
        let difference = self.b.sub(wrapped, exact);
        let difference = self.b.unary(Unary::Abs, difference);
        let most = self.b.real(2f64.powi(60));
        let fine = self.b.compare(Compare::Lt, difference, most);
        self.guard(value, fine, TOO_LARGE)
    }

    /// The number of bits that hold an int without its sign; [`UNKNOWN`] where it may be any, or reals.
    fn magnitude(&self, value: Value, depth: usize) -> u32 {
        if let Some(Scalar::Int(i)) = self.b.constant(value) {
            return u64::BITS - i.unsigned_abs().leading_zeros();
        }
        if self.index == Some(value) {
            return INDEX;
        }
        let Some(depth) = depth.checked_sub(1) else { return UNKNOWN };
        let of = |v: Value| self.magnitude(v, depth);
        let bits = match *self.b.op(value) {
            Op::Unary(Unary::Neg | Unary::Abs, a) | Op::Guard { value: a, .. } => of(a),
            Op::Unary(Unary::Sign, _) => 1,
            Op::Binary(op, a, b) => self.magnitude_of(op, a, b, depth),
            Op::Select(_, a, b) => of(a).max(of(b)),
            _ => UNKNOWN,
        };
        bits.min(UNKNOWN)
    }

    /// The number of bits of an operation's result, were there no end of them.
    fn magnitude_of(&self, op: Binary, a: Value, b: Value, depth: usize) -> u32 {
        let of = |v: Value| self.magnitude(v, depth);
        let bits = match op {
            Binary::Add | Binary::Sub => of(a).max(of(b)) + 1,
            Binary::Mul => of(a) + of(b),
            Binary::Rem => of(b),
            Binary::Min | Binary::Max => of(a).max(of(b)),
            _ => UNKNOWN,
        };
        bits.min(UNKNOWN)
    }

    /// The number of ints from `from` up to but without `to`, 0 where there are none; a failure where it has more than
    /// 64 bits.
    pub(super) fn count(&mut self, from: Value, to: Value) -> Value {
        if let (Some(Scalar::Int(from)), Some(Scalar::Int(to))) = (self.b.constant(from), self.b.constant(to)) {
            // No limit on steps lets a loop run that is too long for 64 bits, or one of 2^63 iterations.
            return self.b.int(to.saturating_sub(from));
        }
        if self.magnitude_of(Binary::Sub, to, from, ANALYSED) < UNKNOWN || self.b.constant(from) == Some(Scalar::Int(0))
        {
            return self.b.sub(to, from);
        }
        // An empty range must not wrap around to a long one.
        let end = self.b.binary(Binary::Max, to, from);
        self.int_arithmetic(Binary::Sub, end, from)
    }

    pub(super) fn binary(&mut self, op: Binary, a: &'m Expr, b: &'m Expr, span: Span) -> Result<Vec<Value>, SizeError> {
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
            if self.b.ty(a) == ir::Type::Int {
                match op {
                    Binary::Rem => return self.int_remainder(a, b, span),
                    Binary::Add | Binary::Sub | Binary::Mul => return self.int_arithmetic(op, a, b),
                    _ => {}
                }
            }
            self.b.binary(op, a, b)
        };
        Ok((0..count).map(&mut combine).collect())
    }

    pub(super) fn compare(&mut self, op: Compare, a: &'m Expr, b: &'m Expr, span: Span) -> Result<Value, SizeError> {
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
        let whole = match (self.b.ty(y), known) {
            (ir::Type::Int, _) => y,
            (_, Some(n)) => self.b.int(n),
            _ => return self.b.pow(x, y),
        };
        let y = self.b.unary(Unary::ToReal, whole);
        if self.magnitude(whole, ANALYSED) <= EXACT {
            return self.b.pow(x, y);
        }
        // Reals beyond 2^53 are even: a power of a negative number would lose its sign.
        let (zero, two, real_zero) = (self.b.int(0), self.b.int(2), self.b.real(0.0));
        let rest = self.b.binary(Binary::Rem, whole, two);
        let odd = self.b.compare(Compare::Ne, rest, zero);
        let negative = self.b.compare(Compare::Lt, x, real_zero);
        let opposite = self.b.neg(x);
        let base = self.b.select(negative, opposite, x);
        let power = self.b.pow(base, y);
        let (flips, negated) = (self.b.binary(Binary::And, odd, negative), self.b.neg(power));
        self.b.select(flips, negated, power)
    }
}
