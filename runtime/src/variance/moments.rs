//! What a set of weighted values is like: means, spreads, percentiles.

use super::values::{Distances, Key, Tally, Wanted};
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

/// The shares of [`Percentiles`].
const SHARES: [f64; 7] = [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99];

impl Moments {
    /// By area, and with every distance counted alike.
    pub(super) fn of(distances: &Distances, tally: &Tally) -> [Self; 2] {
        let mean = |k: usize| [0, 1].map(|w| tally.sums[k][w] / tally.weight[w]);
        let (signed_mean, mean) = (mean(0), mean(1));
        let squares = distances.squares(signed_mean, mean);
        let sd = |k: usize| [0, 1].map(|w| (squares[k][w] / tally.weight[w]).sqrt());
        let (signed_sd, sd) = (sd(0), sd(1));
        let reach = tally.ends[0][1].abs().max(tally.ends[1][1].abs());
        let of = |key, weighting| Wanted { key, weighting, shares: &SHARES };
        let percentiles = distances
            .quantiles(reach, [of(Key::Signed, 0), of(Key::Signed, 1), of(Key::Unsigned, 0), of(Key::Unsigned, 1)]);
        let [signed, alike_signed, unsigned, alike] = percentiles.map(|p| Percentiles::of(&p));
        let middle = |key, weighting| Wanted { key, weighting, shares: &[0.5] };
        let mads = distances.quantiles(
            reach,
            [
                middle(Key::From(signed.p50), 0),
                middle(Key::From(alike_signed.p50), 1),
                middle(Key::UnsignedFrom(unsigned.p50), 0),
                middle(Key::UnsignedFrom(alike.p50), 1),
            ],
        );
        let mads = mads.map(|m| m[0]);
        let percentiles = [(unsigned, signed), (alike, alike_signed)];
        [0, 1].map(|w| {
            let end = |k: usize| if tally.ends[k][w].is_finite() { tally.ends[k][w] } else { f64::NAN };
            let (percentiles, signed) = percentiles[w];
            Self {
                mean: mean[w],
                max: end(0).abs().max(end(1).abs()),
                sd: sd[w],
                min: end(2),
                rms: mean[w].hypot(sd[w]),
                median: percentiles.p50,
                mad: mads[2 + w],
                percentiles,
                signed: SignedMoments {
                    mean: signed_mean[w],
                    sd: signed_sd[w],
                    min: end(0),
                    max: end(1),
                    median: signed.p50,
                    mad: mads[w],
                    percentiles: signed,
                },
            }
        })
    }
}

impl Percentiles {
    fn of(found: &[f64]) -> Self {
        let at = |k: usize| found.get(k).copied().unwrap_or(f64::NAN);
        Self { p1: at(0), p5: at(1), p25: at(2), p50: at(3), p75: at(4), p95: at(5), p99: at(6) }
    }
}

/// NaN is `null` in JSON.
fn null_as_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}
