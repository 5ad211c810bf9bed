//! Values of typed expressions and what the operators do to them.

use super::typed::{Binary, Unary};
use std::rc::Rc;

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Real(f64),
    Int(i64),
    Bool(bool),
    /// Components of a tuple, array, record, range or closure.
    Many(Rc<[Value]>),
}

/// The value as a number, if it is a finite one.
pub(super) fn number(value: &Value) -> Result<f64, String> {
    match value {
        Value::Real(x) if x.is_finite() => Ok(*x),
        Value::Real(_) => Err("its value is not finite".to_owned()),
        Value::Int(k) => Ok(*k as f64),
        Value::Bool(b) => Ok(f64::from(*b)),
        Value::Many(_) => Err("it is not a number".to_owned()),
    }
}

/// Component k of a value.
pub(super) fn component(value: &Value, k: usize) -> Result<Value, String> {
    match value {
        Value::Many(values) => values.get(k).cloned().ok_or_else(|| "its index is out of range".to_owned()),
        _ => Err("it has no components".to_owned()),
    }
}

/// An operation of one operand; of tuples, component by component.
pub(super) fn unary(op: Unary, a: &Value) -> Result<Value, String> {
    Ok(match a {
        Value::Many(values) => Value::Many(values.iter().map(|v| unary(op, v)).collect::<Result<_, _>>()?),
        Value::Bool(b) => Value::Bool(!b),
        Value::Int(k) => match op {
            Unary::Neg => Value::Int(k.wrapping_neg()),
            Unary::Abs => Value::Int(k.wrapping_abs()),
            _ => Value::Int(*k),
        },
        Value::Real(x) => {
            let whole = |x: f64| Value::Int(x as i64);
            Value::Real(match op {
                Unary::Floor => return Ok(whole(x.floor())),
                Unary::Ceil => return Ok(whole(x.ceil())),
                Unary::Round => return Ok(whole(x.round())),
                Unary::Truncate => return Ok(whole(*x)),
                Unary::Neg => -x,
                Unary::Abs => x.abs(),
                Unary::Sign if *x == 0.0 => 0.0,
                Unary::Sign => x.signum(),
                Unary::Sqrt => x.sqrt(),
                Unary::Exp => x.exp(),
                Unary::Ln => x.ln(),
                Unary::Sin => x.sin(),
                Unary::Cos => x.cos(),
                Unary::Tan => x.tan(),
                Unary::Asin => x.asin(),
                Unary::Acos => x.acos(),
                Unary::Atan => x.atan(),
                Unary::Sinh => x.sinh(),
                Unary::Cosh => x.cosh(),
                Unary::Tanh => x.tanh(),
                Unary::Stop | Unary::Not => *x,
            })
        }
    })
}

/// An operation of two operands; of tuples, component by component.
pub(super) fn binary(op: Binary, a: &Value, b: &Value) -> Result<Value, String> {
    Ok(match (a, b) {
        (Value::Many(x), Value::Many(y)) => {
            Value::Many(x.iter().zip(&**y).map(|(x, y)| binary(op, x, y)).collect::<Result<_, _>>()?)
        }
        (Value::Many(x), y) => Value::Many(x.iter().map(|x| binary(op, x, y)).collect::<Result<_, _>>()?),
        (x, Value::Many(y)) => Value::Many(y.iter().map(|y| binary(op, x, y)).collect::<Result<_, _>>()?),
        (Value::Int(x), Value::Int(y)) => ints(op, *x, *y)?,
        (Value::Real(x), Value::Int(k)) if op == Binary::Pow => {
            Value::Real(i32::try_from(*k).map_or_else(|_| x.powf(*k as f64), |k| x.powi(k)))
        }
        (Value::Real(x), Value::Real(y)) => reals(op, *x, *y),
        _ => return Err("its operands do not fit".to_owned()),
    })
}

fn ints(op: Binary, x: i64, y: i64) -> Result<Value, String> {
    Ok(match op {
        Binary::Add => Value::Int(x.wrapping_add(y)),
        Binary::Sub => Value::Int(x.wrapping_sub(y)),
        Binary::Mul => Value::Int(x.wrapping_mul(y)),
        Binary::Rem if y == 0 => return Err("it divides by 0".to_owned()),
        Binary::Rem => match x.wrapping_rem(y) {
            r if r != 0 && (r < 0) != (y < 0) => Value::Int(r + y),
            r => Value::Int(r),
        },
        Binary::Min => Value::Int(x.min(y)),
        Binary::Max => Value::Int(x.max(y)),
        Binary::Eq => Value::Bool(x == y),
        Binary::Ne => Value::Bool(x != y),
        Binary::Lt => Value::Bool(x < y),
        Binary::Le => Value::Bool(x <= y),
        Binary::Gt => Value::Bool(x > y),
        Binary::Ge => Value::Bool(x >= y),
        Binary::Div | Binary::Pow | Binary::Atan2 => return Err("its operands do not fit".to_owned()),
    })
}

fn reals(op: Binary, x: f64, y: f64) -> Value {
    Value::Real(match op {
        Binary::Add => x + y,
        Binary::Sub => x - y,
        Binary::Mul => x * y,
        Binary::Div => x / y,
        Binary::Rem => x - y * (x / y).floor(),
        Binary::Pow => x.powf(y),
        Binary::Atan2 => x.atan2(y),
        Binary::Min => x.min(y),
        Binary::Max => x.max(y),
        Binary::Eq => return Value::Bool(x == y),
        Binary::Ne => return Value::Bool(x != y),
        Binary::Lt => return Value::Bool(x < y),
        Binary::Le => return Value::Bool(x <= y),
        Binary::Gt => return Value::Bool(x > y),
        Binary::Ge => return Value::Bool(x >= y),
    })
}
