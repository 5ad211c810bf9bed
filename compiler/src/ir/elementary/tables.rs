//! Tables and constants, computed by the compiler in double-double arithmetic (Dekker, A floating-point technique for
//! extending the available precision, 1971): numbers as sums of two doubles, to about 2^-104.

/// Entries of each table.
pub(super) const ENTRIES: usize = 128;

/// Added to a number of magnitude below 2^51 and taken off again it leaves the nearest integer, whose lowest bits are
/// those of the sum.
pub(super) const ROUND: f64 = 1.5 * (1u64 << 52) as f64;

/// The bits at which the first interval of [`LOGARITHMS`] begins: 1 is in the middle of one.
pub(super) const LOG_ORIGIN: u64 = 0x3fe5_f000_0000_0000;

/// ln 2: a multiple of 2^-42, so that sums of multiples are exact, and the rest.
pub(super) const LN_2: [f64; 2] = few(LN_2_WHOLE);

/// ln 2: 33 bits, so that multiples of up to 20 bits are exact, and the rest.
pub(super) const LN_2_IN_FEW: [f64; 2] = {
    let high = f64::from_bits(LN_2_WHOLE.0.to_bits() >> 20 << 20);
    [high, (LN_2_WHOLE.0 - high) + LN_2_WHOLE.1]
};

/// 2^(i / 128), and what is to be added to it as a share of it.
pub(super) static POWERS: [[f64; 2]; ENTRIES] = {
    let mut table = [[0.0; 2]; ENTRIES];
    let mut i = 0;
    while i < ENTRIES {
        let power = exp(quotient(product(LN_2_WHOLE, Double(i as f64, 0.0)), ENTRIES as f64));
        table[i] = [power.0, power.1 / power.0];
        i += 1;
    }
    table
};

/// For intervals of z from 0.69 to 1.37: c near 1 / z, a multiple of 2^-7 below 1 and of 2^-8 above, and -ln c as a
/// multiple of 2^-42 and the rest. Where z is about 1, c is.
pub(super) static LOGARITHMS: [[f64; 3]; ENTRIES] = {
    let mut table = [[0.0; 3]; ENTRIES];
    let mut i = 0;
    while i < ENTRIES {
        let start = LOG_ORIGIN + ((i as u64) << 45);
        let (a, b) = (f64::from_bits(start), f64::from_bits(start + (1 << 45)));
        let steps = if b <= 1.0 { 128.0 } else { 256.0 };
        let holds_one = a < 1.0 && b > 1.0;
        let c = if holds_one { 1.0 } else { (2.0 / (a + b) * steps + 0.5) as i64 as f64 / steps };
        let ln = ln(c);
        let [high, low] = few(Double(-ln.0, -ln.1));
        table[i] = [c, high, low];
        i += 1;
    }
    table
};

const LN_2_WHOLE: Double = ln(2.0);

/// A sum of two doubles, of which the second is below half a unit in the last place of the first.
#[derive(Clone, Copy)]
struct Double(f64, f64);

/// A multiple of 2^-42 and the rest, of a number below 1 in magnitude.
const fn few(x: Double) -> [f64; 2] {
    let grid = 1.5 * 1024.0;
    let high = (x.0 + grid) - grid;
    [high, (x.0 - high) + x.1]
}

const fn sum_of(a: f64, b: f64) -> Double {
    let sum = a + b;
    let of_b = sum - a;
    Double(sum, (a - (sum - of_b)) + (b - of_b))
}

const fn halves(a: f64) -> [f64; 2] {
    let scaled = 134_217_729.0 * a;
    let high = scaled - (scaled - a);
    [high, a - high]
}

const fn product_of(a: f64, b: f64) -> Double {
    let product = a * b;
    let ([a, c], [b, d]) = (halves(a), halves(b));
    Double(product, ((a * b - product) + a * d + c * b) + c * d)
}

const fn sum(a: Double, b: Double) -> Double {
    let (high, low) = (sum_of(a.0, b.0), sum_of(a.1, b.1));
    let high = sum_of(high.0, high.1 + low.0);
    sum_of(high.0, high.1 + low.1)
}

const fn product(a: Double, b: Double) -> Double {
    let high = product_of(a.0, b.0);
    sum_of(high.0, high.1 + (a.0 * b.1 + a.1 * b.0))
}

const fn quotient(a: Double, b: f64) -> Double {
    let high = a.0 / b;
    let back = product_of(high, b);
    sum_of(high, (((a.0 - back.0) - back.1) + a.1) / b)
}

/// By its series, for numbers from 0 to 1.
const fn exp(x: Double) -> Double {
    let (mut all, mut term, mut n) = (Double(1.0, 0.0), Double(1.0, 0.0), 1);
    while n < 32 {
        term = quotient(product(term, x), n as f64);
        all = sum(all, term);
        n += 1;
    }
    all
}

/// 2 artanh((x - 1) / (x + 1)), for numbers from 0.5 to 2.
const fn ln(x: f64) -> Double {
    let z = quotient(Double(x - 1.0, 0.0), x + 1.0);
    let square = product(z, z);
    let (mut all, mut power, mut n) = (Double(0.0, 0.0), z, 1);
    while n < 70 {
        all = sum(all, quotient(power, n as f64));
        power = product(power, square);
        n += 2;
    }
    Double(2.0 * all.0, 2.0 * all.1)
}
