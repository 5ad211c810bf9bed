//! Against double-double arithmetic, which knows nothing of tables: series, and a division of the argument by pi/2.

use super::*;
use std::f64::consts::{FRAC_PI_2, LN_2, PI};

/// A sum of two doubles, to about 2^-100.
#[derive(Clone, Copy, Debug)]
struct Double(f64, f64);

fn sum_of(a: f64, b: f64) -> Double {
    let sum = a + b;
    let of_b = sum - a;
    Double(sum, (a - (sum - of_b)) + (b - of_b))
}

fn product_of(a: f64, b: f64) -> Double {
    let product = a * b;
    Double(product, a.mul_add(b, -product))
}

impl Double {
    fn plus(self, other: Double) -> Double {
        let (high, low) = (sum_of(self.0, other.0), sum_of(self.1, other.1));
        let high = sum_of(high.0, high.1 + low.0);
        sum_of(high.0, high.1 + low.1)
    }

    fn times(self, other: Double) -> Double {
        let high = product_of(self.0, other.0);
        sum_of(high.0, high.1 + (self.0 * other.1 + self.1 * other.0))
    }

    fn over(self, b: f64) -> Double {
        let high = self.0 / b;
        let back = product_of(high, b);
        sum_of(high, (((self.0 - back.0) - back.1) + self.1) / b)
    }

    fn negated(self) -> Double {
        Double(-self.0, -self.1)
    }

    /// How far a number is from this, in units of its last place.
    fn distance(self, found: f64) -> f64 {
        let unit = f64::from_bits((self.0.to_bits() >> 52 << 52).max(1 << 52)) * f64::EPSILON;
        (sum_of(found, -self.0).plus(Double(-self.1, 0.0))).0.abs() / unit
    }
}

/// pi/2 and ln 2 in three parts each, from 60 digits.
const QUARTER: [f64; 3] = [FRAC_PI_2, 6.123_233_995_736_766e-17, -1.497_384_904_859_169_8e-33];
const LN_2_PARTS: [f64; 3] = [LN_2, 2.319_046_813_846_299_6e-17, 5.707_708_438_416_212e-34];

/// x - n c.
fn reduced(x: Double, n: f64, c: [f64; 3]) -> Double {
    c.iter().fold(x, |rest, part| rest.plus(product_of(-n, *part)))
}

/// The sum of x^k / k! with signs by k: 0 leaves a term out.
fn series(x: Double, sign: impl Fn(usize) -> f64) -> Double {
    let (mut all, mut term) = (Double(sign(0), 0.0), Double(1.0, 0.0));
    for k in 1..40 {
        term = term.times(x).over(k as f64);
        let sign = sign(k);
        if sign != 0.0 {
            all = all.plus(if sign > 0.0 { term } else { term.negated() });
        }
    }
    all
}

fn true_sin_cos(x: f64) -> [Double; 2] {
    let n = (x / FRAC_PI_2).round();
    let r = reduced(Double(x, 0.0), n, QUARTER);
    let sine = series(r, |k| [0.0, 1.0, 0.0, -1.0][k % 4]);
    let cosine = series(r, |k| [1.0, 0.0, -1.0, 0.0][k % 4]);
    match n.rem_euclid(4.0) {
        0.0 => [sine, cosine],
        1.0 => [cosine, sine.negated()],
        2.0 => [sine.negated(), cosine.negated()],
        _ => [cosine.negated(), sine],
    }
}

/// e^x = (e^(r / 16))^16 2^n.
fn true_exp(x: Double) -> Double {
    let n = (x.0 / LN_2).round();
    let small = reduced(x, n, LN_2_PARTS).over(16.0);
    let root = series(small, |_| 1.0);
    let power = (0..4).fold(root, |p, _| p.times(p));
    let half = |n: f64| 2f64.powi(n as i32);
    let (a, b) = ((n / 2.0).floor(), n - (n / 2.0).floor());
    Double(power.0 * half(a) * half(b), power.1 * half(a) * half(b))
}

/// d - d^2 / 2 + .. of x = 1 + d near 1. Else y + ln(x e^-y) with y = ln x to 53 bits, twice: the logarithm of what is
/// nearly 1 by the first terms of that.
fn true_ln(x: f64) -> Double {
    let near = |d: Double, terms: i32| {
        let (mut all, mut power) = (d, d);
        for k in 2..=terms {
            power = power.times(d).negated();
            all = all.plus(power.over(f64::from(k)));
        }
        all
    };
    if (x - 1.0).abs() < 0.1 {
        return near(Double(x - 1.0, 0.0), 40);
    }
    let step = |y: Double| y.plus(near(true_exp(y.negated()).times(Double(x, 0.0)).plus(Double(-1.0, 0.0)), 2));
    step(step(Double(x.ln(), 0.0)))
}

/// Numbers in 0..1, the same in every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Of all magnitudes up to a limit, with either sign.
    fn number(&mut self, limit: f64) -> f64 {
        let size = if self.next() < 0.5 { self.next() } else { 2f64.powi(-(60.0 * self.next()) as i32) * self.next() };
        if self.next() < 0.5 { -size * limit } else { size * limit }
    }
}

const SAMPLES: usize = 20_000;

#[test]
fn sine_and_cosine() {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for i in 0..SAMPLES {
        let x = match i % 4 {
            // Next to multiples of an eighth of a turn, where results are nearly 0, or change their formula.
            0 => {
                let multiple = (2030.0 * (random.next() - 0.5)).round() * PI / 4.0;
                multiple + 1e-13 * (random.next() - 0.5).powi(9) * multiple
            }
            1 => random.number(7.0),
            _ => random.number(MOST_REDUCED),
        };
        let [sine, cosine] = true_sin_cos(x);
        assert!(sine.distance(sin(x)) < 0.79, "sin {x:e} is {sine:?}, not {:e}", sin(x));
        assert!(cosine.distance(cos(x)) < 0.79, "cos {x:e} is {cosine:?}, not {:e}", cos(x));
    }
}

#[test]
fn exponentials() {
    let mut random = Random(0xbf58_476d_1ce4_e5b9);
    for _ in 0..SAMPLES {
        let limit = if random.next() < 0.5 { 3.0 } else { MOST_EXPONENT };
        let x = random.number(limit);
        let power = true_exp(Double(x, 0.0));
        assert!(power.distance(exp(x)) < 0.52, "e^{x:e} is {power:?}, not {:e}", exp(x));
    }
}

#[test]
fn powers() {
    let mut random = Random(0x94d0_49bb_1331_11eb);
    let mut compared = 0;
    for i in 0..SAMPLES / 4 {
        let x = match i % 4 {
            0 => 3.0 * random.next(),
            1 => 1.0 + random.number(0.02),
            2 => 2f64.powi((2000.0 * (random.next() - 0.5)) as i32) * (1.0 + random.next()),
            _ => 0.6 + random.next(),
        };
        let ln = true_ln(x);
        assert!(ln.distance(super::ln(x)) < 0.52, "ln {x:e} is {ln:?}, not {:e}", super::ln(x));
        let most = if ln.0 == 0.0 { 1e6 } else { 690.0 / ln.0.abs() };
        let limit = if random.next() < 0.5 { most } else { most.min(5.0) };
        let y = random.number(limit);
        let power = true_exp(ln.times(Double(y, 0.0)));
        assert!(power.distance(pow(x, y)) < 0.52, "{x:e}^{y:e} is {power:?}, not {:e}", pow(x, y));
        compared += 1;
    }
    assert_eq!(compared, SAMPLES / 4);
}

#[test]
fn what_is_exact_is_exact() {
    assert_eq!(super::ln(1.0).to_bits(), 0);
    assert_eq!([exp(0.0), exp(-0.0), cos(0.0), pow(2.5, 0.0), pow(1.0, 77.3), pow(1.0, f64::NAN)], [1.0; 6]);
    assert_eq!(sin(0.0).to_bits(), 0);
    assert_eq!(sin(-0.0).to_bits(), (-0.0f64).to_bits());
    assert_eq!(sin(5e-324), 5e-324);
    assert_eq!(sin(PI), 1.224_646_799_147_353_2e-16);
    assert_eq!(cos(FRAC_PI_2), 6.123_233_995_736_766e-17);
    for n in 1..30 {
        assert_eq!(pow(f64::from(n), 2.0), f64::from(n * n));
        assert_eq!(pow(f64::from(n * n), 0.5), f64::from(n));
        assert_eq!(pow(f64::from(n) + 0.3, 1.0), f64::from(n) + 0.3);
        assert_eq!(pow(2.0, f64::from(-n)), 2f64.powi(-n));
    }
}

#[test]
fn special_arguments_are_the_platform_s() {
    let all =
        [f64::NAN, f64::INFINITY, -f64::INFINITY, 0.0, -0.0, -1.0, -2.5, 5e-324, 1e-310, 1e300, -1e300, 709.5, -740.0];
    let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
    for x in all {
        for y in all {
            // Of numbers that are neither 0 nor infinite the last bit may differ.
            let (found, theirs) = (pow(x, y), x.powf(y));
            assert!(same(found, theirs) || (found / theirs - 1.0).abs() < 2e-16, "{x}^{y}: {found:e}, {theirs:e}");
        }
        if !(x.is_normal() && x > 0.0) {
            assert!(same(super::ln(x), x.ln()), "{x}");
        }
        if !(x.abs() < MOST_EXPONENT) {
            assert!(same(exp(x), x.exp()), "{x}");
        }
        if !(x.abs() < MOST_REDUCED) {
            assert!(same(sin(x), x.sin()) && same(cos(x), x.cos()), "{x}");
        }
    }
}
