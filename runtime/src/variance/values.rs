//! Distances with the areas for which they stand: one pass over them for all sums, and quantiles by selection.
//!
//! Nothing is sorted but the few values around a quantile: a first pass over the values counts what falls into each of some thousand
//! bins, a second one gathers the bins in which quantiles are, a third one what is near the medians of differences from the
//! medians. Work is cut into tasks of fixed size whose results are put together in their order, so that nothing depends on the number
//! of threads.

use super::bins::{Bins, Weights};
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

/// Of so few values all are gathered.
const FEW: usize = 2048;

/// What one pass over the values counts.
#[derive(Clone, Debug)]
struct Tally {
    sums: [Both; 2],
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
        let Tally { sums, histogram, conforming, bins: counted } = self.tally(range, tolerance, &bins);
        let signed = [0, 1].map(|w| Weights::new(counted.iter().map(|c| c[w]).collect()));
        let unsigned = [0, 1].map(|w| signed[w].folded());
        let weight = [0, 1].map(|w| signed[w].total());
        let means = sums.map(|s| [0, 1].map(|w| s[w] / weight[w]));

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
        let between = [(&signed, 0), (&unsigned, 1)].map(|(weights, k): (_, usize)| {
            [0, 1].map(
                |w: usize| if count <= FEW { (0.0, f64::INFINITY) } else { weights[w].around(&bins, centers[k][w]) },
            )
        });
        let (squares, mads) = self.spreads(means, centers, between, weight);
        let variances = squares.map(|s| [0, 1].map(|w| s[w] / weight[w]));
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
            sums: [[0.0; 2]; 2],
            histogram: vec![[0.0; 2]; BINS],
            conforming: [[0.0; 2]; 3],
            bins: vec![[0.0; 2]; bins.count()],
        };
        let of_task = |task: &[Run<'_>]| {
            let mut tally = none();
            for (values, areas) in task {
                for (&x, &area) in values.iter().zip(*areas) {
                    let (value, area) = (f64::from(x), f64::from(area));
                    add(&mut tally.bins[bins.of(x)], [area, 1.0]);
                    // Saturates: single precision may lie beyond the ends by a rounding.
                    let bin = (((value + range) * scale) as usize).min(BINS - 1);
                    add(&mut tally.histogram[bin], [area, 1.0]);
                    add(&mut tally.sums[0], [area * value, value]);
                    add(&mut tally.sums[1], [area * value.abs(), value.abs()]);
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
            let own = all.sums.iter_mut().chain(&mut all.conforming).chain(&mut all.histogram).chain(&mut all.bins);
            let other = task.sums.iter().chain(&task.conforming).chain(&task.histogram).chain(&task.bins);
            own.zip(other).for_each(|(a, b)| add(a, *b));
            all
        })
    }

    /// The values in some bins.
    fn gather(&self, bins: &Bins, needed: &[bool]) -> Vec<u64> {
        let of_task = |task: &[Run<'_>]| {
            let mut found = Vec::new();
            for (values, areas) in task {
                let pairs = values.iter().zip(*areas);
                found.extend(pairs.filter(|(x, _)| needed[bins.of(**x)]).map(|(x, a)| pack(*x, *a)));
            }
            found
        };
        self.pass(of_task).concat()
    }

    /// Sums of the squared differences of the values, and of their magnitudes, from `means`; and the medians of their absolute
    /// differences from `centers`, which are `between` these bounds.
    fn spreads(
        &self,
        means: [Both; 2],
        centers: [Both; 2],
        between: [[(f64, f64); 2]; 2],
        weight: Both,
    ) -> ([Both; 2], [Both; 2]) {
        struct Spread {
            squares: [Both; 2],
            below: [Both; 2],
            near: [[Vec<(f64, f64)>; 2]; 2],
        }
        let of_task = |task: &[Run<'_>]| {
            let mut spread =
                Spread { squares: Default::default(), below: Default::default(), near: Default::default() };
            for (values, areas) in task {
                for (k, magnitude) in [false, true].into_iter().enumerate() {
                    for w in 0..2 {
                        let (center, (low, high)) = (centers[k][w], between[k][w]);
                        let (mut squares, mut below) = (0.0, 0.0);
                        let near = &mut spread.near[k][w];
                        for (x, area) in values.iter().zip(*areas) {
                            let value = f64::from(if magnitude { x.abs() } else { *x });
                            let weight = if w == 0 { f64::from(*area) } else { 1.0 };
                            let difference = value - means[k][w];
                            squares += weight * difference * difference;
                            let key = (value - center).abs();
                            below += if key < low { weight } else { 0.0 };
                            if key >= low && key <= high {
                                near.push((key, weight));
                            }
                        }
                        spread.squares[k][w] += squares;
                        spread.below[k][w] += below;
                    }
                }
            }
            spread
        };
        let tasks = self.pass(of_task);
        let sum = |f: &dyn Fn(&Spread) -> f64| tasks.iter().map(f).sum::<f64>();
        let squares = [0, 1].map(|k: usize| [0, 1].map(|w: usize| sum(&|s| s.squares[k][w])));
        let mads = [0, 1].map(|k: usize| {
            [0, 1].map(|w: usize| {
                let mut near: Vec<(f64, f64)> = tasks.iter().flat_map(|s| s.near[k][w].iter().copied()).collect();
                near.retain(|n| n.1 > 0.0);
                near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
                let below = sum(&|s| s.below[k][w]);
                match quantile(&near, below, 0.5 * weight[w]) {
                    (median, true) => median,
                    // None is before the first of all.
                    (median, false) if below == 0.0 && near.first().is_some_and(|n| n.1 >= weight[w]) => median,
                    // A few values that weigh nearly everything may leave nothing beside the median.
                    _ => self.median_from(centers[k][w], k == 1, w),
                }
            })
        });
        (squares, mads)
    }
}

/// A value and its area as an integer of the same order: equal values by their areas, so that the order in which they were found plays
/// no role.
fn pack(value: f32, area: f32) -> u64 {
    let bits = value.to_bits();
    let order = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
    u64::from(order) << 32 | u64::from(area.to_bits())
}

fn unpack(packed: u64) -> (f32, f32) {
    let order = (packed >> 32) as u32;
    let bits = if order >> 31 == 1 { order & !(1 << 31) } else { !order };
    (f32::from_bits(bits), f32::from_bits(packed as u32))
}

/// With their weights; those without are left out.
fn weighed(values: &[u64], weighting: usize) -> Vec<(f64, f64)> {
    let weight = |area: f32| if weighting == 0 { f64::from(area) } else { 1.0 };
    let values = values.iter().map(|packed| unpack(*packed));
    values.map(|(x, area)| (f64::from(x), weight(area))).filter(|v| v.1 > 0.0).collect()
}

/// Of values that contain those of the bins around every quantile.
fn quantiles(found: &[(f64, f64)], weights: &Weights, bins: &Bins) -> Vec<f64> {
    let of_share = |share: &f64| {
        let goal = share * weights.total();
        let first = weights.first_around(goal);
        let start = found.partition_point(|(x, _)| bins.of(*x as f32) < first);
        quantile(&found[start..], weights.before(first), goal).0
    };
    SHARES.iter().map(of_share).collect()
}

/// The value below which the weight `goal` lies: linear in cumulative weight between values, each of which stands at the middle of its
/// own weight (Hazen's rule where all weigh alike). `before` is the weight before the first. NaN where there are none. Also whether it
/// lies between two of them; else it is the first or the last.
fn quantile(values: &[(f64, f64)], mut before: f64, goal: f64) -> (f64, bool) {
    let mut last: Option<(f64, f64)> = None;
    for &(value, weight) in values {
        let place = before + 0.5 * weight;
        if place >= goal {
            return match last {
                Some((least, from)) if place > from => {
                    (least + (value - least) * ((goal - from) / (place - from)).clamp(0.0, 1.0), true)
                }
                _ => (value, false),
            };
        }
        (last, before) = (Some((value, place)), before + weight);
    }
    (last.map_or(f64::NAN, |l| l.0), false)
}

#[inline(always)]
fn add(sum: &mut Both, other: Both) {
    *sum = [sum[0] + other[0], sum[1] + other[1]];
}

#[cfg(test)]
mod tests {
    use super::{Distances, SHARES, Summary, TASK, Values};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The definition, written down plainly: values sorted, each at the middle of its weight.
    fn plainly(mut values: Vec<(f64, f64)>, share: f64) -> f64 {
        values.retain(|v| v.1 > 0.0);
        values.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let goal = share * values.iter().map(|v| v.1).sum::<f64>();
        let mut before = 0.0;
        let mut last: Option<(f64, f64)> = None;
        for (value, weight) in values {
            let place = before + 0.5 * weight;
            if place >= goal {
                return last.map_or(value, |(least, from)| least + (value - least) * (goal - from) / (place - from));
            }
            (last, before) = (Some((value, place)), before + weight);
        }
        last.map_or(f64::NAN, |l| l.0)
    }

    fn summary(values: &Values, range: f64) -> Summary {
        Distances::of([values].into_iter()).summary(range, None)
    }

    #[test]
    fn few_values_and_none() {
        let four = summary(&Values { signed: vec![4.0, 1.0, 8.0, 2.0], areas: vec![3.0; 4] }, 8.0);
        for w in [0, 1] {
            // Hazen's positions 1/8, 3/8, 5/8, 7/8.
            assert_eq!(four.quantiles[0][w], [1.0, 1.0, 1.5, 3.0, 6.0, 8.0, 8.0]);
            assert_eq!([four.ends[0][w], four.ends[1][w], four.ends[2][w]], [1.0, 8.0, 1.0]);
        }
        let none = summary(&Values::default(), 8.0);
        assert!(none.quantiles[0][1][3].is_nan() && none.ends[0][0].is_nan() && none.mads[1][1].is_nan());
        let without_area = summary(&Values { signed: vec![7.0], areas: vec![0.0] }, 8.0);
        assert!(without_area.quantiles[0][0][3].is_nan() && without_area.ends[1][0].is_nan());
        assert_eq!((without_area.quantiles[0][1][3], without_area.ends[1][1]), (7.0, 7.0));
    }

    /// Few distinct values, so that many are equal, and many; hundreds, thousands, and more than a task; one part and two; areas alike,
    /// and one that outweighs all others.
    #[test]
    fn everything_agrees_with_the_definitions() {
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        for round in 0..24 {
            let grid = if round % 2 == 0 { 4.0 } else { 1e6 };
            let count = [400, 5000, 900, 20_000, 300, TASK + 7000][round / 2 % 6] - rng.random_range(0..300);
            let signed: Vec<f32> =
                (0..count).map(|_| (rng.random_range(-1.0..1.2f32).powi(3) * grid).round() / grid).collect();
            let mut areas: Vec<f32> = (0..count).map(|_| rng.random_range(0..5) as f32).collect();
            if round % 5 == 0 {
                areas[count / 2] = 1e6;
            }
            let cut = rng.random_range(0..=count);
            let halves = [
                Values { signed: signed[..cut].to_vec(), areas: areas[..cut].to_vec() },
                Values { signed: signed[cut..].to_vec(), areas: areas[cut..].to_vec() },
            ];
            let found = Distances::of(halves.iter()).summary(2.0, None);
            for w in [0, 1] {
                let with = |key: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
                    let weight = |a: &f32| if w == 0 { f64::from(*a) } else { 1.0 };
                    signed.iter().zip(&areas).map(|(x, a)| (key(f64::from(*x)), weight(a))).collect()
                };
                let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-11, "round {round}: {a}, not {b}");
                let plain: [&dyn Fn(f64) -> f64; 2] = [&|x| x, &f64::abs];
                for (k, key) in plain.into_iter().enumerate() {
                    for (share, value) in SHARES.iter().zip(&found.quantiles[k][w]) {
                        // Whole weights: sums are exact.
                        near(*value, plainly(with(key), *share));
                    }
                    let center = found.quantiles[k][w][3];
                    near(found.mads[k][w], plainly(with(&|x| (key(x) - center).abs()), 0.5));
                    let all = with(key);
                    let total: f64 = all.iter().map(|v| v.1).sum();
                    let mean = all.iter().map(|v| v.0 * v.1).sum::<f64>() / total;
                    near(found.means[k][w], mean);
                    near(found.variances[k][w], all.iter().map(|v| v.1 * (v.0 - mean).powi(2)).sum::<f64>() / total);
                }
                let weighing = with(&|x| x).into_iter().filter(|v| v.1 > 0.0).map(|v| v.0);
                let ends = weighing.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
                assert_eq!((found.ends[0][w], found.ends[1][w]), ends);
            }
        }
    }
}
