//! The end of an earlier fit as the beginning of the last stage.

use super::schedule::Guess;
use crate::fit::options::FitOptions;
use crate::fit::problem::level::Level;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::sides::Sides;

/// The guess at `from`, if an earlier fit of the same problem converged there, by its loss. The way from coarse to fine
/// would lead back to it by detours over samples of the points, which end elsewhere by a tenth of a standard deviation.
pub(crate) fn converged(level: &Level, from: &Estimate) -> Option<Guess> {
    let problem = level.problem;
    let FitOptions { start, fixed, equal, sigma, loss: kind, weights, .. } = problem.options;
    let end = problem.converged()?;
    let same_objective = sigma.is_none() && *kind == end.loss && *weights == end.weights;
    let same_options = start.is_empty() && fixed.is_empty() && equal.is_empty() && same_objective;
    let there = level.space.estimate(&problem.start.x, problem.start_motion());
    if !(same_options && there == *from && end.sigma > 0.0) {
        return None;
    }
    let loss = Loss { kind: end.loss, sigma: end.sigma };
    // As after a level of annealing.
    let signs = Sides::of(level, from, loss)?.signs;
    Some(Guess { estimate: from.clone(), loss, signs, iterations: 0 })
}
