//! Elementary functions that are made of IEEE operations alone: the same bits on every machine, one at a time and in lanes.
//!
//! They are written once, over [`Lanes`]: a number, or several side by side. Additions, multiplications and fused
//! multiplications and additions are rounded as IEEE 754 says wherever they run, so that the interpreter, native code that takes
//! one point and native code that takes two compute the same. Outside of the ranges below, where values overflow, do
//! not exist or need a much longer reduction, all of them ask the platform.
//!
//! | | range | largest error found |
//! |---|---|---|
//! | [`sin`], [`cos`] | up to 1600 in magnitude | 0.78 units in the last place |
//! | [`exp`] | up to 708 in magnitude | 0.51 |
//! | [`pow`] | normal positive x; up to 700 in magnitude of y ln x | 0.52 |
//!
//! Errors are measured against arithmetic of 113 bits, at random arguments of many magnitudes and beside multiples of half
//! a right angle; the tests measure again in double-double arithmetic.

mod circular;
mod exponential;
mod lanes;
mod tables;
#[cfg(test)]
mod tests;

pub(crate) use lanes::Lanes;

/// Arguments of sine and cosine below this are reduced here.
const MOST_TURNED: f64 = 1600.0;

/// Exponents of e below this are raised here: results are normal numbers.
const MOST_RAISED: f64 = 708.0;

/// Likewise the exponents of e of powers.
const MOST_POWER: f64 = 700.0;

/// Sine and cosine.
#[inline(always)]
pub(crate) fn sin_cos_of<L: Lanes>(x: L) -> [L; 2] {
    if x.magnitude().below(L::all(MOST_TURNED)).everywhere() {
        return circular::sin_cos(x);
    }
    [x.each(sin), x.each(cos)]
}

/// e^x.
#[inline(always)]
pub(crate) fn exp_of<L: Lanes>(x: L) -> L {
    if x.magnitude().below(L::all(MOST_RAISED)).everywhere() {
        return exponential::exp(x, L::all(0.0));
    }
    x.each(exp)
}

/// x^y.
#[inline(always)]
pub(crate) fn pow_of<L: Lanes>(x: L, y: L) -> L {
    let normal = L::all(f64::MIN_POSITIVE.next_down()).below(x).and(x.below(L::all(f64::INFINITY)));
    let [exponent, rest] = exponential::times_ln(x, y);
    if normal.and(exponent.magnitude().below(L::all(MOST_POWER))).everywhere() {
        return exponential::exp(exponent, rest);
    }
    x.each_with(y, pow)
}

/// Sine.
#[must_use]
pub fn sin(x: f64) -> f64 {
    if x.abs() < MOST_TURNED { circular::sin_cos(x)[0] } else { x.sin() }
}

/// Cosine.
#[must_use]
pub fn cos(x: f64) -> f64 {
    if x.abs() < MOST_TURNED { circular::sin_cos(x)[1] } else { x.cos() }
}

/// e^x.
#[must_use]
pub fn exp(x: f64) -> f64 {
    if x.abs() < MOST_RAISED { exponential::exp(x, 0.0) } else { x.exp() }
}

/// x^y.
#[must_use]
pub fn pow(x: f64, y: f64) -> f64 {
    if (f64::MIN_POSITIVE..f64::INFINITY).contains(&x) {
        let [exponent, rest] = exponential::times_ln(x, y);
        if exponent.abs() < MOST_POWER {
            return exponential::exp(exponent, rest);
        }
    }
    x.powf(y)
}
