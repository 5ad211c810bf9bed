//! Quantiles of functions of the distances, such as their magnitudes: between the places where such a function turns,
//! sorted samples are sorted by it as well, one way or the other, and a quantile lies in these runs merged. It is found
//! by bisection over sums that are kept, and not by going through all samples.

use super::{Distribution, Sample, Weighting, quantile};

/// Samples between two sums that are kept: a quantile goes through some of these one by one.
const BLOCK: usize = 256;

/// The areas of the samples before each block of [`BLOCK`] samples, and of all.
#[derive(Clone, Debug)]
pub(super) struct Cumulated(Vec<f64>);

impl Default for Cumulated {
    fn default() -> Self {
        Self::of(&[])
    }
}

impl Cumulated {
    pub(super) fn of(samples: &[Sample]) -> Self {
        let mut sum = 0.0;
        let mut sums = vec![0.0];
        for block in samples.chunks(BLOCK) {
            sum += block.iter().map(|s| f64::from(s.area())).sum::<f64>();
            sums.push(sum);
        }
        Self(sums)
    }

    /// The area of all samples.
    pub(super) fn whole(&self) -> f64 {
        self.0.last().copied().unwrap_or(0.0)
    }
}

/// A run of samples, by which a function of the distance grows.
#[derive(Clone, Copy, Debug)]
struct Run {
    start: usize,
    end: usize,
    /// Whether the function grows as distances do; it falls otherwise.
    forward: bool,
}

/// Samples in the order of a function of their distances.
pub(super) struct Merged<'d, F> {
    of: &'d Distribution,
    key: F,
    weighting: Weighting,
    runs: Vec<Run>,
}

impl<'d, F: Fn(f64) -> f64 + Copy> Merged<'d, F> {
    /// `key` falls up to the first of the distances `turns`, which ascend, grows up to the second one, and so on; with
    /// none it grows.
    pub(super) fn new(of: &'d Distribution, key: F, turns: &[f64], weighting: Weighting) -> Self {
        let cut = |turn: &f64| of.samples.partition_point(|s| f64::from(s.distance()) < *turn);
        let ends = turns.iter().map(cut).chain([of.samples.len()]);
        let mut start = 0;
        let run = |(k, end): (usize, usize)| {
            let forward = turns.is_empty() || k % 2 == 1;
            // A turn at NaN, the median where nothing has a weight, is before all samples.
            let end = end.max(start);
            Run { start: std::mem::replace(&mut start, end), end, forward }
        };
        Self { of, key, weighting, runs: ends.enumerate().map(run).collect() }
    }

    /// The values below which the weights `goals` lie ([`quantile`]).
    pub(super) fn quantiles<const N: usize>(&self, goals: [f64; N]) -> [f64; N] {
        goals.map(|goal| self.quantile(goal))
    }

    /// The weight of all samples.
    pub(super) fn whole(&self) -> f64 {
        match self.weighting {
            Weighting::Texel => self.of.len() as f64,
            Weighting::Area => self.of.area(),
        }
    }

    /// The least and the greatest value that has a weight; NaN where none has.
    pub(super) fn ends(&self) -> [f64; 2] {
        let first = self.samples(&self.cut(f64::NEG_INFINITY)).find(|(_, weight)| *weight > 0.0);
        [first, self.last_before(&self.cut(f64::INFINITY))].map(|end| end.map_or(f64::NAN, |(value, _)| value))
    }

    fn quantile(&self, goal: f64) -> f64 {
        let from = self.start(goal);
        let weighing = self.samples(&from).filter(|(_, weight)| *weight > 0.0);
        quantile(weighing, goal, self.weight_before(&from), self.last_before(&from))
    }

    fn value(&self, i: usize) -> f64 {
        (self.key)(f64::from(self.of.samples[i].distance()))
    }

    /// By run, where the values reach `least`: of a forward one the first of these, of another one the end of these.
    fn cut(&self, least: f64) -> Vec<usize> {
        let of_run = |run: &Run| {
            let samples = &self.of.samples[run.start..run.end];
            let below = |s: &Sample| (self.key)(f64::from(s.distance())) < least;
            run.start + samples.partition_point(|s| below(s) == run.forward)
        };
        self.runs.iter().map(of_run).collect()
    }

    /// The farthest cut that is found at the ends of blocks before which there is no more weight than the goal.
    fn start(&self, goal: f64) -> Vec<usize> {
        let mut best = self.cut(f64::NEG_INFINITY);
        let mut most = 0.0;
        for run in &self.runs {
            let (first, past) = (run.start.div_ceil(BLOCK), run.end.div_ceil(BLOCK));
            let (mut low, mut high) = (0, past.saturating_sub(first));
            while low < high {
                let middle = (low + high) / 2;
                // Blocks in the order in which values grow.
                let block = if run.forward { first + middle } else { past - 1 - middle };
                let cut = self.cut(self.value(block * BLOCK));
                let weight = self.weight_before(&cut);
                if weight <= goal {
                    if weight > most {
                        (best, most) = (cut, weight);
                    }
                    low = middle + 1;
                } else {
                    high = middle;
                }
            }
        }
        best
    }

    fn weight_before(&self, cut: &[usize]) -> f64 {
        let of_run = |(run, at): (&Run, &usize)| {
            if run.forward { self.weight(run.start, *at) } else { self.weight(*at, run.end) }
        };
        // The sum of nothing is -0.
        0.0 + self.runs.iter().zip(cut).map(of_run).sum::<f64>()
    }

    /// The weight of the samples from one to another.
    fn weight(&self, from: usize, to: usize) -> f64 {
        match self.weighting {
            Weighting::Texel => (to - from) as f64,
            Weighting::Area => self.area_before(to) - self.area_before(from),
        }
    }

    fn area_before(&self, i: usize) -> f64 {
        let block = i / BLOCK;
        let rest = &self.of.samples[block * BLOCK..i];
        self.of.cumulated.0[block] + rest.iter().map(|s| f64::from(s.area())).sum::<f64>()
    }

    /// The value and the weight of what comes last before a cut, of what has a weight.
    fn last_before(&self, cut: &[usize]) -> Option<(f64, f64)> {
        let samples = &self.of.samples;
        let weighs = |s: &&Sample| self.weighting.weight(**s) > 0.0;
        let of_run = |(run, at): (&Run, &usize)| -> Option<(f64, f64)> {
            let last = if run.forward {
                samples[run.start..*at].iter().rfind(weighs)?
            } else {
                let mut equals = samples[*at..run.end].chunk_by(|a, b| a.distance() == b.distance());
                equals.find_map(|equals| equals.iter().rfind(weighs))?
            };
            Some(((self.key)(f64::from(last.distance())), self.weighting.weight(*last)))
        };
        let lasts = self.runs.iter().zip(cut).filter_map(of_run);
        lasts.max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)))
    }

    /// The values and weights from a cut on, in ascending order, equal values by their areas.
    fn samples(&self, cut: &[usize]) -> impl Iterator<Item = (f64, f64)> {
        let samples = &self.of.samples;
        let of_run = |(run, at): (&Run, &usize)| {
            let (ahead, behind) = if run.forward { (*at..run.end, 0..0) } else { (0..0, run.start..*at) };
            let behind = samples[behind].chunk_by(|a, b| a.distance() == b.distance()).rev().flatten();
            samples[ahead].iter().chain(behind).peekable()
        };
        let mut runs: Vec<_> = self.runs.iter().zip(cut).map(of_run).collect();
        let (key, weighting) = (self.key, self.weighting);
        let order = move |s: &Sample| (key(f64::from(s.distance())), s.area());
        std::iter::from_fn(move || {
            let heads = runs.iter_mut().enumerate().filter_map(|(k, run)| Some((k, order(run.peek()?))));
            let least = heads.min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
            let next = runs[least?.0].next()?;
            Some((order(next).0, weighting.weight(*next)))
        })
    }
}
