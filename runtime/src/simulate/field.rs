//! Noise that is correlated in space: a Gaussian random field.

use super::scanner::Scanner;
use glam::DVec3;
use rand_distr::{Distribution, StandardNormal};

/// Deviates of the lattice's nodes, which are chosen from them by a hash.
const DEVIATES: usize = 1 << 16;
/// Nodes on either side of the nearest one whose kernel is not negligible: exp(-2.5^2) is 0.002 of its middle.
const REACH: i64 = 2;

/// White noise on the nodes of a cubic lattice of pitch L, smoothed by the kernel exp(-d^2 / L^2) and divided by the
/// root of the sum of the squared weights: everywhere normally distributed with variance 1, and with the correlation
/// exp(-d^2 / (2 L^2)) at a distance d.
pub(super) struct Field {
    length: f64,
    deviates: Vec<f64>,
    seed: u64,
}

impl Field {
    pub(super) fn new(scanner: &Scanner, length: f64) -> Self {
        let mut random = scanner.random(super::FIELD_STREAM);
        let mut deviates: Vec<f64> = (0..DEVIATES).map(|_| StandardNormal.sample(&mut random)).collect();
        // The field's mean and variance are 0 and 1 of these deviates themselves.
        let mean = deviates.iter().sum::<f64>() / DEVIATES as f64;
        let variance = deviates.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / DEVIATES as f64;
        deviates.iter_mut().for_each(|x| *x = (*x - mean) / variance.sqrt());
        Self { length, deviates, seed: scanner.seed }
    }

    /// The field at a place; fields of different numbers are independent.
    pub(super) fn at(&self, place: DVec3, number: u64) -> f64 {
        let local = place / self.length;
        let nearest = local.round();
        let weights = (local - nearest).to_array().map(|d| {
            let weight = |k: i64| (-(k as f64 - d).powi(2)).exp();
            [weight(-2), weight(-1), weight(0), weight(1), weight(2)]
        });
        let nearest = nearest.to_array().map(|c| c as i64);
        let (mut sum, mut squares) = (0.0, 0.0);
        for (i, x) in weights[0].iter().enumerate() {
            for (j, y) in weights[1].iter().enumerate() {
                for (k, z) in weights[2].iter().enumerate() {
                    let node = [i, j, k].map(|n| n as i64 - REACH);
                    let weight = x * y * z;
                    sum += weight * self.deviate([0, 1, 2].map(|a| nearest[a].wrapping_add(node[a])), number);
                    squares += weight * weight;
                }
            }
        }
        sum / squares.sqrt()
    }

    fn deviate(&self, node: [i64; 3], number: u64) -> f64 {
        let mut hash = mix(self.seed ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        for c in node {
            hash = mix(hash ^ c as u64);
        }
        self.deviates[hash as usize % DEVIATES]
    }
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood, 'Fast splittable pseudorandom number generators', 2014).
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In a volume of 40 lengths a side are some 11,000 independent places (the integral of the squared correlation is
    /// pi^1.5 L^3), so that a variance is known to sqrt(2 / 11,000) = 0.013; five of these are allowed.
    #[test]
    fn the_field_has_unit_variance_and_the_stated_correlation() {
        let field = Field::new(&Scanner::default(), 3.0);
        let places: Vec<DVec3> = (0..20_000_u32)
            .map(|i| {
                120.0 * DVec3::new(f64::from(i) * 0.754_877, f64::from(i) * 0.569_840, f64::from(i) * 0.430_159).fract()
            })
            .collect();
        let correlation = |d: f64, number: u64| {
            let products = places.iter().map(|p| field.at(*p, 0) * field.at(*p + d * DVec3::X, number));
            products.sum::<f64>() / places.len() as f64
        };
        for d in [0.0, 1.5, 3.0, 6.0, 12.0] {
            let expected = (-d * d / 18.0_f64).exp();
            let found = correlation(d, 0);
            assert!((found - expected).abs() < 0.07, "{found} for {expected} at {d}");
        }
        assert!(correlation(0.0, 1).abs() < 0.07, "other numbers are other fields");
    }
}
