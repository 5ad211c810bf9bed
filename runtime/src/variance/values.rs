//! Distances with the areas for which they stand: one pass over them for all sums, and quantiles by selection.
//!
//! Nothing is sorted but the few values around a quantile: a first pass counts what falls into each of some thousand bins, a
//! second one gathers the bins in which quantiles are. Work is cut into tasks of fixed size whose results are put together in
//! their order, so that nothing depends on the number of threads.

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

/// What one pass over the values gives.
#[derive(Clone, Debug)]
pub(super) struct Tally {
    /// Total weight.
    pub(super) weight: Both,
    /// Sum of the values, and of their magnitudes.
    pub(super) sums: [Both; 2],
    /// Least and greatest value, and least magnitude.
    pub(super) ends: [Both; 3],
    /// Weight in each of the reported histogram's bins.
    pub(super) histogram: Vec<Both>,
    /// Weight below, within and above the tolerance.
    pub(super) conforming: [Both; 3],
}

/// The order in which quantiles see the values: ascending by a key.
#[derive(Clone, Copy, Debug)]
pub(super) enum Key {
    /// The value.
    Signed,
    /// Its magnitude.
    Unsigned,
    /// How far the value is from a number.
    From(f64),
    /// How far its magnitude is from a number.
    UnsignedFrom(f64),
}

/// Quantiles that are wanted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted<'s> {
    pub(super) key: Key,
    /// 0: by area; 1: alike.
    pub(super) weighting: usize,
    /// Shares of the weight, each between 0 and 1.
    pub(super) shares: &'s [f64],
}

impl Key {
    #[inline]
    fn of(self, x: f32) -> f64 {
        let x = f64::from(x);
        match self {
            Key::Signed => x,
            Key::Unsigned => x.abs(),
            Key::From(center) => (x - center).abs(),
            Key::UnsignedFrom(center) => (x.abs() - center).abs(),
        }
    }
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

    /// The values of a task with their areas.
    fn each(task: &'a [Run<'a>]) -> impl Iterator<Item = (f32, f32)> {
        task.iter().flat_map(|(values, areas)| values.iter().copied().zip(areas.iter().copied()))
    }

    /// Does work on every task, and gives the results in their order.
    fn pass<T: Send>(&self, work: impl Fn(&[Run<'a>]) -> T + Sync + Send) -> Vec<T> {
        self.tasks.par_iter().map(|task| work(task)).collect()
    }

    /// Sums, ends and the histogram over -`range` to `range`; of the tolerance too, where there is one.
    pub(super) fn tally(&self, range: f64, tolerance: Option<Tolerance>) -> Tally {
        // Distances are of single precision, and the ends are meant as they are written: 0.1 mm is within 0.1 mm.
        let limits = tolerance.map(|t| (t.lower as f32, t.upper as f32));
        let scale = BINS as f64 / (2.0 * range);
        let of_task = |task: &[Run<'_>]| {
            let mut tally = Tally::none();
            let mut plain = [[0.0; 2]; 3];
            for (x, area) in task.iter().flat_map(|(v, a)| v.iter().copied().zip(a.iter().copied())) {
                let (value, area) = (f64::from(x), f64::from(area));
                plain[0][0] += area;
                plain[1] = [plain[1][0] + area * value, plain[1][1] + value];
                plain[2] = [plain[2][0] + area * value.abs(), plain[2][1] + value.abs()];
                plain[0][1] += 1.0;
                tally.reach(value, area > 0.0);
                // Saturates: single precision may lie beyond the ends by a rounding.
                let bin = (((value + range) * scale) as usize).min(BINS - 1);
                tally.histogram[bin] = add(tally.histogram[bin], [area, 1.0]);
                if let Some((lower, upper)) = limits {
                    let class = usize::from(x >= lower) + usize::from(x > upper);
                    tally.conforming[class] = add(tally.conforming[class], [area, 1.0]);
                }
            }
            (tally.weight, tally.sums) = (plain[0], [plain[1], plain[2]]);
            tally
        };
        let mut tallies = self.pass(of_task).into_iter();
        let first = tallies.next().unwrap_or_else(Tally::none);
        tallies.fold(first, Tally::with)
    }

    /// Sums of the squared differences of the values, and of their magnitudes, from these numbers.
    pub(super) fn squares(&self, signed: Both, unsigned: Both) -> [Both; 2] {
        let of_task = |task: &[Run<'_>]| {
            let mut sums = [[0.0; 2]; 2];
            for (x, area) in task.iter().flat_map(|(v, a)| v.iter().copied().zip(a.iter().copied())) {
                let (value, area) = (f64::from(x), f64::from(area));
                sums[0] = add(sums[0], [area * (value - signed[0]).powi(2), (value - signed[1]).powi(2)]);
                let value = value.abs();
                sums[1] = add(sums[1], [area * (value - unsigned[0]).powi(2), (value - unsigned[1]).powi(2)]);
            }
            sums
        };
        self.pass(of_task).into_iter().fold([[0.0; 2]; 2], |a, b| [add(a[0], b[0]), add(a[1], b[1])])
    }

    /// Keys below which the given shares of the weight lie: linear in cumulative weight between keys, each of which stands at the
    /// middle of its own weight (Hazen's rule where all weigh alike). NaN where nothing weighs anything.
    pub(super) fn quantiles<const N: usize>(&self, reach: f64, wanted: [Wanted<'_>; N]) -> [Vec<f64>; N] {
        let count = self.tasks.iter().flatten().map(|run| run.0.len()).sum();
        let bins = Bins::up_to(reach, count);
        let weigh = |w: &Wanted<'_>, area: f32| if w.weighting == 0 { f64::from(area) } else { 1.0 };
        let count_task = |task: &[Run<'_>]| {
            wanted.map(|w| {
                let mut weights = vec![0.0; bins.count()];
                for (x, area) in Distances::each(task) {
                    weights[bins.of(w.key.of(x))] += weigh(&w, area);
                }
                weights
            })
        };
        let mut weights: [Vec<f64>; N] = std::array::from_fn(|_| vec![0.0; bins.count()]);
        for task in self.pass(count_task) {
            for (sum, own) in weights.iter_mut().zip(task) {
                sum.iter_mut().zip(own).for_each(|(a, b)| *a += b);
            }
        }
        let sought: [Sought; N] = std::array::from_fn(|k| Sought::new(&weights[k], wanted[k].shares));
        let gather = |task: &[Run<'_>]| {
            std::array::from_fn::<Vec<(f64, f64)>, N, _>(|k| {
                let w = &wanted[k];
                Distances::each(task)
                    .map(|(x, area)| (w.key.of(x), weigh(w, area)))
                    .filter(|(key, weight)| sought[k].in_bin[bins.of(*key)] && *weight > 0.0)
                    .collect()
            })
        };
        let mut found: [Vec<(f64, f64)>; N] = std::array::from_fn(|_| Vec::new());
        for task in self.pass(gather) {
            for (all, own) in found.iter_mut().zip(task) {
                all.extend(own);
            }
        }
        let mut results = sought.iter().zip(found).map(|(sought, mut found)| {
            // Equal keys by their weights, so that the order in which they were found plays no role.
            found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
            sought.among(&found, &bins)
        });
        std::array::from_fn(|_| results.next().unwrap_or_default())
    }
}

impl Tally {
    fn none() -> Tally {
        Tally {
            weight: [0.0; 2],
            sums: [[0.0; 2]; 2],
            ends: [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2], [f64::INFINITY; 2]],
            histogram: vec![[0.0; 2]; BINS],
            conforming: [[0.0; 2]; 3],
        }
    }

    #[inline]
    fn reach(&mut self, value: f64, has_area: bool) {
        for k in usize::from(!has_area)..2 {
            self.ends[0][k] = self.ends[0][k].min(value);
            self.ends[1][k] = self.ends[1][k].max(value);
            self.ends[2][k] = self.ends[2][k].min(value.abs());
        }
    }

    fn with(mut self, other: Tally) -> Tally {
        self.weight = add(self.weight, other.weight);
        for k in 0..2 {
            self.sums[k] = add(self.sums[k], other.sums[k]);
            self.ends[0][k] = self.ends[0][k].min(other.ends[0][k]);
            self.ends[1][k] = self.ends[1][k].max(other.ends[1][k]);
            self.ends[2][k] = self.ends[2][k].min(other.ends[2][k]);
        }
        for (own, other) in self.histogram.iter_mut().zip(other.histogram) {
            *own = add(*own, other);
        }
        for (own, other) in self.conforming.iter_mut().zip(other.conforming) {
            *own = add(*own, other);
        }
        self
    }
}

fn add(a: Both, b: Both) -> Both {
    [a[0] + b[0], a[1] + b[1]]
}

/// Bins of keys on a scale that is logarithmic on both sides of zero: a key's sign, exponent and first digits.
struct Bins {
    /// Magnitudes whose bits are below this share a bin.
    least: u32,
    /// How many of a magnitude's bits do not count.
    shift: u32,
    /// Bins of one sign.
    half: usize,
}

/// Powers of two below the reach that are told apart, and above it.
const BELOW: i32 = 16;
const ABOVE: u32 = 2;

impl Bins {
    /// For `count` values of magnitudes up to `reach` and keys up to four times that.
    fn up_to(reach: f64, count: usize) -> Bins {
        // Single precision has 23 digits behind the first: seven of them, or for few values three.
        let shift = if count > TASK / 4 { 16 } else { 20 };
        let least = ((reach as f32) * 2f32.powi(-BELOW)).max(f32::MIN_POSITIVE).to_bits() >> shift << shift;
        let half = ((BELOW as usize + ABOVE as usize) << (23 - shift)) + 1;
        Bins { least, shift, half }
    }

    fn count(&self) -> usize {
        2 * self.half
    }

    /// Larger keys are in the same or in later bins.
    #[inline]
    fn of(&self, key: f64) -> usize {
        let key = key as f32;
        let place = (key.abs().to_bits().saturating_sub(self.least) >> self.shift) as usize;
        let place = place.min(self.half - 1);
        if key < 0.0 { self.half - 1 - place } else { self.half + place }
    }
}

/// Where quantiles are to be looked for.
struct Sought {
    /// Of each quantile the weight below it, and the first of its bins; the last but one has the quantile, and the others its neighbours.
    goals: Vec<(f64, usize)>,
    /// The weight before each bin.
    before: Vec<f64>,
    /// Which bins are needed.
    in_bin: Vec<bool>,
}

impl Sought {
    fn new(weights: &[f64], shares: &[f64]) -> Sought {
        let mut total = 0.0;
        let before: Vec<f64> = weights
            .iter()
            .map(|w| {
                total += w;
                total - w
            })
            .collect();
        let occupied: Vec<usize> = (0..weights.len()).filter(|b| weights[*b] > 0.0).collect();
        let mut in_bin = vec![false; weights.len()];
        let goals = shares.iter().map(|share| {
            let goal = share * total;
            let here = occupied.partition_point(|b| before[*b] + weights[*b] < goal);
            let first = here.saturating_sub(1).min(occupied.len().saturating_sub(1));
            occupied[first..(here + 2).min(occupied.len())].iter().for_each(|b| in_bin[*b] = true);
            (goal, occupied.get(first).copied().unwrap_or(0))
        });
        let goals = goals.collect();
        Sought { goals, before, in_bin }
    }

    /// The quantiles, from the values of the needed bins in their order.
    fn among(&self, found: &[(f64, f64)], bins: &Bins) -> Vec<f64> {
        let quantile = |&(goal, first): &(f64, usize)| {
            let start = found.partition_point(|(key, _)| bins.of(*key) < first);
            let mut before = self.before.get(first).copied().unwrap_or(0.0);
            let mut last: Option<(f64, f64)> = None;
            for &(key, weight) in &found[start..] {
                let place = before + 0.5 * weight;
                if place >= goal {
                    return match last {
                        Some((least, from)) if place > from => {
                            least + (key - least) * ((goal - from) / (place - from)).clamp(0.0, 1.0)
                        }
                        _ => key,
                    };
                }
                (last, before) = (Some((key, place)), before + weight);
            }
            last.map_or(f64::NAN, |l| l.0)
        };
        self.goals.iter().map(quantile).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{Bins, Distances, Key, TASK, Values, Wanted};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The definition, written down plainly: keys sorted, each at the middle of its weight.
    fn plainly(mut keys: Vec<(f64, f64)>, share: f64) -> f64 {
        keys.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let goal = share * keys.iter().map(|k| k.1).sum::<f64>();
        let mut before = 0.0;
        let mut last: Option<(f64, f64)> = None;
        for (key, weight) in keys {
            let place = before + 0.5 * weight;
            if place >= goal {
                return last.map_or(key, |(least, from)| least + (key - least) * (goal - from) / (place - from));
            }
            (last, before) = (Some((key, place)), before + weight);
        }
        last.map_or(f64::NAN, |l| l.0)
    }

    const SHARES: [f64; 7] = [0.0, 0.01, 0.25, 0.5, 0.77, 0.99, 1.0];

    fn quantiles(values: &Values, key: Key, weighting: usize) -> Vec<f64> {
        let [found] = Distances::of([values].into_iter()).quantiles(2.0, [Wanted { key, weighting, shares: &SHARES }]);
        found
    }

    #[test]
    fn equal_weights_give_hazens_quantiles() {
        let values = Values { signed: vec![4.0, 1.0, 8.0, 2.0], areas: vec![3.0; 4] };
        // Positions 1/8, 3/8, 5/8, 7/8.
        for weighting in [0, 1] {
            let shares = [0.0, 0.125, 0.25, 0.5, 0.75, 1.0];
            let wanted = Wanted { key: Key::Signed, weighting, shares: &shares };
            let [found] = Distances::of([&values].into_iter()).quantiles(8.0, [wanted]);
            assert_eq!(found, [1.0, 1.0, 1.5, 3.0, 6.0, 8.0]);
        }
        assert!(quantiles(&Values::default(), Key::Signed, 1)[3].is_nan());
        let one = Values { signed: vec![7.0], areas: vec![0.1] };
        assert_eq!(quantiles(&one, Key::Signed, 0), [7.0; 7]);
        let none = Values { signed: vec![7.0], areas: vec![0.0] };
        assert!(quantiles(&none, Key::Signed, 0)[3].is_nan() && quantiles(&none, Key::Signed, 1)[3] == 7.0);
    }

    /// All orders of the values against sorting: few distinct values, so that many keys are equal, and many; few values and more than a
    /// task; in one part and in several.
    #[test]
    fn every_order_agrees_with_sorting() {
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        for round in 0..44 {
            let grid = if round % 2 == 0 { 4.0 } else { 1e6 };
            let count = if round < 40 { rng.random_range(1..400) } else { TASK + rng.random_range(0..TASK) };
            let signed: Vec<f32> = (0..count).map(|_| (rng.random_range(-1.0..1.2f32) * grid).round() / grid).collect();
            let areas: Vec<f32> = (0..count).map(|_| rng.random_range(1..5) as f32).collect();
            let cut = rng.random_range(0..=count);
            let halves = [
                Values { signed: signed[..cut].to_vec(), areas: areas[..cut].to_vec() },
                Values { signed: signed[cut..].to_vec(), areas: areas[cut..].to_vec() },
            ];
            let distances = Distances::of(halves.iter());
            for key in [Key::Signed, Key::Unsigned, Key::From(0.25), Key::From(-2.0), Key::UnsignedFrom(0.3)] {
                let wanted = |weighting| Wanted { key, weighting, shares: &SHARES };
                let found = distances.quantiles(1.2, [wanted(0), wanted(1)]);
                for (weighting, found) in found.iter().enumerate() {
                    let weight = |a: &f32| if weighting == 0 { f64::from(*a) } else { 1.0 };
                    let keys: Vec<(f64, f64)> =
                        signed.iter().zip(&areas).map(|(x, a)| (key.of(*x), weight(a))).collect();
                    for (share, value) in SHARES.iter().zip(found) {
                        let expected = plainly(keys.clone(), *share);
                        // Whole weights: sums are exact.
                        assert!((value - expected).abs() < 1e-12, "{key:?} {share}: {value}, not {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn bins_ascend_with_the_keys() {
        for count in [10, 1_000_000] {
            let bins = Bins::up_to(3.0, count);
            let keys: Vec<f64> = (-4000..4000).map(|i| f64::from(i).powi(3) * 2e-10).collect();
            assert!(keys.is_sorted_by_key(|k| bins.of(*k)));
            assert!([-1e30, -0.0, 0.0, 1e-30, 12.0, 1e30].iter().all(|k| bins.of(*k) < bins.count()));
            // Keys up to four times the reach are told apart.
            assert!(bins.of(11.9) < bins.count() - 1 && bins.of(11.9) > bins.of(6.0));
        }
    }
}
