//! Distances with the areas for which they stand: one pass over them for all sums, and quantiles by selection.
//!
//! Nothing is sorted but the few values around a quantile: a first pass over the values sums and counts what falls into each of some
//! thousand bins, a second one gathers the bins in which quantiles are, a third one those around the medians of differences from the
//! medians. Work is cut into tasks of fixed size whose results are put together in their order, so that nothing depends on the number
//! of threads.

use super::bins::{Bins, Weights};
use super::quantile::{Ring, pack, quantile, quantiles, unpack, weighed};
use super::spread::Spread;
use super::tolerance::Tolerance;
use rayon::prelude::*;

/// Values a task.
const TASK: usize = 1 << 16;

/// Bins of the histogram that is reported, over twice the maximum distance.
pub(super) const BINS: usize = 64;

/// Figures by area, and with every value counted alike.
pub(super) type Both = [f64; 2];

/// The signed distances of a part, each with its area, which is not negative; those without area have a zero there and count only alike.
#[derive(Clone, Debug, Default)]
pub(super) struct Values {
    pub(super) signed: Vec<f32>,
    pub(super) areas: Vec<f32>,
}

/// Some values.
type Run<'a> = (&'a [f32], &'a [f32]);

/// The values of one or several parts, cut into tasks.
#[derive(Clone, Debug, Default)]
pub(super) struct Distances<'a> {
    tasks: Vec<Vec<Run<'a>>>,
}

/// What there is to say of some distances.
#[derive(Clone, Debug, Default)]
pub(super) struct Summary {
    /// Total weight.
    pub(super) weight: Both,
    /// Mean of the values, and of their magnitudes.
    pub(super) means: [Both; 2],
    /// Mean squared differences from these.
    pub(super) variances: [Both; 2],
    /// Least and greatest value, and least magnitude; NaN where nothing weighs anything.
    pub(super) ends: [Both; 3],
    /// Of the values, and of their magnitudes: the quantiles at [`SHARES`].
    pub(super) quantiles: [[Vec<f64>; 2]; 2],
    /// Medians of their absolute differences from their medians.
    pub(super) mads: [Both; 2],
    /// Weight in each of the reported histogram's bins.
    pub(super) histogram: Vec<Both>,
    /// Weight below, within and above the tolerance.
    pub(super) conforming: [Both; 3],
}

/// Shares of the weight of which quantiles are wanted.
pub(super) const SHARES: [f64; 7] = [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99];

/// Values that are gathered before they are kept.
const BUFFER: usize = 1024;

/// Of so few values all are gathered.
const FEW: usize = 2048;

/// What one pass over the values counts.
#[derive(Clone, Debug)]
struct Tally {
    /// Of the values, and of their magnitudes.
    spreads: [Spread; 2],
    histogram: Vec<Both>,
    conforming: [Both; 3],
    bins: Vec<Both>,
}

impl<'a> Distances<'a> {
    /// Of the values of some parts.
    pub(super) fn of(parts: impl Iterator<Item = &'a Values>) -> Self {
        let mut tasks: Vec<Vec<Run<'a>>> = Vec::new();
        let mut room = 0;
        for Values { signed, areas } in parts {
            let (mut signed, mut areas) = (&signed[..], &areas[..]);
            while !signed.is_empty() {
                if room == 0 {
                    tasks.push(Vec::new());
                    room = TASK;
                }
                let count = signed.len().min(room);
                let (now, later) = (signed.split_at(count), areas.split_at(count));
                if let Some(task) = tasks.last_mut() {
                    task.push((now.0, later.0));
                }
                (signed, areas) = (now.1, later.1);
                room -= count;
            }
        }
        Distances { tasks }
    }

    /// Everything, of values between -`range` and `range`.
    pub(super) fn summary(&self, range: f64, tolerance: Option<Tolerance>) -> Summary {
        let count = self.tasks.iter().flatten().map(|run| run.0.len()).sum::<usize>();
        let bins = Bins::up_to(range, count > TASK / 4);
        let Tally { spreads, histogram, conforming, bins: counted } = self.tally(range, tolerance, &bins);
        let signed = [0, 1].map(|w| Weights::new(counted.iter().map(|c| c[w]).collect()));
        let unsigned = [0, 1].map(|w| signed[w].folded());
        let weight = [0, 1].map(|w| signed[w].total());
        let means = spreads.map(|s| [0, 1].map(|w| if weight[w] > 0.0 { s.mean[w] } else { f64::NAN }));
        let variances = spreads.map(|s| [0, 1].map(|w| s.squares[w] / weight[w]));

        let mut needed = vec![count <= FEW; bins.count()];
        for w in 0..2 {
            signed[w].bins_around(&SHARES, |b| needed[b] = true);
            // Both signs of a magnitude; and the ends, which are the first and the last.
            unsigned[w].bins_around(&SHARES, |b| (needed[b], needed[bins.mirrored(b)]) = (true, true));
            signed[w].bins_around(&[0.0, 1.0], |b| needed[b] = true);
            unsigned[w].bins_around(&[0.0], |b| (needed[b], needed[bins.mirrored(b)]) = (true, true));
        }
        let mut near = self.gather(&bins, &needed);
        near.sort_unstable();
        let mut magnitudes: Vec<u64> =
            near.iter().map(|packed| pack(unpack(*packed).0.abs(), unpack(*packed).1)).collect();
        magnitudes.sort_unstable();
        let ordered = [0, 1].map(|w| (weighed(&near, w), weighed(&magnitudes, w)));
        let quantiles = [
            [0, 1].map(|w| quantiles(&ordered[w].0, &signed[w], &bins)),
            [0, 1].map(|w| quantiles(&ordered[w].1, &unsigned[w], &bins)),
        ];
        let end = |found: Option<&(f64, f64)>| found.map_or(f64::NAN, |f| f.0);
        let ends = [0, 1, 2].map(|k| {
            [0, 1].map(|w| match k {
                0 => end(ordered[w].0.first()),
                1 => end(ordered[w].0.last()),
                _ => end(ordered[w].1.first()),
            })
        });

        // The median is the fourth of the shares.
        let centers = [0, 1].map(|k: usize| [0, 1].map(|w: usize| quantiles[k][w][3]));
        let mads = self.median_deviations([&signed, &unsigned], centers, &bins, count <= FEW);
        Summary { weight, means, variances, ends, quantiles, mads, histogram, conforming }
    }

    /// The median of the absolute differences from a number, of all values at once.
    fn median_from(&self, center: f64, magnitude: bool, w: usize) -> f64 {
        let mut all: Vec<(f64, f64)> = Vec::new();
        for (values, areas) in self.tasks.iter().flatten() {
            all.extend(values.iter().zip(*areas).map(|(x, area)| {
                let value = f64::from(if magnitude { x.abs() } else { *x });
                ((value - center).abs(), if w == 0 { f64::from(*area) } else { 1.0 })
            }));
        }
        all.retain(|n| n.1 > 0.0);
        all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        quantile(&all, 0.0, 0.5 * all.iter().map(|n| n.1).sum::<f64>()).0
    }

    /// Does work on every task, and gives the results in their order.
    fn pass<T: Send>(&self, work: impl Fn(&[Run<'a>]) -> T + Sync + Send) -> Vec<T> {
        self.tasks.par_iter().map(|task| work(task)).collect()
    }

    fn tally(&self, range: f64, tolerance: Option<Tolerance>, bins: &Bins) -> Tally {
        // Distances are of single precision, and the ends are meant as they are written: 0.1 mm is within 0.1 mm.
        let limits = tolerance.map(|t| (t.lower as f32, t.upper as f32));
        let scale = BINS as f64 / (2.0 * range);
        let none = || Tally {
            spreads: Default::default(),
            histogram: vec![[0.0; 2]; BINS],
            conforming: [[0.0; 2]; 3],
            bins: vec![[0.0; 2]; bins.count()],
        };
        let of_task = |task: &[Run<'_>]| {
            let mut tally = none();
            for (values, areas) in task {
                tally.spreads = std::array::from_fn(|k| tally.spreads[k].with(Spread::of(values, areas, k == 1)));
                for (&x, &area) in values.iter().zip(*areas) {
                    let (value, area) = (f64::from(x), f64::from(area));
                    add(&mut tally.bins[bins.of(x)], [area, 1.0]);
                    // Saturates: single precision may lie beyond the ends by a rounding.
                    let bin = (((value + range) * scale) as usize).min(BINS - 1);
                    add(&mut tally.histogram[bin], [area, 1.0]);
                }
                if let Some((lower, upper)) = limits {
                    for (&x, &area) in values.iter().zip(*areas) {
                        let class = usize::from(x >= lower) + usize::from(x > upper);
                        add(&mut tally.conforming[class], [f64::from(area), 1.0]);
                    }
                }
            }
            tally
        };
        self.pass(of_task).into_iter().fold(none(), |mut all, task| {
            let own = all.conforming.iter_mut().chain(&mut all.histogram).chain(&mut all.bins);
            let other = task.conforming.iter().chain(&task.histogram).chain(&task.bins);
            own.zip(other).for_each(|(a, b)| add(a, *b));
            all.spreads = std::array::from_fn(|k| all.spreads[k].with(task.spreads[k]));
            all
        })
    }

    /// The values in some bins.
    fn gather(&self, bins: &Bins, needed: &[bool]) -> Vec<u64> {
        let of_task = |task: &[Run<'_>]| {
            let (mut found, mut buffer) = (Vec::new(), [0; BUFFER]);
            for (values, areas) in task {
                for (values, areas) in values.chunks(BUFFER).zip(areas.chunks(BUFFER)) {
                    let mut count = 0;
                    for (x, area) in values.iter().zip(areas) {
                        // Written in any case, and kept or not: no branch can be guessed wrongly.
                        buffer[count] = pack(*x, *area);
                        count += usize::from(needed[bins.of(*x)]);
                    }
                    found.extend_from_slice(&buffer[..count]);
                }
            }
            found
        };
        self.pass(of_task).concat()
    }

    /// The medians of the absolute differences of the values, and of their magnitudes, from `centers`; `weights` are those in the bins.
    /// What lies between two bounds around them is gathered, the rest known from the bins.
    fn median_deviations(&self, weights: [&[Weights; 2]; 2], centers: [Both; 2], bins: &Bins, few: bool) -> [Both; 2] {
        let ring = |k: usize, w: usize| {
            let (low, high) = if few { (0.0, f64::INFINITY) } else { weights[k][w].around(bins, centers[k][w]) };
            Ring::new(bins, centers[k][w], low, high)
        };
        let rings = [0, 1].map(|k| [0, 1].map(|w| ring(k, w)));
        let mut needed = vec![false; bins.count()];
        for ring in &rings[0] {
            ring.bins().for_each(|b| needed[b] = true);
        }
        for ring in &rings[1] {
            ring.bins().for_each(|b| (needed[b], needed[bins.mirrored(b)]) = (true, true));
        }
        let found = self.gather(bins, &needed);
        [0, 1].map(|k| {
            [0, 1].map(|w| {
                let (center, ring) = (centers[k][w], &rings[k][w]);
                let (mut near, mut below) = (Vec::new(), weights[k][w].between(ring.inside.clone()));
                for (x, area) in found.iter().map(|packed| unpack(*packed)) {
                    let value = if k == 1 { x.abs() } else { x };
                    let weight = if w == 0 { f64::from(area) } else { 1.0 };
                    let key = (f64::from(value) - center).abs();
                    if weight <= 0.0 || ring.inside.contains(&bins.of(value)) {
                        continue;
                    } else if key < ring.low {
                        below += weight;
                    } else if key <= ring.high {
                        near.push((key, weight));
                    }
                }
                near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
                let all = weights[k][w].total();
                match quantile(&near, below, 0.5 * all) {
                    (median, true) => median,
                    // None is before the first of all.
                    (median, false) if below == 0.0 && near.first().is_some_and(|n| n.1 >= all) => median,
                    // A few values that weigh nearly everything may leave nothing beside the median.
                    _ => self.median_from(center, k == 1, w),
                }
            })
        })
    }
}

#[inline(always)]
fn add(sum: &mut Both, other: Both) {
    *sum = [sum[0] + other[0], sum[1] + other[1]];
}

#[cfg(test)]
mod tests;
