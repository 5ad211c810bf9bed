//! All stages from a problem to its optimum.

use super::apart::hold_apart;
use super::cover::cover;
use super::schedule::{Solution, refine};
use super::write_back::write_back;
use crate::fit::options::FitError;
use crate::fit::problem::Problem;
use crate::fit::register::register;

/// Registers, refines, writes the pose back, holds the ends to the scan where that is requested, and walls apart that
/// pass through each other.
///
/// # Errors
/// The model cannot be evaluated at the start.
pub(crate) fn solve<'a>(problem: &'a Problem<'a>) -> Result<Solution<'a>, FitError> {
    let monitor = problem.monitor;
    let registration = monitor.stage("screen", || register(problem))?;
    let solution = monitor.stage("fit", || refine(registration));
    let mut solution = monitor.stage("finish", || write_back(solution));
    if problem.options.coverage && !monitor.cancelled() {
        solution = monitor.stage("coverage", || cover(solution));
    }
    Ok(if monitor.cancelled() { solution } else { monitor.stage("walls", || hold_apart(solution)) })
}
