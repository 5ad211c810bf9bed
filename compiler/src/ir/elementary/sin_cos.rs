//! Sine and cosine.

use super::Lanes;
use super::tables::ROUND;
use std::f64::consts::FRAC_2_PI;

/// Half of pi in three parts, of 43, 43 and 53 bits: multiples below 2^10 of the first two are exact.
const QUARTER: [f64; 3] = [
    f64::from_bits(0x3ff9_21fb_5444_2c00),
    f64::from_bits(0x3d31_8469_898c_c400),
    f64::from_bits(0x3a71_701b_839a_2520),
];

/// Polynomials for sine and cosine up to an eighth of a turn, of FreeBSD's `k_sin.c` and `k_cos.c` (Sun Microsystems
/// 1993): x + x^3 (S0 + S1 x^2 + ..) and 1 - x^2 / 2 + x^4 (C0 + C1 x^2 + ..), to 2^-58 of the result.
const SINE: [f64; 6] = [
    -0.166_666_666_666_666_32,
    0.008_333_333_333_322_49,
    -0.000_198_412_698_298_579_5,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
const COSINE: [f64; 6] = [
    0.041_666_666_666_666_6,
    -0.001_388_888_888_887_411,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Below this magnitude the sine is the number itself, to 2^-56.
const SMALL: f64 = 1.0 / (1u64 << 28) as f64;

/// Sine and cosine for magnitudes below 1600.
///
/// x = n pi/2 + r + s with |r| up to pi/4 and s its rounding error (Cody and Waite's reduction): n times the first part
/// of pi/2 is subtracted exactly, as the difference is small; the error of the second part is computed; the third part
/// is finer than the difference of any double to its nearest multiple.
#[inline(always)]
pub(super) fn sin_cos<L: Lanes>(x: L) -> [L; 2] {
    let shifted = x.times_plus(L::all(FRAC_2_PI), L::all(ROUND));
    let n = shifted - L::all(ROUND);
    let [a, b, c] = QUARTER.map(|q| L::all(-q));
    let first = n.times_plus(a, x);
    let second = n.times_plus(b, first);
    let lost = n.times_plus(b, first - second);
    let r = n.times_plus(c, second);
    let s = n.times_plus(c, second - r) + lost;
    let [sine, cosine] = [reduced_sine(r, s), reduced_cosine(r, s)];
    // Every quarter turn exchanges them and changes one sign: by the lowest bits of n.
    let odd = L::all(0.0).minus_bits(shifted.and(L::all_bits(1)));
    let (of_sine, of_cosine) = (L::chosen(odd, cosine, sine), L::chosen(odd, sine, cosine));
    let sign = |n: L| n.down::<1>().up::<63>();
    let sine = of_sine.xor(sign(shifted));
    // This also keeps -0.
    let sine = L::chosen(x.magnitude().below(L::all(SMALL)), x, sine);
    [sine, of_cosine.xor(sign(shifted.plus_bits(L::all_bits(1))))]
}

/// The sine of r + s.
#[inline(always)]
fn reduced_sine<L: Lanes>(r: L, s: L) -> L {
    let [c0, c1, c2, c3, c4, c5] = SINE.map(L::all);
    let z = r * r;
    let p = z.times_plus(z.times_plus(c3, c2), c1);
    let p = (z * (z * z)).times_plus(z.times_plus(c5, c4), p);
    let cube = z * r;
    // r + r^3 c0 + (z (r^3 p - s / 2) + s)
    let low = cube.times_plus(p, (L::all(0.5) * s).negated());
    r + cube.times_plus(c0, z.times_plus(low, s))
}

/// The cosine of r + s.
#[inline(always)]
fn reduced_cosine<L: Lanes>(r: L, s: L) -> L {
    let [c0, c1, c2, c3, c4, c5] = COSINE.map(L::all);
    let z = r * r;
    let square = z * z;
    let p = z * z.times_plus(z.times_plus(c2, c1), c0);
    let p = (square * square).times_plus(z.times_plus(z.times_plus(c5, c4), c3), p);
    let half = L::all(0.5) * z;
    let high = L::all(1.0) - half;
    // 1 - z / 2 in two parts, then z p - r s.
    high + z.times_plus(p, r.times_plus(s.negated(), (L::all(1.0) - high) - half))
}
