//! Surfaces of least squares of the measured points of parts.

use super::Recognised;
use super::datum::{Datum, Kind};
use super::filter::{Place, Point};
use super::linear::MOST;
use super::{FEWEST, zone};
use crate::robust::{MAD_TO_SD, median};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// Points are left out that lie farther than so many robust standard deviations from the surface of least squares.
pub(super) const OUTLYING: f64 = 4.0;

/// Passes after which the points that lie on a surface are those of the pass before, or nearly.
const PASSES: usize = 20;

/// Cosine of the most by which a measured form is turned against that of the model: 30 degrees.
const SAME_WAY: f64 = 0.866;

/// Distances below this are rounding. Millimetres.
const ROUNDING: f64 = 1e-9;

/// A part's surface of least squares.
pub(super) struct Associated {
    /// That of the measured points, and the same of the model's own.
    pub(super) measured: Datum,
    pub(super) model: Datum,
    /// The middle of the points, measured and in the model.
    pub(super) centres: [DVec3; 2],
    /// Covariance of the unknowns of `measured`.
    pub(super) covariance: DMatrix<f64>,
}

impl Associated {
    /// From points of the scan and of the model's own surface.
    pub(super) fn new(points: &[DVec3], exact: &[DVec3], datum: Datum) -> Option<Self> {
        if points.len() < FEWEST {
            return None;
        }
        let (measured, kept) = fitted(points, datum)?;
        let covariance = covariance(&kept, &measured)?;
        let model = zone::least_squares(exact, datum, zone::FITTED);
        let centre = |points: &[DVec3]| points.iter().sum::<DVec3>() / points.len() as f64;
        Some(Self { measured, model, centres: [centre(&kept), centre(exact)], covariance })
    }

    pub(super) fn variance(&self, slopes: &[f64]) -> f64 {
        let g = DVector::from_iterator(self.covariance.nrows(), slopes.iter().copied());
        (g.transpose() * &self.covariance * g)[(0, 0)]
    }

    /// The derivatives of the surface's height at a point.
    pub(super) fn height_slopes(&self, point: DVec3) -> [f64; MOST] {
        self.measured.placed().row(point).factors
    }

    /// The derivatives of the place of a sphere's centre, or of an axis at the height of a point, along a direction.
    pub(super) fn place_slopes(&self, point: DVec3, direction: DVec3) -> [f64; MOST] {
        let (x, y) = self.measured.axis.any_orthonormal_pair();
        let (right, up) = (direction.dot(x), direction.dot(y));
        if self.measured.kind == Kind::Sphere {
            return [0.0, right, up, direction.dot(self.measured.axis), 0.0, 0.0];
        }
        let height = (point - self.measured.origin).dot(self.measured.axis);
        [0.0, right, up, height * right, height * up, 0.0]
    }

    /// The derivatives of the normal of a plane, or of an axis, along a direction at right angles to it.
    pub(super) fn direction_slopes(&self, direction: DVec3) -> [f64; MOST] {
        let (x, y) = self.measured.axis.any_orthonormal_pair();
        let (right, up) = (direction.dot(x), direction.dot(y));
        match self.measured.kind {
            Kind::Plane => [0.0, -right, -up, 0.0, 0.0, 0.0],
            _ => [0.0, 0.0, 0.0, right, up, 0.0],
        }
    }
}

/// The surface of least squares of the points that lie on it, and these.
pub(super) fn fitted(points: &[DVec3], datum: Datum) -> Option<(Datum, Vec<DVec3>)> {
    let first = zone::least_squares(points, datum, zone::FITTED);
    let heights = |surface: &Datum| {
        let placed = surface.placed();
        points.iter().map(|p| placed.height(*p)).collect()
    };
    let at = |kept: &[usize]| kept.iter().map(|i| points[*i]).collect::<Vec<DVec3>>();
    let of_kept = |kept: &[usize]| Some(zone::least_squares(&at(kept), datum, usize::MAX));
    let (measured, kept) = of_those_on_it(first, heights, of_kept)?;
    Some((measured, at(&kept)))
}

/// A part's form in the position and size that suit its points best, and the points with their places and heights on
/// that. Deviations from the form where the model has it would be those of a shifted form: those of a circle that is
/// shifted by e differ by up to e^2 / 2 r from those of any circle about the model's axis. As they were where there is
/// no such form, or it lies another way altogether.
pub(super) fn in_position(shape: &Recognised, points: &[Point]) -> (Recognised, Vec<Point>) {
    let at = |point: &Point| point.place.displaced(point.deviation);
    let sample: Vec<DVec3> = points.iter().step_by(points.len().div_ceil(zone::FITTED).max(1)).map(at).collect();
    let in_measured_position = |model: Datum| {
        let (measured, _) = fitted(&sample, model)?;
        (model.axis.dot(measured.axis) > SAME_WAY).then_some(measured)
    };
    let Some(measured) = shape.datum().and_then(in_measured_position) else {
        return (*shape, points.to_vec());
    };
    let placed = measured.placed();
    let moved = |point: &Point| {
        let (at, normal) = (at(point), placed.normal(at(point)));
        let outward = if normal.dot(point.place.normal) < 0.0 { -normal } else { normal };
        let deviation = placed.height(at) * outward.dot(normal);
        Point { place: Place { position: at - deviation * outward, normal: outward }, deviation, ..*point }
    };
    (shape.at(measured), points.iter().map(moved).collect())
}

/// The surface of least squares of the points that lie on it, and their numbers. Many points that lie off it, as where
/// rays of a part meet another one, draw the first surface to them and hide in its spread: what is off is asked again
/// of the surface of the others, until that says the same.
pub(super) fn of_those_on_it<S>(
    first: S,
    heights: impl Fn(&S) -> Vec<f64>,
    fitted: impl Fn(&[usize]) -> Option<S>,
) -> Option<(S, Vec<usize>)> {
    let (mut surface, mut kept) = (first, Vec::new());
    for _ in 0..PASSES {
        let heights = heights(&surface);
        let mut sizes: Vec<f64> = heights.iter().map(|h| h.abs()).collect();
        let most = (OUTLYING * MAD_TO_SD * median(&mut sizes)?).max(ROUNDING);
        let on: Vec<usize> = (0..heights.len()).filter(|i| heights[*i].abs() <= most).collect();
        if on == kept {
            break;
        }
        (surface, kept) = (fitted(&on)?, on);
    }
    Some((surface, kept))
}

/// The covariance of the unknowns of least squares, with the variance of the points about the surface.
fn covariance(kept: &[DVec3], datum: &Datum) -> Option<DMatrix<f64>> {
    let (count, placed) = (datum.unknowns(), datum.placed());
    let mut normal = DMatrix::<f64>::zeros(count, count);
    let mut squares = 0.0;
    for point in kept {
        let row = placed.row(*point);
        let factors = DVector::from_row_slice(&row.factors[..count]);
        normal.ger(1.0, &factors, &factors, 1.0);
        squares += row.value * row.value;
    }
    let degrees = kept.len().checked_sub(count).filter(|n| *n > 0)?;
    Some(normal.try_inverse()? * (squares / degrees as f64))
}
