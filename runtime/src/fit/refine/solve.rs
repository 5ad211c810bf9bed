//! All stages from a problem to its optimum.

use super::apart::hold_apart;
use super::cover::cover;
use super::schedule::{Solution, refine};
use super::second_search::{Found, reconsider};
use super::write_back::write_back;
use crate::fit::options::FitError;
use crate::fit::problem::Problem;
use crate::fit::register::register;

/// Registers, refines, searches once more where the scan contradicts what was found, writes the pose back, holds the
/// ends to the scan where that is requested, and walls apart that pass through each other.
///
/// # Errors
/// The model cannot be evaluated at the start.
pub(crate) fn solve<'a>(problem: &'a Problem<'a>) -> Result<Solution<'a>, FitError> {
    let monitor = problem.monitor;
    let registration = monitor.stage("screen", || register(problem))?;
    let searched = registration.searched;
    let mut found = Found::of(monitor, || monitor.stage("fit", || refine(registration)));
    if searched {
        found = monitor.stage("second search", || reconsider(found));
    }
    let solution = found.accept(monitor);
    let mut solution = monitor.stage("finish", || write_back(solution));
    if problem.options.coverage && !monitor.cancelled() {
        solution = monitor.stage("coverage", || cover(solution));
    }
    Ok(if monitor.cancelled() { solution } else { monitor.stage("walls", || hold_apart(solution)) })
}
