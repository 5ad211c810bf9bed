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
        let unsigned = differences(ascending, 0.0);
        let (mean, sd) = mean_and_sd(&unsigned);
        let (signed_mean, signed_sd) = mean_and_sd(ascending);
        let (percentiles, signed_percentiles) = (Percentiles::of(&unsigned), Percentiles::of(ascending));
        let ends = |values: &[Weighted]| {
            let weighty = || values.iter().filter(|(_, w)| *w > 0.0).map(|(x, _)| *x);
            (weighty().next().unwrap_or(f64::NAN), weighty().next_back().unwrap_or(f64::NAN))
        };
        let (min, max) = ends(&unsigned);
        let (signed_min, signed_max) = ends(ascending);
        Self {
            mean,
            max,
            sd,
            min,
            rms: mean.hypot(sd),
            median: percentiles.p50,
            mad: quantiles(&differences(&unsigned, percentiles.p50), [0.5])[0],
            percentiles,
            signed: SignedMoments {
                mean: signed_mean,
                sd: signed_sd,
                min: signed_min,
                max: signed_max,
                median: signed_percentiles.p50,
                mad: quantiles(&differences(ascending, signed_percentiles.p50), [0.5])[0],
                percentiles: signed_percentiles,
            },
        }
    }
}

impl Percentiles {
    fn of(ascending: &[Weighted]) -> Self {
        let [p1, p5, p25, p50, p75, p95, p99] = quantiles(ascending, [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99]);
        Self { p1, p5, p25, p50, p75, p95, p99 }
    }
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

fn mean_and_sd(values: &[Weighted]) -> (f64, f64) {
    let weight = sum(values.iter().map(|(_, w)| *w));
    let mean = sum(values.iter().map(|(x, w)| x * w)) / weight;
    let variance = sum(values.iter().map(|(x, w)| (x - mean) * (x - mean) * w)) / weight;
    (mean, variance.sqrt())
}

/// |x - center| of all values, ascending: the values below the centre, backwards, merged with those above.
fn differences(ascending: &[Weighted], center: f64) -> Vec<Weighted> {
    let (below, above) = ascending.split_at(ascending.partition_point(|(x, _)| *x < center));
    let mut below = below.iter().rev().map(|(x, w)| (center - x, *w)).peekable();
    let mut above = above.iter().map(|(x, w)| (x - center, *w)).peekable();
    let mut merged = Vec::with_capacity(ascending.len());
    loop {
        let next = match (below.peek(), above.peek()) {
            (Some(b), Some(a)) if b.0 < a.0 => below.next(),
            (Some(_), None) => below.next(),
            _ => above.next(),
        };
        let Some(next) = next else { return merged };
        merged.push(next);
    }
}

/// The values at the given shares (ascending) of the weight, as `Percentiles` says.
fn quantiles<const N: usize>(ascending: &[Weighted], shares: [f64; N]) -> [f64; N] {
    let mut out = [f64::NAN; N];
    let weight = sum(ascending.iter().map(|(_, w)| *w));
    if weight <= 0.0 {
        return out;
    }
    let (mut next, mut before) = (0, Sum::default());
    let mut last: Option<(f64, f64)> = None;
    for &(x, w) in ascending.iter().filter(|(_, w)| *w > 0.0) {
        let place = (before.total() + 0.5 * w) / weight;
        before.add(w);
        while next < N && shares[next] <= place {
            out[next] = match last {
                Some((x0, place0)) if place > place0 => x0 + (x - x0) * (shares[next] - place0) / (place - place0),
                _ => x,
            };
            next += 1;
        }
        last = Some((x, place));
    }
    out[next..].fill(last.map_or(f64::NAN, |(x, _)| x));
    out
}

/// NaN is `null` in JSON.
fn null_as_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

#[cfg(test)]
mod tests {
    use super::{differences, quantiles, sum};

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
        assert_eq!(differences(&values, 37.0).iter().map(|d| d.0).collect::<Vec<_>>(), expected);
    }

    #[test]
    fn sums_keep_what_rounding_drops() {
        assert_eq!(sum([1e16, 1.0, -1e16, 1.0].into_iter()), 2.0);
    }
}
