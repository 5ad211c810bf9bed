//! Statistics of deviations.

use super::Deviations;
use super::moments::Moments;
use super::tolerance::{Conformance, Tolerance};
use super::values::{Distances, Values};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

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
    /// How many of the others look at a hole of the scan that was closed.
    #[serde(default)]
    pub filled_texels: usize,
    /// Their area. Square millimetres.
    #[serde(default)]
    pub filled_area: f64,
    /// `measured_area / area`; 0 where there is no area.
    pub coverage: f64,
    /// Every texel weighted by its area.
    #[serde(flatten)]
    pub weighted: Moments,
    /// Every texel counted alike, as in the paper.
    pub per_texel: Moments,
    /// How the signed distances are distributed.
    pub histogram: Histogram,
    /// How they stand to the tolerance, where one was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<Conformance>,
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

/// The texels of a part.
#[derive(Clone, Debug, Default)]
pub(super) struct Samples {
    /// Those that have a distance.
    values: Values,
    /// Those that have none.
    missing: Missing,
}

/// How many texels have no distance, and their area; how many of them look at a closed hole, and theirs.
#[derive(Clone, Copy, Debug, Default)]
struct Missing {
    texels: usize,
    area: f64,
    filled: usize,
    filled_area: f64,
}

/// Texels that are sorted by part at once.
const RUN: usize = 1 << 16;

impl Samples {
    /// Of every part.
    pub(super) fn of_parts(deviations: &Deviations) -> Vec<Samples> {
        let texels = &deviations.texels;
        let area = |i: usize| if texels.area[i].is_finite() && texels.area[i] > 0.0 { texels.area[i] } else { 0.0 };
        let of_run = |run: usize| {
            let mut parts: BTreeMap<u32, Samples> = BTreeMap::new();
            let (mut start, end) = (run * RUN, texels.len().min((run + 1) * RUN));
            while start < end {
                // Charts are wide: their rows are long runs of one part.
                let part = texels.part[start];
                let next = start + texels.part[start..end].iter().take_while(|p| **p == part).count();
                let samples = parts.entry(part).or_default();
                for i in start..next {
                    samples.add(deviations, i, area(i));
                }
                start = next;
            }
            parts
        };
        let runs: Vec<_> = (0..texels.len().div_ceil(RUN)).into_par_iter().map(of_run).collect();
        let mut pieces: Vec<Vec<Samples>> = vec![Vec::new(); texels.part_names.len()];
        for (part, samples) in runs.into_iter().flatten() {
            pieces[part as usize].push(samples);
        }
        pieces.into_par_iter().map(Samples::together).collect()
    }

    fn add(&mut self, deviations: &Deviations, i: usize, area: f32) {
        let distance = deviations.signed(i);
        if distance.is_nan() {
            let filled = deviations.is_filled(i);
            self.missing.texels += 1;
            self.missing.area += f64::from(area);
            self.missing.filled += usize::from(filled);
            self.missing.filled_area += if filled { f64::from(area) } else { 0.0 };
        } else {
            // -0 is 0, which is what is printed then.
            self.values.signed.push(distance + 0.0);
            self.values.areas.push(area);
        }
    }

    fn together(pieces: Vec<Samples>) -> Samples {
        let count = pieces.iter().map(|p| p.values.signed.len()).sum();
        let mut all = Samples::default();
        all.values.signed.reserve_exact(count);
        all.values.areas.reserve_exact(count);
        for piece in pieces {
            all.values.signed.extend(piece.values.signed);
            all.values.areas.extend(piece.values.areas);
            all.missing = all.missing.with(piece.missing);
        }
        all
    }
}

impl Missing {
    fn with(self, other: Missing) -> Missing {
        Missing {
            texels: self.texels + other.texels,
            area: self.area + other.area,
            filled: self.filled + other.filled,
            filled_area: self.filled_area + other.filled_area,
        }
    }
}

impl Statistics {
    /// Of all texels. Areas that are negative or not finite count as zero.
    #[must_use]
    pub fn of(deviations: &Deviations) -> Self {
        Self::of_samples(Samples::of_parts(deviations).iter(), deviations.max_distance, None)
    }

    /// Of the texels of some parts.
    pub(super) fn of_samples<'a>(
        samples: impl Iterator<Item = &'a Samples> + Clone,
        max_distance: f64,
        tolerance: Option<Tolerance>,
    ) -> Self {
        let distances = Distances::of(samples.clone().map(|s| &s.values));
        let missing = samples.fold(Missing::default(), |sum, s| sum.with(s.missing));
        let found = distances.summary(max_distance, tolerance);
        let [weighted, per_texel] = Moments::of(&found);
        let [measured_area, measured] = found.weight;
        let area = measured_area + missing.area;
        Self {
            texels: measured as usize + missing.texels,
            measured_texels: measured as usize,
            area,
            measured_area,
            filled_texels: missing.filled,
            filled_area: missing.filled_area,
            coverage: if area > 0.0 { measured_area / area } else { 0.0 },
            weighted,
            per_texel,
            histogram: Histogram {
                low: -max_distance,
                high: max_distance,
                area: found.histogram.iter().map(|bin| bin[0]).collect(),
                texels: found.histogram.iter().map(|bin| bin[1] as usize).collect(),
            },
            tolerance: tolerance.map(|t| Conformance::of(&found, t)),
        }
    }
}

#[cfg(test)]
mod tests;
