//! One fit of a model to a scan, from the problem to the result.

use super::infer::{Inference, infer, misfit};
use super::monitor::Monitor;
use super::options::{FitError, FitOptions};
use super::problem::{Problem, extent};
use super::refine::schedule::Solution;
use super::refine::solve::{solve, solve_if_likely};
use super::result::FitResult;
use super::{plan, report};
use crate::model::Model;
use crate::progress::Progress;
use crate::scan::Scan;
use std::sync::atomic::Ordering;

/// A fit with what it explains of the scan.
pub(crate) struct Attempt {
    pub(crate) result: FitResult,
    /// Per vertex of the scan, whether it is an inlier.
    pub(crate) near: Vec<bool>,
    /// The scan is about as large as the model.
    pub(crate) in_proportion: bool,
}

/// Fits a model to a scan. See [`crate::fit::fit()`].
///
/// # Errors
/// See [`crate::fit::fit()`].
pub(crate) fn attempt(
    model: &dyn Model,
    scan: &Scan,
    options: &FitOptions,
    progress: &dyn Progress,
) -> Result<Attempt, FitError> {
    let monitor = Monitor::of_stages(progress, plan::whole(options));
    let problem = prepare(model, scan, options, &monitor)?;
    Ok(conclude(solve(&problem)?))
}

/// Fits a model to a scan if it may well show the object: none where the first search explains no more than some of it.
///
/// # Errors
/// See [`crate::fit::fit()`].
pub(crate) fn attempt_if_likely(
    model: &dyn Model,
    scan: &Scan,
    options: &FitOptions,
    progress: &dyn Progress,
) -> Result<Option<Attempt>, FitError> {
    let monitor = Monitor::of_stages(progress, plan::whole(options));
    let problem = prepare(model, scan, options, &monitor)?;
    Ok(solve_if_likely(&problem)?.map(conclude))
}

fn prepare<'a>(
    model: &'a dyn Model,
    scan: &'a Scan,
    options: &'a FitOptions,
    monitor: &'a Monitor<'a>,
) -> Result<Problem<'a>, FitError> {
    let problem = monitor.stage("prepare", || Problem::new(model, scan, options, monitor))?;
    extent::degenerate(&problem).into_iter().for_each(|sentence| monitor.warn(sentence));
    Ok(problem)
}

/// The statistics of a solution, and the result.
fn conclude(solution: Solution) -> Attempt {
    explained(infer(solution))
}

/// The result of a solution whose statistics are known.
pub(crate) fn explained(inference: Inference) -> Attempt {
    let Problem { scan, monitor, points, .. } = inference.solution.level.problem;
    // All that is looked for in what a fit leaves over is for fits that have ended.
    let residuals = if monitor.cancelled() { None } else { misfit::residuals(&inference.solution) };
    let mut near = vec![false; scan.mesh.positions.len()];
    for residual in residuals.iter().flatten() {
        near[points.index[residual.point] as usize] = true;
    }
    let result = report::result(inference, residuals.as_deref(), &near);
    Attempt { result, near, in_proportion: !monitor.out_of_proportion.load(Ordering::Relaxed) }
}
