//! What a set of weighted values is like: means, spreads, percentiles.

use super::ordered::{Ordered, View};
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

impl Moments {
    /// Of signed distances.
    pub(super) fn of(distances: &Ordered) -> Self {
        let total = distances.total();
        let [sum, unsigned_sum] = distances.sums(|x| [x, x.abs()]);
        let (mean, signed_mean) = (unsigned_sum / total, sum / total);
        let [squares, unsigned_squares] = distances.sums(|x| [(x - signed_mean).powi(2), (x.abs() - mean).powi(2)]);
        let sd = (unsigned_squares / total).sqrt();
        let signed = SignedMoments::of(distances, signed_mean, (squares / total).sqrt());
        let percentiles = Percentiles::of(&distances.around(0.0));
        let values = distances.values();
        let place = values.partition_point(|&x| x < 0.0);
        let beside = [place.checked_sub(1), Some(place)].into_iter().flatten().filter_map(|i| values.get(i));
        Self {
            mean,
            max: signed.min.abs().max(signed.max.abs()),
            sd,
            min: beside.map(|&x| f64::from(x.abs())).reduce(f64::min).unwrap_or(f64::NAN),
            rms: mean.hypot(sd),
            median: percentiles.p50,
            mad: distances.around_both(percentiles.p50).quantiles([0.5])[0],
            percentiles,
            signed,
        }
    }
}

impl SignedMoments {
    fn of(distances: &Ordered, mean: f64, sd: f64) -> Self {
        let percentiles = Percentiles::of(&distances.plain());
        let end = |x: Option<&f32>| x.map_or(f64::NAN, |&x| f64::from(x));
        Self {
            mean,
            sd,
            min: end(distances.values().first()),
            max: end(distances.values().last()),
            median: percentiles.p50,
            mad: distances.around(percentiles.p50).quantiles([0.5])[0],
            percentiles,
        }
    }
}

impl Percentiles {
    fn of<K: Fn(f64) -> f64>(view: &View<K>) -> Self {
        let [p1, p5, p25, p50, p75, p95, p99] = view.quantiles([0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99]);
        Self { p1, p5, p25, p50, p75, p95, p99 }
    }
}

/// NaN is `null` in JSON.
fn null_as_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}
