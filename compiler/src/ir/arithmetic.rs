//! The results of the operations, bit for bit.
//!
//! The interpreter, constant folding and the host functions of native code all call these functions, so that they
//! cannot differ (except in the payload of a NaN, on which nothing may depend). Sine, cosine, exponential function and
//! powers are those of [`elementary`]; the other elementary functions are the platform's, through the standard library.

use super::{Binary, Unary, elementary};

/// An operation on one real; `None` where the operation does not take and give a real.
#[must_use]
pub(crate) fn unary(op: Unary, x: f64) -> Option<f64> {
    Some(match op {
        Unary::Neg => -x,
        Unary::Abs => x.abs(),
        Unary::Sign => sign(x),
        Unary::Sqrt => x.sqrt(),
        Unary::Exp => elementary::exp(x),
        Unary::Ln => elementary::ln(x),
        Unary::Sin => elementary::sin(x),
        Unary::Cos => elementary::cos(x),
        Unary::Tan => x.tan(),
        Unary::Asin => x.asin(),
        Unary::Acos => x.acos(),
        Unary::Atan => x.atan(),
        Unary::Sinh => x.sinh(),
        Unary::Cosh => x.cosh(),
        Unary::Tanh => x.tanh(),
        Unary::Floor => x.floor(),
        Unary::Ceil => x.ceil(),
        Unary::Round => x.round(),
        Unary::Stop => x,
        Unary::Not | Unary::ToReal | Unary::ToInt => return None,
    })
}

/// An operation on two reals; `None` where the operation does not take reals.
#[must_use]
pub(crate) fn binary(op: Binary, a: f64, b: f64) -> Option<f64> {
    Some(match op {
        Binary::Add => a + b,
        Binary::Sub => a - b,
        Binary::Mul => a * b,
        Binary::Div => a / b,
        Binary::Rem => remainder(a, b),
        Binary::Pow => elementary::pow(a, b),
        Binary::Atan2 => a.atan2(b),
        Binary::Min => minimum(a, b),
        Binary::Max => maximum(a, b),
        Binary::MulOrZero => {
            if a == 0.0 {
                0.0
            } else {
                a * b
            }
        }
        Binary::DivOrZero => {
            if a == 0.0 {
                0.0
            } else {
                a / b
            }
        }
        Binary::Keep => a,
        Binary::And | Binary::Or => return None,
    })
}

/// An operation on two integers; `None` where the operation does not take integers.
#[must_use]
pub(crate) fn binary_int(op: Binary, a: i64, b: i64) -> Option<i64> {
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
        Binary::Pow
        | Binary::Atan2
        | Binary::MulOrZero
        | Binary::DivOrZero
        | Binary::Keep
        | Binary::And
        | Binary::Or => return None,
    })
}

/// x^n by repeated squaring; x^-n is 1 / x^n, and 0^0 is 1. The multiplications are those of [`pow_int_steps`].
#[must_use]
pub(crate) fn pow_int(x: f64, n: i32) -> f64 {
    let power = pow_int_steps(&mut |a, b| a * b, x, n.unsigned_abs()).unwrap_or(1.0);
    if n < 0 { 1.0 / power } else { power }
}

/// The multiplications of x^n in the order in which they are made, over any representation of values (numbers, or
/// instructions that compute them); `None` for n = 0.
pub(crate) fn pow_int_steps<T: Copy>(multiply: &mut impl FnMut(T, T) -> T, x: T, n: u32) -> Option<T> {
    let mut square = x;
    let mut product = None;
    let mut rest = n;
    while rest > 0 {
        if rest & 1 == 1 {
            product = Some(match product {
                None => square,
                Some(p) => multiply(p, square),
            });
        }
        rest >>= 1;
        if rest > 0 {
            square = multiply(square, square);
        }
    }
    product
}

/// -1, 0 or 1; NaN at NaN.
#[must_use]
pub(crate) fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        // The sum takes away the sign of zero.
        x + 0.0
    }
}

/// Remainder with the sign of the divisor; NaN where b is 0.
#[must_use]
pub(crate) fn remainder(a: f64, b: f64) -> f64 {
    let r = a % b;
    if r != 0.0 && (r < 0.0) != (b < 0.0) { r + b } else { r }
}

/// The smaller one; NaN where either is NaN, and -0 is smaller than 0 (IEEE 754-2019 minimum).
#[must_use]
pub(crate) fn minimum(a: f64, b: f64) -> f64 {
    if a < b {
        a
    } else if b < a {
        b
    } else if a == b {
        f64::from_bits(a.to_bits() | b.to_bits())
    } else {
        f64::NAN
    }
}

/// The greater one; NaN where either is NaN, and 0 is greater than -0 (IEEE 754-2019 maximum).
#[must_use]
pub(crate) fn maximum(a: f64, b: f64) -> f64 {
    -minimum(-a, -b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integer_powers_are_products() {
        for n in 0..20 {
            let direct: f64 = (0..n).fold(1.0, |p, _| p * 1.5);
            assert_eq!(pow_int(1.5, n), direct, "small powers of 1.5 are exact");
            assert_eq!(pow_int(2.0, -n), 2f64.powi(-n));
        }
        assert_eq!(pow_int(0.0, 0), 1.0);
        assert_eq!(pow_int(1.0, i32::MIN), 1.0);
        assert_eq!(pow_int(0.0, -1), f64::INFINITY);
    }

    #[test]
    fn remainders_have_the_sign_of_the_divisor() {
        assert_eq!(remainder(-1.0, 3.0), 2.0);
        assert_eq!(remainder(1.0, -3.0), -2.0);
        assert_eq!(binary_int(Binary::Rem, -1, 3), Some(2));
        assert_eq!(binary_int(Binary::Rem, 7, -3), Some(-2));
        assert_eq!(binary_int(Binary::Rem, i64::MIN, -1), Some(0));
        assert_eq!(binary_int(Binary::Div, i64::MIN, -1), Some(i64::MIN));
        assert_eq!(binary_int(Binary::Div, 5, 0), Some(0));
    }

    #[test]
    fn extremes_propagate_nan_and_order_zeros() {
        assert!(minimum(f64::NAN, 1.0).is_nan() && maximum(1.0, f64::NAN).is_nan());
        assert!(minimum(0.0, -0.0).is_sign_negative() && maximum(-0.0, 0.0).is_sign_positive());
        assert_eq!((minimum(1.0, 2.0), maximum(1.0, 2.0)), (1.0, 2.0));
    }
}
