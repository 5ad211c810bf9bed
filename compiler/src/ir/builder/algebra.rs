//! Rules for sums, products and quotients. See [`super`] for their assumptions.

use crate::ir::scalar::Scalar;
use crate::ir::{Binary, FunctionBuilder, Op, Type, Unary, Value};

/// `constant + term`, or `constant - term`.
struct Affine {
    constant: f64,
    term: Value,
    subtracted: bool,
}

impl FunctionBuilder {
    pub(super) fn simpler_binary(&mut self, op: Binary, a: Value, b: Value) -> Option<Value> {
        match (op, self.ty(a)) {
            (Binary::And | Binary::Or, _) => self.simpler_logic(op, a, b),
            (Binary::Min | Binary::Max, _) => (a == b).then_some(a),
            (op, Type::Int) => self.simpler_int(op, a, b),
            (Binary::Add, _) => self.simpler_add(a, b),
            (Binary::Sub, _) => self.simpler_sub(a, b),
            (Binary::Mul, _) => self.simpler_mul(a, b),
            (Binary::Div, _) => self.simpler_div(a, b),
            (Binary::Pow, _) => self.simpler_pow(a, b),
            (Binary::MulOrZero, _) => self.simpler_mul_or_zero(a, b),
            (Binary::DivOrZero, _) => self.simpler_div_or_zero(a, b),
            (Binary::Rem | Binary::Atan2 | Binary::Keep, _) => None,
        }
    }

    /// Wrapping addition and multiplication are associative, so these are exact.
    fn simpler_int(&mut self, op: Binary, a: Value, b: Value) -> Option<Value> {
        let int = |v| if let Some(Scalar::Int(i)) = self.constant(v) { Some(i) } else { None };
        match (op, int(a), int(b)) {
            (Binary::Add, Some(0), _) | (Binary::Mul, Some(1), _) => Some(b),
            (Binary::Add | Binary::Sub, _, Some(0)) | (Binary::Mul | Binary::Div, _, Some(1)) => Some(a),
            (Binary::Mul, Some(0), _) => Some(a),
            (Binary::Mul, _, Some(0)) => Some(b),
            (Binary::Rem, _, Some(1)) => Some(self.int(0)),
            (Binary::Sub, ..) if a == b => Some(self.int(0)),
            (Binary::Sub, None, Some(j)) => {
                let negative = self.int(j.wrapping_neg());
                Some(self.add(a, negative))
            }
            (Binary::Add, None, Some(j)) => {
                let Op::Binary(Binary::Add, x, c) = *self.op(a) else { return None };
                let Some(Scalar::Int(i)) = self.constant(c) else { return None };
                let sum = self.int(i.wrapping_add(j));
                Some(self.add(x, sum))
            }
            (Binary::Add, Some(_), None) => Some(self.add(b, a)),
            _ => None,
        }
    }

    /// `c * x` of a value: 2 * x is (2, x), -x is (-1, x), anything else (1, itself).
    fn coefficient(&self, v: Value) -> (f64, Value) {
        match *self.op(v) {
            Op::Unary(Unary::Neg, x) => (-1.0, x),
            Op::Binary(Binary::Mul, c, x) => self.real_constant(c).map_or((1.0, v), |c| (c, x)),
            _ => (1.0, v),
        }
    }

    /// c * v.
    pub(super) fn scaled(&mut self, c: f64, v: Value) -> Value {
        let c = self.real(c);
        self.mul(c, v)
    }

    fn simpler_add(&mut self, a: Value, b: Value) -> Option<Value> {
        if let Some(c) = self.real_constant(a) {
            // The constant goes last. Two constants are left only where their sum is not finite.
            return if c == 0.0 { Some(b) } else { self.constant(b).is_none().then(|| self.add(b, a)) };
        }
        if let Some(c) = self.real_constant(b) {
            return if c == 0.0 { Some(a) } else { self.add_constant(a, c) };
        }
        let ((p, x), (q, y)) = (self.coefficient(a), self.coefficient(b));
        if x == y {
            return Some(self.scaled(p + q, x));
        }
        if p == q && p != 1.0 {
            let sum = self.add(x, y);
            return Some(self.scaled(p, sum));
        }
        if p == -q && q != 1.0 {
            let difference = if p > 0.0 { self.sub(x, y) } else { self.sub(y, x) };
            return Some(self.scaled(p.abs(), difference));
        }
        if self.is_square_of(a, Unary::Sin, b, Unary::Cos) || self.is_square_of(a, Unary::Cos, b, Unary::Sin) {
            return Some(self.real(1.0));
        }
        if q < 0.0 {
            let y = self.scaled(-q, y);
            return Some(self.sub(a, y));
        }
        if p < 0.0 {
            let x = self.scaled(-p, x);
            return Some(self.sub(b, x));
        }
        None
    }

    /// a is f(x)^2 and b is g(x)^2 of the same x.
    fn is_square_of(&self, a: Value, f: Unary, b: Value, g: Unary) -> bool {
        let base = |v, f| match *self.op(v) {
            Op::PowInt(u, 2) => match *self.op(u) {
                Op::Unary(h, x) if h == f => Some(x),
                _ => None,
            },
            _ => None,
        };
        base(a, f).is_some_and(|x| base(b, g) == Some(x))
    }

    /// A value as a constant and a term: `x + d`, `d - x` and `-x`.
    fn affine(&self, v: Value) -> Option<Affine> {
        Some(match *self.op(v) {
            Op::Binary(Binary::Add, term, d) => Affine { constant: self.real_constant(d)?, term, subtracted: false },
            Op::Binary(Binary::Sub, d, term) => Affine { constant: self.real_constant(d)?, term, subtracted: true },
            Op::Unary(Unary::Neg, term) => Affine { constant: 0.0, term, subtracted: true },
            _ => return None,
        })
    }

    /// The value; `None` where the constant is not finite.
    fn affine_value(&mut self, Affine { constant, term, subtracted }: Affine) -> Option<Value> {
        let constant = constant.is_finite().then(|| self.real(constant))?;
        Some(if subtracted { self.sub(constant, term) } else { self.add(term, constant) })
    }

    /// a + c, c not zero.
    fn add_constant(&mut self, a: Value, c: f64) -> Option<Value> {
        let a = self.affine(a)?;
        self.affine_value(Affine { constant: a.constant + c, ..a })
    }

    fn simpler_sub(&mut self, a: Value, b: Value) -> Option<Value> {
        if a == b {
            return Some(self.real(0.0));
        }
        if let Some(c) = self.real_constant(b) {
            let negative = self.real(-c);
            return (self.constant(a).is_none()).then(|| self.add(a, negative));
        }
        if let Some(c) = self.real_constant(a) {
            return if c == 0.0 { Some(self.neg(b)) } else { self.subtract_from_constant(c, b) };
        }
        let ((p, x), (q, y)) = (self.coefficient(a), self.coefficient(b));
        if x == y {
            return Some(self.scaled(p - q, x));
        }
        if p == q && p != 1.0 {
            let difference = self.sub(x, y);
            return Some(self.scaled(p, difference));
        }
        if q < 0.0 {
            let y = self.scaled(-q, y);
            return Some(self.add(a, y));
        }
        if self.existing(&Op::Binary(Binary::Sub, b, a)).is_some() {
            // The opposite difference exists already.
            let opposite = self.sub(b, a);
            return Some(self.neg(opposite));
        }
        if p == -1.0 {
            let sum = self.add(x, b);
            return Some(self.neg(sum));
        }
        None
    }

    /// c - b, c not zero.
    fn subtract_from_constant(&mut self, c: f64, b: Value) -> Option<Value> {
        if let Some(b) = self.affine(b) {
            return self.affine_value(Affine { constant: c - b.constant, subtracted: !b.subtracted, ..b });
        }
        let (d, x) = self.coefficient(b);
        if !(d < 0.0) {
            return None;
        }
        let (x, c) = (self.scaled(-d, x), self.real(c));
        Some(self.add(x, c))
    }

    fn simpler_mul(&mut self, a: Value, b: Value) -> Option<Value> {
        if let Some(c) = self.real_constant(a) {
            return self.multiply_by_constant(c, b);
        }
        if let Some(c) = self.real_constant(b) {
            return self.multiply_by_constant(c, a);
        }
        let ((p, x), (q, y)) = (self.coefficient(a), self.coefficient(b));
        if (p, q) != (1.0, 1.0) {
            let product = self.mul(x, y);
            return Some(self.scaled(p * q, product));
        }
        if let Some(power) = self.product_of_powers(a, b) {
            return Some(power);
        }
        // a * (c / b) becomes c * a / b, so that a factor 1 / b becomes a division.
        let divides = matches!(self.op(b), Op::Binary(Binary::Div | Binary::DivOrZero, ..));
        let (whole, quotient) = if divides { (a, b) } else { (b, a) };
        if let Op::Binary(Binary::Div | Binary::DivOrZero, numerator, denominator) = *self.op(quotient)
            && denominator == whole
        {
            return Some(numerator);
        }
        if let Op::Binary(Binary::Div, numerator, denominator) = *self.op(quotient)
            && self.constant(numerator).is_some()
        {
            let numerator = self.mul(numerator, whole);
            // It is the quotient that may divide by zero, wherever the product stands.
            let product = self.span();
            self.set_span(self.span_of(quotient));
            let quotient = self.div(numerator, denominator);
            self.set_span(product);
            return Some(quotient);
        }
        None
    }

    fn multiply_by_constant(&mut self, c: f64, x: Value) -> Option<Value> {
        if c == 0.0 {
            return Some(self.real(0.0));
        }
        if c == 1.0 {
            return Some(x);
        }
        if self.constant(x).is_some() {
            // A product of constants that is not finite stays.
            return None;
        }
        match *self.op(x) {
            Op::Unary(Unary::Neg, y) => Some(self.scaled(-c, y)),
            Op::Binary(op @ (Binary::Mul | Binary::Div), d, y) if self.real_constant(d).is_some() => {
                let product = c * self.real_constant(d)?;
                let product = (product != 0.0 && product.is_finite()).then(|| self.real(product))?;
                Some(self.binary(op, product, y))
            }
            _ if c == -1.0 => Some(self.neg(x)),
            _ => None,
        }
    }

    fn simpler_div(&mut self, a: Value, b: Value) -> Option<Value> {
        if let Some(c) = self.real_constant(b) {
            return self.divide_by_constant(a, c);
        }
        if self.real_constant(a) == Some(0.0) {
            return Some(a);
        }
        if let Some(cancelled) = self.cancelled(a, b) {
            return Some(cancelled);
        }
        // The derivative of a power is simpler than that of a quotient.
        if let (Some(c), &Op::PowInt(x, n @ 1..)) = (self.real_constant(a), self.op(b)) {
            let power = self.pow_int(x, -n);
            return Some(self.scaled(c, power));
        }
        let ((p, x), (q, y)) = (self.coefficient(a), self.coefficient(b));
        if (p, q) != (1.0, 1.0) {
            // Constants are moved out, so that they can meet others.
            let quotient = self.div(x, y);
            return (p / q).is_finite().then(|| self.scaled(p / q, quotient));
        }
        // But not by a power: each derivative would square it, and beyond the tenth it overflows.
        if let Op::Binary(Binary::Div, numerator, inner) = *self.op(a)
            && self.constant(inner).is_none()
            && self.base(inner) != self.base(b)
        {
            let denominator = self.mul(inner, b);
            return Some(self.div(numerator, denominator));
        }
        None
    }

    /// What a value is a power of.
    fn base(&self, a: Value) -> Value {
        match *self.op(a) {
            Op::PowInt(base, _) => base,
            _ => a,
        }
    }

    /// a / b, where they have a factor in common.
    fn cancelled(&mut self, a: Value, b: Value) -> Option<Value> {
        if let Some(power) = self.quotient_of_powers(a, b) {
            return Some(power);
        }
        match *self.op(a) {
            Op::Binary(Binary::Mul, x, y) if x == b => Some(y),
            Op::Binary(Binary::Mul, x, y) if y == b => Some(x),
            _ => None,
        }
    }

    fn divide_by_constant(&mut self, a: Value, c: f64) -> Option<Value> {
        if c == 0.0 || !c.is_finite() || self.constant(a).is_some() {
            return None;
        }
        let (p, x) = self.coefficient(a);
        if c == 1.0 {
            Some(a)
        } else if p != 1.0 && (p / c).is_finite() && p / c != 0.0 {
            Some(self.scaled(p / c, x))
        } else if is_power_of_two(c) && (1.0 / c).is_normal() {
            // Exact, and cheaper.
            Some(self.scaled(1.0 / c, a))
        } else {
            None
        }
    }

    fn simpler_mul_or_zero(&mut self, a: Value, b: Value) -> Option<Value> {
        if self.real_constant(a) == Some(0.0) || self.real_constant(b) == Some(0.0) {
            return Some(self.real(0.0));
        }
        if self.properties(a).nonzero || self.properties(b).finite {
            return Some(self.mul(a, b));
        }
        let ((p, x), (q, y)) = (self.coefficient(a), self.coefficient(b));
        if (p, q) != (1.0, 1.0) {
            let product = self.binary(Binary::MulOrZero, x, y);
            return Some(self.scaled(p * q, product));
        }
        // a * (c / d), with c known not to be zero.
        if let Op::Binary(Binary::Div, numerator, denominator) = *self.op(b)
            && let Some(c) = self.real_constant(numerator)
            && c != 0.0
        {
            let numerator = self.mul(numerator, a);
            return Some(self.binary(Binary::DivOrZero, numerator, denominator));
        }
        None
    }

    fn simpler_div_or_zero(&mut self, a: Value, b: Value) -> Option<Value> {
        if self.real_constant(a) == Some(0.0) {
            return Some(a);
        }
        if self.properties(a).nonzero || self.properties(b).nonzero {
            return Some(self.div(a, b));
        }
        let ((p, x), (q, y)) = (self.coefficient(a), self.coefficient(b));
        if (p, q) != (1.0, 1.0) {
            let quotient = self.binary(Binary::DivOrZero, x, y);
            return (p / q).is_finite().then(|| self.scaled(p / q, quotient));
        }
        None
    }
}

/// A power of two, of either sign and normal: dividing by it is exact.
fn is_power_of_two(c: f64) -> bool {
    c.is_normal() && c.to_bits() & ((1 << 52) - 1) == 0
}
