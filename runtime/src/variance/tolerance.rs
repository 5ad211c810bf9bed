//! Tolerances: how far deviations may go.

use super::values::Summary;
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
    /// The tolerance; absent where parts with different ones are taken together.
    #[serde(flatten)]
    pub tolerance: Option<Tolerance>,
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
    /// Of several parts together, those that have a tolerance; none where no part has one.
    pub(super) fn together<'a>(parts: impl Iterator<Item = &'a Conformance>) -> Option<Conformance> {
        let sum = parts.copied().reduce(|a, b| Conformance {
            tolerance: a.tolerance.filter(|_| a.tolerance == b.tolerance),
            within: a.within && b.within,
            area_within: a.area_within + b.area_within,
            area_below: a.area_below + b.area_below,
            area_above: a.area_above + b.area_above,
            share: 0.0,
            texels_within: a.texels_within + b.texels_within,
            texels_below: a.texels_below + b.texels_below,
            texels_above: a.texels_above + b.texels_above,
        })?;
        let area = sum.area_within + sum.area_below + sum.area_above;
        Some(Conformance { share: if area > 0.0 { sum.area_within / area } else { 0.0 }, ..sum })
    }

    /// Of what was counted with this tolerance.
    pub(super) fn of(found: &Summary, tolerance: Tolerance) -> Self {
        let [area_below, area_within, area_above] = found.conforming.map(|c| c[0]);
        let [texels_below, texels_within, texels_above] = found.conforming.map(|c| c[1] as usize);
        let area = found.weight[0];
        Self {
            tolerance: Some(tolerance),
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
