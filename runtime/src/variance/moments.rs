//! What a set of weighted values is like: means, spreads, percentiles.

use super::values::Summary;
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    /// By area, and with every distance counted alike.
    pub(super) fn of(found: &Summary) -> [Self; 2] {
        [0, 1].map(|w| {
            let of = |k: usize| Percentiles::of(&found.quantiles[k][w]);
            let (signed, percentiles) = (of(0), of(1));
            let [low, high, least] = found.ends.map(|end| end[w]);
            let [signed_mean, mean] = found.means.map(|mean| mean[w]);
            let [signed_sd, sd] = found.variances.map(|variance| variance[w].sqrt());
            let [signed_mad, mad] = found.mads.map(|mad| mad[w]);
            Self {
                mean,
                max: low.abs().max(high.abs()),
                sd,
                min: least,
                rms: mean.hypot(sd),
                median: percentiles.p50,
                mad,
                percentiles,
                signed: SignedMoments {
                    mean: signed_mean,
                    sd: signed_sd,
                    min: low,
                    max: high,
                    median: signed.p50,
                    mad: signed_mad,
                    percentiles: signed,
                },
            }
        })
    }
}

impl Percentiles {
    /// Of the quantiles at [`SHARES`](super::values::SHARES).
    fn of(found: &[f64]) -> Self {
        let at = |k: usize| found.get(k).copied().unwrap_or(f64::NAN);
        Self { p1: at(0), p5: at(1), p25: at(2), p50: at(3), p75: at(4), p95: at(5), p99: at(6) }
    }
}

/// NaN is `null` in JSON.
pub(super) fn null_as_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}
