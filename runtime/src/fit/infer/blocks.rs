//! Blocks of space within which the residuals of a scan may depend on each other.

use crate::fit::tuning::{BLOCK_CLEAR, BLOCK_CORRECTION, BLOCK_EDGES, BLOCK_SIGNIFICANT, FEWEST_BLOCKS};
use crate::morton::morton;
use glam::DVec3;
use rayon::prelude::*;

/// A patch and a cube, its coordinates in 21 bits each.
pub(crate) type Key = (u32, u64);

/// Blocks of one size: points of one patch in one cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Blocks {
    /// Edge of a cube. Millimetres.
    pub(crate) edge: f64,
    /// About how many there are.
    pub(crate) count: usize,
    /// By how much dependence within blocks raises the variance of a mean, over that of independent residuals.
    pub(crate) inflation: f64,
    /// A factor on variances for the dependence across the borders of blocks.
    pub(crate) correction: f64,
}

impl Blocks {
    /// The key of a point's block; `shift` (fractions of an edge) moves the grid.
    pub(crate) fn key(edge: f64, shift: DVec3, patch: u32, p: DVec3) -> Key {
        // A cube so far out that its number does not fit is taken for another one, far out as well.
        let [x, y, z] = (p / edge + shift).floor().to_array().map(|c| c as i64 as u64 & 0x1f_ffff);
        (patch, x | y << 21 | z << 42)
    }

    /// The blocks in which scores depend on each other, from the sizes of block sums: those of independent scores grow
    /// like the root of their number, so that sum over blocks of (sum of scores)^2 / sum of scores^2 is 1 whatever the
    /// size. None where it is not clearly more. The edge taken is the one at which the ratio is largest: in larger
    /// blocks the fit itself has made the sums small. `points` have the position and the patch of every score.
    pub(crate) fn find(points: &[(DVec3, u32)], scores: &[f64], radius: f64) -> Option<Self> {
        let total: f64 = scores.iter().map(|z| z * z).sum();
        if !(total > 0.0) {
            return None;
        }
        let cubes = Sorted::new(points, scores, radius * 0.5_f64.powi(BLOCK_EDGES));
        // From fine to coarse; None where there are too few blocks.
        let of_edge = |level: i32| {
            let (count, squares) = cubes.block_sums(level);
            let ratio = squares / total;
            let clear = ratio > BLOCK_CLEAR + BLOCK_SIGNIFICANT * (2.0 / count as f64).sqrt();
            (count >= FEWEST_BLOCKS).then_some(OfEdge {
                edge: radius * 0.5_f64.powi(BLOCK_EDGES - level),
                count,
                ratio,
                clear,
            })
        };
        let all: Vec<Option<OfEdge>> = (0..BLOCK_EDGES).into_par_iter().map(of_edge).collect();
        let enough: Vec<OfEdge> = all.into_iter().map_while(|edge| edge).collect();
        if !enough.iter().any(|e| e.clear) {
            return None;
        }
        let best = (0..enough.len()).max_by(|a, b| enough[*a].ratio.total_cmp(&enough[*b].ratio))?;
        let OfEdge { edge, count, ratio, .. } = enough[best];
        // Half the edge cuts off twice as much: the limit without any cut is about one difference farther.
        let finer = best.checked_sub(1).map_or(ratio, |i| enough[i].ratio);
        let correction = (1.0 + (ratio - finer) / ratio).clamp(1.0, BLOCK_CORRECTION);
        Some(Self { edge, count, inflation: ratio * correction, correction })
    }
}

/// The dependence within blocks of one size.
struct OfEdge {
    edge: f64,
    count: usize,
    /// Sum over blocks of (sum of scores)^2 over sum of scores^2.
    ratio: f64,
    /// Whether it is clearly more than 1.
    clear: bool,
}

/// Scores in the order of a walk through the smallest cubes, patch by patch: those of a larger cube stand together as
/// well.
struct Sorted(Vec<PlacedScore>);

struct PlacedScore {
    patch: u32,
    /// The smallest cube: interleaved coordinates.
    cube: u64,
    score: f64,
}

impl Sorted {
    fn new(points: &[(DVec3, u32)], scores: &[f64], edge: f64) -> Self {
        let low = points.iter().map(|(p, _)| *p).fold(DVec3::INFINITY, DVec3::min);
        let placed = |((p, patch), score): (&(DVec3, u32), &f64)| PlacedScore {
            patch: *patch,
            cube: morton(((*p - low) / edge).as_u64vec3()),
            score: *score,
        };
        let mut sorted: Vec<PlacedScore> = points.par_iter().zip(scores).map(placed).collect();
        sorted.par_sort_by_key(|p| (p.patch, p.cube));
        Self(sorted)
    }

    /// The number of blocks whose edge is 2^level times the smallest, and the sum over them of (sum of scores)^2.
    fn block_sums(&self, level: i32) -> (usize, f64) {
        let block = |p: &PlacedScore| (p.patch, p.cube >> (3 * level));
        let of_block = |scores: &[PlacedScore]| scores.iter().map(|p| p.score).sum::<f64>().powi(2);
        let blocks = self.0.chunk_by(|a, b| block(a) == block(b)).map(of_block);
        blocks.fold((0, 0.0), |(count, sum), square| (count + 1, sum + square))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn independent_scores_have_no_blocks_and_smooth_ones_have() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let points: Vec<(DVec3, u32)> = (0..20_000)
            .map(|_| (DVec3::new(random.random_range(-50.0..50.0), random.random_range(-50.0..50.0), 0.0), 0))
            .collect();
        let white: Vec<f64> = points.iter().map(|_| random.random_range(-1.0..1.0)).collect();
        assert_eq!(Blocks::find(&points, &white, 50.0), None);
        // A random value on every square of 5 mm, and white noise of the same size: of n = 20000 * 25 / 10000 = 50
        // points a square, the variance of the mean is 1 + (n - 1) / 2 times that of independent ones.
        let levels: Vec<f64> = (0..400).map(|_| random.random_range(-1.0..1.0)).collect();
        let at =
            |p: DVec3| levels[(((p.x + 50.0) / 5.0) as usize).min(19) * 20 + (((p.y + 50.0) / 5.0) as usize).min(19)];
        let patchy: Vec<f64> = points.iter().zip(&white).map(|((p, _), z)| at(*p) + z).collect();
        let blocks = Blocks::find(&points, &patchy, 50.0).unwrap();
        assert!((15.0..40.0).contains(&blocks.inflation) && blocks.edge >= 5.0, "{blocks:?}");
    }
}
