//! Even samples: Halton's low-discrepancy sequence, directions by it, and the centres of a grid's cells.

use glam::DVec3;
use std::f64::consts::TAU;

/// The i-th number (from 1) of Halton's sequence in dimension n, in (0, 1).
pub(crate) fn halton(i: usize, n: usize) -> f64 {
    const PRIMES: [usize; 24] =
        [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89];
    let base = PRIMES[n % PRIMES.len()];
    // Higher dimensions reuse the bases from another start.
    let (mut i, mut f, mut x) = (i + 409 * (n / PRIMES.len()), 1.0, 0.0);
    while i > 0 {
        f /= base as f64;
        x += f * (i % base) as f64;
        i /= base;
    }
    x
}

/// Direction k of an even set over the sphere.
pub(crate) fn direction(k: usize) -> DVec3 {
    let (z, angle) = (2.0 * halton(k + 1, 0) - 1.0, TAU * halton(k + 1, 1));
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * angle.cos(), r * angle.sin(), z)
}

/// The centres of the cells of a grid over [0, 1]^2: u and v, row by row.
pub(crate) fn cell_centres([nu, nv]: [usize; 2]) -> [Vec<f64>; 2] {
    let centre = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
    let (u, v) = (0..nu * nv).map(|k| (centre(k % nu, nu), centre(k / nu, nv))).unzip();
    [u, v]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halton_numbers_are_even() {
        assert_eq!((halton(1, 0), halton(2, 0), halton(3, 0), halton(1, 1)), (0.5, 0.25, 0.75, 1.0 / 3.0));
        for n in 0..40 {
            let mean: f64 = (1..=2000).map(|i| halton(i, n)).sum::<f64>() / 2000.0;
            assert!((mean - 0.5).abs() < 0.03, "{n}: {mean}");
        }
    }
}
