//! The optimum over a sample of the points, with which other shapes are compared.

use super::{Rival, RivalOf, largest};
use crate::fit::infer::sandwich::Uncertainty;
use crate::fit::optimise::gauss_newton::{self, Minimum, Stop};
use crate::fit::problem::level::Level;
use crate::fit::problem::objective::Objective;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::points::Points;
use crate::fit::refine::schedule::Solution;
use crate::fit::register::group::Group;
use crate::fit::tuning::{
    RIVAL_CLEARLY_WORSE, RIVAL_DEVIATIONS, RIVAL_EVIDENCE, RIVAL_ITERATIONS, RIVAL_SAME, RIVAL_STEP, RIVAL_WORSE,
};

/// The optimum over a sample of the points, next to the solution: other shapes are optima over the same points.
pub(super) struct Base<'s> {
    pub(super) solution: &'s Solution<'s>,
    pub(super) uncertainty: &'s Uncertainty,
    pub(super) sample: &'s Points,
    pub(super) estimate: Estimate,
    /// The parameters, the losses of the sample's points and their mean.
    pub(super) x: Vec<f64>,
    losses: Vec<f64>,
    pub(super) mean: f64,
}

impl<'s> Base<'s> {
    /// None where the model does not exist or the fit is cancelled.
    pub(super) fn new(solution: &'s Solution<'s>, uncertainty: &'s Uncertainty, sample: &'s Points) -> Option<Self> {
        let from = solution.estimate.clone();
        let Minimum { estimate, evaluation, .. } = optimum(solution, &solution.level, sample, from, |_| false)?;
        let mean = evaluation.value;
        let losses = losses(solution, &solution.level, sample, &estimate)?;
        let x = solution.level.space.x(&estimate.z)?;
        Some(Self { solution, uncertainty, sample, estimate, x, losses, mean })
    }

    pub(super) fn level(&self) -> &'s Level<'s> {
        &self.solution.level
    }

    /// The largest difference of two shapes in a parameter of a group, in standard deviations.
    pub(super) fn apart(&self, group: &Group, a: &[f64], b: &[f64]) -> f64 {
        let space = &self.level().space;
        let [a, b] = [a, b].map(|x| space.estimate(x, self.estimate.motion));
        largest(self.uncertainty, &group.members, &space.step(&a, &b))
    }

    /// A shape as a rival of the solution over all of the sample, after some steps of all parameters on a level that is
    /// right about it. None where it explains the scan worse or turns out to be the same.
    pub(super) fn rival(&self, level: &Level, of: RivalOf, from: Estimate) -> Option<Rival> {
        let Shape { estimate: there, step, evidence, certainty } = self.shape(level, from, |_| false)?;
        let worse = evidence > RIVAL_EVIDENCE && certainty > RIVAL_WORSE;
        // Two shapes that differ only in parameters that the scan does not determine are one, unless the scan prefers
        // the other.
        let better = of.is_preferred(evidence, certainty);
        let distinct = better || largest(self.uncertainty, &of.members, &step) > RIVAL_DEVIATIONS;
        let space = &self.level().space;
        let mut padded = step.clone();
        padded.resize(space.dim(), 0.0);
        // The sample's own error is that of both optima.
        let shifted = space.retract(&self.solution.estimate, &padded);
        let estimate = if of.turned { Estimate { motion: there.motion, ..shifted } } else { shifted };
        if !distinct || worse {
            return None;
        }
        // A shape that the scan prefers is no other name of the solution, although it may be the solution with other
        // values of parameters that the scan leaves open there.
        let same = if better { None } else { self.relabelled(level, &there) };
        if let Some(estimate) = same {
            let nearer = self.distance_to_start(&estimate) < self.distance_to_start(&self.estimate);
            return nearer.then_some(Rival {
                estimate,
                step,
                of,
                evidence,
                certainty,
                relabelled: true,
                contradicted: 0.0,
            });
        }
        Some(Rival { estimate, step, of, evidence, certainty, relabelled: false, contradicted: 0.0 })
    }

    /// Where a shape comes to by this sample. None where it clearly is no rival: the same shape as the base's, or one
    /// that explains the scan worse by more than the sample's chance.
    pub(super) fn survivor(&self, level: &Level, members: &[usize], from: Estimate) -> Option<Estimate> {
        let is_same = |at: &Estimate| {
            let step = self.level().space.step(&self.estimate, at);
            largest(self.uncertainty, members, &step) <= RIVAL_SAME
        };
        // A shape that starts at the base, by the parameters that the scan determines there, remains only if the scan
        // prefers it in the end.
        let begins_same = is_same(&from);
        // The loss from which on a shape is worse, and the losses on the way.
        let worse = self.mean * (RIVAL_EVIDENCE / self.uncertainty.effective_points).exp();
        let mut way = Vec::new();
        let is_decided = |at: &Minimum| {
            way.push(at.evaluation.value);
            !begins_same && is_same(&at.estimate) || is_hopeless(&way, worse)
        };
        let Shape { estimate, evidence, certainty, .. } = self.shape(level, from, is_decided)?;
        let worse = evidence > RIVAL_EVIDENCE && certainty > RIVAL_CLEARLY_WORSE;
        let remains = if begins_same { evidence < -RIVAL_EVIDENCE } else { !worse && !is_same(&estimate) };
        remains.then_some(estimate)
    }

    /// The optimum next to an estimate, or where the way to it `is_decided`, compared with the base.
    fn shape(&self, level: &Level, from: Estimate, is_decided: impl FnMut(&Minimum) -> bool) -> Option<Shape> {
        let Minimum { estimate, .. } = optimum(self.solution, level, self.sample, from, is_decided)?;
        let there = losses(self.solution, level, self.sample, &estimate)?;
        let (mut before, mut after, mut squares) = (0.0, 0.0, 0.0);
        for (i, (present, there)) in self.losses.iter().zip(there).enumerate() {
            let prior = self.sample.prior(i);
            before += prior * present;
            after += prior * there;
            squares += (prior * (there - present)).powi(2);
        }
        Some(Shape {
            step: self.level().space.step(&self.estimate, &estimate),
            estimate,
            evidence: self.uncertainty.effective_points * (after / before.max(f64::MIN_POSITIVE)).ln(),
            certainty: (after - before) / squares.sqrt().max(f64::MIN_POSITIVE),
        })
    }
}

/// The optimum of all parameters over some points, or where the way to it `is_decided`. None where the model does not
/// exist or the fit is cancelled.
fn optimum(
    solution: &Solution,
    level: &Level,
    points: &Points,
    from: Estimate,
    is_decided: impl FnMut(&Minimum) -> bool,
) -> Option<Minimum> {
    let objective = Objective { cancellable: true, ..solution.objective_on(level, points) };
    let stop = Stop { iterations: RIVAL_ITERATIONS, step: RIVAL_STEP * solution.loss.sigma };
    gauss_newton::minimise_until(&objective, from, stop, is_decided)
}

/// Whether the losses on a way fall so slowly that `aim` is out of reach: they would have to fall by more than twice of
/// what they did over the last steps.
fn is_hopeless(way: &[f64], aim: f64) -> bool {
    match way {
        [.., before, _, _, last] => last - aim > 2.0 * (before - last),
        _ => false,
    }
}

fn losses(solution: &Solution, level: &Level, points: &Points, at: &Estimate) -> Option<Vec<f64>> {
    let objective = solution.objective_on(level, points);
    let placed = objective.place(at).ok()?;
    Some(objective.losses(&placed))
}

/// Another optimum over the base's points. See `Rival` for what the numbers say.
struct Shape {
    estimate: Estimate,
    /// The scaled step of the free parameters from the base to here.
    step: Vec<f64>,
    evidence: f64,
    certainty: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_hopeless_that_falls_too_slowly() {
        // Ways of a fit of the cup's handle: one that arrives, one that creeps, and one that has hardly begun.
        let arrives = [24.6, 14.7, 12.2, 10.1, 0.1];
        assert!((0..=arrives.len()).all(|n| !is_hopeless(&arrives[..n], 0.0)));
        let creeps = [133.2, 132.2, 131.8, 130.2];
        assert!(is_hopeless(&creeps, 10.0) && !is_hopeless(&creeps, 125.0) && !is_hopeless(&creeps[1..], 10.0));
    }
}
