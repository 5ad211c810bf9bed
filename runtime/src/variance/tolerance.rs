//! Tolerances, and whether deviations conform to them.

use serde::{Deserialize, Serialize};

/// The allowed signed distances, in millimetres, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tolerance {
    /// The least: how far the scan may lie inside the model; usually negative.
    pub lower: f64,
    /// The greatest: how far the scan may lie outside the model.
    pub upper: f64,
}

/// Whether deviations conform to a tolerance. Unmeasured texels are neither within nor beyond it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Conformance {
    /// The tolerance; absent if parts with different ones are taken together.
    #[serde(flatten)]
    pub tolerance: Option<Tolerance>,
    /// Whether something was measured and every measured texel is within it. This is not the verdict.
    pub within: bool,
    /// Measured area within it. Square millimetres.
    pub area_within: f64,
    /// Measured area below it, where the scan lies too far inside the model. Square millimetres.
    pub area_below: f64,
    /// Measured area above it, where the scan lies too far outside the model. Square millimetres.
    pub area_above: f64,
    /// `area_within` divided by the measured area; 0 if there is none.
    pub share: f64,
    /// Texels within it.
    pub texels_within: usize,
    /// Texels below it.
    pub texels_below: usize,
    /// Texels above it.
    pub texels_above: usize,
}

impl Conformance {
    /// The sum over the parts that have a tolerance; none if no part has one.
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

    /// From the numbers and areas of the texels below, within and above a tolerance.
    pub(super) fn new(tolerance: Tolerance, [below, within, above]: [(usize, f64); 3]) -> Self {
        let area = below.1 + within.1 + above.1;
        Self {
            tolerance: Some(tolerance),
            within: within.0 > 0 && below.0 == 0 && above.0 == 0,
            area_within: within.1,
            area_below: below.1,
            area_above: above.1,
            share: if area > 0.0 { within.1 / area } else { 0.0 },
            texels_within: within.0,
            texels_below: below.0,
            texels_above: above.0,
        }
    }
}
