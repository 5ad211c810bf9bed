//! Other shapes to begin from: parameters for which pairs of the model's surface points have the distances of the
//! scan's. The distribution of such distances (Osada et al., "Shape distributions", D2) does not depend on the pose.

use crate::fit::problem::level::Level;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::tuning::{D2_BINS, D2_GRID, D2_POINTS, D2_SPAN, PROPOSAL_DRAWS, PROPOSALS, PROPOSALS_APART};
use crate::model::Instance;
use crate::sampling::halton;
use glam::DVec3;
use rayon::prelude::*;

/// Up to `PROPOSALS` shapes whose distribution is nearest to the scan's, none nearly the same as another, of other
/// draws in every round.
pub(super) fn propose(level: &Level, start: &Estimate, round: usize) -> Vec<Estimate> {
    let problem = level.problem;
    let dim = start.z.len();
    if dim == 0 {
        return Vec::new();
    }
    let ranges: Vec<(f64, f64)> = (0..dim).map(|k| level.space.search_range(k, start.z[k], problem.radius)).collect();
    let sample = problem.thin.sample(D2_POINTS);
    let scanned = distances(&sample.position, |i| sample.prior(i), problem.radius);
    let draw = |i: usize| {
        let unit: Vec<f64> = (0..dim).map(|n| halton(i, n)).collect();
        let z: Vec<f64> = unit.iter().zip(&ranges).map(|(t, (low, high))| low + t * (high - low)).collect();
        Some(Proposal { distance: earth_movers(&of_model(level, &z)?, &scanned), unit, z })
    };
    let first = 1 + round * PROPOSAL_DRAWS;
    let mut proposals: Vec<Proposal> = (first..first + PROPOSAL_DRAWS).into_par_iter().filter_map(draw).collect();
    proposals.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    let mut chosen: Vec<Proposal> = Vec::new();
    for proposal in proposals {
        if chosen.len() < PROPOSALS && !chosen.iter().any(|other| other.is_near(&proposal)) {
            chosen.push(proposal);
        }
    }
    chosen.into_iter().map(|proposal| Estimate { z: proposal.z, motion: start.motion }).collect()
}

/// A shape that was drawn.
struct Proposal {
    /// The distance of its distribution from the scan's.
    distance: f64,
    /// Its free parameters, as fractions of their ranges.
    unit: Vec<f64>,
    z: Vec<f64>,
}

impl Proposal {
    fn is_near(&self, other: &Self) -> bool {
        self.unit.iter().zip(&other.unit).all(|(a, b)| (a - b).abs() < PROPOSALS_APART)
    }
}

/// A cumulative distribution of distances.
type Distribution = [f64; D2_BINS];

/// The distribution of the distances between points, which have prior weights; bins are scaled by `radius`
/// (millimetres).
fn distances(points: &[DVec3], prior: impl Fn(usize) -> f64, radius: f64) -> Distribution {
    let mut counts = [0.0; D2_BINS];
    let width = D2_SPAN * radius / D2_BINS as f64;
    for (i, a) in points.iter().enumerate() {
        for (j, b) in points[..i].iter().enumerate() {
            counts[((a.distance(*b) / width) as usize).min(D2_BINS - 1)] += prior(i) * prior(j);
        }
    }
    let total: f64 = counts.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let mut sum = 0.0;
    counts.map(|c| {
        sum += c / total;
        sum
    })
}

fn earth_movers(a: &Distribution, b: &Distribution) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum()
}

/// The distribution of the model at free parameters `z`; None where it does not exist.
fn of_model(level: &Level, z: &[f64]) -> Option<Distribution> {
    let model = level.problem.model;
    let instance = model.instantiate(&level.space.x(z)?).ok()?;
    let points = surface_points(model.parts().len(), &*instance);
    (points.len() > 2).then(|| distances(&points, |_| 1.0, level.problem.radius))
}

/// About `D2_POINTS` points of the surface, even by area.
fn surface_points(patches: usize, instance: &dyn Instance) -> Vec<DVec3> {
    let axis: Vec<f64> = (0..D2_GRID).map(|i| i as f64 / (D2_GRID - 1) as f64).collect();
    let mut cells: Vec<(f64, [DVec3; 4])> = Vec::new();
    let mut p = vec![[0.0; 3]; D2_GRID * D2_GRID];
    for patch in 0..patches {
        if instance.points_grid(patch, &axis, &axis, &mut p).is_err() {
            continue;
        }
        let at = |i: usize, j: usize| DVec3::from_array(p[j * D2_GRID + i]);
        for j in 0..D2_GRID - 1 {
            for i in 0..D2_GRID - 1 {
                let c = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                let area = 0.5 * (c[2] - c[0]).cross(c[3] - c[1]).length();
                if area.is_finite() {
                    cells.push((area, c));
                }
            }
        }
    }
    let total: f64 = cells.iter().map(|c| c.0).sum();
    let mut points = Vec::with_capacity(D2_POINTS);
    let mut sum = 0.0;
    for (area, c) in cells {
        let before = sum;
        sum += area;
        // Systematic sampling: a point whenever the running area passes the next mark.
        let mark = |a: f64| (a / total * D2_POINTS as f64) as usize;
        for k in mark(before)..mark(sum) {
            let (s, t) = (halton(k + 1, 0), halton(k + 1, 1));
            points.push(c[0].lerp(c[1], s).lerp(c[3].lerp(c[2], s), t));
        }
    }
    points
}
