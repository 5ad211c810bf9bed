//! The zone that contains the points.

use super::Zone;
use super::datum::Datum;
use super::linear::{self, Row};
use super::shape::Shape;
use crate::robust::{MAD_TO_SD, median_and_deviation};
use glam::DVec3;
use rayon::prelude::*;

/// Points of a least squares fit, evenly spread; the widths of the zones are of all points.
const FITTED: usize = 20_000;

/// Points of the least squares fits that decide on outliers.
const TRIED: usize = 4_000;

/// Least squares converge when points move by less than this. Millimetres.
const CONVERGED: f64 = 1e-9;

/// The minimum zone starts from this number of points, and adds points outside of it until there are none.
const FIRST: usize = 600;

/// The extreme points of this number of runs are added at once.
const RUNS: usize = 32;

/// Outliers are this many robust standard deviations away from the surface of least squares.
const OUTLYING: f64 = 4.0;

/// The zone of points, from a first guess of the surface; none if they do not determine it. `precision` is the rounding
/// of the points' distances from the surface.
pub(super) fn zone(points: &[DVec3], datum: Datum, shape: Shape, precision: f64) -> Option<Zone> {
    let characteristic = match shape {
        Shape::Plane => "flatness",
        Shape::Sphere => "sphericity",
        Shape::Cylinder => "cylindricity",
        Shape::Cone => "conicity",
        Shape::Revolution => return None,
    };
    let mut inliers = points.to_vec();
    // Outliers are decided by a surface without them: a few rounds suffice, since the first is close to the model's
    // own.
    for _ in 0..3 {
        let fitted = least_squares(&inliers, datum, TRIED);
        inliers = without_outlying(points, fitted, precision)?;
    }
    let (least_squares, minimum_zone) = widths(&inliers, datum)?;
    let outlying = points.len() - inliers.len();
    let with_outlying = if outlying == 0 { [least_squares, minimum_zone] } else { widths(points, datum)?.into() };
    let characteristic = characteristic.to_owned();
    Some(Zone { characteristic, least_squares, minimum_zone, points: inliers.len(), outlying, with_outlying })
}

/// The widths of the zones of least squares and of the minimum zone.
fn widths(points: &[DVec3], datum: Datum) -> Option<(f64, f64)> {
    let fitted = least_squares(points, datum, FITTED);
    let width = width(&extremes(points, fitted));
    let least = minimum_zone(points, fitted).min(width);
    // Smaller widths are rounding.
    let rounded = |x: f64| if x < 1e-9 { 0.0 } else { x };
    (width.is_finite() && least.is_finite()).then_some((rounded(width), rounded(least)))
}

fn without_outlying(points: &[DVec3], datum: Datum, precision: f64) -> Option<Vec<DVec3>> {
    let (step, placed) = (points.len().div_ceil(FITTED).max(1), datum.placed());
    let mut sample: Vec<f64> = points.iter().step_by(step).map(|p| placed.height(*p)).collect();
    let (middle, spread) = median_and_deviation(&mut sample)?;
    // Where most points lie on the surface itself, the others' rounding is no outlier.
    let limit = (OUTLYING * MAD_TO_SD * spread).max(precision);
    let near = |p: &&DVec3| (placed.height(**p) - middle).abs() <= limit;
    let inliers: Vec<DVec3> = points.par_iter().filter(near).copied().collect();
    // If most points lie on the surface up to rounding, the others are form and not noise.
    Some(if 2 * inliers.len() > points.len() { inliers } else { points.to_vec() })
}

/// Gauss-Newton.
fn least_squares(points: &[DVec3], mut datum: Datum, most: usize) -> Datum {
    let step = points.len().div_ceil(most).max(1);
    for _ in 0..8 {
        let placed = datum.placed();
        let rows = points.iter().step_by(step).map(|p| placed.row(*p));
        let Some((change, norm)) = linear::least_squares(rows, datum.unknowns()) else { return datum };
        datum = datum.moved(&change);
        if norm <= CONVERGED * (points.len() as f64 / step as f64).sqrt() {
            break;
        }
    }
    datum
}

/// The least width over all positions of the surface.
fn minimum_zone(points: &[DVec3], mut datum: Datum) -> f64 {
    let mut chosen: Vec<usize> = (0..points.len()).step_by((points.len() / FIRST).max(1)).collect();
    chosen.extend(extremes(points, datum).iter().flatten().map(|e| e.1));
    let mut least = f64::INFINITY;
    for _ in 0..40 {
        let placed = datum.placed();
        let rows: Vec<Row> = chosen.iter().map(|i| placed.row(points[*i])).collect();
        let change = linear::chebyshev(&rows, datum.unknowns());
        if !change.iter().all(|x| x.is_finite()) {
            break;
        }
        datum = datum.moved(&change);
        let sample: Vec<DVec3> = chosen.iter().map(|i| points[*i]).collect();
        let ((low, high), extremes) = (range(&sample, datum), extremes(points, datum));
        let width = width(&extremes);
        let before = least;
        least = least.min(width);
        if width <= (high - low) * (1.0 + 1e-9) && before - least <= 1e-9 * least {
            break;
        }
        chosen.extend(extremes.iter().flatten().map(|e| e.1));
        chosen.sort_unstable();
        chosen.dedup();
    }
    least
}

/// The least and the greatest distance from a surface.
fn range(points: &[DVec3], datum: Datum) -> (f64, f64) {
    let placed = datum.placed();
    let distances = points.iter().map(|p| placed.height(*p));
    distances.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), d| (l.min(d), h.max(d)))
}

/// The lowest and the highest point of every run of points: distance and index.
fn extremes(points: &[DVec3], datum: Datum) -> Vec<[(f64, usize); 2]> {
    let (run, placed) = (points.len().div_ceil(RUNS).max(1), datum.placed());
    let of_run = |(k, run_points): (usize, &[DVec3])| {
        let mut ends = [(f64::INFINITY, 0), (f64::NEG_INFINITY, 0)];
        for (i, point) in run_points.iter().enumerate() {
            let value = placed.height(*point);
            if value < ends[0].0 {
                ends[0] = (value, k * run + i);
            }
            if value > ends[1].0 {
                ends[1] = (value, k * run + i);
            }
        }
        ends
    };
    points.par_chunks(run).enumerate().map(of_run).collect()
}

/// The distance between the lowest and the highest point.
fn width(extremes: &[[(f64, usize); 2]]) -> f64 {
    let low = extremes.iter().map(|e| e[0].0).fold(f64::INFINITY, f64::min);
    let high = extremes.iter().map(|e| e[1].0).fold(f64::NEG_INFINITY, f64::max);
    high - low
}
