//! Correlations of quantities over a population.

use super::capability::COVERAGE;
use crate::spread::mean_and_sd;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal};

/// Pearson's coefficient needs one value more than its interval has degrees.
const LEAST: usize = 4;

/// The correlation of two quantities.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Correlation {
    /// The names of the two.
    pub names: [String; 2],
    /// Pearson's coefficient.
    pub r: f64,
    /// Its confidence limits at 95 %, by Fisher's transformation.
    pub interval: [f64; 2],
    /// The number of objects that have both.
    pub count: usize,
    /// The mean correlation of the errors of the two in one scan: measurement alone makes values correlate so, as far
    /// as they vary by measurement. None where it is not known.
    pub of_errors: Option<f64>,
    /// The coefficient without what measurement adds, by the covariances of the fits; none where too little is left.
    pub between: Option<f64>,
}

impl Correlation {
    /// The correlation of pairs; none of fewer than four, or where one of the two does not vary.
    #[must_use]
    pub fn of(names: [&str; 2], pairs: &[(f64, f64)]) -> Option<Self> {
        let (a, b): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
        let ((mean_a, sd_a), (mean_b, sd_b)) = (mean_and_sd(&a), mean_and_sd(&b));
        if pairs.len() < LEAST || !(sd_a > 0.0 && sd_b > 0.0) {
            return None;
        }
        let sum: f64 = pairs.iter().map(|(a, b)| (a - mean_a) * (b - mean_b)).sum();
        let r = (sum / ((pairs.len() - 1) as f64 * sd_a * sd_b)).clamp(-1.0, 1.0);
        let z = Normal::standard().inverse_cdf(0.5 + COVERAGE / 2.0) / ((pairs.len() - 3) as f64).sqrt();
        // The transformation of 1 itself is infinite.
        let middle = r.clamp(-1.0 + f64::EPSILON, 1.0 - f64::EPSILON).atanh();
        let interval = [(middle - z).tanh(), (middle + z).tanh()];
        let names = names.map(str::to_owned);
        Some(Self { names, r, interval, count: pairs.len(), of_errors: None, between: None })
    }

    /// Whether the interval leaves zero out.
    #[must_use]
    pub fn is_clear(&self) -> bool {
        self.interval[0] > 0.0 || self.interval[1] < 0.0
    }
}
