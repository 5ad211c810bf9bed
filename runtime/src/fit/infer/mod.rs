//! Inference: how well the scan determines the parameters (the sandwich estimator with dependent residuals, the block
//! bootstrap), which held values it contradicts (Wald), which parts it does not show, and which of several models it
//! supports.

pub(crate) mod agreement;
mod bias;
mod blocks;
pub(crate) mod bootstrap;
mod cholesky;
pub(crate) mod compare;
mod convergence;
mod field;
mod invariance;
pub(crate) mod joint;
mod least_surface;
mod meat;
pub(crate) mod misfit;
pub(crate) mod pose;
pub(crate) mod rivals;
mod rounding;
pub(crate) mod sandwich;
pub(super) mod significance;
mod sums;
mod switches;
pub(crate) mod unobserved;
pub(crate) mod wald;
mod without_bounds;

use super::problem::objective::Objective;
use super::refine::schedule::Solution;
use super::result::{Bootstrap, HypothesisTest};
use convergence::{Assessed, assess};
use rivals::Rival;
use sandwich::Uncertainty;

/// A solution with the statistics of its parameters.
pub(crate) struct Inference<'a> {
    pub(crate) solution: Solution<'a>,
    /// None where the fit was cancelled or the scan determines nothing.
    pub(crate) uncertainty: Option<Uncertainty>,
    pub(crate) tests: Vec<HypothesisTest>,
    pub(crate) bootstrap: Option<Bootstrap>,
    /// Other shapes that explain the scan as well.
    pub(crate) rivals: Vec<Rival>,
}

/// Takes a solution to the optimum if it is not there yet; standard deviations, tests and the bootstrap, as far as they
/// were asked for.
pub(crate) fn infer(solution: Solution) -> Inference {
    let problem = solution.level.problem;
    let assessed = problem.monitor.stage("uncertainty", || assess(solution));
    let (assessed, rivals) = problem.monitor.stage("other shapes", || {
        let assessed = if problem.options.one_sided { assessed } else { least_surface::settle(assessed) };
        rivals::weigh(assessed)
    });
    let Assessed { solution, uncertainty, warning } = assessed;
    warning.into_iter().for_each(|warning| problem.monitor.warn(warning));
    let tests = wald::test(&solution);
    let uncertainty = problem.monitor.stage("uncertainty", || {
        // One fit that was cancelled is like another, wherever it was.
        let uncertainty = uncertainty.filter(|_| !problem.monitor.cancelled());
        let uncertainty = uncertainty.map(|uncertainty| bias::include(&solution, uncertainty));
        let uncertainty = uncertainty.map(|uncertainty| field::include(&solution, uncertainty));
        let uncertainty = uncertainty.map(|found| rounding::include(&solution, found).within(problem.radius));
        uncertainty.map(|uncertainty| unobserved::mark(&solution, uncertainty))
    });
    let bootstrap = (problem.options.bootstrap > 0)
        .then(|| problem.monitor.stage("bootstrap", || bootstrap::run(&solution, uncertainty.as_ref())));
    Inference { solution, uncertainty, tests, bootstrap: bootstrap.flatten(), rivals }
}

/// The solution of several scans that were merged, with the uncertainty of the shape and of the pose in the first: open
/// ends come back to where the scans end, and what no scan shows is said.
pub(crate) fn conclude_several(solution: Solution, uncertainty: Uncertainty) -> (Solution, Uncertainty) {
    let problem = solution.level.problem;
    let assessed = Assessed { solution, uncertainty: Some(uncertainty.clone()), warning: None };
    let settled = if problem.options.one_sided { assessed } else { least_surface::settle(assessed) };
    let uncertainty = settled.uncertainty.unwrap_or(uncertainty);
    let uncertainty = rounding::include(&settled.solution, uncertainty).within(problem.radius);
    let uncertainty = unobserved::mark(&settled.solution, uncertainty);
    (settled.solution, uncertainty)
}

/// How well the solution is determined.
fn uncertainty(solution: &Solution) -> Option<Uncertainty> {
    let Solution { level, estimate, cache, evaluation, .. } = solution;
    let objective = Objective { cache: Some(cache.clone()), ..solution.objective(&level.problem.points) };
    sandwich::assess(&objective, estimate, &evaluation.gradient, &level.space.at_bound(estimate))
}
