//! Even samples: Halton's low-discrepancy sequence, directions by it, the centres of a grid's cells, and other places
//! in these.

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

/// Weights of a triangle's second and third corner from two numbers in [0, 1): even over the square, even over the
/// triangle.
pub(crate) fn in_triangle(s: f64, t: f64) -> (f64, f64) {
    if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) }
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

/// A place in every cell of a grid over [0, 1]^2: u and v, row by row. Where it is in its cell changes from cell to
/// cell by ever longer irrational steps: centres of cells, and places with even steps, see the flutes of a periodic
/// surface at the same phase every time if their numbers are multiples of each other.
pub(crate) fn scattered([nu, nv]: [usize; 2]) -> [Vec<f64>; 2] {
    let within =
        |i: usize, n: usize, step: f64, k: usize| (i as f64 + (((k + 1) * (k + 1)) as f64 * step).fract()) / n as f64;
    let (u, v) = (0..nu * nv)
        .map(|k| (within(k % nu, nu, std::f64::consts::SQRT_2, k), within(k / nu, nv, 3f64.sqrt(), k)))
        .unzip();
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

    #[test]
    fn scattered_places_see_every_phase_of_a_periodic_surface() {
        for axis in scattered([5, 5]) {
            for periods in 1..=200 {
                let squares: f64 =
                    axis.iter().map(|t| (std::f64::consts::PI * f64::from(periods) * t).sin().powi(2)).sum();
                // The mean square of a sine is 1/2.
                assert!((squares / 25.0 - 0.5).abs() < 0.25, "{periods}: {squares}");
            }
        }
    }
}
