//! What a set of weighted values is like: means, spreads, percentiles.

use serde::{Deserialize, Deserializer, Serialize};

/// Statistics of distances in millimetres, unsigned and signed. All are NaN (`null` in JSON) where nothing was
/// measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moments {
    /// Mean of the unsigned distances ([VA] sect. 6).
    #[serde(deserialize_with = "null_as_nan")]
    pub mean: f64,
    /// Largest unsigned distance ([VA] sect. 6).
    #[serde(deserialize_with = "null_as_nan")]
    pub max: f64,
    /// Standard deviation of the unsigned distances, of the population, not of a sample ([VA] sect. 6).
    #[serde(deserialize_with = "null_as_nan")]
    pub sd: f64,
    /// Smallest unsigned distance.
    #[serde(deserialize_with = "null_as_nan")]
    pub min: f64,
    /// Root of the mean square; the sign plays no role.
    #[serde(deserialize_with = "null_as_nan")]
    pub rms: f64,
    /// Median of the unsigned distances.
    #[serde(deserialize_with = "null_as_nan")]
    pub median: f64,
    /// Median of the unsigned distances' absolute differences from their median (not scaled).
    #[serde(deserialize_with = "null_as_nan")]
    pub mad: f64,
    /// Of the unsigned distances.
    pub percentiles: Percentiles,
    /// The same with signs: positive where the scan lies outside the model.
    pub signed: SignedMoments,
}

/// Statistics of signed distances in millimetres, positive where the scan lies outside the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SignedMoments {
    /// Mean.
    #[serde(deserialize_with = "null_as_nan")]
    pub mean: f64,
    /// Standard deviation of the population.
    #[serde(deserialize_with = "null_as_nan")]
    pub sd: f64,
    /// Smallest.
    #[serde(deserialize_with = "null_as_nan")]
    pub min: f64,
    /// Largest.
    #[serde(deserialize_with = "null_as_nan")]
    pub max: f64,
    /// Median.
    #[serde(deserialize_with = "null_as_nan")]
    pub median: f64,
    /// Median of the absolute differences from the median (not scaled).
    #[serde(deserialize_with = "null_as_nan")]
    pub mad: f64,
    /// Percentiles.
    pub percentiles: Percentiles,
}

/// Values below which 1, 5, ... 99 per cent of the weight lie. Between values linear in cumulative weight, each value
/// standing at the middle of its own weight (Hazen's rule where all weigh alike); millimetres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Percentiles {
    /// 1 per cent.
    #[serde(deserialize_with = "null_as_nan")]
    pub p1: f64,
    /// 5 per cent.
    #[serde(deserialize_with = "null_as_nan")]
    pub p5: f64,
    /// 25 per cent.
    #[serde(deserialize_with = "null_as_nan")]
    pub p25: f64,
    /// 50 per cent: the median.
    #[serde(deserialize_with = "null_as_nan")]
    pub p50: f64,
    /// 75 per cent.
    #[serde(deserialize_with = "null_as_nan")]
    pub p75: f64,
    /// 95 per cent.
    #[serde(deserialize_with = "null_as_nan")]
    pub p95: f64,
    /// 99 per cent.
    #[serde(deserialize_with = "null_as_nan")]
    pub p99: f64,
}

/// A value and its weight.
pub(super) type Weighted = (f64, f64);

impl Moments {
    /// Of signed distances in ascending order, without NaN, with weights that are finite and not negative.
    pub(super) fn of(ascending: &[Weighted]) -> Self {
        let weight = sum(ascending.iter().map(|(_, w)| *w));
        let unsigned = || differences(ascending, 0.0).filter(weighty);
        let (mean, sd) = mean_and_sd(weight, || ascending.iter().map(|(x, w)| (x.abs(), *w)));
        let percentiles = Percentiles::of(unsigned(), weight);
        let signed = SignedMoments::of(ascending, weight);
        Self {
            mean,
            max: signed.min.abs().max(signed.max.abs()),
            sd,
            min: unsigned().next().map_or(f64::NAN, |(x, _)| x),
            rms: mean.hypot(sd),
            median: percentiles.p50,
            mad: median_of_unsigned_differences(ascending, percentiles.p50, weight),
            percentiles,
            signed,
        }
    }
}

impl SignedMoments {
    fn of(ascending: &[Weighted], weight: f64) -> Self {
        let values = || ascending.iter().copied().filter(weighty);
        let (mean, sd) = mean_and_sd(weight, values);
        let percentiles = Percentiles::of(values(), weight);
        Self {
            mean,
            sd,
            min: values().next().map_or(f64::NAN, |(x, _)| x),
            max: values().next_back().map_or(f64::NAN, |(x, _)| x),
            median: percentiles.p50,
            mad: quantiles(differences(ascending, percentiles.p50).filter(weighty), weight, [0.5])[0],
            percentiles,
        }
    }
}

impl Percentiles {
    fn of(ascending: impl Iterator<Item = Weighted>, weight: f64) -> Self {
        let [p1, p5, p25, p50, p75, p95, p99] = quantiles(ascending, weight, [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99]);
        Self { p1, p5, p25, p50, p75, p95, p99 }
    }
}

fn weighty((_, w): &Weighted) -> bool {
    *w > 0.0
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

fn mean_and_sd<I: Iterator<Item = Weighted>>(weight: f64, values: impl Fn() -> I) -> (f64, f64) {
    let mean = sum(values().map(|(x, w)| x * w)) / weight;
    let variance = sum(values().map(|(x, w)| (x - mean) * (x - mean) * w)) / weight;
    (mean, variance.sqrt())
}

/// |x - center| of all values, ascending: the values below the centre, backwards, merged with those above.
fn differences(ascending: &[Weighted], center: f64) -> impl Iterator<Item = Weighted> {
    let (below, above) = ascending.split_at(ascending.partition_point(|(x, _)| *x < center));
    merge(below.iter().rev().map(move |(x, w)| (center - x, *w)), above.iter().map(move |(x, w)| (x - center, *w)))
}

/// The median of | |x| - center |, for a centre that is not negative; NaN for NaN.
fn median_of_unsigned_differences(ascending: &[Weighted], center: f64, weight: f64) -> f64 {
    if center.is_nan() {
        return f64::NAN;
    }
    let at = |x: f64| ascending.partition_point(|(y, _)| *y < x);
    let (low, zero, high) = (at(-center), at(0.0), at(center));
    // Each of the four stretches is monotonous; from the centre outwards they ascend.
    let map = move |(x, w): &Weighted| ((x.abs() - center).abs(), *w);
    let beyond = merge(ascending[..low].iter().rev().map(map), ascending[high..].iter().map(map));
    let within = merge(ascending[low..zero].iter().map(map), ascending[zero..high].iter().rev().map(map));
    quantiles(merge(beyond, within).filter(weighty), weight, [0.5])[0]
}

/// Two ascending sequences as one.
fn merge(a: impl Iterator<Item = Weighted>, b: impl Iterator<Item = Weighted>) -> impl Iterator<Item = Weighted> {
    let (mut a, mut b) = (a.peekable(), b.peekable());
    std::iter::from_fn(move || match (a.peek(), b.peek()) {
        (Some(x), Some(y)) if x.0 <= y.0 => a.next(),
        (_, Some(_)) => b.next(),
        (_, None) => a.next(),
    })
}

/// The values at the given shares (ascending) of the weight, as `Percentiles` says; `ascending` without values of no
/// weight.
fn quantiles<const N: usize>(ascending: impl Iterator<Item = Weighted>, weight: f64, shares: [f64; N]) -> [f64; N] {
    let mut out = [f64::NAN; N];
    let (mut next, mut before) = (0, 0.0);
    let (mut last, mut last_place) = (f64::NAN, f64::NEG_INFINITY);
    for (x, w) in ascending {
        let place = (before + 0.5 * w) / weight;
        before += w;
        while shares[next] <= place {
            let share = (shares[next] - last_place) / (place - last_place);
            out[next] = if last.is_nan() || place <= last_place { x } else { last + (x - last) * share };
            next += 1;
            if next == N {
                return out;
            }
        }
        (last, last_place) = (x, place);
    }
    out[next..].fill(last);
    out
}

/// NaN is `null` in JSON.
fn null_as_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

#[cfg(test)]
mod tests {
    use super::{Weighted, differences, median_of_unsigned_differences, sum};

    fn quantiles<const N: usize>(values: &[Weighted], shares: [f64; N]) -> [f64; N] {
        super::quantiles(values.iter().copied().filter(super::weighty), sum(values.iter().map(|(_, w)| *w)), shares)
    }

    #[test]
    fn equal_weights_give_hazens_quantiles() {
        let values: Vec<(f64, f64)> = [1.0, 2.0, 4.0, 8.0].map(|x| (x, 3.0)).to_vec();
        // Positions 1/8, 3/8, 5/8, 7/8.
        assert_eq!(quantiles(&values, [0.0, 0.125, 0.25, 0.5, 0.75, 1.0]), [1.0, 1.0, 1.5, 3.0, 6.0, 8.0]);
        assert!(quantiles(&[], [0.5])[0].is_nan());
        assert!(quantiles(&[(1.0, 0.0)], [0.5])[0].is_nan());
        assert_eq!(quantiles(&[(7.0, 0.1)], [0.01, 0.5, 0.99]), [7.0; 3]);
    }

    #[test]
    fn a_weight_counts_like_repetition() {
        let weighted: Vec<(f64, f64)> = (0..1000).map(|i| (f64::from(i), f64::from(i % 7))).collect();
        let repeated: Vec<(f64, f64)> = (0..1000).flat_map(|i| vec![(f64::from(i), 1.0); i as usize % 7]).collect();
        for (a, b) in quantiles(&weighted, [0.1, 0.3, 0.9]).iter().zip(quantiles(&repeated, [0.1, 0.3, 0.9])) {
            assert!((a - b).abs() < 1.5);
        }
    }

    #[test]
    fn differences_are_sorted() {
        let values: Vec<(f64, f64)> = (-50..50).map(|i| (f64::from(i).powi(3), f64::from(i))).collect();
        let mut expected: Vec<f64> = values.iter().map(|(x, _)| (x - 37.0).abs()).collect();
        expected.sort_by(f64::total_cmp);
        assert_eq!(differences(&values, 37.0).map(|d| d.0).collect::<Vec<_>>(), expected);
        for center in [0.0, 5.0, 64.0, 1e6] {
            let mut distances: Vec<Weighted> = values.iter().map(|(x, _)| ((x.abs() - center).abs(), 1.0)).collect();
            distances.sort_by(|a, b| a.0.total_cmp(&b.0));
            let alike: Vec<Weighted> = values.iter().map(|(x, _)| (*x, 1.0)).collect();
            assert_eq!(median_of_unsigned_differences(&alike, center, 100.0), quantiles(&distances, [0.5])[0]);
        }
    }

    #[test]
    fn sums_keep_what_rounding_drops() {
        assert_eq!(sum([1e16, 1.0, -1e16, 1.0].into_iter()), 2.0);
    }
}
