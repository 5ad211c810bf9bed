//! Exponential function and powers, by tables of 128 powers of 2 and logarithms (after Tang, Table-driven
//! implementation of the exponential function in IEEE floating-point arithmetic, 1989, and the same of the logarithm,
//! 1990).

use super::Lanes;
use super::tables::{ENTRIES, LN_2, LN_2_IN_FEW, LOG_ORIGIN, LOGARITHMS, POWERS, ROUND};
use std::f64::consts::LOG2_E;

const COUNT: f64 = ENTRIES as f64;

/// e^(x + rest) for |x| below 708 and a rest below half a unit in its last place.
///
/// x = (k / 128) ln 2 + r with |r| up to 0.0028, e^x = 2^(k / 128) e^r; the series of e^r is cut off at 2^-60.
#[inline(always)]
pub(super) fn exp<L: Lanes>(x: L, rest: L) -> L {
    let shifted = x.times_plus(L::all(LOG2_E * COUNT), L::all(ROUND));
    let k = shifted - L::all(ROUND);
    let r = k.times_plus(L::all(-LN_2_IN_FEW[0] / COUNT), x);
    let r = k.times_plus(L::all(-LN_2_IN_FEW[1] / COUNT), r) + rest;
    let [power, correction] = L::entries(&POWERS, shifted);
    // The bits of k above the table's go to the exponent.
    let scale = power.plus_bits(shifted.and(L::all_bits(!(ENTRIES as u64 - 1))).up::<45>());
    let square = r * r;
    let low = square.times_plus(r.times_plus(L::all(1.0 / 6.0), L::all(0.5)), correction + r);
    let high = r.times_plus(L::all(1.0 / 120.0), L::all(1.0 / 24.0));
    scale.times_plus((square * square).times_plus(high, low), scale)
}

/// y ln x in two parts for a normal positive x: to 2^-67 of it.
#[inline(always)]
pub(super) fn times_ln<L: Lanes>(x: L, y: L) -> [L; 2] {
    let [high, low] = ln(x);
    let product = y * high;
    [product, y.times_plus(low, y.times_plus(high, product.negated()))]
}

/// The logarithm in two parts: x = 2^k z with z from 0.69 to 1.37, ln x = k ln 2 - ln c + ln(1 + r), where c from the
/// table is nearly 1 / z and of so few bits that r = c z - 1 is exact.
#[inline(always)]
pub(super) fn ln<L: Lanes>(x: L) -> [L; 2] {
    let offset = x.plus_bits(L::all_bits(1.0f64.to_bits() - LOG_ORIGIN));
    // 2^52 with an integer in its last bits is their sum.
    let two_52 = (1u64 << 52) as f64;
    let k = offset.down::<52>().or(L::all(two_52)) - L::all(two_52 + 1023.0);
    let exponent = offset.and(L::all_bits(0xfff << 52)).minus_bits(L::all(1.0));
    let z = x.minus_bits(exponent);
    let [c, log_high, log_low] = L::entries(&LOGARITHMS, offset.down::<45>());
    let r = z.times_plus(c, L::all(-1.0));

    let whole = k.times_plus(L::all(LN_2[0]), log_high);
    let sum = whole + r;
    let low = k.times_plus(L::all(LN_2[1]), log_low) + ((whole - sum) + r);
    // -r^2 / 2 in two parts, then r^3 / 3 - r^4 / 4 + .. - r^10 / 10, of which -r^3 / 2 is taken out.
    let half = r * L::all(-0.5);
    let square = r * half;
    let high = sum + square;
    let low = low + half.times_plus(r, square.negated()) + ((sum - high) + square);
    let [a, b, c, d, e, f, g] = [-2.0 / 3.0, 0.5, -2.0 / 5.0, 1.0 / 3.0, -2.0 / 7.0, 0.25, -2.0 / 9.0].map(L::all);
    let z = r * r;
    let p = z.times_plus(z.times_plus(g, r.times_plus(f, e)), r.times_plus(d, c));
    let p = z.times_plus(p, r.times_plus(b, a));
    let low = (r * square).times_plus(p, low);
    let result = high + low;
    [result, (high - result) + low]
}
