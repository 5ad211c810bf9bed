//! Distributions of signed distances: sorted samples, from which means, extremes, quantiles and histograms are read.

use super::moments::{Moments, Percentiles, SignedMoments};
use super::statistics::Histogram;
use super::tolerance::{Conformance, Tolerance};
use std::ops::Range;

/// Bins of the reported histogram, over twice the maximum distance.
const BINS: usize = 64;

/// A signed distance and the area that it stands for, packed so that integers are ordered by distance and equal
/// distances by area: the order in which samples were found plays no role.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Sample(u64);

impl Sample {
    /// `area` is finite and not negative; it is 0 for texels that count per texel only.
    pub(super) fn new(distance: f32, area: f32) -> Self {
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

/// How much a sample counts.
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

/// A figure of a distance x whose quantiles are wanted.
#[derive(Clone, Copy, Debug)]
enum Figure {
    /// x, or |x|.
    Value { magnitude: bool },
    /// |x - centre|, or ||x| - centre|.
    Deviation { magnitude: bool, centre: f64 },
}

impl Figure {
    fn of(self, sample: Sample) -> f64 {
        let x = f64::from(sample.distance());
        let value = |magnitude: bool| if magnitude { x.abs() } else { x };
        match self {
            Self::Value { magnitude } => value(magnitude),
            Self::Deviation { magnitude, centre } => (value(magnitude) - centre).abs(),
        }
    }

    /// The distances at which it turns between falling and rising; at last it rises.
    fn turns(self) -> Vec<f64> {
        match self {
            Self::Value { magnitude: false } => vec![],
            Self::Value { magnitude: true } => vec![0.0],
            Self::Deviation { magnitude: false, centre } => vec![centre],
            Self::Deviation { magnitude: true, centre } => vec![-centre, 0.0, centre],
        }
    }
}

/// Samples in ascending order.
#[derive(Clone, Debug, Default)]
pub(super) struct Distribution {
    samples: Vec<Sample>,
    /// Area before every [`BLOCK`]th sample, and that of all.
    areas: Vec<f64>,
}

/// Samples between two known sums of areas.
const BLOCK: usize = 64;

impl Distribution {
    pub(super) fn new(mut samples: Vec<Sample>) -> Self {
        samples.sort_unstable();
        Self::of_sorted(samples)
    }

    /// The samples of several distributions.
    pub(super) fn merge<'a>(parts: impl Iterator<Item = &'a Self>) -> Self {
        let mut samples: Vec<Sample> = parts.flat_map(|p| &p.samples).copied().collect();
        // The stable sort finds the sorted runs and merges them.
        samples.sort();
        Self::of_sorted(samples)
    }

    fn of_sorted(samples: Vec<Sample>) -> Self {
        let mut areas = vec![0.0];
        let mut sum = 0.0;
        for block in samples.chunks(BLOCK) {
            sum += area(block);
            areas.push(sum);
        }
        Self { samples, areas }
    }

    pub(super) fn len(&self) -> usize {
        self.samples.len()
    }

    /// Total area. Square millimetres.
    pub(super) fn area(&self) -> f64 {
        self.areas.last().copied().unwrap_or_default()
    }

    /// Statistics of the distances and of their magnitudes, by area and by texel; all NaN if nothing has a weight.
    pub(super) fn moments(&self) -> [Moments; 2] {
        let weighing = self.samples.iter().filter(|s| s.area() > 0.0);
        let weighing = (weighing.clone().count() < self.len()).then(|| Self::of_sorted(weighing.copied().collect()));
        let [by_area, by_texel] = self.spreads();
        [
            weighing.as_ref().unwrap_or(self).weighted_moments(Weighting::Area, by_area),
            self.weighted_moments(Weighting::Texel, by_texel),
        ]
    }

    /// Means and variances of the distances and of their magnitudes, by area and by texel.
    fn spreads(&self) -> [[(f64, f64); 2]; 2] {
        let values = || {
            let value = |s: &Sample| (f64::from(s.distance()), f64::from(s.area()));
            self.samples.iter().map(value).map(|(x, area)| ([x, x.abs()], [area, 1.0]))
        };
        let total = [self.area(), self.len() as f64];
        let mut means = [[0.0; 2]; 2];
        for (x, weight) in values() {
            for (w, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                means[w][k] += weight[w] * x[k];
            }
        }
        let means = [0, 1].map(|w| means[w].map(|sum| sum / total[w]));
        let mut squares = [[0.0; 2]; 2];
        for (x, weight) in values() {
            for (w, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                squares[w][k] += weight[w] * (x[k] - means[w][k]).powi(2);
            }
        }
        [0, 1].map(|w| [0, 1].map(|k| (means[w][k], squares[w][k] / total[w])))
    }

    /// Every sample has a weight.
    fn weighted_moments(&self, weighting: Weighting, spreads: [(f64, f64); 2]) -> Moments {
        let [signed, unsigned] = [0, 1].map(|k| self.describe(weighting, k == 1, spreads[k]));
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
    }

    /// Statistics of the distances, or of their magnitudes.
    fn describe(&self, weighting: Weighting, magnitude: bool, (mean, variance): (f64, f64)) -> SignedMoments {
        let figure = Figure::Value { magnitude };
        let total = self.before(self.len(), weighting);
        let [p1, p5, p25, p50, p75, p95, p99] =
            [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99].map(|share| self.quantile(figure, weighting, share * total));
        let (min, max) = self.range(figure).unwrap_or((f64::NAN, f64::NAN));
        SignedMoments {
            mean,
            sd: variance.sqrt(),
            min,
            max,
            median: p50,
            mad: self.quantile(Figure::Deviation { magnitude, centre: p50 }, weighting, 0.5 * total),
            percentiles: Percentiles { p1, p5, p25, p50, p75, p95, p99 },
        }
    }

    /// Weight of the first `count` samples.
    fn before(&self, count: usize, weighting: Weighting) -> f64 {
        match weighting {
            Weighting::Area => {
                self.areas.get(count / BLOCK).unwrap_or(&0.0) + area(&self.samples[count / BLOCK * BLOCK..count])
            }
            Weighting::Texel => count as f64,
        }
    }

    /// The runs of samples along which a figure rises or falls.
    fn pieces(&self, figure: Figure) -> Vec<Piece> {
        let turns = figure.turns();
        let places = turns.iter().map(|x| self.samples.partition_point(|s| f64::from(s.distance()) < *x));
        let ends: Vec<usize> = std::iter::once(0).chain(places).chain([self.len()]).collect();
        let piece = |k: usize| Piece { samples: ends[k]..ends[k + 1], rising: (turns.len() - k).is_multiple_of(2) };
        (0..=turns.len()).map(piece).filter(|p| !p.samples.is_empty()).collect()
    }

    /// The least and the greatest value of a figure; none if there are no samples.
    fn range(&self, figure: Figure) -> Option<(f64, f64)> {
        let ends = self.pieces(figure).into_iter().flat_map(|p| [p.samples.start, p.samples.end - 1]);
        let ends = ends.map(|i| figure.of(self.samples[i]));
        ends.fold(None, |range, x| {
            range.map_or(Some((x, x)), |(low, high): (f64, f64)| Some((low.min(x), high.max(x))))
        })
    }

    /// The value of a figure below which the weight `goal` lies: linear in cumulative weight between samples, each of
    /// which stands at the middle of its own weight (Hazen's rule where all weigh alike), equal values in the order of
    /// their weights. NaN if there are no samples.
    fn quantile(&self, figure: Figure, weighting: Weighting, goal: f64) -> f64 {
        let Some((least, greatest)) = self.range(figure) else { return f64::NAN };
        let values = Values { all: self, figure, weighting, pieces: self.pieces(figure) };
        // The least value up to which the weight is enough, by bisection over all numbers.
        let (mut low, mut high) = (ordered(least.to_bits()) - 1, ordered(greatest.to_bits()));
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if values.weight(|x| ordered(x.to_bits()) <= middle) < goal { low = middle } else { high = middle }
        }
        let value = f64::from_bits(ordered(high as u64) as u64);
        let (lightest, heaviest) = values.weights_of(value);
        let first = values.weight(|x| x < value) + 0.5 * lightest;
        let last = values.weight(|x| x <= value) - 0.5 * heaviest;
        let between = |a: f64, from: f64, b: f64, to: f64| a + (b - a) * ((goal - from) / (to - from)).clamp(0.0, 1.0);
        if goal <= first {
            values.next_below(value).map_or(value, |lower| {
                let from = first - 0.5 * lightest - 0.5 * values.weights_of(lower).1;
                between(lower, from, value, first)
            })
        } else if goal > last {
            values.next_above(value).map_or(value, |upper| {
                let to = last + 0.5 * heaviest + 0.5 * values.weights_of(upper).0;
                between(value, last, upper, to)
            })
        } else {
            value
        }
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

    pub(super) fn conformance(&self, tolerance: Tolerance) -> Conformance {
        // Distances are of single precision, and the ends are meant as they are written: 0.1 mm is within 0.1 mm.
        let (lower, upper) = (tolerance.lower as f32, tolerance.upper as f32);
        let (below, rest) = self.samples.split_at(self.samples.partition_point(|s| s.distance() < lower));
        let (within, above) = rest.split_at(rest.partition_point(|s| s.distance() <= upper));
        Conformance::new(tolerance, [below, within, above].map(|samples| (samples.len(), area(samples))))
    }
}

/// A run of samples along which a figure rises or falls.
struct Piece {
    samples: Range<usize>,
    rising: bool,
}

/// The weighted values of a figure.
struct Values<'a> {
    all: &'a Distribution,
    figure: Figure,
    weighting: Weighting,
    pieces: Vec<Piece>,
}

impl Values<'_> {
    fn at(&self, i: usize) -> f64 {
        self.figure.of(self.all.samples[i])
    }

    /// The samples of a piece that pass a test which the low values pass.
    fn low(&self, piece: &Piece, test: impl Fn(f64) -> bool) -> Range<usize> {
        let Range { start, end } = piece.samples;
        let samples = &self.all.samples[start..end];
        if piece.rising {
            start..start + samples.partition_point(|s| test(self.figure.of(*s)))
        } else {
            start + samples.partition_point(|s| !test(self.figure.of(*s)))..end
        }
    }

    /// The weight of the values that pass a test which low values pass.
    fn weight(&self, test: impl Fn(f64) -> bool + Copy) -> f64 {
        let low = self.pieces.iter().map(|p| self.low(p, test));
        low.map(|r| self.all.before(r.end, self.weighting) - self.all.before(r.start, self.weighting)).sum()
    }

    /// The least and the greatest weight of the samples with a value.
    fn weights_of(&self, value: f64) -> (f64, f64) {
        let samples = self.pieces.iter().flat_map(|p| {
            let (below, up_to) = (self.low(p, |x| x < value), self.low(p, |x| x <= value));
            (up_to.start..below.start).chain(below.end..up_to.end)
        });
        let weights = samples.map(|i| self.weighting.weight(self.all.samples[i]));
        weights.fold((f64::INFINITY, 0.0), |(least, greatest), w| (least.min(w), greatest.max(w)))
    }

    fn next_below(&self, value: f64) -> Option<f64> {
        let low = self.pieces.iter().map(|p| (p, self.low(p, |x| x < value))).filter(|(_, r)| !r.is_empty());
        low.map(|(p, r)| self.at(if p.rising { r.end - 1 } else { r.start })).reduce(f64::max)
    }

    fn next_above(&self, value: f64) -> Option<f64> {
        let low = self.pieces.iter().map(|p| (p, self.low(p, |x| x <= value))).filter(|(p, r)| *r != p.samples);
        low.map(|(p, r)| self.at(if p.rising { r.end } else { r.start - 1 })).reduce(f64::min)
    }
}

/// The bits of a double as an integer of the same order, and back.
fn ordered(bits: u64) -> i64 {
    let bits = bits as i64;
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

fn area(samples: &[Sample]) -> f64 {
    // The sum of nothing is -0.
    0.0 + samples.iter().map(|s| f64::from(s.area())).sum::<f64>()
}

#[cfg(test)]
mod tests;
