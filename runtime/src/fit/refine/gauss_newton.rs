//! Iteratively reweighted Gauss-Newton with Levenberg-Marquardt damping and bounds.

use crate::fit::problem::objective::{Evaluation, Objective, Order};
use crate::fit::problem::parameterization::Estimate;
use nalgebra::{DMatrix, DVector};

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stop {
    /// Steps at most.
    pub(crate) iterations: u32,
    /// Enough once a step moves the surface by less (root mean square over what each parameter moves). Millimetres.
    pub(crate) step: f64,
}

/// The longest step of a scaled coordinate, in sigma.
const REACH: f64 = 2.0;

/// Steps of scaled coordinates below this, in sigma, are the last ones.
const LAST: f64 = 2e-3;
/// By how much, relatively, an objective may be off: feet are found to a finite precision.
const ROUNDING: f64 = 1e-7;

/// Where an optimiser ended.
pub(crate) struct Minimum {
    pub(crate) estimate: Estimate,
    pub(crate) evaluation: Evaluation,
    pub(crate) iterations: u32,
    pub(crate) converged: bool,
}

/// Minimises from `start`; None where the model does not exist there.
pub(crate) fn minimise(objective: &Objective, start: Estimate, stop: Stop) -> Option<Minimum> {
    let evaluation = objective.evaluate(&start, Order::Normal)?;
    let mut at = Minimum { estimate: start, evaluation, iterations: 0, converged: false };
    objective.note(&at.evaluation);
    let mut damping = 1e-4;
    while at.iterations < stop.iterations {
        at.iterations += 1;
        // The linear model holds for about sigma; longer steps jump over valleys (and onto bounds).
        let reach = REACH * objective.loss.sigma;
        let room: Vec<(f64, f64)> =
            objective.space.room(&at.estimate).iter().map(|(low, high)| (low.max(-reach), high.min(reach))).collect();
        let Some(step) = damped_step(&at.evaluation, &room, damping) else {
            damping = (damping * 100.0).max(1e-6);
            if damping > 1e8 {
                break;
            }
            continue;
        };
        if step.amax() <= stop.step {
            at.converged = true;
            break;
        }
        let predicted = -(at.evaluation.gradient.dot(&step) + 0.5 * step.dot(&(&at.evaluation.normal * &step)));
        let estimate = objective.space.retract(&at.estimate, step.as_slice());
        let trial = objective.evaluate(&estimate, Order::Normal);
        let gain = trial.as_ref().map_or(f64::NEG_INFINITY, |t| at.evaluation.value - t.value);
        // The last steps gain less than the objective is rounded by: there the gradient judges.
        let last = step.amax() < LAST * objective.loss.sigma;
        let calmer = |t: &Evaluation| pull(t, &room) < pull(&at.evaluation, &room);
        match trial {
            Some(trial) if last && gain > -ROUNDING * trial.value && calmer(&trial) => {
                at.estimate = estimate;
                at.evaluation = trial;
                objective.note(&at.evaluation);
            }
            Some(trial) if gain > 0.0 => {
                let ratio = gain / predicted.max(f64::MIN_POSITIVE);
                damping = if ratio > 0.75 {
                    (damping * 0.2).max(1e-9)
                } else if ratio > 0.25 {
                    damping
                } else {
                    damping * 3.0
                };
                at.estimate = estimate;
                at.evaluation = trial;
                objective.note(&at.evaluation);
            }
            _ => {
                // Below the rounding of the objective no step can be told from another.
                if predicted < 1e-13 * at.evaluation.value.max(1e-3) {
                    at.converged = true;
                    break;
                }
                damping = (damping * 8.0).max(1e-6);
                if damping > 1e8 {
                    break;
                }
            }
        }
    }
    Some(at)
}

/// The largest component of the gradient that no bound holds.
fn pull(at: &Evaluation, room: &[(f64, f64)]) -> f64 {
    let components = at.gradient.iter().zip(room);
    let free = components.filter(|(g, (low, high))| !((*low >= 0.0 && **g > 0.0) || (*high <= 0.0 && **g < 0.0)));
    free.map(|(g, _)| g.abs()).fold(0.0, f64::max)
}

/// The step that minimises the damped quadratic model inside the bounds. Coordinates that stand at a bound and are pushed
/// against it stay; those that would cross one stop there, and the rest is solved again. None where the model is singular in
/// spite of the damping.
pub(crate) fn damped_step(at: &Evaluation, room: &[(f64, f64)], damping: f64) -> Option<DVector<f64>> {
    let n = at.gradient.len();
    let largest = at.normal.diagonal().amax();
    let mut held: Vec<Option<f64>> = (0..n)
        .map(|k| {
            let (low, high) = room[k];
            let pushed = (low >= 0.0 && at.gradient[k] > 0.0) || (high <= 0.0 && at.gradient[k] < 0.0);
            pushed.then_some(0.0)
        })
        .collect();
    loop {
        let free: Vec<usize> = (0..n).filter(|k| held[*k].is_none()).collect();
        let mut step = DVector::from_iterator(n, held.iter().map(|h| h.unwrap_or(0.0)));
        if free.is_empty() {
            return Some(step);
        }
        let rhs = -(&at.gradient + &at.normal * &step);
        let matrix = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            let h = at.normal[(free[a], free[b])];
            // The floor keeps coordinates without influence where they are.
            if a == b { h + damping * h + (1e-12 + 1e-4 * damping) * largest } else { h }
        });
        let rhs = DVector::from_iterator(free.len(), free.iter().map(|k| rhs[*k]));
        let solution = matrix.cholesky()?.solve(&rhs);
        let mut crossed = false;
        for (k, s) in free.iter().zip(solution.iter()) {
            let (low, high) = room[*k];
            step[*k] = *s;
            if *s < low || *s > high {
                held[*k] = Some(s.max(low).min(high));
                crossed = true;
            }
        }
        if !crossed {
            return Some(step);
        }
    }
}
