//! What follows from the deviations of all footprints of a part.

use super::extreme::{Extreme, greatest};
use super::rule::{DecisionRule, Estimate, Outcome, probability};
use crate::variance::Tolerance;

/// The outcome, and the place that it is due to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decided {
    pub(super) outcome: Outcome,
    /// The worst place: of a part that does not conform the one that is beyond with the least doubt, otherwise the one
    /// that may be beyond the most. Signed.
    pub(super) worst: Extreme,
    /// Its limit: 0 the lower, 1 the upper.
    pub(super) side: usize,
    /// The least and the greatest probability of conformance.
    pub(super) probabilities: [f64; 2],
}

impl Decided {
    /// From the deviations of the footprints with their noise and their uncertainties; none without footprints.
    pub(super) fn new(
        rule: DecisionRule,
        limits: Tolerance,
        values: &[f64],
        noise: &[f64],
        sd: &[f64],
    ) -> Option<Self> {
        let mirrored: Vec<f64> = values.iter().map(|x| -x).collect();
        // The lowest place and the highest one, with so many of their uncertainties beyond what was measured.
        let extremes = |guard: f64| {
            let below = greatest(&mirrored, noise, sd, guard)?;
            let above = greatest(values, noise, sd, guard)?;
            Some([Extreme { value: -below.value, again: -below.again, ..below }, above])
        };
        let measured = |extremes: [Extreme; 2]| extremes.map(|e| Estimate { value: e.value, sd: sd[e.place] });
        let (doubtful, certain) = (extremes(rule.guard())?, extremes(-rule.guard())?);
        let again = certain.map(|e| Estimate { value: e.again, sd: sd[e.place] });
        let least = [doubtful, certain].map(|extremes| probability(limits, measured(extremes)));
        let probabilities = [least[0].min(least[1]), probability(limits, again)];
        let outcome = rule.decide(limits, measured(doubtful), again, probabilities);
        let worst = if outcome == Outcome::DoesNotConform { certain } else { doubtful };
        let side = nearer_side(limits, measured(worst));
        Some(Self { outcome, worst: worst[side], side, probabilities })
    }
}

/// The side (0 below, 1 above) whose worst place keeps within its limit by less: by the probability of conformance, and
/// where that is the same by the margin.
fn nearer_side(limits: Tolerance, [low, high]: [Estimate; 2]) -> usize {
    let [below, above] = [low, high].map(|estimate| probability(limits, [estimate; 2]));
    let is_closer = limits.upper - high.value < low.value - limits.lower;
    usize::from(above < below || above == below && is_closer)
}
