//! The optimum over a sample of the points, with which other shapes are compared.

use super::{Rival, largest};
use crate::fit::infer::sandwich::Uncertainty;
use crate::fit::optimise::gauss_newton::{self, Stop};
use crate::fit::problem::level::Level;
use crate::fit::problem::objective::Objective;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::points::Points;
use crate::fit::refine::schedule::Solution;
use crate::fit::register::group::Group;
use crate::fit::tuning::{RIVAL_DEVIATIONS, RIVAL_EVIDENCE, RIVAL_ITERATIONS, RIVAL_STEP, RIVAL_WORSE};

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
        let (estimate, mean) = optimum(solution, sample, solution.estimate.clone())?;
        let losses = losses(solution, sample, &estimate)?;
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

    /// The shape `x` as a rival of the solution over all of the sample, after some steps of all parameters. None where
    /// it explains the scan worse or turns out to be the same.
    pub(super) fn rival(&self, group: &Group, x: &[f64]) -> Option<Rival> {
        let Level { space, .. } = self.level();
        let from = space.estimate(x, self.estimate.motion);
        let (estimate, _) = optimum(self.solution, self.sample, from)?;
        let there = losses(self.solution, self.sample, &estimate)?;
        let Compared { evidence, certainty } = Compared::of(self, &there);
        let worse = evidence > RIVAL_EVIDENCE && certainty > RIVAL_WORSE;
        let step = space.step(&self.estimate, &estimate);
        let distinct = largest(self.uncertainty, &group.members, &step) > RIVAL_DEVIATIONS;
        let mut padded = step.clone();
        padded.resize(space.dim(), 0.0);
        // The sample's own error is that of both optima.
        let estimate = space.retract(&self.solution.estimate, &padded);
        (distinct && !worse).then(|| Rival {
            estimate,
            step,
            members: group.members.clone(),
            patches: group.patches.clone(),
            evidence,
            certainty,
            contradicted: 0.0,
        })
    }
}

/// The optimum of all parameters over some points, and the mean loss there. None where the model does not exist or the
/// fit is cancelled.
fn optimum(solution: &Solution, points: &Points, from: Estimate) -> Option<(Estimate, f64)> {
    let objective = Objective { cancellable: true, ..solution.objective(points) };
    let stop = Stop { iterations: RIVAL_ITERATIONS, step: RIVAL_STEP * solution.loss.sigma };
    let minimum = gauss_newton::minimise(&objective, from, stop)?;
    Some((minimum.estimate, minimum.evaluation.value))
}

fn losses(solution: &Solution, points: &Points, at: &Estimate) -> Option<Vec<f64>> {
    let objective = solution.objective(points);
    let placed = objective.place(at).ok()?;
    Some(objective.losses(&placed))
}

/// Another shape compared with the base by the losses of the same points.
struct Compared {
    evidence: f64,
    certainty: f64,
}

impl Compared {
    fn of(base: &Base, there: &[f64]) -> Self {
        let (mut before, mut after, mut squares) = (0.0, 0.0, 0.0);
        for (i, (present, there)) in base.losses.iter().zip(there).enumerate() {
            let prior = base.sample.prior(i);
            before += prior * present;
            after += prior * there;
            squares += (prior * (there - present)).powi(2);
        }
        Self {
            evidence: base.uncertainty.effective_points * (after / before.max(f64::MIN_POSITIVE)).ln(),
            certainty: (after - before) / squares.sqrt().max(f64::MIN_POSITIVE),
        }
    }
}
