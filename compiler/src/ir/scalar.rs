//! Values at run time, and the operations of `arithmetic` on them.

use super::{Binary, Compare, Type, Unary, arithmetic};

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

/// Applies a unary operation; `None` where the operand has the wrong type.
#[must_use]
pub fn unary(op: Unary, a: Scalar) -> Option<Scalar> {
    Some(match (op, a) {
        (Unary::Not, Scalar::Bool(a)) => Scalar::Bool(!a),
        (Unary::ToReal, Scalar::Int(a)) => Scalar::Real(a as f64),
        // `as` saturates and gives 0 for NaN, as the operation is defined.
        (Unary::ToInt, Scalar::Real(a)) => Scalar::Int(a as i64),
        (op, Scalar::Real(a)) => Scalar::Real(arithmetic::unary(op, a)?),
        _ => return None,
    })
}

/// Applies a binary operation; `None` where an operand has the wrong type.
#[must_use]
pub fn binary(op: Binary, a: Scalar, b: Scalar) -> Option<Scalar> {
    Some(match (a, b) {
        (Scalar::Real(a), Scalar::Real(b)) => Scalar::Real(arithmetic::binary(op, a, b)?),
        (Scalar::Int(a), Scalar::Int(b)) => Scalar::Int(arithmetic::binary_int(op, a, b)?),
        (Scalar::Bool(a), Scalar::Bool(b)) => Scalar::Bool(match op {
            Binary::And => a && b,
            Binary::Or => a || b,
            _ => return None,
        }),
        _ => return None,
    })
}

/// Compares; `None` where the operands are not both Real or both Int.
#[must_use]
pub fn compare(op: Compare, a: Scalar, b: Scalar) -> Option<bool> {
    match (a, b) {
        (Scalar::Real(a), Scalar::Real(b)) => Some(op.holds(a, b)),
        (Scalar::Int(a), Scalar::Int(b)) => Some(op.holds(a, b)),
        _ => None,
    }
}
