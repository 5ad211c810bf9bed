//! Steps of coordinates: files hold them rounded, to whole millimetres, to so many digits, or to single precision.
//!
//! Rounding that is finer than the noise adds its variance, a twelfth of the squared step, and no more. Where it is
//! coarser, whole faces of an object lie off by up to half a step, without any spread that would tell: a statistic of
//! the residuals calls them certain. So the steps are read off the coordinates themselves.

use super::neighbours::Neighbours;
use crate::mesh::TriangleMesh;
use crate::robust::median;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The number of points whose coordinates are looked at. Of n random ones on L steps some n^2 / 2L are neighbours on
/// them: steps of a millionth of the scan's size are still found.
const SAMPLES: usize = 20_000;
/// Fewer coordinates, or fewer different ones, show no steps: those of a designed object are few.
const FEWEST: usize = 200;
const FEWEST_GAPS: usize = 8;
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

/// The step of the coordinates of every axis, as they stand in the file; 0 where none is seen.
pub(crate) fn steps(positions: &[[f64; 3]]) -> [f64; 3] {
    let every = positions.len().div_ceil(SAMPLES).max(1);
    std::array::from_fn(|k| {
        let mut values: Vec<f64> = positions.iter().step_by(every).map(|p| p[k]).collect();
        values.sort_unstable_by(f64::total_cmp);
        of_axis(&values)
    })
}

/// The step of sorted coordinates: by the power of two and of ten that they are in, as numbers of so many digits have
/// it, or the same for all where there are few of a size; the quadratic mean of those.
fn of_axis(values: &[f64]) -> f64 {
    let of_all = common(values).unwrap_or_else(|| of_single(values));
    let mut by_size: BTreeMap<(bool, i64, i64), Vec<f64>> = BTreeMap::new();
    for value in values {
        let size = (*value < 0.0, value.abs().log2().floor() as i64, value.abs().log10().floor() as i64);
        by_size.entry(size).or_default().push(*value);
    }
    let square = |of_size: &Vec<f64>| of_size.len() as f64 * common(of_size).unwrap_or(of_all).powi(2);
    (by_size.values().map(square).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The step of single precision where it is so wide that sorted coordinates are hardly any different ones; else 0.
fn of_single(values: &[f64]) -> f64 {
    let [Some(low), Some(high)] = [values.first(), values.last()] else { return 0.0 };
    let step = f64::from(f32::EPSILON) * low.abs().max(high.abs()).log2().floor().exp2();
    let is_single = values.iter().all(|value| f64::from(*value as f32) == *value);
    if is_single && high - low <= FEWEST_GAPS as f64 * step { step } else { 0.0 }
}

/// The step of which all differences of sorted coordinates are whole multiples.
fn common(values: &[f64]) -> Option<f64> {
    let largest = values.first()?.abs().max(values.last()?.abs());
    // Decimal numbers are rounded to binary ones.
    let rounding = 8.0 * f64::EPSILON * largest;
    let gaps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > rounding).collect();
    if values.len() < FEWEST || gaps.len() < FEWEST_GAPS {
        return None;
    }
    let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    let step = median(&mut gaps.iter().copied().filter(|gap| *gap < 1.5 * least).collect::<Vec<f64>>())?;
    let is_whole = |gap: &f64| (gap - (gap / step).round() * step).abs() <= OFF * step;
    gaps.iter().filter(|gap| **gap < FAR * step).all(is_whole).then_some(step)
}

/// Those of the steps that are the rounding of measured coordinates, and coarse beside the noise: a raster's points lie
/// on a grid too, and are exact there. In millimetres, as the steps and the noise; `coincident` is the share of points,
/// or of triangles, that fell together with another one, or vanished.
pub(super) fn coarse(steps: [f64; 3], mesh: &TriangleMesh, noise: f64, coincident: f64) -> [f64; 3] {
    let bounds = mesh.bounds();
    let least = (COARSE * noise).max(FINE * bounds.diagonal());
    if steps.iter().all(|step| *step <= least) {
        return [0.0; 3];
    }
    let spacing = spacing(&mesh.positions);
    let counts = |k: usize| {
        let (step, largest) = (steps[k], bounds.low[k].abs().max(bounds.high[k].abs()));
        let is_single = step <= 1.001 * f64::from(f32::EPSILON) * largest;
        step > least && (is_single || step < OF_SPACING * spacing || coincident > COINCIDENT)
    };
    std::array::from_fn(|k| if counts(k) { steps[k] } else { 0.0 })
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

/// The standard deviation along the normals of points whose coordinates are rounded to steps.
pub(super) fn deviation(steps: [f64; 3], normals: &[[f64; 3]]) -> f64 {
    let variance = steps.map(|step| step * step / 12.0);
    let along = |n: &[f64; 3]| (0..3).map(|k| variance[k] * n[k] * n[k]).sum::<f64>();
    if normals.is_empty() {
        return (variance.iter().sum::<f64>() / 3.0).sqrt();
    }
    (normals.iter().map(along).sum::<f64>() / normals.len() as f64).sqrt()
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
        let expected = f64::sqrt(0.5 * (1e-6 + 1e-8));
        assert!(found.iter().all(|step| (step / expected - 1.0).abs() < 0.05), "{found:?}");
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

    #[test]
    fn rounding_has_a_twelfth_of_the_squared_step_as_its_variance() {
        let expected = 0.6 / 12f64.sqrt();
        assert!((deviation([0.6; 3], &[[0.6, 0.0, 0.8], [0.0, 1.0, 0.0]]) - expected).abs() < 1e-15);
        assert!(
            (deviation([0.6, 0.0, 0.0], &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]) - expected / 2f64.sqrt()).abs() < 1e-15
        );
        assert_eq!(deviation([0.0; 3], &[]), 0.0);
    }
}
