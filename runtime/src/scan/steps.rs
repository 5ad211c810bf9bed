//! Steps of coordinates: files hold them rounded, to whole millimetres, to so many digits, or to single precision.
//!
//! Rounding that is finer than the noise adds its variance, a twelfth of the squared step, and no more. Where it is
//! coarser, whole faces of an object lie off by up to half a step, without any spread that would tell: a statistic of
//! the residuals calls them certain. So the steps are read off the coordinates themselves.

use super::neighbours::Neighbours;
use super::rounded::Frame;
use crate::mesh::TriangleMesh;
use crate::robust::median;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The number of points whose coordinates are looked at. Of n random ones on L steps some n^2 / 2L are neighbours on
/// them: steps of a millionth of the scan's size are still found.
const SAMPLES: usize = 20_000;
/// Fewer coordinates, or fewer different ones, show no steps: those of a designed object are few.
pub(super) const FEWEST: usize = 200;
const FEWEST_GAPS: usize = 8;
/// The least share of the coordinates that have a step, for it to matter: a face of the object has so many.
const SHARE: f64 = 0.05;
/// Coordinates come again and again that come at least so many times as often as the median of those that come twice:
/// others do so by chance.
const OF_USUAL: f64 = 0.25;
/// How far from a whole number of steps a difference of two coordinates may be, in steps: that of a random one is
/// nearer once in ten times.
const OFF: f64 = 0.05;
/// Differences of more steps add up the errors of the step, and are not looked at.
const FAR: f64 = 1000.0;
/// Steps below this share of the scan's size are no matter: single precision near the origin has 1.2e-7.
const FINE: f64 = 2e-6;
/// Steps matter that are larger than the noise: with smaller ones, the noise being 0.96 of a step, a face is off by
/// less than a millionth of a step (the first harmonic of rounding, see `rounding`).
const COARSE: f64 = 1.0;
/// Points of a regular grid are apart by its step, and on steep faces by little more, as one of its axes runs along
/// them. Rounded ones are farther apart, by the diagonal of a step at least, or some fall on one place.
const OF_SPACING: f64 = 0.72;
const COINCIDENT: f64 = 0.05;

/// The cosine from which on a normal is along an axis, the share of such points on a lattice, of that of all points,
/// below which it is no rounding, and the intervals of a step in which coordinates are counted. Of 7,000 points of a
/// plate's voxels 79 % are on the lattice in x, 1.4 % of those across x; of a ball's two thirds and a third at most.
const ACROSS: f64 = 0.95;
const OF_ALL: f64 = 0.6;
const PHASES: usize = 1000;

/// The step of coordinates along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Step {
    /// 0 where none is seen.
    pub(crate) length: f64,
    /// It is that of numbers of so many digits: larger ones have a larger step, by a power of ten or two.
    pub(crate) of_digits: bool,
}

/// The steps of the coordinates of points in a frame.
pub(crate) fn steps(positions: &[[f64; 3]], frame: &Frame) -> [Step; 3] {
    let every = positions.len().div_ceil(SAMPLES).max(1);
    let local: Vec<[f64; 3]> = positions.iter().step_by(every).map(|p| frame.local(*p)).collect();
    // Numbers that were moved and moved back have lost some of their last digits.
    let all = positions.iter().step_by(every).chain([&frame.origin]).flatten();
    let farthest = all.fold(0.0, |a: f64, c| a.max(c.abs()));
    let scale = frame.rows.iter().flatten().fold(0.0, |a: f64, c| a.max(c.abs()));
    std::array::from_fn(|k| {
        let mut values: Vec<f64> = local.iter().map(|p| p[k]).collect();
        values.sort_unstable_by(f64::total_cmp);
        of_axis(&values, 8.0 * f64::EPSILON * scale * farthest)
    })
}

/// The step of sorted coordinates: by the power of two and of ten that they are in, as numbers of so many digits have
/// it, or the same for all where there are few of a size; the largest of those that a part of the points have.
/// Coordinates that differ by `rounding` are the same.
fn of_axis(values: &[f64], rounding: f64) -> Step {
    let of_all = common(values, rounding).unwrap_or_else(|| of_single(values));
    let mut by_size: BTreeMap<(bool, i64, i64), Vec<f64>> = BTreeMap::new();
    for value in values {
        let size = (*value < 0.0, value.abs().log2().floor() as i64, value.abs().log10().floor() as i64);
        by_size.entry(size).or_default().push(*value);
    }
    let of_sizes: Vec<(f64, usize)> =
        by_size.values().map(|of_size| (common(of_size, rounding).unwrap_or(of_all), of_size.len())).collect();
    let mut steps: Vec<(f64, usize)> = of_sizes.iter().copied().chain(repeated(values, rounding)).collect();
    steps.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut have = 0;
    let of_many = |(_, count): &&(f64, usize)| {
        have += count;
        have as f64 >= SHARE * values.len() as f64
    };
    let length = steps.iter().find(of_many).map_or(0.0, |(step, _)| *step);
    let many = of_sizes.iter().filter(|(_, count)| *count >= FEWEST).map(|(step, _)| *step);
    let least = many.clone().fold(f64::INFINITY, f64::min);
    let of_digits = least > 0.0 && length > 1.5 * least && many.chain([length]).all(|step| is_power(step / least));
    Step { length, of_digits }
}

/// Whether a number is a power of ten or of two.
fn is_power(x: f64) -> bool {
    [x.log10(), x.log2()].iter().any(|power| (power - power.round()).abs() < 0.01)
}

/// The step of those of the sorted coordinates that come again and again, and their number: where some points are not
/// rounded, or are to other steps, these are the others. Of coordinates with many digits none come twice.
fn repeated(values: &[f64], rounding: f64) -> Option<(f64, usize)> {
    let runs: Vec<&[f64]> = values.chunk_by(|a, b| b - a <= rounding).filter(|run| run.len() > 1).collect();
    let mut counts: Vec<f64> = runs.iter().map(|run| run.len() as f64).collect();
    let usual = OF_USUAL * median(&mut counts)?;
    let often: Vec<f64> = runs.into_iter().filter(|run| run.len() as f64 >= usual).flatten().copied().collect();
    if (often.len() as f64) < SHARE * values.len() as f64 {
        return None;
    }
    Some((common(&often, rounding)?, often.len()))
}

/// The step of single precision where it is so wide that sorted coordinates are hardly any different ones; else 0.
fn of_single(values: &[f64]) -> f64 {
    let [Some(low), Some(high)] = [values.first(), values.last()] else { return 0.0 };
    let step = f64::from(f32::EPSILON) * low.abs().max(high.abs()).log2().floor().exp2();
    let is_single = values.iter().all(|value| f64::from(*value as f32) == *value);
    if is_single && high - low <= FEWEST_GAPS as f64 * step { step } else { 0.0 }
}

/// The step of which all differences of sorted coordinates are whole multiples.
fn common(values: &[f64], rounding: f64) -> Option<f64> {
    let gaps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > rounding).collect();
    if values.len() < FEWEST || gaps.len() < FEWEST_GAPS {
        return None;
    }
    let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    let step = median(&mut gaps.iter().copied().filter(|gap| *gap < 1.5 * least).collect::<Vec<f64>>())?;
    let is_whole = |gap: &f64| (gap - (gap / step).round() * step).abs() <= OFF * step;
    gaps.iter().filter(|gap| **gap < FAR * step).all(is_whole).then_some(step)
}

/// Whether some steps are coarse beside the noise. Millimetres.
pub(super) fn any_coarse(frames: &[Frame], mesh: &TriangleMesh, noise: f64) -> bool {
    let least = least(mesh, noise);
    frames.iter().any(|frame| (0..3).any(|k| is_coarse(frame, k, least)))
}

/// The step above which rounding is coarse.
fn least(mesh: &TriangleMesh, noise: f64) -> f64 {
    (COARSE * noise).max(FINE * mesh.bounds().diagonal())
}

fn is_coarse(frame: &Frame, k: usize, least: f64) -> bool {
    frame.step(k).1 > least
}

/// Sets steps to 0 but those that are the rounding of measured coordinates, and coarse beside the noise: a raster's
/// points lie on a grid too, and are exact there. In millimetres, as the noise; `largest` has the largest coordinates
/// by frame, and `coincident` is the share of points, or of triangles, that fell together with another one, or
/// vanished.
pub(super) fn coarse(frames: &mut [Frame], largest: &[[f64; 3]], mesh: &TriangleMesh, noise: f64, coincident: f64) {
    let (spacing, least) = (spacing(&mesh.positions), least(mesh, noise));
    for (frame, largest) in frames.iter_mut().zip(largest) {
        let counts = |k: usize| {
            let is_single = frame.steps[k] <= 1.001 * f64::from(f32::EPSILON) * largest[k];
            let is_grid = frame.step(k).1 >= OF_SPACING * spacing && coincident <= COINCIDENT;
            is_coarse(frame, k, least) && (is_single || frame.of_digits[k] || !is_grid)
        };
        frame.steps = std::array::from_fn(|k| if counts(k) { frame.steps[k] } else { 0.0 });
    }
}

/// Whether coordinates have a step along the faces of an object and not across them, as those of a mesh that was made
/// from voxels: its vertices are on the edges of these, where the value says. Nothing lies off then. Each has how much
/// its point's normal is along the axis.
pub(super) fn are_of_a_lattice(coordinates: &[(f64, f64)], step: f64) -> bool {
    let interval = |c: f64| (((c / step).rem_euclid(1.0) * PHASES as f64) as usize).min(PHASES - 1);
    let mut counts = [0_usize; PHASES];
    coordinates.iter().for_each(|(c, _)| counts[interval(*c)] += 1);
    // The lattice may be at the border of two intervals.
    let pair = |k: usize| counts[k] + counts[(k + 1) % PHASES];
    let first = (0..PHASES).max_by_key(|k| pair(*k)).unwrap_or(0);
    let is_on = |c: f64| [first, (first + 1) % PHASES].contains(&interval(c));
    let share = |of: &[f64]| of.iter().filter(|c| is_on(**c)).count() as f64 / of.len() as f64;
    let [all, across] = [0.0, ACROSS]
        .map(|least| coordinates.iter().filter(|(_, n)| *n >= least).map(|(c, _)| *c).collect::<Vec<f64>>());
    across.len() >= FEWEST && share(&across) < OF_ALL * share(&all)
}

/// The median distance of points from their nearest neighbours.
fn spacing(positions: &[[f64; 3]]) -> f64 {
    let tree = Neighbours::new(positions);
    let distance = |at: &[f64; 3]| {
        let nearest = positions[*tree.nearest(*at, 2).get(1)? as usize];
        Some((0..3).map(|k| (at[k] - nearest[k]).powi(2)).sum::<f64>().sqrt())
    };
    let every = positions.len().div_ceil(SAMPLES).max(1);
    let mut distances: Vec<f64> = positions.par_iter().step_by(every).filter_map(distance).collect();
    median(&mut distances).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn random(count: usize, low: f64, high: f64) -> Vec<[f64; 3]> {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        (0..count).map(|_| std::array::from_fn(|_| random.random_range(low..high))).collect()
    }

    fn steps(points: &[[f64; 3]]) -> [f64; 3] {
        super::steps(points, &Frame::own([0.0; 3])).map(|step| step.length)
    }

    fn coarse(steps: [f64; 3], mesh: &TriangleMesh, noise: f64, coincident: f64) -> [f64; 3] {
        let mut frames = [Frame::own(steps)];
        super::coarse(&mut frames, &[[60.0; 3]], mesh, noise, coincident);
        frames[0].steps
    }

    fn rounded(points: &[[f64; 3]], by: impl Fn(f64) -> f64) -> [f64; 3] {
        steps(&points.iter().map(|p| p.map(&by)).collect::<Vec<_>>())
    }

    #[test]
    fn steps_are_those_to_which_coordinates_were_rounded() {
        for (low, high) in [(-30.0, 31.0), (400_000.0, 400_060.0), (5_400_000.0, 5_400_060.0)] {
            let points = random(30_000, low, high);
            assert_eq!(steps(&points), [0.0; 3]);
            for step in [1.0, 0.5, 0.1, 0.025, 0.001] {
                // As LAS files have them: whole numbers of steps from some place.
                let found = rounded(&points, |c| (c / step).round() * step + 17.1234);
                assert!(found.iter().all(|s| (s / step - 1.0).abs() < 1e-3), "{found:?} for {step} from {low}");
            }
        }
    }

    #[test]
    fn numbers_of_so_many_digits_have_the_steps_of_their_size() {
        // Single precision has 24 binary digits.
        let points = random(30_000, 900_000.0, 1_000_000.0);
        assert_eq!(rounded(&points, |c| f64::from(c as f32)), [0.0625; 3]);
        let far = random(30_000, 450_000_000.0, 450_000_061.0);
        assert_eq!(rounded(&far, |c| f64::from(c as f32)), [32.0; 3]);
        let near = rounded(&random(30_000, -60.0, 60.0), |c| f64::from(c as f32));
        assert!(near.iter().all(|step| *step < 4e-6), "{near:?}");
        // Six decimal ones: half of these numbers have three before the point, the others two.
        let six = |c: f64| format!("{c:.5e}").parse().unwrap();
        let found = rounded(&random(30_000, 50.0, 150.0), six);
        let points: Vec<[f64; 3]> = random(30_000, 50.0, 150.0).iter().map(|p| p.map(six)).collect();
        assert!(super::steps(&points, &Frame::own([0.0; 3])).iter().all(|step| step.of_digits));
        // The largest one that many have counts.
        assert!(found.iter().all(|step| (step / 1e-3 - 1.0).abs() < 1e-3), "{found:?}");
    }

    #[test]
    fn points_that_are_not_rounded_do_not_hide_the_steps_of_the_others() {
        let mut points = random(30_000, -30.0, 30.0);
        for digits in [1e3, 1e6] {
            for (i, p) in points.iter_mut().enumerate() {
                let step = if i % 10 == 0 { 1.0 / digits } else { 0.2 };
                *p = p.map(|c| (c / step).round() * step);
            }
            let found = steps(&points);
            assert!(found.iter().all(|step| (step - 0.2).abs() < 1e-6), "{found:?}");
        }
        // Half of the points have a step of 0.5 m, a tenth of a millimetre the others.
        let points = random(30_000, -30.0, 30.0);
        let found = rounded(&points, |c| if c > 10.0 { (c * 2.0).round() / 2.0 } else { (c * 1e4).round() / 1e4 });
        assert!(found.iter().all(|step| (step - 0.5).abs() < 1e-6), "{found:?}");
    }

    #[test]
    fn few_coordinates_have_no_steps() {
        assert_eq!(steps(&[]), [0.0; 3]);
        // But those of single precision, which are no matter so near the origin.
        assert_eq!(steps(&[[1.0; 3]; 3000]), [f64::from(f32::EPSILON); 3]);
        assert_eq!(steps(&[[1.1; 3]; 3000]), [0.0; 3]);
        assert_eq!(steps(&[[0.0; 3]; 3000]), [0.0; 3]);
        let corners: Vec<[f64; 3]> = (0..3000).map(|i| [f64::from(i % 4) * 10.0; 3]).collect();
        assert_eq!(steps(&corners), [0.0; 3]);
    }

    /// The vertices of the voxels' edges that a ball crosses; and the ball's points, rounded.
    #[test]
    fn a_lattice_of_voxels_is_no_rounding() {
        let (radius, step) = (40.0_f64, 0.7);
        let mut made = Vec::new();
        for k in 0..3 {
            for (i, j) in (-58..58).flat_map(|i| (-58..58).map(move |j| (f64::from(i) * step, f64::from(j) * step))) {
                let square = radius * radius - i * i - j * j;
                if square > 0.0 {
                    let mut p = [i, j, square.sqrt()];
                    p.rotate_right(k);
                    made.extend([p, p.map(|c| -c)]);
                }
            }
        }
        let normals: Vec<[f64; 3]> = made.iter().map(|p| p.map(|c| c / radius)).collect();
        let rounded: Vec<[f64; 3]> = normals.iter().map(|n| n.map(|c| (c * radius / step).round() * step)).collect();
        for (points, is_lattice) in [(&made, true), (&rounded, false)] {
            for k in 0..3 {
                let coordinates: Vec<(f64, f64)> =
                    points.iter().zip(&normals).map(|(p, n)| (p[k] + 0.123, n[k].abs())).collect();
                assert_eq!(are_of_a_lattice(&coordinates, step), is_lattice, "{k}");
            }
        }
    }

    #[test]
    fn a_raster_is_exact_on_its_grid() {
        let height = |i: f64, j: f64| (0.13 * i).sin() * (0.07 * j).cos() * 4.0;
        let at = |i: u32| (f64::from(i % 100), f64::from(i / 100));
        let grid = |up: &dyn Fn(f64) -> f64| {
            let positions = (0..10_000).map(|i| [at(i).0, at(i).1, up(height(at(i).0, at(i).1))]).collect();
            TriangleMesh { positions, ..TriangleMesh::default() }
        };
        let raster = grid(&|z| z);
        let found = steps(&raster.positions);
        assert_eq!(found, [1.0, 1.0, 0.0]);
        assert_eq!(coarse(found, &raster, 0.0, 0.0), [0.0; 3]);
        // Heights that are rounded are.
        let flat = grid(&|z| (z * 4.0).round() / 4.0);
        assert_eq!(coarse(steps(&flat.positions), &flat, 0.0, 0.0), [0.0, 0.0, 0.25]);
        assert_eq!(coarse(steps(&flat.positions), &flat, 0.3, 0.0), [0.0; 3]);
        // So are all, where some points fell together.
        assert_eq!(coarse(steps(&flat.positions), &flat, 0.0, 0.3), [1.0, 1.0, 0.25]);
    }
}
