//! Distributions of signed distances: sorted samples, from which means, extremes, quantiles and histograms are read.

use super::moments::{Moments, Percentiles, SignedMoments};
use super::statistics::Histogram;
use super::tolerance::{Conformance, Tolerance};
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

/// Samples in ascending order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Distribution(Vec<Sample>);

impl Distribution {
    pub(crate) fn new(mut samples: Vec<Sample>) -> Self {
        samples.par_sort_unstable();
        Self(samples)
    }

    /// The samples of several distributions.
    pub(super) fn merge<'a>(parts: impl Iterator<Item = &'a Self>) -> Self {
        let mut samples: Vec<Sample> = parts.flat_map(|p| &p.0).copied().collect();
        // The stable sort finds the sorted runs and merges them.
        samples.sort();
        Self(samples)
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Total area. Square millimetres.
    pub(crate) fn area(&self) -> f64 {
        area(&self.0)
    }

    /// The distance that half of the area exceeds; NaN without area.
    pub(super) fn median(&self) -> f64 {
        quantiles(self.weighted(Weighting::Area), [0.5 * self.area()])[0]
    }

    /// Statistics of the distances and of their magnitudes, by area and by texel.
    pub(crate) fn moments(&self) -> [Moments; 2] {
        let magnitudes = Self(self.outwards(0.0).map(|(d, area)| Sample::new(d as f32, area)).collect());
        [Weighting::Area, Weighting::Texel].map(|weighting| {
            let (signed, unsigned) = (self.describe(weighting), magnitudes.describe(weighting));
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
        })
    }

    /// All NaN where no sample has a weight.
    fn describe(&self, weighting: Weighting) -> SignedMoments {
        let weighted = || self.weighted(weighting);
        let total: f64 = weighted().map(|(_, weight)| weight).sum();
        let mean = weighted().map(|(x, weight)| weight * x).sum::<f64>() / total;
        let variance = weighted().map(|(x, weight)| weight * (x - mean).powi(2)).sum::<f64>() / total;
        let [p1, p5, p25, p50, p75, p95, p99] =
            quantiles(weighted(), [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99].map(|share| share * total));
        let distances = self.outwards(p50).map(|(x, area)| match weighting {
            Weighting::Area => (x, f64::from(area)),
            Weighting::Texel => (x, 1.0),
        });
        let [mad] = quantiles(distances.filter(|(_, weight)| *weight > 0.0), [0.5 * total]);
        SignedMoments {
            mean,
            sd: variance.sqrt(),
            min: weighted().next().map_or(f64::NAN, |(x, _)| x),
            max: weighted().next_back().map_or(f64::NAN, |(x, _)| x),
            median: p50,
            mad,
            percentiles: Percentiles { p1, p5, p25, p50, p75, p95, p99 },
        }
    }

    /// Distances with their weights, without those that weigh nothing.
    fn weighted(&self, weighting: Weighting) -> impl DoubleEndedIterator<Item = (f64, f64)> {
        let weighted = self.0.iter().map(move |s| (f64::from(s.distance()), weighting.weight(*s)));
        weighted.filter(|(_, weight)| *weight > 0.0)
    }

    /// Offsets of the samples from a distance, with their areas, in ascending order: both sides merged, equal offsets
    /// by their areas.
    fn outwards(&self, from: f64) -> impl Iterator<Item = (f64, f32)> {
        let offset = move |s: &Sample| ((f64::from(s.distance()) - from).abs(), s.area());
        let (below, above) = self.0.split_at(self.0.partition_point(|s| f64::from(s.distance()) < from));
        let mut below = below.chunk_by(|a, b| a.distance() == b.distance()).rev().flatten().map(offset).peekable();
        let mut above = above.iter().map(offset).peekable();
        std::iter::from_fn(move || match (below.peek(), above.peek()) {
            (Some(b), Some(a)) if b <= a => below.next(),
            (Some(_), None) => below.next(),
            _ => above.next(),
        })
    }

    /// `range` is the maximum distance.
    pub(super) fn histogram(&self, range: f64) -> Histogram {
        let (mut area, mut texels) = (vec![0.0; BINS], vec![0; BINS]);
        for sample in &self.0 {
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
        let (below, rest) = self.0.split_at(self.0.partition_point(|s| s.distance() < lower));
        let (within, above) = rest.split_at(rest.partition_point(|s| s.distance() <= upper));
        Conformance::new(tolerance, [below, within, above].map(|samples| (samples.len(), area(samples))))
    }
}

fn area(samples: &[Sample]) -> f64 {
    // The sum of nothing is -0.
    0.0 + samples.iter().map(|s| f64::from(s.area())).sum::<f64>()
}

/// The values below which the weights `goals`, which ascend, lie: linear in cumulative weight between values, each of
/// which stands at the middle of its own weight (Hazen's rule where all weigh alike). NaN where there are none.
pub(super) fn quantiles<const N: usize>(values: impl Iterator<Item = (f64, f64)>, goals: [f64; N]) -> [f64; N] {
    let mut quantiles = [f64::NAN; N];
    let (mut reached, mut before) = (0, 0.0);
    let mut last: Option<(f64, f64)> = None;
    for (value, weight) in values {
        let place = before + 0.5 * weight;
        while reached < N && goals[reached] <= place {
            quantiles[reached] = match last {
                Some((lower, from)) if place > from => {
                    lower + (value - lower) * ((goals[reached] - from) / (place - from)).clamp(0.0, 1.0)
                }
                _ => value,
            };
            reached += 1;
        }
        if reached == N {
            return quantiles;
        }
        (last, before) = (Some((value, place)), before + weight);
    }
    quantiles[reached..].fill(last.map_or(f64::NAN, |(value, _)| value));
    quantiles
}

#[cfg(test)]
mod tests;
