//! Rules for powers, roots and functions of one operand. See [`super`] for their assumptions.

use crate::ir::{Binary, FunctionBuilder, Op, Type, Unary, Value};

/// The largest constant whole exponent with which a power becomes [`Op::PowInt`]: repeated squaring for larger ones
/// loses digits that `pow` keeps.
const MAX_WHOLE_EXPONENT: f64 = 64.0;

impl FunctionBuilder {
    pub(super) fn simpler_pow(&mut self, x: Value, y: Value) -> Option<Value> {
        let exponent = self.real_constant(y)?;
        if exponent == 0.5 {
            return Some(self.unary(Unary::Sqrt, x));
        }
        let whole = exponent.fract() == 0.0 && exponent.abs() <= MAX_WHOLE_EXPONENT;
        whole.then(|| self.pow_int(x, exponent as i32))
    }

    pub(super) fn simpler_pow_int(&mut self, x: Value, n: i32) -> Option<Value> {
        match n {
            0 => return Some(self.real(1.0)),
            1 => return Some(x),
            -1 => {
                let one = self.real(1.0);
                return Some(self.div(one, x));
            }
            _ => {}
        }
        match *self.op(x) {
            Op::PowInt(y, m) => {
                let product = m.checked_mul(n)?;
                Some(self.pow_int(y, product))
            }
            Op::Unary(Unary::Abs, y) if n % 2 == 0 => Some(self.pow_int(y, n)),
            Op::Unary(Unary::Sqrt, y) if n % 2 == 0 => Some(self.pow_int(y, n / 2)),
            Op::Unary(Unary::Neg, y) => {
                let power = self.pow_int(y, n);
                Some(if n % 2 == 0 { power } else { self.neg(power) })
            }
            _ => None,
        }
    }

    /// x^m * x^n as a power of x, where this also holds if x is 0.
    pub(super) fn product_of_powers(&mut self, a: Value, b: Value) -> Option<Value> {
        let power = |v| if let Op::PowInt(x, n) = *self.op(v) { (x, n) } else { (v, 1) };
        let ((x, m), (y, n)) = (power(a), power(b));
        if x == y && (m > 0) == (n > 0) {
            let sum = m.checked_add(n)?;
            return Some(self.pow_int(x, sum));
        }
        // sqrt(x) * sqrt(x).
        match (self.op(a), self.op(b)) {
            (Op::Unary(Unary::Sqrt, x), Op::Unary(Unary::Sqrt, y)) if x == y => Some(*x),
            _ => None,
        }
    }

    /// x^m / x^n as a power of x, and x / sqrt(x).
    pub(super) fn quotient_of_powers(&mut self, a: Value, b: Value) -> Option<Value> {
        let power = |v| if let Op::PowInt(x, n) = *self.op(v) { (x, n) } else { (v, 1) };
        let ((x, m), (y, n)) = (power(a), power(b));
        if x == y {
            let difference = m.checked_sub(n)?;
            return Some(self.pow_int(x, difference));
        }
        match (self.op(a), self.op(b)) {
            (_, Op::Unary(Unary::Sqrt, x)) if *x == a => Some(b),
            (Op::Unary(Unary::Sqrt, x), _) if *x == b => {
                let one = self.real(1.0);
                Some(self.div(one, a))
            }
            _ => None,
        }
    }

    pub(super) fn simpler_unary(&mut self, op: Unary, a: Value) -> Option<Value> {
        if op == Unary::Not {
            return self.simpler_not(a);
        }
        if self.ty(a) != Type::Real {
            return None;
        }
        if op == Unary::Neg {
            return self.simpler_neg(a);
        }
        let negated = self.negated(a);
        match op {
            Unary::Abs if self.properties(a).nonnegative => Some(a),
            Unary::Abs | Unary::Cos | Unary::Cosh => negated.map(|x| self.unary(op, x)),
            Unary::Sign if self.properties(a).is_positive() => Some(self.real(1.0)),
            Unary::Sign
            | Unary::Sin
            | Unary::Tan
            | Unary::Asin
            | Unary::Atan
            | Unary::Sinh
            | Unary::Tanh
            | Unary::Round => negated.map(|x| {
                let y = self.unary(op, x);
                self.neg(y)
            }),
            Unary::Sqrt => match *self.op(a) {
                Op::PowInt(x, 2) => Some(self.unary(Unary::Abs, x)),
                _ => None,
            },
            Unary::Ln => match *self.op(a) {
                Op::Unary(Unary::Exp, x) => Some(x),
                _ => None,
            },
            Unary::Floor | Unary::Ceil => match *self.op(a) {
                Op::Unary(Unary::Floor | Unary::Ceil | Unary::Round | Unary::ToReal, _) => Some(a),
                _ => None,
            },
            _ => None,
        }
    }

    fn simpler_neg(&mut self, a: Value) -> Option<Value> {
        match *self.op(a) {
            Op::Unary(Unary::Neg, x) => Some(x),
            Op::Binary(Binary::Sub, x, y) => self.existing(&Op::Binary(Binary::Sub, y, x)),
            Op::Binary(Binary::Mul, c, x) => {
                let c = self.real_constant(c)?;
                Some(self.scaled(-c, x))
            }
            Op::Binary(Binary::Div, c, x) => {
                let c = self.real_constant(c)?;
                let c = self.real(-c);
                Some(self.div(c, x))
            }
            _ => None,
        }
    }
}
