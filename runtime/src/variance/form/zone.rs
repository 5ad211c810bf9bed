//! The zone that contains the points.

use super::datum::Datum;
use super::linear::{self, Row};
use super::noise::Spread;
use super::shape::Shape;
use glam::DVec3;
use rayon::prelude::*;

/// Points of a least squares fit, evenly spread; the widths of the zones are of all points.
pub(super) const FITTED: usize = 20_000;

/// Least squares converge when points move by less than this. Millimetres.
const CONVERGED: f64 = 1e-9;

/// The minimum zone starts from this number of points, and adds points outside of it until there are none.
const FIRST: usize = 600;

/// The extreme points of this number of runs are added at once.
const RUNS: usize = 32;

/// The zone of points.
pub(super) struct Narrowest {
    /// Width about the surface of least squares. Millimetres.
    pub(super) least_squares: f64,
    /// Width of the narrowest zone. Millimetres.
    pub(super) minimum_zone: f64,
    /// Its lowest and its highest point.
    pub(super) ends: [DVec3; 2],
    /// The surface of least squares.
    pub(super) datum: Datum,
}

/// Name of the width of a zone. None for general surfaces of revolution.
pub(super) fn characteristic(shape: Shape) -> Option<&'static str> {
    match shape {
        Shape::Plane => Some("flatness"),
        Shape::Sphere => Some("sphericity"),
        Shape::Cylinder => Some("cylindricity"),
        Shape::Cone => Some("conicity"),
        Shape::Revolution => None,
    }
}

/// The zone of points, from a first guess of the surface; none if they do not determine it.
pub(super) fn zone(points: &[DVec3], datum: Datum) -> Option<Narrowest> {
    let fitted = least_squares(points, datum, FITTED);
    let width_there = width(&extremes(points, fitted));
    let (least, narrowest) = minimum_zone(points, fitted);
    let (least, narrowest) = if least < width_there { (least, narrowest) } else { (width_there, fitted) };
    let ends = extremes(points, narrowest);
    let lowest = ends.iter().map(|e| e[0]).min_by(|a, b| a.0.total_cmp(&b.0))?.1;
    let highest = ends.iter().map(|e| e[1]).max_by(|a, b| a.0.total_cmp(&b.0))?.1;
    // Smaller widths are rounding.
    let rounded = |x: f64| if x < 1e-9 { 0.0 } else { x };
    (width_there.is_finite() && least.is_finite()).then_some(Narrowest {
        least_squares: rounded(width_there),
        minimum_zone: rounded(least),
        ends: [points[lowest], points[highest]],
        datum: fitted,
    })
}

/// How far points lie from their surface of least squares.
pub(super) fn spread(points: &[DVec3], datum: Datum) -> Spread {
    let fitted = least_squares(points, datum, FITTED);
    let placed = fitted.placed();
    let sum: f64 = points.iter().map(|p| placed.height(*p).powi(2)).sum();
    Spread { width: width(&extremes(points, fitted)), mean_square: sum / points.len().max(1) as f64 }
}

/// Gauss-Newton.
pub(super) fn least_squares(points: &[DVec3], mut datum: Datum, most: usize) -> Datum {
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

/// The least width over all positions of the surface, and the surface there.
fn minimum_zone(points: &[DVec3], mut datum: Datum) -> (f64, Datum) {
    let mut chosen: Vec<usize> = (0..points.len()).step_by((points.len() / FIRST).max(1)).collect();
    chosen.extend(extremes(points, datum).iter().flatten().map(|e| e.1));
    let (mut least, mut narrowest) = (f64::INFINITY, datum);
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
        if width < least {
            (least, narrowest) = (width, datum);
        }
        if width <= (high - low) * (1.0 + 1e-9) && before - least <= 1e-9 * least {
            break;
        }
        chosen.extend(extremes.iter().flatten().map(|e| e.1));
        chosen.sort_unstable();
        chosen.dedup();
    }
    (least, narrowest)
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
