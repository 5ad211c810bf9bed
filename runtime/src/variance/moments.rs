//! Means, spreads and percentiles of weighted distances.

use serde::{Deserialize, Deserializer, Serialize};

/// Statistics of distances in millimetres, unsigned and signed. All are NaN (`null` in JSON) if nothing was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moments {
    /// Mean of the unsigned distances (\[VA\] sect. 6).
    #[serde(deserialize_with = "null_as_nan")]
    pub mean: f64,
    /// Largest unsigned distance (\[VA\] sect. 6).
    #[serde(deserialize_with = "null_as_nan")]
    pub max: f64,
    /// Standard deviation of the unsigned distances, of the population, not of a sample (\[VA\] sect. 6).
    #[serde(deserialize_with = "null_as_nan")]
    pub sd: f64,
    /// Smallest unsigned distance.
    #[serde(deserialize_with = "null_as_nan")]
    pub min: f64,
    /// Root mean square.
    #[serde(deserialize_with = "null_as_nan")]
    pub rms: f64,
    /// Median of the unsigned distances.
    #[serde(deserialize_with = "null_as_nan")]
    pub median: f64,
    /// Median of the unsigned distances' absolute differences from their median (not scaled).
    #[serde(deserialize_with = "null_as_nan")]
    pub mad: f64,
    /// Percentiles of the unsigned distances.
    pub percentiles: Percentiles,
    /// The same of the signed distances.
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

/// Values below which 1, 5, ... 99 per cent of the weight lie, in millimetres. Linear in cumulative weight between
/// values, each of which stands at the middle of its own weight (Hazen's rule for equal weights).
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

/// NaN is `null` in JSON.
pub(crate) fn null_as_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}
