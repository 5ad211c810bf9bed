//! Whether values may come from a normal distribution.

use crate::spread::mean_and_sd;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal};

/// The least number of values for the test.
const LEAST: usize = 8;

/// The test of Anderson and Darling for a normal distribution of unknown mean and variance, with the approximations of
/// D'Agostino and Stephens, *Goodness-of-Fit Techniques*, 1986, table 4.9.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Normality {
    /// The statistic, corrected for the number of values.
    pub statistic: f64,
    /// The probability of such a statistic, or a larger one, of normal values.
    pub p: f64,
}

impl Normality {
    /// Tests values; none of fewer than eight, or of values that are all equal.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        let (mean, sd) = mean_and_sd(values);
        if values.len() < LEAST || !(sd > 0.0) {
            return None;
        }
        let normal = Normal::standard();
        let mut sorted: Vec<f64> = values.iter().map(|v| (v - mean) / sd).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let n = sorted.len();
        let term = |i: usize| {
            // Tails by symmetry, so that none of them is rounded to 1.
            let (low, high) = (normal.cdf(sorted[i]), normal.cdf(-sorted[n - 1 - i]));
            (2 * i + 1) as f64 * (low.max(f64::MIN_POSITIVE).ln() + high.max(f64::MIN_POSITIVE).ln())
        };
        let count = n as f64;
        let square = -count - (0..n).map(term).sum::<f64>() / count;
        let a = square * (1.0 + 0.75 / count + 2.25 / (count * count));
        let p = match a {
            a if a < 0.2 => 1.0 - (-13.436 + 101.14 * a - 223.73 * a * a).exp(),
            a if a < 0.34 => 1.0 - (-8.318 + 42.796 * a - 59.938 * a * a).exp(),
            a if a < 0.6 => (0.9177 - 4.279 * a - 1.38 * a * a).exp(),
            a => (1.2937 - 5.709 * a + 0.0186 * a * a).exp(),
        };
        // The last approximation turns upwards far out.
        Some(Self { statistic: a, p: if a > 13.0 { 0.0 } else { p.clamp(0.0, 1.0) } })
    }
}
