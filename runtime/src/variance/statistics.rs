//! Statistics of deviations.

use super::Deviations;
use super::moments::{Moments, Weighted, sum};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Bins of a histogram.
const BINS: usize = 64;

/// What the deviations of some texels are like. Those without data count towards `texels` and `area`, and nothing else.
/// The fields of `weighted` stand beside the others in JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// How many texels there are.
    pub texels: usize,
    /// How many of them have a distance.
    pub measured_texels: usize,
    /// Area of the surface that the texels stand for. Square millimetres.
    pub area: f64,
    /// Area of those that have a distance. Square millimetres.
    pub measured_area: f64,
    /// `measured_area / area`; 0 where there is no area.
    pub coverage: f64,
    /// Every texel weighted by its area.
    #[serde(flatten)]
    pub weighted: Moments,
    /// Every texel counted alike, as in the paper.
    pub per_texel: Moments,
    /// How the signed distances are distributed.
    pub histogram: Histogram,
}

/// How signed distances are distributed: bins of equal width from `low` to `high`, each with its lower end, the last
/// one with both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Histogram {
    /// Lower end of the first bin: minus the maximum distance. Millimetres.
    pub low: f64,
    /// Upper end of the last: the maximum distance. Millimetres.
    pub high: f64,
    /// Area in each bin. Square millimetres.
    pub area: Vec<f64>,
    /// Texels in each bin.
    pub texels: Vec<usize>,
}

/// One texel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) signed: f64,
    pub(super) area: f64,
    pub(super) part: u32,
}

/// All texels, those with data in ascending order of their signed distance.
pub(super) struct Samples {
    pub(super) measured: Vec<Sample>,
    pub(super) missing: Vec<Sample>,
}

impl Samples {
    /// Sorts once what all statistics need sorted. Areas that are negative or not finite count as zero.
    pub(super) fn of(deviations: &Deviations) -> Self {
        let sample = |i: usize| {
            let area = f64::from(deviations.texels.area[i]);
            Sample {
                // Not -0, which would be printed.
                signed: f64::from(deviations.signed(i)) + 0.0,
                area: if area.is_finite() && area > 0.0 { area } else { 0.0 },
                part: deviations.texels.part[i],
            }
        };
        let samples: Vec<Sample> = (0..deviations.outward.len()).into_par_iter().map(sample).collect();
        let (missing, mut measured): (Vec<_>, Vec<_>) = samples.into_iter().partition(|s| s.signed.is_nan());
        // Stable, so that equal distances keep the texels' order whatever the number of threads.
        measured.par_sort_by(|a, b| a.signed.total_cmp(&b.signed));
        Self { measured, missing }
    }
}

impl Statistics {
    /// Of all texels.
    #[must_use]
    pub fn of(deviations: &Deviations) -> Self {
        let samples = Samples::of(deviations);
        Self::of_samples(&samples.measured, &samples.missing, deviations.max_distance)
    }

    /// `measured` in ascending order of signed distance.
    pub(super) fn of_samples(measured: &[Sample], missing: &[Sample], max_distance: f64) -> Self {
        let by =
            |weight: fn(&Sample) -> f64| -> Vec<Weighted> { measured.iter().map(|s| (s.signed, weight(s))).collect() };
        let (weighted, per_texel) = rayon::join(|| Moments::of(&by(|s| s.area)), || Moments::of(&by(|_| 1.0)));
        let measured_area = sum(measured.iter().map(|s| s.area));
        let area = measured_area + sum(missing.iter().map(|s| s.area));
        Self {
            texels: measured.len() + missing.len(),
            measured_texels: measured.len(),
            area,
            measured_area,
            coverage: if area > 0.0 { measured_area / area } else { 0.0 },
            weighted,
            per_texel,
            histogram: Histogram::of(measured, max_distance),
        }
    }
}

impl Histogram {
    fn of(measured: &[Sample], max_distance: f64) -> Self {
        let mut area = vec![0.0; BINS];
        let mut texels = vec![0; BINS];
        for sample in measured {
            let place = (sample.signed + max_distance) / (2.0 * max_distance) * BINS as f64;
            // Saturates: single precision may lie beyond the ends by a rounding.
            let bin = (place as usize).min(BINS - 1);
            area[bin] += sample.area;
            texels[bin] += 1;
        }
        Self { low: -max_distance, high: max_distance, area, texels }
    }
}

#[cfg(test)]
mod tests;
