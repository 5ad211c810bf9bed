//! Tolerances: how far deviations may go.

use super::ordered::Ordered;
use serde::{Deserialize, Serialize};

/// Signed distances that are allowed, in millimetres, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tolerance {
    /// The least: how far the scan may lie inside the model, as a number that is rarely positive.
    pub lower: f64,
    /// The greatest: how far it may lie outside.
    pub upper: f64,
}

/// How deviations stand to a tolerance. What was not measured is neither in nor out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Conformance {
    /// The tolerance.
    #[serde(flatten)]
    pub tolerance: Tolerance,
    /// Whether everything that was measured is within it.
    pub within: bool,
    /// Measured area within it. Square millimetres.
    pub area_within: f64,
    /// Measured area where the scan lies too far inside the model. Square millimetres.
    pub area_below: f64,
    /// Measured area where the scan lies too far outside. Square millimetres.
    pub area_above: f64,
    /// `area_within` of the measured area; 0 where there is none.
    pub share: f64,
    /// Texels within it.
    pub texels_within: usize,
    /// Texels below it.
    pub texels_below: usize,
    /// Texels above it.
    pub texels_above: usize,
}

impl Conformance {
    /// Of distances with their areas, and of all distances, those without area among them.
    pub(super) fn of(weighted: &Ordered, alike: &Ordered, tolerance: Tolerance) -> Self {
        let split = |distances: &Ordered| {
            let at = |limit: &dyn Fn(f64) -> bool| {
                distances.before(distances.values().partition_point(|&x| limit(f64::from(x))))
            };
            // Distances are of single precision, and the ends are meant as they are written: 0.1 mm is within 0.1 mm.
            let (lower, upper) = (f64::from(tolerance.lower as f32), f64::from(tolerance.upper as f32));
            let (below, to_upper) = (at(&|x| x < lower), at(&|x| x <= upper));
            [below, to_upper - below, distances.total() - to_upper]
        };
        let [area_below, area_within, area_above] = split(weighted);
        let [texels_below, texels_within, texels_above] = split(alike).map(|n| n as usize);
        let area = weighted.total();
        Self {
            tolerance,
            within: texels_below == 0 && texels_above == 0,
            area_within,
            area_below,
            area_above,
            share: if area > 0.0 { area_within / area } else { 0.0 },
            texels_within,
            texels_below,
            texels_above,
        }
    }
}
