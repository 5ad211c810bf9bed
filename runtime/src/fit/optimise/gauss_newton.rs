//! Iteratively reweighted Gauss-Newton with Levenberg-Marquardt damping and bounds.

use super::in_box::{self, pushed};
use crate::fit::problem::objective::{Evaluation, Objective, Order};
use crate::fit::problem::parameterization::Estimate;
use crate::fit::tuning::{
    DAMPING_FLOOR, DAMPING_GOOD, DAMPING_LEAST, DAMPING_MOST, DAMPING_POOR, DAMPING_RAISED, DAMPING_REJECTED,
    DAMPING_SINGULAR, DAMPING_START, GOOD_RATIO, POOR_RATIO, ROUNDED_STEP, STEP_LIMIT,
};
use nalgebra::DVector;

/// The criterion by which a minimisation ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stop {
    /// Limit of steps.
    pub(crate) iterations: u32,
    /// A step is the last one if it moves the surface by less (root mean square over what each parameter moves).
    /// Millimetres.
    pub(crate) step: f64,
}

/// Relative error of the objective: feet are found to a finite precision.
pub(crate) const ROUNDING: f64 = 1e-7;
/// Predicted gain, relative to the objective, that is below the rounding of its sums.
const LEAST_GAIN: f64 = 1e-13;

/// What can be minimised: an objective over one scan, or over several at a time.
pub(crate) trait Target {
    /// The places at which it has a value.
    type At: Clone;

    /// The value at a place, with its derivatives by scaled local coordinates; None where the model does not exist or
    /// the fit is cancelled.
    fn evaluated(&self, at: &Self::At, order: Order) -> Option<Evaluation>;

    /// Lowest and highest admissible scaled steps from a place.
    fn room(&self, from: &Self::At) -> Vec<(f64, f64)>;

    /// The place at scaled local coordinates from another one.
    fn retract(&self, from: &Self::At, step: &[f64]) -> Self::At;

    /// The scale of the loss: the linear model holds for about as far. Millimetres.
    fn scale(&self) -> f64;

    /// Traces a step.
    fn trace(&self, evaluation: &Evaluation);
}

impl Target for Objective<'_> {
    type At = Estimate;

    fn evaluated(&self, at: &Estimate, order: Order) -> Option<Evaluation> {
        self.evaluate(at, order)
    }

    fn room(&self, from: &Estimate) -> Vec<(f64, f64)> {
        self.space.room(from)
    }

    fn retract(&self, from: &Estimate, step: &[f64]) -> Estimate {
        self.space.retract(from, step)
    }

    fn scale(&self) -> f64 {
        self.loss.sigma
    }

    fn trace(&self, evaluation: &Evaluation) {
        self.note(evaluation);
    }
}

/// The end of a minimisation.
pub(crate) struct Minimum<At = Estimate> {
    pub(crate) estimate: At,
    pub(crate) evaluation: Evaluation,
    pub(crate) iterations: u32,
    pub(crate) converged: bool,
}

/// Levenberg and Marquardt's damping, relative to the diagonal of the Gauss-Newton matrix.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Damping(f64);

impl Damping {
    /// The damping of a first step.
    pub(crate) const START: Self = Self(DAMPING_START);

    /// Adapts to a step that gained `ratio` times as much as the quadratic model predicted.
    pub(crate) fn accept(&mut self, ratio: f64) {
        if ratio > GOOD_RATIO {
            self.0 = (self.0 * DAMPING_GOOD).max(DAMPING_LEAST);
        } else if !(ratio > POOR_RATIO) {
            self.0 *= DAMPING_POOR;
        }
    }

    /// Adapts to a step that gained nothing; false where no damping helps.
    pub(crate) fn reject(&mut self) -> bool {
        self.raise(DAMPING_REJECTED)
    }

    /// Adapts to a matrix that is singular in spite of the damping; false where no damping helps.
    pub(crate) fn singular(&mut self) -> bool {
        self.raise(DAMPING_SINGULAR)
    }

    fn raise(&mut self, factor: f64) -> bool {
        self.0 = (self.0 * factor).max(DAMPING_RAISED);
        self.0 <= DAMPING_MOST
    }
}

/// Minimises from `start`; None where the model does not exist there.
pub(crate) fn minimise<T: Target>(objective: &T, start: T::At, stop: Stop) -> Option<Minimum<T::At>> {
    minimise_until(objective, start, stop, |_| false)
}

/// The same, but ends as soon as a step has led to a place of which `is_decided` is true.
pub(crate) fn minimise_until<T: Target>(
    objective: &T,
    start: T::At,
    stop: Stop,
    mut is_decided: impl FnMut(&Minimum<T::At>) -> bool,
) -> Option<Minimum<T::At>> {
    let evaluation = objective.evaluated(&start, Order::Normal)?;
    let mut at = Minimum { estimate: start, evaluation, iterations: 0, converged: false };
    objective.trace(&at.evaluation);
    let mut damping = Damping::START;
    while at.iterations < stop.iterations {
        at.iterations += 1;
        // The linear model holds for about sigma; longer steps jump over valleys (and onto bounds).
        let reach = STEP_LIMIT * objective.scale();
        let room: Vec<(f64, f64)> =
            objective.room(&at.estimate).iter().map(|(low, high)| (low.max(-reach), high.min(reach))).collect();
        let Some(step) = damped_step(&at.evaluation, &room, damping) else {
            if damping.singular() {
                continue;
            }
            break;
        };
        if step.amax() <= stop.step {
            at.converged = is_optimum(&at.evaluation, &room, stop);
            break;
        }
        let predicted = at.evaluation.predicted_gain(&step);
        let estimate = objective.retract(&at.estimate, step.as_slice());
        let trial = objective.evaluated(&estimate, Order::Normal);
        let gain = trial.as_ref().map_or(f64::NEG_INFINITY, |t| at.evaluation.value - t.value);
        // The last steps gain less than the objective is rounded by: there the gradient judges.
        let rounded = step.amax() < ROUNDED_STEP * objective.scale();
        let settles = |t: &Evaluation| {
            rounded && gain > -ROUNDING * t.value && free_gradient(t, &room) < free_gradient(&at.evaluation, &room)
        };
        let settled = trial.as_ref().is_some_and(settles);
        match trial {
            Some(trial) if settled || gain > 0.0 => {
                if !settled {
                    damping.accept(gain / predicted.max(f64::MIN_POSITIVE));
                }
                at.estimate = estimate;
                at.evaluation = trial;
                objective.trace(&at.evaluation);
                if is_decided(&at) {
                    break;
                }
            }
            _ => {
                // Below the rounding of the objective no step can be told from another.
                if predicted < LEAST_GAIN * at.evaluation.value.max(1e-3) || !damping.reject() {
                    at.converged = is_optimum(&at.evaluation, &room, stop);
                    break;
                }
            }
        }
    }
    Some(at)
}

/// Whether the step with hardly any damping is short enough, or would gain nothing: a step may be short only because
/// damping was raised, far from any optimum.
fn is_optimum(at: &Evaluation, room: &[(f64, f64)], stop: Stop) -> bool {
    damped_step(at, room, Damping::START)
        .is_some_and(|step| step.amax() <= stop.step || at.predicted_gain(&step) < LEAST_GAIN * at.value.max(1e-3))
}

/// The largest component of the gradient that no bound holds.
fn free_gradient(at: &Evaluation, room: &[(f64, f64)]) -> f64 {
    let components = at.gradient.iter().zip(room);
    components.filter(|(g, room)| !pushed(**g, **room)).map(|(g, _)| g.abs()).fold(0.0, f64::max)
}

/// The step that minimises the damped quadratic model inside the bounds. None where the model is singular in spite of
/// the damping.
pub(crate) fn damped_step(at: &Evaluation, room: &[(f64, f64)], Damping(damping): Damping) -> Option<DVector<f64>> {
    let largest = at.normal.diagonal().amax();
    let mut matrix = at.normal.clone();
    for k in 0..matrix.nrows() {
        // The floor keeps coordinates without influence where they are.
        matrix[(k, k)] += damping * matrix[(k, k)] + (1e-12 + DAMPING_FLOOR * damping) * largest;
    }
    in_box::minimum(&at.gradient, &matrix, room)
}
