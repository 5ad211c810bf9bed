//! Whether the residuals are noise, or have a pattern: the model then does not have exactly the scan's shape.

use crate::fit::correspond::foot::Foot;
use crate::fit::problem::Problem;
use crate::fit::problem::objective::Objective;
use crate::fit::refine::schedule::Solution;
use crate::fit::tuning::{
    CORRELATED, CORRELATION_CLEAR, LOPSIDED, LOPSIDED_CLEAR, LOPSIDED_POINTS, THINNED, WALK_STEP,
};
use crate::morton::morton;
use glam::DVec3;

/// A point of the scan that is an inlier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Residual {
    /// Its index in the problem's points.
    pub(crate) point: usize,
    /// The patch on which its foot lies.
    patch: usize,
    /// The foot's cell in a grid over the model, by its Morton code.
    cell: u64,
    /// Its signed distance from the model. Millimetres.
    distance: f64,
}

/// A pattern in residuals.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pattern {
    /// The correlation of neighbours, which is that of Durbin and Watson (1950): 0 of noise, 1 of a pattern without any
    /// noise.
    pub(crate) correlation: f64,
    /// Root mean square of the residuals that were compared. Millimetres.
    pub(crate) rms: f64,
}

impl Pattern {
    /// Root mean square of what is no noise. Millimetres.
    pub(crate) fn size(&self) -> f64 {
        self.rms * self.correlation.sqrt()
    }
}

/// A patch whose residuals have a long tail on one side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lopsided {
    pub(crate) patch: usize,
    /// The middle of the shortest interval that holds half of its residuals: where the surface is if the tail is what
    /// does not belong to it. Millimetres along the patch's normal.
    pub(crate) shift: f64,
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
    let mut feet = objective.feet_on_patches(&placed);
    feet.retain(|(_, _, foot)| solution.loss.value(foot.d2) < 0.5);
    let low = feet.iter().map(|(_, _, foot)| foot.point).fold(DVec3::INFINITY, DVec3::min);
    let residual = |(patch, point, foot): &(usize, usize, Foot)| {
        let off: DVec3 = inverse * (points.position[*point] - estimate.motion.translation) - foot.point;
        let sign = if off.dot(foot.normal) < 0.0 { -1.0 } else { 1.0 };
        let cell = morton(((foot.point - low) / (WALK_STEP * radius)).as_u64vec3());
        Residual { point: *point, patch: *patch, cell, distance: sign * foot.d2.sqrt() }
    };
    let mut residuals: Vec<Residual> = feet.iter().map(residual).collect();
    residuals.sort_by_key(|residual| (residual.cell, residual.point));
    Some(residuals)
}

/// A pattern of all residuals, or else of one in every cell of a coarser grid, in which a part of the object of which
/// there are few points counts as one of which there are many. None where there is no more of it than chance
/// leaves.
pub(crate) fn pattern(residuals: &[Residual]) -> Option<Pattern> {
    let all = pattern_of(&residuals.iter().map(|residual| residual.distance).collect::<Vec<f64>>());
    let sparse = || {
        let thinned = THINNED.iter().map(|levels| thinned(residuals, *levels));
        let fewer = thinned.filter(|thinned| 2 * thinned.len() < residuals.len());
        fewer.filter_map(|thinned| pattern_of(&thinned)).max_by(|a, b| a.size().total_cmp(&b.size()))
    };
    all.or_else(sparse)
}

/// One residual of every cell that is 2^levels times as large.
fn thinned(residuals: &[Residual], levels: u32) -> Vec<f64> {
    let cells = residuals.chunk_by(|a, b| a.cell >> (3 * levels) == b.cell >> (3 * levels));
    cells.map(|cell| cell[cell.len() / 2].distance).collect()
}

/// The pattern of residuals that follow each other, where it is no accident.
fn pattern_of(residuals: &[f64]) -> Option<Pattern> {
    let (mut product, mut squares) = (0.0, 0.0);
    for pair in residuals.windows(2) {
        product += pair[0] * pair[1];
        squares += 0.5 * (pair[0] * pair[0] + pair[1] * pair[1]);
    }
    let count = residuals.len() as f64;
    let correlation = product / f64::max(squares, f64::MIN_POSITIVE);
    // Of independent residuals its standard deviation is one over the root of their number.
    let is_clear = correlation > f64::max(CORRELATED, CORRELATION_CLEAR / f64::sqrt(count));
    is_clear.then(|| Pattern { correlation, rms: (squares / (count - 1.0)).sqrt() })
}

/// The patches whose residuals have a long tail on one side, the farthest shifted first. `least` is the root mean
/// square below which residuals are rounding. Millimetres.
pub(crate) fn lopsided(residuals: &[Residual], least: f64) -> Vec<Lopsided> {
    let patches = residuals.iter().map(|residual| residual.patch + 1).max().unwrap_or(0);
    let mut by_patch: Vec<Vec<f64>> = vec![Vec::new(); patches];
    residuals.iter().for_each(|residual| by_patch[residual.patch].push(residual.distance));
    let of_patch = |(patch, mut own): (usize, Vec<f64>)| {
        if own.len() < LOPSIDED_POINTS {
            return None;
        }
        own.sort_unstable_by(f64::total_cmp);
        let (count, half) = (own.len() as f64, own.len() / 2);
        let mean = own.iter().sum::<f64>() / count;
        let sd = (own.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / count).sqrt();
        let skewness = (mean - own[half]) / sd;
        // Of normally distributed residuals its variance is (pi / 2 - 1) over their number.
        let clear = LOPSIDED_CLEAR * ((std::f64::consts::FRAC_PI_2 - 1.0) / count).sqrt();
        if !(sd > least && skewness.abs() > clear.max(LOPSIDED)) {
            return None;
        }
        let shortest = (0..own.len() - half).min_by(|a, b| {
            let width = |k: &usize| own[k + half] - own[*k];
            width(a).total_cmp(&width(b))
        })?;
        Some(Lopsided { patch, shift: 0.5 * (own[shortest] + own[shortest + half]) })
    };
    let mut found: Vec<Lopsided> = by_patch.into_iter().enumerate().filter_map(of_patch).collect();
    found.sort_by(|a, b| b.shift.abs().total_cmp(&a.shift.abs()));
    found
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
            let with = |(k, z): (usize, &f64)| z + wave * (k as f64 / 50.0).sin();
            pattern_of(&noise.iter().enumerate().map(with).collect::<Vec<f64>>())
        };
        assert!(of(0.0).is_none());
        // The variance of the noise is 1/3, that of a wave of amplitude 1 is 1/2.
        let found = of(1.0).unwrap();
        assert!((found.correlation - 0.6).abs() < 0.03 && (found.size() - 0.5_f64.sqrt()).abs() < 0.03, "{found:?}");
        assert!(pattern_of(&[1.0; 4]).is_none());
    }

    #[test]
    fn a_pattern_where_there_are_few_points_is_seen_beside_many_without() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        // Along a line of 2,048 cells: a hundred points in each of the first half, one in each of the others, which is
        // off by twice the noise.
        let mut residuals = Vec::new();
        for k in 0..2048_u64 {
            let (count, off) = if k < 1024 { (100, 0.0) } else { (1, 2.0) };
            for _ in 0..count {
                let distance = off + random.random_range(-1.0..1.0);
                let cell = morton(glam::U64Vec3::new(32 * k, 0, 0));
                residuals.push(Residual { point: residuals.len(), patch: 0, cell, distance });
            }
        }
        let all: Vec<f64> = residuals.iter().map(|residual| residual.distance).collect();
        assert!(pattern_of(&all).is_none());
        // Of the thinned ones the mean square is 1/3 + 2, of which 2 are the pattern.
        let found = pattern(&residuals).unwrap();
        assert!((found.size() - 2.0_f64.sqrt()).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn a_tail_on_one_side_is_seen_and_how_far_it_has_moved_the_rest() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        let noise: Vec<f64> = (0..20_000).map(|_| normal()).collect();
        let with = |share: usize, tail: f64| -> Vec<Residual> {
            let tailed = |(k, z): (usize, &f64)| if k % 10 < share { z + tail * (k % 97) as f64 / 97.0 } else { *z };
            let all: Vec<f64> = noise.iter().enumerate().map(tailed).collect();
            let mean = all.iter().sum::<f64>() / all.len() as f64;
            let residual = |(point, d): (usize, &f64)| Residual { point, patch: 3, cell: 0, distance: d - mean };
            all.iter().enumerate().map(residual).collect()
        };
        assert!(lopsided(&with(0, 0.0), 1e-6).is_empty());
        // Three in ten are off by 0 to 10 standard deviations: the mean is moved by 1.5.
        let found = lopsided(&with(3, 10.0), 1e-6);
        assert!(found[0].patch == 3 && (found[0].shift + 1.4).abs() < 0.15, "{found:?}");
        assert!(lopsided(&with(3, 10.0), 1e6).is_empty());
    }
}
