//! Decision rules: what follows from a value, its uncertainty and the limits of a tolerance.

use crate::variance::Tolerance;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_1_SQRT_2;

/// Width of the guard bands of [`DecisionRule::Guarded`] in standard uncertainties: one-sided 95 % of the normal
/// distribution, rounded as in ISO 14253-1:2017.
const GUARD: f64 = 1.65;

/// How it is decided whether a part conforms to its tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum DecisionRule {
    /// A value must keep away from each limit by 1.65 standard uncertainties, on either side: ISO 14253-1.
    #[default]
    Guarded,
    /// The value alone decides, whatever its uncertainty.
    Simple,
    /// The probability of conformance (JCGM 106) must be at least this to conform, and that of the opposite not to.
    Probability(f64),
}

impl DecisionRule {
    /// The name in variance.json: `guarded`, `simple`, `p=0.95`.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Guarded => "guarded".to_owned(),
            Self::Simple => "simple".to_owned(),
            Self::Probability(p) => format!("p={p}"),
        }
    }

    /// Width of the guard bands by which the worst places are selected, in standard uncertainties.
    pub(super) fn guard(self) -> f64 {
        if self == Self::Simple { 0.0 } else { GUARD }
    }

    /// What follows from the deviations of the worst places below and above: as those were measured that are the most
    /// doubtful, and as those would be measured again that are beyond with the least doubt.
    /// `probabilities` are the least and the greatest probability of conformance by these.
    pub(super) fn decide(
        self,
        tolerance: Tolerance,
        measured: [Estimate; 2],
        again: [Estimate; 2],
        probabilities: [f64; 2],
    ) -> Outcome {
        let conforms = match self {
            Self::Guarded => margins(tolerance, measured).iter().zip(measured).all(|(m, e)| *m >= GUARD * e.sd),
            Self::Simple => margins(tolerance, measured).iter().all(|m| *m >= 0.0),
            Self::Probability(p) => probabilities[0] >= p,
        };
        let fails = match self {
            Self::Guarded => margins(tolerance, again).iter().zip(again).any(|(m, e)| *m < -GUARD * e.sd),
            Self::Simple => !conforms,
            Self::Probability(p) => probabilities[1] <= 1.0 - p,
        };
        match (conforms, fails) {
            (true, _) => Outcome::Conforms,
            (false, true) => Outcome::DoesNotConform,
            (false, false) => Outcome::Undecided,
        }
    }
}

/// What is decided of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Outcome {
    /// It conforms to its tolerance.
    #[serde(rename = "conforms")]
    Conforms,
    /// It does not.
    #[serde(rename = "does not conform")]
    DoesNotConform,
    /// The measurement does not tell.
    #[serde(rename = "undecided")]
    Undecided,
}

impl Outcome {
    /// In words, as in variance.json.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::Conforms => "conforms",
            Self::DoesNotConform => "does not conform",
            Self::Undecided => "undecided",
        }
    }

    /// Of several parts together: one that does not conform outweighs those that are undecided.
    #[must_use]
    pub fn together(outcomes: impl Iterator<Item = Self>) -> Option<Self> {
        let rank = |outcome: &Self| match outcome {
            Self::Conforms => 0,
            Self::Undecided => 1,
            Self::DoesNotConform => 2,
        };
        outcomes.max_by_key(rank)
    }
}

/// A deviation and its standard uncertainty. Millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    pub(super) value: f64,
    pub(super) sd: f64,
}

/// By how far the deviations of the lowest and of the highest place keep within the lower and the upper limit.
fn margins(tolerance: Tolerance, [low, high]: [Estimate; 2]) -> [f64; 2] {
    [low.value - tolerance.lower, tolerance.upper - high.value]
}

/// The least probability that the lowest and the highest place both are within the tolerance, however their errors
/// depend on each other. If they are one place, it is that place's probability of conformance (JCGM 106, 7.2).
pub(super) fn probability(tolerance: Tolerance, extremes: [Estimate; 2]) -> f64 {
    let [below, above] = margins(tolerance, extremes);
    let [low, high] = extremes;
    (standard_normal(below, low.sd) + standard_normal(above, high.sd) - 1.0).max(0.0)
}

/// The probability that a normal variable with this standard deviation, and a mean of 0, is at most `x`.
fn standard_normal(x: f64, sd: f64) -> f64 {
    if sd > 0.0 { 0.5 * libm::erfc(-FRAC_1_SQRT_2 * x / sd) } else { f64::from(x >= 0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    const TOLERANCE: Tolerance = Tolerance { lower: -0.1, upper: 0.3 };

    fn at(value: f64, sd: f64) -> [Estimate; 2] {
        [Estimate { value, sd }; 2]
    }

    fn decide(rule: DecisionRule, measured: [Estimate; 2], again: [Estimate; 2]) -> Outcome {
        rule.decide(TOLERANCE, measured, again, [measured, again].map(|extremes| probability(TOLERANCE, extremes)))
    }

    /// Tables of the normal distribution, and what has no spread.
    #[test]
    fn probabilities_are_those_of_tables() {
        for (x, table) in [(0.0, 0.5), (1.0, 0.841_345), (1.645, 0.950_015), (-1.96, 0.024_998), (3.0, 0.998_650)] {
            assert!((standard_normal(2.0 * x, 2.0) - table).abs() < 1e-6, "{x}");
        }
        assert_eq!([-1e-9, 0.0, 1e-9].map(|x| standard_normal(x, 0.0)), [0.0, 1.0, 1.0]);
    }

    /// The share of draws of the true deviation, given its estimate, that is within both limits.
    #[test]
    fn probability_of_conformance_is_the_share_of_draws() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for (value, sd) in [(0.1, 0.05), (0.28, 0.05), (0.3, 0.1), (0.35, 0.04), (0.0, 0.4), (-0.12, 0.02)] {
            let truth = Normal::new(value, sd).unwrap();
            let draws = 200_000;
            let inside = (0..draws).filter(|_| (-0.1..=0.3).contains(&truth.sample(&mut random))).count();
            let share = inside as f64 / f64::from(draws);
            let found = probability(TOLERANCE, at(value, sd));
            assert!((found - share).abs() < 0.005, "{value} {sd}: {found}, not {share}");
        }
    }

    /// ISO 14253-1: beside a limit the acceptance zone ends where the probability of conformance is 95 %.
    #[test]
    fn guard_bands_are_those_of_iso_14253() {
        let sd = 0.02;
        let by = |rule: DecisionRule, value: f64| decide(rule, at(value, sd), at(value, sd));
        for (value, expected) in [
            (0.1, Outcome::Conforms),
            (0.3 - 1.66 * sd, Outcome::Conforms),
            (0.3 - 1.64 * sd, Outcome::Undecided),
            (0.3 + 1.64 * sd, Outcome::Undecided),
            (0.3 + 1.66 * sd, Outcome::DoesNotConform),
            (-0.1 + 1.66 * sd, Outcome::Conforms),
            (-0.1 - 1.64 * sd, Outcome::Undecided),
            (-0.1 - 1.66 * sd, Outcome::DoesNotConform),
        ] {
            assert_eq!(by(DecisionRule::Guarded, value), expected, "{value}");
            // One limit is far away: the rule by the probability is the same.
            assert_eq!(by(DecisionRule::Probability(0.95), value), expected, "{value}");
            let simple = by(DecisionRule::Simple, value);
            let within = (-0.1..=0.3).contains(&value);
            assert_eq!(simple, if within { Outcome::Conforms } else { Outcome::DoesNotConform }, "{value}");
        }
        // Between limits that are two uncertainties away on both sides are 95.45 %, at 1.67 of them 90.4 %.
        let middle = |sd: f64| decide(DecisionRule::Probability(0.95), at(0.1, sd), at(0.1, sd));
        assert_eq!([0.1, 0.12].map(middle), [Outcome::Conforms, Outcome::Undecided]);
    }

    /// Noise makes the worst of many places look worse than it is: it is no part's failing, and no reason to pass it.
    #[test]
    fn what_noise_may_have_made_decides_nothing() {
        let (measured, again) = (at(0.36, 0.02), at(0.25, 0.02));
        assert_eq!(decide(DecisionRule::Guarded, measured, again), Outcome::Undecided);
        assert_eq!(decide(DecisionRule::Probability(0.9), measured, again), Outcome::Undecided);
        assert_eq!(decide(DecisionRule::Simple, measured, again), Outcome::DoesNotConform);
        assert_eq!(decide(DecisionRule::Guarded, measured, measured), Outcome::DoesNotConform);
    }

    #[test]
    fn the_worst_outcome_is_that_of_all() {
        use Outcome::{Conforms, DoesNotConform, Undecided};
        let together = |outcomes: &[Outcome]| Outcome::together(outcomes.iter().copied());
        assert_eq!(together(&[]), None);
        assert_eq!(together(&[Conforms, Conforms]), Some(Conforms));
        assert_eq!(together(&[Conforms, Undecided]), Some(Undecided));
        assert_eq!(together(&[DoesNotConform, Undecided, Conforms]), Some(DoesNotConform));
    }
}
