//! Statistics of deviations.

use super::Deviations;
use super::agreement::{Agreement, Limits};
use super::distribution::{Distribution, Sample};
use super::moments::Moments;
use super::texel_widths::TexelWidths;
use super::tolerance::{Conformance, Tolerance};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Statistics of the deviations of some texels. Texels without data count towards `texels` and `area` only, those
/// inside of the model's own material towards `buried_texels` and `buried_area` only. In JSON the fields of
/// `weighted` stand beside the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Number of texels.
    pub texels: usize,
    /// Number of texels that have a distance.
    pub measured_texels: usize,
    /// Area of the surface that the texels stand for. Square millimetres.
    pub area: f64,
    /// Area of the texels that have a distance. Square millimetres.
    pub measured_area: f64,
    /// Number of texels whose ray meets a closed hole of the scan.
    #[serde(default)]
    pub filled_texels: usize,
    /// Area of the texels whose ray meets a closed hole. Square millimetres.
    #[serde(default)]
    pub filled_area: f64,
    /// Number of texels inside of the model's own material: no others count them.
    #[serde(default)]
    pub buried_texels: usize,
    /// Their area. Square millimetres.
    #[serde(default)]
    pub buried_area: f64,
    /// Number of texels without a distance that stand where the scan shows empty space.
    #[serde(default)]
    pub contradicted_texels: usize,
    /// Their area. Square millimetres.
    #[serde(default)]
    pub contradicted_area: f64,
    /// Number of texels without a distance because what their rays meet belongs elsewhere.
    #[serde(default)]
    pub ambiguous_texels: usize,
    /// Their area. Square millimetres.
    #[serde(default)]
    pub ambiguous_area: f64,
    /// `measured_area / area`; 0 if there is no area.
    pub coverage: f64,
    /// Every texel weighted by its area.
    #[serde(flatten)]
    pub weighted: Moments,
    /// Every texel counted alike, as in the paper.
    pub per_texel: Moments,
    /// Distribution of the signed distances.
    pub histogram: Histogram,
    /// How much of what was measured is within the limits, over and under them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub agreement: Option<Agreement>,
    /// How wide the texels are; none without any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texel_widths: Option<TexelWidths>,
    /// Conformance to the tolerance, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<Conformance>,
}

/// Histogram of signed distances: bins of equal width from `low` to `high`, each with its lower end, the last one with
/// both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Histogram {
    /// Lower end of the first bin: minus the maximum distance. Millimetres.
    pub low: f64,
    /// Upper end of the last bin: the maximum distance. Millimetres.
    pub high: f64,
    /// Area in each bin. Square millimetres.
    pub area: Vec<f64>,
    /// Texels in each bin.
    pub texels: Vec<usize>,
}

impl Statistics {
    /// Whether there is any surface: of a trimmed part nothing may be left.
    #[must_use]
    pub fn is_of_something(&self) -> bool {
        self.texels + self.buried_texels > 0
    }
}

/// The texels of one part or of several.
#[derive(Clone, Debug, Default)]
pub(super) struct PartTexels {
    measured: Distribution,
    /// Number and area of the texels without a distance.
    missing: (usize, f64),
    /// Number and area of those whose ray meets a closed hole of the scan.
    filled: (usize, f64),
    /// Number and area of those where the scan shows empty space.
    contradicted: (usize, f64),
    /// Number and area of those whose rays meet what belongs elsewhere.
    ambiguous: (usize, f64),
    /// Number and area of those inside of the model's own material.
    buried: (usize, f64),
}

impl PartTexels {
    /// The texels of each part. Areas that are negative or not finite count as zero.
    pub(super) fn by_part(deviations: &Deviations) -> Vec<Self> {
        let texels = &deviations.texels;
        let mut parts = vec![Self::default(); texels.part_names.len()];
        let mut measured: Vec<Vec<Sample>> = vec![Vec::new(); parts.len()];
        for (i, part) in texels.part.iter().map(|p| *p as usize).enumerate() {
            let area = if texels.area[i].is_finite() { texels.area[i].max(0.0) } else { 0.0 };
            if deviations.is_buried(i) {
                add(&mut parts[part].buried, (1, f64::from(area)));
                continue;
            }
            let distance = deviations.signed(i);
            if !distance.is_nan() {
                measured[part].push(Sample::new(distance, area));
                continue;
            }
            add(&mut parts[part].missing, (1, f64::from(area)));
            if deviations.is_filled(i) {
                add(&mut parts[part].filled, (1, f64::from(area)));
            }
            if deviations.is_contradicted(i) {
                add(&mut parts[part].contradicted, (1, f64::from(area)));
            }
            if deviations.is_ambiguous(i) {
                add(&mut parts[part].ambiguous, (1, f64::from(area)));
            }
        }
        let sorted = parts.par_iter_mut().zip(measured);
        sorted.for_each(|(part, samples)| part.measured = Distribution::new(samples));
        parts
    }

    /// The texels of several parts together.
    pub(super) fn merge<'a>(parts: impl Iterator<Item = &'a Self> + Clone) -> Self {
        let mut merged = Self { measured: Distribution::merge(parts.clone().map(|p| &p.measured)), ..Self::default() };
        for part in parts {
            add(&mut merged.missing, part.missing);
            add(&mut merged.filled, part.filled);
            add(&mut merged.buried, part.buried);
            add(&mut merged.contradicted, part.contradicted);
            add(&mut merged.ambiguous, part.ambiguous);
        }
        merged
    }

    /// How much of what was measured is within some limits, over and under them. `precision` is the rounding.
    pub(super) fn agreement(&self, limits: Limits, precision: f64) -> Agreement {
        Agreement::new(limits, &self.measured.conformance(limits.ends(), precision))
    }

    /// `max_distance` is the range of the histogram, `precision` the rounding of the distances. Agreement and widths of
    /// texels are left out.
    pub(super) fn statistics(&self, max_distance: f64, tolerance: Option<Tolerance>, precision: f64) -> Statistics {
        let measured_area = self.measured.area();
        let area = measured_area + self.missing.1;
        let [weighted, per_texel] = self.measured.moments();
        Statistics {
            texels: self.measured.len() + self.missing.0,
            measured_texels: self.measured.len(),
            area,
            measured_area,
            filled_texels: self.filled.0,
            filled_area: self.filled.1,
            buried_texels: self.buried.0,
            buried_area: self.buried.1,
            contradicted_texels: self.contradicted.0,
            contradicted_area: self.contradicted.1,
            ambiguous_texels: self.ambiguous.0,
            ambiguous_area: self.ambiguous.1,
            coverage: if area > 0.0 { measured_area / area } else { 0.0 },
            weighted,
            per_texel,
            histogram: self.measured.histogram(max_distance),
            agreement: None,
            texel_widths: None,
            tolerance: tolerance.map(|t| self.measured.conformance(t, precision)),
        }
    }
}

/// Adds a number of texels and their area.
fn add(sum: &mut (usize, f64), other: (usize, f64)) {
    *sum = (sum.0 + other.0, sum.1 + other.1);
}

#[cfg(test)]
mod tests;
