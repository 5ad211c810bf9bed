//! What the scalar operations compute: the one definition, which folding, interpreting and compiling follow.

use super::{Binary, Compare, Type, Unary};

/// A value at run time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalar {
    /// IEEE double.
    Real(f64),
    /// Signed integer.
    Int(i64),
    /// Truth value.
    Bool(bool),
}

impl Scalar {
    /// Its type.
    #[must_use]
    pub fn ty(self) -> Type {
        match self {
            Scalar::Real(_) => Type::Real,
            Scalar::Int(_) => Type::Int,
            Scalar::Bool(_) => Type::Bool,
        }
    }

    /// The real, if it is one.
    #[must_use]
    pub fn real(self) -> Option<f64> {
        if let Scalar::Real(x) = self { Some(x) } else { None }
    }

    /// Neither infinite nor NaN.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.real().is_none_or(f64::is_finite)
    }
}

/// Applies a unary operation; nothing where the operand has the wrong type.
#[must_use]
pub fn unary(op: Unary, a: Scalar) -> Option<Scalar> {
    Some(match (op, a) {
        (Unary::Not, Scalar::Bool(a)) => Scalar::Bool(!a),
        (Unary::Neg, Scalar::Int(a)) => Scalar::Int(a.wrapping_neg()),
        (Unary::Abs, Scalar::Int(a)) => Scalar::Int(a.wrapping_abs()),
        (Unary::Sign, Scalar::Int(a)) => Scalar::Int(a.signum()),
        (Unary::ToReal, Scalar::Int(a)) => Scalar::Real(a as f64),
        // `as` saturates and gives 0 for NaN, as the operation is defined.
        (Unary::ToInt, Scalar::Real(a)) => Scalar::Int(a as i64),
        (Unary::Not | Unary::ToReal | Unary::ToInt, _) => return None,
        (op, Scalar::Real(a)) => Scalar::Real(real_unary(op, a)),
        _ => return None,
    })
}

fn real_unary(op: Unary, a: f64) -> f64 {
    match op {
        Unary::Neg => -a,
        Unary::Abs => a.abs(),
        Unary::Sign if a > 0.0 => 1.0,
        Unary::Sign if a < 0.0 => -1.0,
        // Zero for zero, NaN for NaN.
        Unary::Sign => a * 0.0,
        Unary::Sqrt => a.sqrt(),
        Unary::Exp => a.exp(),
        Unary::Ln => a.ln(),
        Unary::Sin => a.sin(),
        Unary::Cos => a.cos(),
        Unary::Tan => a.tan(),
        Unary::Asin => a.asin(),
        Unary::Acos => a.acos(),
        Unary::Atan => a.atan(),
        Unary::Sinh => a.sinh(),
        Unary::Cosh => a.cosh(),
        Unary::Tanh => a.tanh(),
        Unary::Floor => a.floor(),
        Unary::Ceil => a.ceil(),
        Unary::Round => a.round(),
        Unary::Stop | Unary::Not | Unary::ToReal | Unary::ToInt => a,
    }
}

/// Applies a binary operation; nothing where an operand has the wrong type.
#[must_use]
pub fn binary(op: Binary, a: Scalar, b: Scalar) -> Option<Scalar> {
    Some(match (a, b) {
        (Scalar::Real(a), Scalar::Real(b)) => Scalar::Real(real_binary(op, a, b)?),
        (Scalar::Int(a), Scalar::Int(b)) => Scalar::Int(int_binary(op, a, b)?),
        (Scalar::Bool(a), Scalar::Bool(b)) => Scalar::Bool(match op {
            Binary::And => a && b,
            Binary::Or => a || b,
            _ => return None,
        }),
        _ => return None,
    })
}

fn real_binary(op: Binary, a: f64, b: f64) -> Option<f64> {
    Some(match op {
        Binary::Add => a + b,
        Binary::Sub => a - b,
        Binary::Mul => a * b,
        Binary::Div => a / b,
        Binary::Rem => a - b * (a / b).floor(),
        Binary::Pow => a.powf(b),
        Binary::Atan2 => a.atan2(b),
        // NaN where either is NaN, so that it is seen and reported.
        Binary::Min if a.is_nan() || b.is_nan() => f64::NAN,
        Binary::Max if a.is_nan() || b.is_nan() => f64::NAN,
        Binary::Min => a.min(b),
        Binary::Max => a.max(b),
        Binary::MulOrZero if a == 0.0 => 0.0,
        Binary::MulOrZero => a * b,
        Binary::DivOrZero if a == 0.0 => 0.0,
        Binary::DivOrZero => a / b,
        Binary::And | Binary::Or => return None,
    })
}

fn int_binary(op: Binary, a: i64, b: i64) -> Option<i64> {
    Some(match op {
        Binary::Add => a.wrapping_add(b),
        Binary::Sub => a.wrapping_sub(b),
        Binary::Mul => a.wrapping_mul(b),
        Binary::Div if b == 0 => 0,
        Binary::Div => a.wrapping_div(b),
        Binary::Rem if b == 0 => 0,
        Binary::Rem => {
            let r = a.wrapping_rem(b);
            if r != 0 && (r < 0) != (b < 0) { r + b } else { r }
        }
        Binary::Min => a.min(b),
        Binary::Max => a.max(b),
        _ => return None,
    })
}

/// Compares; nothing where the operands are not both Real or both Int.
#[must_use]
pub fn compare(op: Compare, a: Scalar, b: Scalar) -> Option<bool> {
    fn holds<T: PartialOrd>(op: Compare, a: T, b: T) -> bool {
        match op {
            Compare::Eq => a == b,
            Compare::Ne => a != b,
            Compare::Lt => a < b,
            Compare::Le => a <= b,
            Compare::Gt => a > b,
            Compare::Ge => a >= b,
        }
    }
    match (a, b) {
        (Scalar::Real(a), Scalar::Real(b)) => Some(holds(op, a, b)),
        (Scalar::Int(a), Scalar::Int(b)) => Some(holds(op, a, b)),
        _ => None,
    }
}

/// x^n by repeated squaring, the lowest bit of |n| first; a negative n gives the reciprocal; 0^0 = 1.
#[must_use]
pub fn pow_int(x: f64, n: i32) -> f64 {
    let mut power = 1.0;
    let mut square = x;
    let mut left = n.unsigned_abs();
    while left > 0 {
        if left & 1 == 1 {
            power *= square;
        }
        left >>= 1;
        if left > 0 {
            square *= square;
        }
    }
    if n < 0 { 1.0 / power } else { power }
}
