//! How the distances to a cloud were measured.

use crate::robust::median;
use serde::{Deserialize, Serialize};

/// The cylinders about the texels' normals whose points have the distances to a cloud.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CylinderSummary {
    /// Median radius. Millimetres.
    pub radius: f64,
    /// Median number of points in one.
    pub points: f64,
    /// The fewest points that have a distance: texels with fewer have none.
    pub fewest: usize,
    /// Standard uncertainty of a distance by the scatter of its points: root mean square over the texels that have one.
    /// Millimetres.
    pub uncertainty: f64,
}

impl CylinderSummary {
    /// A sentence without its full stop; `number` writes a figure.
    #[must_use]
    pub fn sentence(&self, number: impl Fn(f64) -> String) -> String {
        format!(
            "the scan is a cloud of points: distances are those of the points in cylinders about the normals (radius {} mm, {} \
             points, half of them more; with fewer than {} there is none), each with a standard uncertainty of {} mm by their scatter",
            number(self.radius),
            number(self.points),
            self.fewest,
            number(self.uncertainty)
        )
    }

    /// Of the radii and numbers of points of the texels that have a distance; `uncertainty` is NaN at others.
    pub(super) fn new(mut radii: Vec<f64>, mut points: Vec<f64>, fewest: usize, uncertainty: &[f32]) -> Self {
        let squares = uncertainty.iter().filter(|u| !u.is_nan()).map(|u| f64::from(*u).powi(2));
        let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 1.0));
        Self {
            radius: median(&mut radii).unwrap_or(0.0),
            points: median(&mut points).unwrap_or(0.0),
            fewest,
            uncertainty: (sum / f64::max(count, 1.0)).sqrt(),
        }
    }
}
