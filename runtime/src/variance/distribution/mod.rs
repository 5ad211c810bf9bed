//! Distributions of signed distances: sorted samples, from which means, extremes, quantiles and histograms are read.

mod merged;

use super::moments::{Moments, Percentiles, SignedMoments};
use super::statistics::Histogram;
use super::tolerance::{Conformance, Tolerance};
use merged::{Cumulated, Merged};
use rayon::prelude::*;

/// Bins of the reported histogram, over twice the maximum distance.
const BINS: usize = 64;

/// A signed distance and the area that it stands for, packed so that integers are ordered by distance and equal
/// distances by area: the order in which samples were found plays no role.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Sample(u64);

impl Sample {
    /// `area` is finite and not negative; it is 0 for texels that count per texel only.
    pub(crate) fn new(distance: f32, area: f32) -> Self {
        // -0 becomes 0, so that both are one value.
        let bits = (distance + 0.0).to_bits();
        let order = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
        Self(u64::from(order) << 32 | u64::from(area.to_bits()))
    }

    fn distance(self) -> f32 {
        let order = (self.0 >> 32) as u32;
        f32::from_bits(if order >> 31 == 1 { order & !(1 << 31) } else { !order })
    }

    fn area(self) -> f32 {
        f32::from_bits(self.0 as u32)
    }
}

/// The weight of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Weighting {
    /// By its area.
    Area,
    /// Like every other texel.
    Texel,
}

impl Weighting {
    fn weight(self, sample: Sample) -> f64 {
        match self {
            Self::Area => f64::from(sample.area()),
            Self::Texel => 1.0,
        }
    }
}

/// Mean and standard deviation of the population. Millimetres.
#[derive(Clone, Copy, Debug)]
struct Spread {
    mean: f64,
    sd: f64,
}

/// Samples in ascending order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Distribution {
    samples: Vec<Sample>,
    cumulated: Cumulated,
}

/// Samples that are summed up at a time: sums do not depend on the number of threads.
const CHUNK: usize = 1 << 16;

impl Distribution {
    pub(crate) fn new(mut samples: Vec<Sample>) -> Self {
        // Parts are sorted side by side: one sort over all threads took three times the processor time.
        samples.sort_unstable();
        Self::sorted(samples)
    }

    /// The samples of several distributions.
    pub(super) fn merge<'a>(parts: impl Iterator<Item = &'a Self>) -> Self {
        let mut samples: Vec<Sample> = parts.flat_map(|p| &p.samples).copied().collect();
        // The stable sort finds the sorted runs and merges them.
        samples.sort();
        Self::sorted(samples)
    }

    fn sorted(samples: Vec<Sample>) -> Self {
        let cumulated = Cumulated::of(&samples);
        Self { samples, cumulated }
    }

    pub(super) fn len(&self) -> usize {
        self.samples.len()
    }

    /// Total area. Square millimetres.
    pub(crate) fn area(&self) -> f64 {
        self.cumulated.whole()
    }

    /// The distance that half of the area exceeds; NaN without area.
    pub(super) fn median(&self) -> f64 {
        Merged::new(self, |x| x, &[], Weighting::Area).quantiles([0.5 * self.area()])[0]
    }

    /// Statistics of the distances and of their magnitudes, by area and by texel.
    pub(crate) fn moments(&self) -> [Moments; 2] {
        let spreads = self.spreads();
        let described = [Weighting::Area, Weighting::Texel].into_iter().zip(spreads).map(|(weighting, spreads)| {
            let [signed, unsigned] = spreads;
            let (signed, unsigned) = (self.signed(weighting, signed), self.magnitudes(weighting, unsigned));
            Moments {
                mean: unsigned.mean,
                max: unsigned.max,
                sd: unsigned.sd,
                min: unsigned.min,
                rms: unsigned.mean.hypot(unsigned.sd),
                median: unsigned.median,
                mad: unsigned.mad,
                percentiles: unsigned.percentiles,
                signed,
            }
        });
        let [by_area, per_texel] = described.collect::<Vec<_>>().try_into().unwrap_or_else(|_| unreachable!("two"));
        [by_area, per_texel]
    }

    /// By weighting the mean and the standard deviation of the distances and of their magnitudes.
    fn spreads(&self) -> [[Spread; 2]; 2] {
        let total = [self.area(), self.len() as f64];
        // By weighting, of distances and of magnitudes.
        let sums = |of: &(dyn Fn(f64) -> [[f64; 2]; 2] + Sync)| -> [[f64; 2]; 2] {
            let chunk = |samples: &[Sample]| {
                samples.iter().fold([[0.0; 2]; 2], |sums: [[f64; 2]; 2], sample| {
                    let (values, area) = (of(f64::from(sample.distance())), f64::from(sample.area()));
                    let [[a, b], [c, d]] = values;
                    [[sums[0][0] + area * a, sums[0][1] + area * b], [sums[1][0] + c, sums[1][1] + d]]
                })
            };
            let chunks: Vec<[[f64; 2]; 2]> = self.samples.par_chunks(CHUNK).map(chunk).collect();
            let sum = |w: usize, k: usize| chunks.iter().map(|sums| sums[w][k]).sum::<f64>() / total[w];
            [0, 1].map(|w| [0, 1].map(|k| sum(w, k)))
        };
        let means = sums(&|x| [[x, x.abs()]; 2]);
        let squares = sums(&|x| means.map(|[mean, size]| [(x - mean).powi(2), (x.abs() - size).powi(2)]));
        [0, 1].map(|w| [0, 1].map(|k| Spread { mean: means[w][k], sd: squares[w][k].sqrt() }))
    }

    fn signed(&self, weighting: Weighting, spread: Spread) -> SignedMoments {
        let median = |p50: f64| Merged::new(self, move |x: f64| (x - p50).abs(), &[p50], weighting);
        describe(&Merged::new(self, |x| x, &[], weighting), median, spread)
    }

    fn magnitudes(&self, weighting: Weighting, spread: Spread) -> SignedMoments {
        let median = |p50: f64| Merged::new(self, move |x: f64| (x.abs() - p50).abs(), &[-p50, 0.0, p50], weighting);
        describe(&Merged::new(self, f64::abs, &[0.0], weighting), median, spread)
    }

    /// `range` is the maximum distance.
    pub(super) fn histogram(&self, range: f64) -> Histogram {
        let (mut area, mut texels) = (vec![0.0; BINS], vec![0; BINS]);
        for sample in &self.samples {
            // The cast saturates: single precision may lie beyond the ends by a rounding.
            let bin = (f64::from(sample.distance()) + range) * BINS as f64 / (2.0 * range);
            let bin = (bin as usize).min(BINS - 1);
            area[bin] += f64::from(sample.area());
            texels[bin] += 1;
        }
        Histogram { low: -range, high: range, area, texels }
    }

    /// `precision` is the rounding of the distances. The ends of a tolerance are meant as they are written: a surface
    /// at 0.1 mm is within 0.1 mm, on whichever side of it its distance is rounded to.
    pub(super) fn conformance(&self, tolerance: Tolerance, precision: f64) -> Conformance {
        let (lower, upper) = ((tolerance.lower - precision) as f32, (tolerance.upper + precision) as f32);
        let (below, rest) = self.samples.split_at(self.samples.partition_point(|s| s.distance() < lower));
        let (within, above) = rest.split_at(rest.partition_point(|s| s.distance() <= upper));
        Conformance::new(tolerance, [below, within, above].map(|samples| (samples.len(), area(samples))))
    }
}

/// `about` orders the samples by how far they are from the median. All NaN where no sample has a weight.
fn describe<'d, F: Fn(f64) -> f64 + Copy, G: Fn(f64) -> f64 + Copy>(
    values: &Merged<'d, F>,
    about: impl Fn(f64) -> Merged<'d, G>,
    Spread { mean, sd }: Spread,
) -> SignedMoments {
    let total = values.whole();
    let [p1, p5, p25, p50, p75, p95, p99] =
        values.quantiles([0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99].map(|share| share * total));
    let [mad] = about(p50).quantiles([0.5 * total]);
    let [min, max] = values.ends();
    let percentiles = Percentiles { p1, p5, p25, p50, p75, p95, p99 };
    SignedMoments { mean, sd, min, max, median: p50, mad, percentiles }
}

fn area(samples: &[Sample]) -> f64 {
    // The sum of nothing is -0.
    0.0 + samples.iter().map(|s| f64::from(s.area())).sum::<f64>()
}

/// The value below which the weight `goal` lies: linear in cumulative weight between values, each of which stands at
/// the middle of its own weight (Hazen's rule where all weigh alike). NaN where there are none. `values` ascend and
/// have weights; `last` comes before them, with its weight, at a cumulative weight of `before`.
pub(super) fn quantile(
    values: impl Iterator<Item = (f64, f64)>,
    goal: f64,
    mut before: f64,
    last: Option<(f64, f64)>,
) -> f64 {
    let mut last = last.map(|(value, weight)| (value, before - 0.5 * weight));
    for (value, weight) in values {
        let place = before + 0.5 * weight;
        if goal <= place {
            return match last {
                Some((lower, from)) if place > from => {
                    lower + (value - lower) * ((goal - from) / (place - from)).clamp(0.0, 1.0)
                }
                _ => value,
            };
        }
        (last, before) = (Some((value, place)), before + weight);
    }
    last.map_or(f64::NAN, |(value, _)| value)
}

#[cfg(test)]
mod tests;
