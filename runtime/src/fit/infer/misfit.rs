//! Whether the residuals are noise, or have a pattern: the model then does not have exactly the scan's shape.

use crate::fit::correspond::foot::Foot;
use crate::fit::problem::Problem;
use crate::fit::problem::objective::Objective;
use crate::fit::refine::schedule::Solution;
use crate::fit::tuning::{CORRELATED, CORRELATION_CLEAR, WALK_STEP};
use crate::morton::morton;
use glam::DVec3;

/// A point of the scan that is an inlier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Residual {
    /// Its index in the problem's points.
    pub(crate) point: usize,
    /// Its signed distance from the model. Millimetres.
    pub(crate) distance: f64,
}

/// The residuals of all inliers in the order of a walk over the model, so that neighbours in the list are neighbours on
/// the surface. (Neighbours in space are also alike in their noise, where that is larger than the spacing.) None where
/// the model does not exist.
pub(crate) fn residuals(solution: &Solution) -> Option<Vec<Residual>> {
    let Solution { level, estimate, cache, .. } = solution;
    let Problem { points, radius, .. } = level.problem;
    let objective = Objective { cache: Some(cache.clone()), ..solution.objective(points) };
    let placed = objective.place(estimate).ok()?;
    let inverse = estimate.motion.rotation.inverse();
    let mut feet = solution.inlier_feet(&objective, &placed);
    let low = feet.iter().map(|(_, foot)| foot.point).fold(DVec3::INFINITY, DVec3::min);
    let cell = |foot: &Foot| morton(((foot.point - low) / (WALK_STEP * radius)).as_u64vec3());
    feet.sort_by_cached_key(|(i, foot)| (cell(foot), *i));
    let residual = |(i, foot): &(usize, Foot)| {
        let off: DVec3 = inverse * (points.position[*i] - estimate.motion.translation) - foot.point;
        let sign = if off.dot(foot.normal) < 0.0 { -1.0 } else { 1.0 };
        Residual { point: *i, distance: sign * foot.d2.sqrt() }
    };
    Some(feet.iter().map(residual).collect())
}

/// The correlation of residuals that follow each other, where it is no accident: it is that of Durbin and Watson
/// (1950), 0 of noise, 1 of a pattern without any noise.
pub(crate) fn correlation(residuals: &[Residual]) -> Option<f64> {
    let (mut product, mut squares) = (0.0, 0.0);
    for pair in residuals.windows(2) {
        let [a, b] = [pair[0].distance, pair[1].distance];
        product += a * b;
        squares += 0.5 * (a * a + b * b);
    }
    let count = residuals.len() as f64;
    let correlation = product / f64::max(squares, f64::MIN_POSITIVE);
    // Of independent residuals its standard deviation is one over the root of their number.
    (correlation > f64::max(CORRELATED, CORRELATION_CLEAR / f64::sqrt(count))).then_some(correlation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn noise_has_no_correlation_and_a_wave_has_its_share() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let noise: Vec<f64> = (0..4000).map(|_| random.random_range(-1.0..1.0)).collect();
        let of = |wave: f64| {
            let with = |(point, z): (usize, &f64)| Residual { point, distance: z + wave * (point as f64 / 50.0).sin() };
            noise.iter().enumerate().map(with).collect::<Vec<_>>()
        };
        assert_eq!(correlation(&of(0.0)), None);
        // The variance of the noise is 1/3, that of a wave of amplitude 1 is 1/2.
        let found = correlation(&of(1.0)).unwrap();
        assert!((found - 0.6).abs() < 0.03, "{found}");
        assert_eq!(correlation(&[Residual { point: 0, distance: 1.0 }; 4]), None);
    }
}
