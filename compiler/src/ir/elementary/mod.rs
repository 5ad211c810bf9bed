//! Elementary functions made of IEEE operations alone: the same bits on every machine, for one number and for several
//! in lanes.
//!
//! They are written once, over [`Lanes`]: one number, or several side by side. IEEE 754 defines the rounding of
//! additions, multiplications and fused multiply-adds, so that the interpreter, native code for one point and native
//! code for two compute the same. Outside of the ranges below, where values overflow, do not exist or need a much
//! longer reduction, all of them call the platform's functions.
//!
//! | | range | largest error found |
//! |---|---|---|
//! | [`sin`], [`cos`] | up to 1600 in magnitude | 0.78 units in the last place |
//! | [`exp`] | up to 708 in magnitude | 0.51 |
//! | [`ln`] | normal positive x | 0.51 |
//! | [`pow`] | normal positive x; up to 700 in magnitude of y ln x | 0.52 |
//!
//! Errors are measured against arithmetic of 113 bits, at random arguments of many magnitudes and beside multiples of
//! half a right angle; the tests measure again in double-double arithmetic.

mod exponential;
mod lanes;
mod sin_cos;
mod tables;
#[cfg(test)]
mod tests;

pub(crate) use lanes::Lanes;

/// Sine and cosine reduce arguments below this magnitude; larger ones go to the platform.
const MOST_REDUCED: f64 = 1600.0;

/// Magnitude of an exponent of e below which the result is a normal number.
const MOST_EXPONENT: f64 = 708.0;

/// The same for the exponent y ln x of x^y.
const MOST_POWER: f64 = 700.0;

/// Sine and cosine.
#[inline(always)]
pub(crate) fn sin_cos_of<L: Lanes>(x: L) -> [L; 2] {
    if x.magnitude().below(L::all(MOST_REDUCED)).everywhere() {
        return sin_cos::sin_cos(x);
    }
    [x.each(sin), x.each(cos)]
}

/// e^x.
#[inline(always)]
pub(crate) fn exp_of<L: Lanes>(x: L) -> L {
    if x.magnitude().below(L::all(MOST_EXPONENT)).everywhere() {
        return exponential::exp(x, L::all(0.0));
    }
    x.each(exp)
}

/// Natural logarithm.
#[inline(always)]
pub(crate) fn ln_of<L: Lanes>(x: L) -> L {
    if normal(x).everywhere() {
        return exponential::ln(x)[0];
    }
    x.each(ln)
}

/// The lanes that are normal positive numbers.
#[inline(always)]
fn normal<L: Lanes>(x: L) -> L {
    L::all(f64::MIN_POSITIVE.next_down()).below(x).and(x.below(L::all(f64::INFINITY)))
}

/// x^y.
#[inline(always)]
pub(crate) fn pow_of<L: Lanes>(x: L, y: L) -> L {
    let [exponent, rest] = exponential::times_ln(x, y);
    if normal(x).and(exponent.magnitude().below(L::all(MOST_POWER))).everywhere() {
        return exponential::exp(exponent, rest);
    }
    x.each_with(y, pow)
}

/// Sine.
#[must_use]
pub(crate) fn sin(x: f64) -> f64 {
    if x.abs() < MOST_REDUCED { sin_cos::sin_cos(x)[0] } else { x.sin() }
}

/// Cosine.
#[must_use]
pub(crate) fn cos(x: f64) -> f64 {
    if x.abs() < MOST_REDUCED { sin_cos::sin_cos(x)[1] } else { x.cos() }
}

/// e^x.
#[must_use]
pub(crate) fn exp(x: f64) -> f64 {
    if x.abs() < MOST_EXPONENT { exponential::exp(x, 0.0) } else { x.exp() }
}

/// Natural logarithm.
#[must_use]
pub(crate) fn ln(x: f64) -> f64 {
    if (f64::MIN_POSITIVE..f64::INFINITY).contains(&x) { exponential::ln(x)[0] } else { x.ln() }
}

/// x^y.
#[must_use]
pub(crate) fn pow(x: f64, y: f64) -> f64 {
    if (f64::MIN_POSITIVE..f64::INFINITY).contains(&x) {
        let [exponent, rest] = exponential::times_ln(x, y);
        if exponent.abs() < MOST_POWER {
            return exponential::exp(exponent, rest);
        }
    }
    x.powf(y)
}
