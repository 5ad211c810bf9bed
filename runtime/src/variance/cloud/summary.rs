//! How the distances to a cloud were measured.

use super::cylinder::FEWEST;
use crate::robust::median;
use crate::variance::Deviations;
use serde::{Deserialize, Serialize};

/// The share of the distances that are more certain than the percentile that is stated.
const HIGH: f64 = 0.95;

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
    /// The median of these. Millimetres.
    #[serde(default)]
    pub uncertainty_median: f64,
    /// Their 95th percentile. Millimetres.
    #[serde(default)]
    pub uncertainty_p95: f64,
}

impl CylinderSummary {
    /// A sentence without its full stop; `number` writes a figure.
    #[must_use]
    pub fn sentence(&self, number: impl Fn(f64) -> String) -> String {
        format!(
            "the scan is a cloud of points: distances are those of the points in cylinders about the normals (radius {} mm, {} \
             points, half of them more; with fewer than {} there is none), each with a standard uncertainty of {} mm by their scatter \
             (median {} mm, 95th percentile {} mm)",
            number(self.radius),
            number(self.points),
            self.fewest,
            number(self.uncertainty),
            number(self.uncertainty_median),
            number(self.uncertainty_p95)
        )
    }

    /// Of cylinders that have a distance, by their radii and numbers of points, and of the distances that were found in
    /// them, from which those of texels inside of the material are taken out.
    pub(crate) fn new(mut radii: Vec<f64>, mut points: Vec<f64>, deviations: &Deviations) -> Self {
        let of_distances = |(i, u): (usize, &f32)| (!deviations.along(i).is_nan()).then_some(f64::from(*u));
        let mut uncertainty: Vec<f64> = deviations.uncertainty.iter().enumerate().filter_map(of_distances).collect();
        let sum: f64 = uncertainty.iter().map(|u| u * u).sum();
        let count = uncertainty.len().max(1) as f64;
        let place = (HIGH * uncertainty.len() as f64) as usize;
        let high =
            uncertainty.get(place).is_some().then(|| *uncertainty.select_nth_unstable_by(place, f64::total_cmp).1);
        Self {
            radius: median(&mut radii).unwrap_or(0.0),
            points: median(&mut points).unwrap_or(0.0),
            fewest: FEWEST,
            uncertainty: (sum / count).sqrt(),
            uncertainty_median: median(&mut uncertainty).unwrap_or(0.0),
            uncertainty_p95: high.unwrap_or(0.0),
        }
    }
}
