//! Other shapes to begin from: parameters for which the model's pairs of surface points have the distances of the scan's.
//! The distribution of such distances (Osada et al., "Shape distributions", D2) does not depend on the pose.

use crate::fit::problem::level::Level;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::points::Points;
use crate::model::Instance;
use glam::DVec3;
use rayon::prelude::*;

/// Shapes that are looked at.
const SHAPES: usize = 512;
/// Rounds in which the best are varied, how many of them, and how often each.
const ROUNDS: usize = 4;
const PARENTS: usize = 8;
const CHILDREN: usize = 16;
/// Points of a shape.
const SAMPLE: usize = 120;
/// Bins of the distribution.
const BINS: usize = 24;

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

/// Up to `count` shapes whose distribution is nearest to the scan's, none nearly the same as another.
pub(crate) fn propose(level: &Level, start: &Estimate, count: usize) -> Vec<Estimate> {
    let dim = start.z.len();
    if dim == 0 {
        return Vec::new();
    }
    let ranges: Vec<(f64, f64)> =
        (0..dim).map(|k| level.space.search_range(k, start.z[k], level.problem.radius)).collect();
    let target = Distribution::of_points(&level.problem.thin.sample(SAMPLE), level.problem.radius);
    let judge = |unit: Vec<f64>| {
        let z: Vec<f64> = unit.iter().zip(&ranges).map(|(t, (low, high))| low + t * (high - low)).collect();
        let off = Distribution::of_model(level, &z).map_or(f64::INFINITY, |d| d.distance(&target));
        (off, unit)
    };
    let mut shapes: Vec<(f64, Vec<f64>)> =
        (1..=SHAPES).into_par_iter().map(|i| judge((0..dim).map(|n| halton(i, n)).collect())).collect();
    shapes.sort_by(|a, b| a.0.total_cmp(&b.0));
    for round in 0..ROUNDS {
        let reach = 0.3 * 0.5_f64.powi(round as i32);
        let parents: Vec<Vec<f64>> = shapes.iter().take(PARENTS).map(|(_, unit)| unit.clone()).collect();
        let children: Vec<(f64, Vec<f64>)> = (0..PARENTS * CHILDREN)
            .into_par_iter()
            .filter_map(|c| {
                let parent = parents.get(c / CHILDREN)?;
                let draw = |n: usize| halton(1 + round * PARENTS * CHILDREN + c, n) - 0.5;
                Some(judge(
                    parent.iter().enumerate().map(|(n, t)| (t + 2.0 * reach * draw(n)).clamp(0.0, 1.0)).collect(),
                ))
            })
            .collect();
        shapes.extend(children);
        shapes.sort_by(|a, b| a.0.total_cmp(&b.0));
        shapes.truncate(4 * PARENTS);
    }
    let mut chosen: Vec<Vec<f64>> = Vec::new();
    for (off, unit) in shapes {
        let near = |other: &Vec<f64>| unit.iter().zip(other).all(|(a, b)| (a - b).abs() < 0.12);
        if chosen.len() < count && off.is_finite() && !chosen.iter().any(near) {
            chosen.push(unit);
        }
    }
    chosen
        .into_iter()
        .map(|unit| Estimate {
            z: unit.iter().zip(&ranges).map(|(t, (low, high))| low + t * (high - low)).collect(),
            motion: start.motion,
        })
        .collect()
}

/// The cumulative distribution of distances between points of a surface.
struct Distribution {
    below: [f64; BINS],
}

impl Distribution {
    fn of_points(points: &Points, radius: f64) -> Self {
        Self::of(&points.position, radius)
    }

    /// Of the model at coordinates z; None where it does not exist.
    fn of_model(level: &Level, z: &[f64]) -> Option<Self> {
        let x = level.space.x(z)?;
        let instance = level.problem.model.instantiate(&x).ok()?;
        let points = surface_points(level.problem.model.parts().len(), &*instance);
        (points.len() > 2).then(|| Self::of(&points, level.problem.radius))
    }

    fn of(points: &[DVec3], radius: f64) -> Self {
        let mut counts = [0.0; BINS];
        let width = 5.0 * radius / BINS as f64;
        for (i, a) in points.iter().enumerate() {
            for b in &points[..i] {
                counts[((a.distance(*b) / width) as usize).min(BINS - 1)] += 1.0;
            }
        }
        let total: f64 = counts.iter().sum::<f64>().max(1.0);
        let mut sum = 0.0;
        Self {
            below: counts.map(|c| {
                sum += c / total;
                sum
            }),
        }
    }

    /// The earth mover's distance.
    fn distance(&self, other: &Self) -> f64 {
        self.below.iter().zip(&other.below).map(|(a, b)| (a - b).abs()).sum()
    }
}

/// About `SAMPLE` points, even by area.
fn surface_points(patches: usize, instance: &dyn Instance) -> Vec<DVec3> {
    const N: usize = 11;
    let axis: Vec<f64> = (0..N).map(|i| i as f64 / (N - 1) as f64).collect();
    let mut cells: Vec<(f64, [DVec3; 4])> = Vec::new();
    let mut p = vec![[0.0; 3]; N * N];
    for patch in 0..patches {
        if instance.points_grid(patch, &axis, &axis, &mut p).is_err() {
            continue;
        }
        let at = |i: usize, j: usize| DVec3::from_array(p[j * N + i]);
        for j in 0..N - 1 {
            for i in 0..N - 1 {
                let c = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                let area = 0.5 * (c[2] - c[0]).cross(c[3] - c[1]).length();
                if area.is_finite() {
                    cells.push((area, c));
                }
            }
        }
    }
    let total: f64 = cells.iter().map(|c| c.0).sum();
    let mut points = Vec::with_capacity(SAMPLE);
    let mut sum = 0.0;
    for (area, c) in cells {
        let before = sum;
        sum += area;
        // Systematic sampling: a point whenever the running area passes the next mark.
        let mark = |a: f64| (a / total * SAMPLE as f64) as usize;
        for k in mark(before)..mark(sum) {
            let (s, t) = (halton(k + 1, 0), halton(k + 1, 1));
            points.push(c[0].lerp(c[1], s).lerp(c[3].lerp(c[2], s), t));
        }
    }
    points
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
