//! Sorted values with weights: sums and quantiles without sorting again.

use rayon::prelude::*;
use std::ops::Range;

/// Values a task; fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 1 << 16;

/// Values that are added plainly before the rounding errors are carried along.
const BLOCK: usize = 64;

/// Finite values in ascending order, each with a weight.
pub(super) struct Ordered<'a> {
    values: &'a [f32],
    /// None where all weigh one.
    weights: Option<&'a [f32]>,
    /// The weight of the first i values, for every i up to their number; none where all weigh one.
    before: Option<Vec<f64>>,
}

/// A run of values over which a key rises or falls.
struct Piece {
    range: Range<usize>,
    falls: bool,
}

/// The order in which quantiles see the values: ascending by a key.
pub(super) struct View<'o, 'a, K> {
    ordered: &'o Ordered<'a>,
    key: K,
    pieces: Vec<Piece>,
}

impl<'a> Ordered<'a> {
    /// Every value counts alike.
    pub(super) fn alike(values: &'a [f32]) -> Self {
        Self { values, weights: None, before: None }
    }

    /// Weights are positive, and as many as values.
    pub(super) fn weighted(values: &'a [f32], weights: &'a [f32]) -> Self {
        let mut total = Sum::default();
        let mut before = Vec::with_capacity(values.len() + 1);
        before.push(0.0);
        before.extend(weights.iter().map(|&w| {
            total.add(f64::from(w));
            total.total()
        }));
        Self { values, weights: Some(weights), before: Some(before) }
    }

    /// The values.
    pub(super) fn values(&self) -> &[f32] {
        self.values
    }

    /// The weight of the first `count` values.
    pub(super) fn before(&self, count: usize) -> f64 {
        self.before.as_ref().map_or(count as f64, |before| before[count])
    }

    /// The weight of all.
    pub(super) fn total(&self) -> f64 {
        self.before(self.values.len())
    }

    /// Sums of several functions of a value, each times its weight.
    pub(super) fn sums<const N: usize>(&self, f: impl Fn(f64) -> [f64; N] + Sync) -> [f64; N] {
        let of_range = |range: Range<usize>| {
            let mut sums = [Sum::default(); N];
            for block in range.clone().step_by(BLOCK) {
                let mut plain = [0.0; N];
                for i in block..range.end.min(block + BLOCK) {
                    let weight = self.weights.map_or(1.0, |w| f64::from(w[i]));
                    for (sum, x) in plain.iter_mut().zip(f(f64::from(self.values[i]))) {
                        *sum += weight * x;
                    }
                }
                for (sum, x) in sums.iter_mut().zip(plain) {
                    sum.add(x);
                }
            }
            sums.map(Sum::total)
        };
        let chunks = self.values.len().div_ceil(CHUNK);
        let parts: Vec<[f64; N]> =
            (0..chunks).into_par_iter().map(|c| of_range(c * CHUNK..self.values.len().min((c + 1) * CHUNK))).collect();
        std::array::from_fn(|k| sum(parts.iter().map(|part| part[k])))
    }

    /// The values as they are.
    pub(super) fn plain(&self) -> View<'_, 'a, impl Fn(f64) -> f64> {
        View { ordered: self, key: |x| x, pieces: vec![Piece { range: 0..self.values.len(), falls: false }] }
    }

    /// By |x - center|.
    pub(super) fn around(&self, center: f64) -> View<'_, 'a, impl Fn(f64) -> f64> {
        self.view(move |x| (x - center).abs(), &[center])
    }

    /// By | |x| - center |, for a centre that is not negative.
    pub(super) fn around_both(&self, center: f64) -> View<'_, 'a, impl Fn(f64) -> f64> {
        self.view(move |x| (x.abs() - center).abs(), &[-center, 0.0, center])
    }

    /// By a key that falls up to the first of the turns, rises up to the second, and so on.
    fn view<K: Fn(f64) -> f64>(&self, key: K, turns: &[f64]) -> View<'_, 'a, K> {
        let mut pieces = Vec::with_capacity(turns.len() + 1);
        let mut start = 0;
        for i in 0..=turns.len() {
            let end = turns.get(i).map_or(self.values.len(), |&t| self.values.partition_point(|&x| f64::from(x) < t));
            pieces.push(Piece { range: start..end.max(start), falls: i % 2 == 0 });
            start = end.max(start);
        }
        View { ordered: self, key, pieces }
    }
}

impl<K: Fn(f64) -> f64> View<'_, '_, K> {
    /// Keys below which the given shares of the weight lie: linear in cumulative weight between keys, each of which stands at
    /// the middle of its own weight (Hazen's rule where all weigh alike). NaN where there are no values.
    pub(super) fn quantiles<const N: usize>(&self, shares: [f64; N]) -> [f64; N] {
        shares.map(|share| self.quantile(share))
    }

    /// One of [`quantiles`](Self::quantiles).
    fn quantile(&self, share: f64) -> f64 {
        let goal = share * self.ordered.total();
        // The least key below and at which there is the weight wanted: by bisection over all keys there are.
        let (mut low, mut high) = (order_of(f64::NEG_INFINITY), order_of(f64::INFINITY));
        while low + 1 < high {
            let middle = low + (high - low) / 2;
            if self.weight_below(from_order(middle)) < goal { low = middle } else { high = middle }
        }
        let start = from_order(low);
        let mut taken: Vec<usize> = self.pieces.iter().map(|piece| self.count_below(piece, start)).collect();
        let mut before = self.weight_below(start);
        // The greatest key before, at the middle of its weight; the last piece has it of several.
        let last = self.pieces.iter().zip(&taken).filter(|(_, count)| **count > 0).map(|(piece, &count)| {
            let i = piece.at(count - 1);
            (self.key_of(i), self.weight_of(i))
        });
        let mut last = last.reduce(|a, b| if b.0 >= a.0 { b } else { a }).map(|(key, w)| (key, before - 0.5 * w));
        loop {
            let mut next: Option<(usize, usize, f64)> = None;
            for (p, piece) in self.pieces.iter().enumerate().filter(|(p, piece)| taken[*p] < piece.range.len()) {
                let i = piece.at(taken[p]);
                let key = self.key_of(i);
                if next.is_none_or(|n| key < n.2) {
                    next = Some((p, i, key));
                }
            }
            let Some((p, i, key)) = next else { return last.map_or(f64::NAN, |l| l.0) };
            let weight = self.weight_of(i);
            let place = before + 0.5 * weight;
            if place >= goal {
                return match last {
                    Some((least, from)) if place > from => {
                        least + (key - least) * ((goal - from) / (place - from)).clamp(0.0, 1.0)
                    }
                    _ => key,
                };
            }
            last = Some((key, place));
            before += weight;
            taken[p] += 1;
        }
    }

    fn key_of(&self, i: usize) -> f64 {
        (self.key)(f64::from(self.ordered.values[i]))
    }

    fn weight_of(&self, i: usize) -> f64 {
        self.ordered.weights.map_or(1.0, |w| f64::from(w[i]))
    }

    /// How many keys of a piece are less than `limit`.
    fn count_below(&self, piece: &Piece, limit: f64) -> usize {
        let values = &self.ordered.values[piece.range.clone()];
        let is_below = |x: f32| (self.key)(f64::from(x)) < limit;
        if piece.falls {
            values.len() - values.partition_point(|&x| !is_below(x))
        } else {
            values.partition_point(|&x| is_below(x))
        }
    }

    fn weight_below(&self, limit: f64) -> f64 {
        let weight = |piece: &Piece| {
            let count = self.count_below(piece, limit);
            let Range { start, end } = piece.range;
            let (from, to) = if piece.falls { (end - count, end) } else { (start, start + count) };
            self.ordered.before(to) - self.ordered.before(from)
        };
        self.pieces.iter().map(weight).sum()
    }
}

impl Piece {
    /// The place of the value whose key is the n-th.
    fn at(&self, n: usize) -> usize {
        if self.falls { self.range.end - 1 - n } else { self.range.start + n }
    }
}

/// A number as an integer of the same order; NaN is not asked for.
fn order_of(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits >> 63 == 0 { bits | 1 << 63 } else { !bits }
}

fn from_order(order: u64) -> f64 {
    f64::from_bits(if order >> 63 == 1 { order & !(1 << 63) } else { !order })
}

/// Sum that carries the rounding errors along (Neumaier 1974).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    sum: f64,
    lost: f64,
}

impl Sum {
    pub(super) fn add(&mut self, x: f64) {
        let sum = self.sum + x;
        self.lost += if self.sum.abs() >= x.abs() { (self.sum - sum) + x } else { (x - sum) + self.sum };
        self.sum = sum;
    }

    pub(super) fn total(self) -> f64 {
        self.sum + self.lost
    }
}

/// The sum of all.
pub(super) fn sum(values: impl Iterator<Item = f64>) -> f64 {
    let mut sum = Sum::default();
    values.for_each(|x| sum.add(x));
    sum.total()
}

#[cfg(test)]
mod tests {
    use super::{Ordered, from_order, order_of, sum};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The definition, written down plainly: keys sorted, each at the middle of its weight.
    fn plainly(mut keys: Vec<(f64, f64)>, share: f64) -> f64 {
        keys.sort_by(|a, b| a.0.total_cmp(&b.0));
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

    #[test]
    fn equal_weights_give_hazens_quantiles() {
        let values = [1.0, 2.0, 4.0, 8.0];
        // Positions 1/8, 3/8, 5/8, 7/8.
        let expected = [1.0, 1.0, 1.5, 3.0, 6.0, 8.0];
        for ordered in [Ordered::alike(&values), Ordered::weighted(&values, &[3.0; 4])] {
            assert_eq!(ordered.plain().quantiles([0.0, 0.125, 0.25, 0.5, 0.75, 1.0]), expected);
        }
        assert!(Ordered::alike(&[]).plain().quantiles([0.5])[0].is_nan());
        assert_eq!(Ordered::weighted(&[7.0], &[0.1]).plain().quantiles([0.01, 0.5, 0.99]), [7.0; 3]);
    }

    /// All orders of the values against sorting; few distinct values, so that many keys are equal, and many.
    #[test]
    fn every_order_agrees_with_sorting() {
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        for round in 0..60 {
            let grid = if round % 2 == 0 { 4.0 } else { 1e6 };
            let count = rng.random_range(1..400);
            let mut values: Vec<f32> =
                (0..count).map(|_| (rng.random_range(-1.0..1.2f32) * grid).round() / grid).collect();
            values.sort_by(f32::total_cmp);
            let weights: Vec<f32> = (0..count).map(|_| rng.random_range(1..5) as f32).collect();
            let ordered = Ordered::weighted(&values, &weights);
            let with = |key: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
                values.iter().zip(&weights).map(|(&x, &w)| (key(f64::from(x)), f64::from(w))).collect()
            };
            for share in [0.0, 0.01, 0.25, 0.5, 0.77, 0.99, 1.0] {
                // Which of equal keys comes last decides how wide the step to the next one is.
                let close =
                    |a: f64, b: f64| assert!((a - b).abs() <= if grid > 10.0 { 1e-12 } else { 0.25 }, "{a} {b}");
                close(ordered.plain().quantiles([share])[0], plainly(with(&|x| x), share));
                for center in [0.0, 0.25, 0.3, 2.0] {
                    close(ordered.around(center).quantiles([share])[0], plainly(with(&|x| (x - center).abs()), share));
                    let both = ordered.around_both(center).quantiles([share])[0];
                    close(both, plainly(with(&|x| (x.abs() - center).abs()), share));
                }
            }
        }
    }

    #[test]
    fn sums_are_weighted_and_do_not_lose_small_terms() {
        let values: Vec<f32> = (0..100_000).map(|i| i as f32).collect();
        let weights: Vec<f32> = (0..100_000).map(|i| (i % 3) as f32 + 1.0).collect();
        let [ones, squares] = Ordered::weighted(&values, &weights).sums(|x| [1.0, x * x]);
        let expected: f64 = (0..100_000u64).map(|i| (i * i * (i % 3 + 1)) as f64).sum();
        assert_eq!(ones, 199_999.0);
        assert!((squares / expected - 1.0).abs() < 1e-14);
        assert_eq!(sum([1e16, 1.0, -1e16, 1.0].into_iter()), 2.0);
    }

    #[test]
    fn orders_are_those_of_the_numbers() {
        let numbers = [f64::NEG_INFINITY, -2.0, -1e-300, 0.0, 1e-300, 1.0, f64::INFINITY];
        assert!(numbers.is_sorted_by_key(|&x| order_of(x)));
        assert!(numbers.iter().all(|&x| from_order(order_of(x)) == x));
    }
}
