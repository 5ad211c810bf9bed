//! Statistics of deviations.

use super::Deviations;
use super::moments::Moments;
use super::ordered::{Ordered, sum};
use super::tolerance::{Conformance, Tolerance};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

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

/// The texels of the model, of a part or of a group of parts.
#[derive(Clone, Debug, Default)]
pub(super) struct Samples {
    /// Signed distances of those that have one, ascending.
    pub(super) signed: Vec<f32>,
    /// Their areas.
    pub(super) areas: Vec<f32>,
    /// How many texels have none, and their area.
    pub(super) missing: usize,
    pub(super) missing_area: f64,
    /// How many of these look at a closed hole, and their area.
    pub(super) filled: usize,
    pub(super) filled_area: f64,
}

/// All texels in ascending order of their signed distance, then of their place; those without data at the end.
pub(super) struct Sorted<'a> {
    deviations: &'a Deviations,
    /// Above the distance as an integer of the same order, below the texel.
    keys: Vec<u64>,
    measured: usize,
}

impl<'a> Sorted<'a> {
    /// Sorts once what all statistics need sorted.
    pub(super) fn of(deviations: &'a Deviations) -> Self {
        let key = |i: usize| u64::from(order_of(deviations.signed(i))) << 32 | i as u64;
        let keys = sorted_by_distance((0..deviations.outward.len()).into_par_iter().map(key).collect());
        let measured = keys.partition_point(|key| (key >> 32) as u32 != NO_DATA);
        Self { deviations, keys, measured }
    }

    /// Everything together.
    pub(super) fn all(&self) -> Samples {
        self.samples(&self.keys[..self.measured], &self.keys[self.measured..])
    }

    /// Texels of one class each: `class` by part, below `classes`; parts without a class are left out.
    pub(super) fn by_class(&self, class: &[Option<usize>], classes: usize) -> Vec<Samples> {
        if classes == 0 {
            return Vec::new();
        }
        let split = |keys: &[u64]| {
            let mut split = vec![Vec::new(); classes];
            for &key in keys {
                let part = self.deviations.texels.part[key as u32 as usize];
                if let Some(class) = class.get(part as usize).copied().flatten() {
                    split[class].push(key);
                }
            }
            split
        };
        let (measured, missing) =
            rayon::join(|| split(&self.keys[..self.measured]), || split(&self.keys[self.measured..]));
        measured.into_iter().zip(missing).map(|(measured, missing)| self.samples(&measured, &missing)).collect()
    }

    fn samples(&self, measured: &[u64], missing: &[u64]) -> Samples {
        let area = |key: &u64| {
            let area = self.deviations.texels.area[*key as u32 as usize];
            if area.is_finite() && area > 0.0 { area } else { 0.0 }
        };
        let is_filled = |key: &&u64| self.deviations.is_filled(**key as u32 as usize);
        let filled = || missing.iter().filter(is_filled);
        Samples {
            signed: measured.par_iter().map(|key| from_order((key >> 32) as u32)).collect(),
            areas: measured.par_iter().map(area).collect(),
            missing: missing.len(),
            missing_area: sum(missing.iter().map(|key| f64::from(area(key)))),
            filled: filled().count(),
            filled_area: sum(filled().map(|key| f64::from(area(key)))),
        }
    }
}

/// Sorts keys by their upper halves and leaves equal ones in their order: by counting, eleven bits at a time.
fn sorted_by_distance(mut keys: Vec<u64>) -> Vec<u64> {
    const BITS: u32 = 11;
    let mut sorted = vec![0; keys.len()];
    for shift in [32, 32 + BITS, 32 + 2 * BITS] {
        let digit = |key: u64| (key >> shift) as usize & ((1 << BITS) - 1);
        let mut places = vec![0usize; 1 << BITS];
        keys.iter().for_each(|&key| places[digit(key)] += 1);
        let mut start = 0;
        for place in &mut places {
            (*place, start) = (start, start + *place);
        }
        for &key in &keys {
            let place = &mut places[digit(key)];
            sorted[*place] = key;
            *place += 1;
        }
        std::mem::swap(&mut keys, &mut sorted);
    }
    keys
}

/// The order of what is not a distance.
const NO_DATA: u32 = u32::MAX;

/// A distance as an integer of the same order; -0 counts as 0, which is what is printed then.
fn order_of(x: f32) -> u32 {
    let bits = (x + 0.0).to_bits();
    match (x.is_nan(), bits >> 31) {
        (true, _) => NO_DATA,
        (_, 0) => bits | 1 << 31,
        _ => !bits,
    }
}

fn from_order(order: u32) -> f32 {
    f32::from_bits(if order >> 31 == 1 { order & !(1 << 31) } else { !order })
}

impl Statistics {
    /// Of all texels. Areas that are negative or not finite count as zero.
    #[must_use]
    pub fn of(deviations: &Deviations) -> Self {
        Self::of_samples(&Sorted::of(deviations).all(), deviations.max_distance, None)
    }

    pub(super) fn of_samples(samples: &Samples, max_distance: f64, tolerance: Option<Tolerance>) -> Self {
        let (mut signed, mut areas) = (Cow::Borrowed(&samples.signed), Cow::Borrowed(&samples.areas));
        if areas.contains(&0.0) {
            let with_area = |(x, a): (&f32, &f32)| (*a > 0.0).then_some((*x, *a));
            let (x, a) = samples.signed.iter().zip(&samples.areas).filter_map(with_area).unzip();
            (signed, areas) = (Cow::Owned(x), Cow::Owned(a));
        }
        let weighted = Ordered::weighted(&signed, &areas);
        let alike = Ordered::alike(&samples.signed);
        let measured_area = weighted.total();
        let area = measured_area + samples.missing_area;
        Self {
            texels: samples.signed.len() + samples.missing,
            measured_texels: samples.signed.len(),
            area,
            measured_area,
            filled_texels: samples.filled,
            filled_area: samples.filled_area,
            coverage: if area > 0.0 { measured_area / area } else { 0.0 },
            weighted: Moments::of(&weighted),
            per_texel: Moments::of(&alike),
            histogram: Histogram::of(&weighted, &alike, max_distance),
            tolerance: tolerance.map(|t| Conformance::of(&weighted, &alike, t)),
        }
    }
}

impl Histogram {
    fn of(weighted: &Ordered, alike: &Ordered, max_distance: f64) -> Self {
        // Saturates: single precision may lie beyond the ends by a rounding.
        let bin = |x: f32| ((f64::from(x) + max_distance) / (2.0 * max_distance) * BINS as f64) as usize;
        let ends = |distances: &Ordered| -> Vec<f64> {
            let inner = (1..BINS).map(|b| distances.before(distances.values().partition_point(|&x| bin(x) < b)));
            inner.chain([distances.total()]).collect()
        };
        let differences = |ends: Vec<f64>| -> Vec<f64> {
            let starts = std::iter::once(0.0).chain(ends.iter().copied());
            starts.zip(&ends).map(|(start, end)| end - start).collect()
        };
        Self {
            low: -max_distance,
            high: max_distance,
            area: differences(ends(weighted)),
            texels: differences(ends(alike)).into_iter().map(|n| n as usize).collect(),
        }
    }
}

#[cfg(test)]
mod tests;
