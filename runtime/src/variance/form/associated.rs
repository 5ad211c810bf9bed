//! Surfaces of least squares of the measured points of parts.

use super::datum::{Datum, Kind};
use super::linear::MOST;
use super::{FEWEST, zone};
use crate::robust::{MAD_TO_SD, median};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// Points are left out that lie farther than so many robust standard deviations from the surface of least squares.
pub(super) const OUTLYING: f64 = 4.0;

/// Distances below this are rounding. Millimetres.
pub(super) const ROUNDING: f64 = 1e-9;

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
        let first = zone::least_squares(points, datum, zone::FITTED).placed();
        let mut sizes: Vec<f64> = points.iter().map(|p| first.height(*p).abs()).collect();
        let most = (OUTLYING * MAD_TO_SD * median(&mut sizes)?).max(ROUNDING);
        let kept: Vec<DVec3> = points.iter().copied().filter(|p| first.height(*p).abs() <= most).collect();
        let measured = zone::least_squares(&kept, datum, usize::MAX);
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
