//! Whether two scans are the same measurement: a file that was converted, moved, or exported in another order of points.
//!
//! Distances of the points from their centroid are the same whatever the frame, the order and the format. Sorted, those
//! of a copy differ by the rounding of the coordinates; those of a second measurement by its noise, which exchanges the
//! ranks of points that are about as far away: with n points over a range r a noise of s moves a quantile by some
//! (0.56 s r / n)^(1/2), as 0.56 s n / r points (root mean square) have passed it.

use super::Scan;
use glam::DVec3;
use rayon::prelude::*;

/// Quantiles that are compared.
const QUANTILES: usize = 64;
/// A copy's quantiles differ by less than this part of what noise would do (root mean square). Rounding is then below a
/// twenty-fifth of the noise.
const COPY: f64 = 0.2;
/// Or by less than this part of the range of distances, where no noise is known: rounding in single precision.
const ROUNDING: f64 = 1e-7;

impl Scan {
    /// Whether this is the other scan again. A copy that was rounded to more than a tenth of the noise is not recognised.
    #[must_use]
    pub fn is_copy_of(&self, other: &Self) -> bool {
        let count = self.mesh.positions.len();
        if count != other.mesh.positions.len() || count < QUANTILES {
            return false;
        }
        let (these, those) = (distances(self), distances(other));
        let at = |k: usize| k * (count - 1) / (QUANTILES - 1);
        let square = |k: usize| (these[at(k)] - those[at(k)]).powi(2);
        let off = ((0..QUANTILES).map(square).sum::<f64>() / QUANTILES as f64).sqrt();
        let range = these[count - 1] - these[0];
        let noise = (0.56 * self.noise.min(other.noise) * range / count as f64).sqrt();
        off < (COPY * noise).max(ROUNDING * range)
    }
}

/// The distances of all points from their centroid, ascending. Millimetres.
fn distances(scan: &Scan) -> Vec<f64> {
    let positions = &scan.mesh.positions;
    let centroid = positions.iter().map(|p| DVec3::from(*p)).sum::<DVec3>() / positions.len() as f64;
    let mut distances: Vec<f64> = positions.par_iter().map(|p| DVec3::from(*p).distance(centroid)).collect();
    distances.par_sort_unstable_by(f64::total_cmp);
    distances
}

#[cfg(test)]
mod tests {
    use crate::mesh::TriangleMesh;
    use crate::scan::{Scan, from_mesh};
    use glam::{DQuat, DVec3};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    /// A bumpy ball, measured at the same places with noise by a seed.
    fn measured(noise: f64, seed: u64) -> Vec<DVec3> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let normal = Normal::new(0.0, noise).unwrap();
        let mut point = |i: u32| {
            let (z, turn) = (f64::from(i) / 10_000.0 - 1.0, f64::from(i) * 2.399_963);
            let (r, flat) = (30.0 + 4.0 * (3.0 * z).sin() + normal.sample(&mut random), (1.0 - z * z).sqrt());
            r * DVec3::new(flat * turn.cos(), 1.3 * flat * turn.sin(), z)
        };
        (0..20_001).map(&mut point).collect()
    }

    fn scan(points: impl Iterator<Item = DVec3>) -> Scan {
        from_mesh(TriangleMesh { positions: points.map(Into::into).collect(), ..TriangleMesh::default() }, "s").unwrap()
    }

    #[test]
    fn a_copy_is_recognised_and_a_second_measurement_is_none() {
        let first = measured(0.02, 1);
        let original = scan(first.iter().copied());
        let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1);
        let moved = first.iter().rev().map(|p| turn * *p + DVec3::new(80.0, -3.0, 12.0));
        // As a text of three decimal places, in another order and frame.
        let rounded = moved.clone().map(|p| (p * 1000.0).round() / 1000.0);
        assert!(original.is_copy_of(&scan(moved.clone())) && scan(rounded).is_copy_of(&original));
        for noise in [0.01, 0.02, 0.1] {
            assert!(!original.is_copy_of(&scan(measured(noise, 2).into_iter())), "{noise}");
        }
        assert!(!original.is_copy_of(&scan(moved.skip(1))));
    }
}
