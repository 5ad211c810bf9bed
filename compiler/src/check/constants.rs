//! Arithmetic on what is known while compiling.

use super::typed::{Binary, Expr, ExprKind, Type, Unary};
use super::types::Exponent;
use crate::syntax::ast::BinaryOp;

/// An operator on two known ints; `None` where the result is a real, which is not tracked.
pub(super) fn int_binary(op: BinaryOp, a: i64, b: i64) -> Result<Option<Type>, &'static str> {
    const LARGE: &str = "this whole number gets too large";
    let truth = |b| Ok(Some(Type::Bool(Some(b))));
    let value = match op {
        BinaryOp::Add => a.checked_add(b).ok_or(LARGE)?,
        BinaryOp::Sub => a.checked_sub(b).ok_or(LARGE)?,
        BinaryOp::Mul => a.checked_mul(b).ok_or(LARGE)?,
        BinaryOp::Rem if b == 0 => return Err("the remainder of a division by 0 is not defined"),
        // With the divisor's sign, as for reals.
        BinaryOp::Rem => match a.checked_rem(b).unwrap_or(0) {
            r if r != 0 && (r < 0) != (b < 0) => r + b,
            r => r,
        },
        BinaryOp::Pow => match u32::try_from(b) {
            Ok(b) => a.checked_pow(b).ok_or(LARGE)?,
            Err(_) => return Ok(None),
        },
        BinaryOp::Div if b == 0 => return Err("division by 0"),
        BinaryOp::Div => return Ok(None),
        BinaryOp::Eq => return truth(a == b),
        BinaryOp::Ne => return truth(a != b),
        BinaryOp::Lt => return truth(a < b),
        BinaryOp::Le => return truth(a <= b),
        BinaryOp::Gt => return truth(a > b),
        BinaryOp::Ge => return truth(a >= b),
        BinaryOp::And | BinaryOp::Or => return Ok(None),
    };
    Ok(Some(Type::Int(Some(value))))
}

/// The value of a constant exponent as a fraction, such as `0.5` or `2/3`.
pub(super) fn exponent_of(e: &Expr) -> Option<Exponent> {
    let x = constant(e)?;
    (1..=12).find_map(|denominator| {
        let numerator = x * f64::from(denominator);
        let close = (numerator - numerator.round()).abs() < 1e-12 * numerator.abs().max(1.0);
        if close && numerator.abs() < 1e4 {
            Exponent::new(numerator.round() as i64, i64::from(denominator))
        } else {
            None
        }
    })
}

/// The value of an expression made of literals.
pub(super) fn constant(e: &Expr) -> Option<f64> {
    match &e.kind {
        ExprKind::Real(x) => Some(*x),
        ExprKind::Int(k) => Some(*k as f64),
        ExprKind::Convert(e) => constant(e),
        ExprKind::Unary(Unary::Neg, e) => Some(-constant(e)?),
        ExprKind::Binary(op, a, b) => {
            let (a, b) = (constant(a)?, constant(b)?);
            match op {
                Binary::Add => Some(a + b),
                Binary::Sub => Some(a - b),
                Binary::Mul => Some(a * b),
                Binary::Div => Some(a / b),
                _ => None,
            }
        }
        _ => None,
    }
}
