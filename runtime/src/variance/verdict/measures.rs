//! Verdicts on measures: dimensions that the script computes of fitted parameters.

use super::rule::{Estimate, Outcome, probability};
use super::{OverallVerdict, VarianceReport, VerdictOptions};
use crate::variance::Tolerance;
use crate::variance::moments::null_as_nan;
use serde::{Deserialize, Serialize};

/// Relative slack of limits for the rounding of differences.
const ROUNDING: f64 = 1e-12;

/// A dimension of the fitted model that has a tolerance.
#[derive(Clone, Debug, PartialEq)]
pub struct Dimension {
    /// Its name.
    pub name: String,
    /// The unit of all figures: `mm`, `rad`, a power of `mm`, or empty.
    pub unit: String,
    /// Its value.
    pub value: f64,
    /// Standard deviation of the value by the fit, or the reason why it tells nothing.
    pub sd: Result<f64, String>,
    /// The nominal value.
    pub nominal: f64,
    /// The deviations from the nominal value that are allowed, in `unit`.
    pub tolerance: Tolerance,
}

/// Whether a dimension conforms to its tolerance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DimensionVerdict {
    /// Its name.
    pub name: String,
    /// The verdict.
    pub outcome: Outcome,
    /// The unit of all figures but the probability: `mm`, `rad`, a power of `mm`, or empty.
    pub unit: String,
    /// Its value. NaN where it cannot be computed.
    #[serde(deserialize_with = "null_as_nan")]
    pub value: f64,
    /// The nominal value. NaN where it cannot be computed.
    #[serde(deserialize_with = "null_as_nan")]
    pub nominal: f64,
    /// The value less the nominal one.
    #[serde(deserialize_with = "null_as_nan")]
    pub deviation: f64,
    /// The deviations that are allowed.
    #[serde(flatten)]
    pub tolerance: Tolerance,
    /// Standard uncertainty of the value: the root of the sum of the squares of the next two. NaN where there is none.
    #[serde(deserialize_with = "null_as_nan")]
    pub uncertainty: f64,
    /// The part of the fit.
    #[serde(deserialize_with = "null_as_nan")]
    pub fit: f64,
    /// The part of the scanner, as stated; 0 but for lengths.
    pub device: f64,
    /// The probability of conformance. NaN where there is no uncertainty.
    #[serde(deserialize_with = "null_as_nan")]
    pub probability: f64,
    /// Why the fit does not tell, beyond `deviation` and `uncertainty`. Sentences without a full stop.
    pub reasons: Vec<String>,
}

impl DimensionVerdict {
    fn new(dimension: &Dimension, options: VerdictOptions) -> Self {
        let Dimension { name, unit, value, sd, nominal, tolerance } = dimension.clone();
        let device = if unit == "mm" { options.device_uncertainty } else { 0.0 };
        let deviation = value - nominal;
        let fit = sd.as_ref().copied().unwrap_or(f64::NAN);
        let uncertainty = fit.hypot(device);
        let slack = ROUNDING * value.abs().max(nominal.abs());
        let limits = Tolerance { lower: tolerance.lower - slack, upper: tolerance.upper + slack };
        // One place, so that what a second measurement would show of it is what this one has.
        let both = [Estimate { value: deviation, sd: uncertainty }; 2];
        let undetermined = match sd {
            _ if nominal.is_nan() => Some("its nominal value cannot be computed".to_owned()),
            Err(reason) => Some(reason),
            Ok(0.0) => Some("it depends on nothing that was fitted".to_owned()),
            Ok(_) => None,
        };
        let (outcome, probability) = match undetermined {
            Some(_) => (Outcome::Undecided, f64::NAN),
            None => {
                let probability = probability(limits, both);
                (options.rule.decide(limits, both, both, [probability; 2]), probability)
            }
        };
        let reasons = undetermined.into_iter().collect();
        Self {
            name,
            outcome,
            unit,
            value,
            nominal,
            deviation,
            tolerance,
            uncertainty,
            fit,
            device,
            probability,
            reasons,
        }
    }

    /// Makes the verdict undecided, for a reason.
    pub(super) fn doubt(&mut self, reason: String) {
        self.outcome = Outcome::Undecided;
        if !self.reasons.contains(&reason) {
            self.reasons.push(reason);
        }
    }

    /// A figure of it as people write it, and its unit: angles in degrees.
    #[must_use]
    pub fn written(&self, figure: f64) -> (f64, &str) {
        if self.unit == "rad" { (figure.to_degrees(), "deg") } else { (figure, &self.unit) }
    }
}

impl VarianceReport {
    /// Adds verdicts on dimensions, which count as those on parts do.
    pub fn judge(&mut self, dimensions: &[Dimension], options: VerdictOptions) {
        self.measures = dimensions.iter().map(|d| DimensionVerdict::new(d, options)).collect();
        let parts = self.parts.iter().filter_map(|p| Some(p.verdict.as_ref()?.outcome));
        let Some(outcome) = Outcome::together(parts.chain(self.measures.iter().map(|m| m.outcome))) else { return };
        let VerdictOptions { rule, min_coverage, device_uncertainty, .. } = options;
        self.verdict = Some(OverallVerdict { outcome, decision: rule.name(), min_coverage, device_uncertainty });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::variance::DecisionRule;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    fn dimension(deviation: f64, sd: Result<f64, String>) -> Dimension {
        let tolerance = Tolerance { lower: -0.1, upper: 0.2 };
        Dimension { name: "d".into(), unit: "mm".into(), value: 80.0 + deviation, sd, nominal: 80.0, tolerance }
    }

    fn verdict(deviation: f64, sd: f64, options: VerdictOptions) -> DimensionVerdict {
        DimensionVerdict::new(&dimension(deviation, Ok(sd)), options)
    }

    /// The limits lie where the guard bands of ISO 14253-1 end, and the probability is the share of draws of the truth.
    #[test]
    fn dimensions_are_judged_as_single_places() {
        let guarded = VerdictOptions::default();
        for (deviation, expected) in [
            (0.0, Outcome::Conforms),
            (0.2 - 1.66 * 0.01, Outcome::Conforms),
            (0.2 - 1.64 * 0.01, Outcome::Undecided),
            (0.2 + 1.66 * 0.01, Outcome::DoesNotConform),
            (-0.1 - 1.64 * 0.01, Outcome::Undecided),
            (-0.1 - 1.66 * 0.01, Outcome::DoesNotConform),
        ] {
            assert_eq!(verdict(deviation, 0.01, guarded).outcome, expected, "{deviation}");
        }
        let simple = VerdictOptions { rule: DecisionRule::Simple, ..guarded };
        assert_eq!(
            [0.2, 0.201].map(|d| verdict(d, 0.05, simple).outcome),
            [Outcome::Conforms, Outcome::DoesNotConform]
        );
        let mut random = ChaCha8Rng::seed_from_u64(4);
        for (deviation, sd) in [(0.15, 0.05), (0.05, 0.2), (-0.12, 0.03)] {
            let truth = Normal::new(deviation, sd).unwrap();
            let draws = 200_000;
            let inside = (0..draws).filter(|_| (-0.1..=0.2).contains(&truth.sample(&mut random))).count();
            let share = inside as f64 / f64::from(draws);
            let found = verdict(deviation, sd, guarded).probability;
            assert!((found - share).abs() < 0.005, "{deviation} {sd}: {found}, not {share}");
        }
    }

    #[test]
    fn the_scanner_adds_to_lengths_alone() {
        let options = VerdictOptions { device_uncertainty: 0.04, ..VerdictOptions::default() };
        let length = verdict(0.0, 0.03, options);
        assert!((length.uncertainty - 0.05).abs() < 1e-15 && length.device == 0.04);
        let angle = Dimension { unit: "rad".into(), ..dimension(0.0, Ok(0.03)) };
        assert_eq!(DimensionVerdict::new(&angle, options).uncertainty, 0.03);
    }

    /// What was not fitted was not measured, whatever the rule.
    #[test]
    fn what_has_no_deviation_is_undecided() {
        for rule in [DecisionRule::Guarded, DecisionRule::Simple, DecisionRule::Probability(0.9)] {
            let options = VerdictOptions { rule, ..VerdictOptions::default() };
            assert_eq!(verdict(0.0, 0.0, options).outcome, Outcome::Undecided);
            let open = DimensionVerdict::new(&dimension(0.0, Err("r: at its bound".to_owned())), options);
            assert_eq!(open.outcome, Outcome::Undecided);
            assert_eq!(open.reasons, ["r: at its bound"]);
            assert!(open.uncertainty.is_nan() && open.probability.is_nan());
        }
    }
}
