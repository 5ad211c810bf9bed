//! All stages from a problem to its optimum.

use super::apart::hold_apart;
use super::cover::cover;
use super::schedule::{Solution, refine};
use super::second_search::{Found, reconsider};
use super::write_back::write_back;
use crate::fit::options::FitError;
use crate::fit::problem::Problem;
use crate::fit::register::register;
use crate::fit::tuning::MOST_LEFT_OVER;

/// Registers, refines, searches once more where the scan contradicts what was found, writes the pose back, holds the
/// ends to the scan where that is requested, and walls apart that pass through each other.
///
/// # Errors
/// The model cannot be evaluated at the start.
pub(crate) fn solve<'a>(problem: &'a Problem<'a>) -> Result<Solution<'a>, FitError> {
    let found = search(problem)?;
    Ok(finish(problem, found))
}

/// The same where the first search explains most of the scan; none otherwise. What is left over then is of no object
/// that a second search would find.
///
/// # Errors
/// The model cannot be evaluated at the start.
pub(crate) fn solve_if_likely<'a>(problem: &'a Problem<'a>) -> Result<Option<Solution<'a>>, FitError> {
    let found = search(problem)?;
    let is_likely = found.found.explained() >= 1.0 - MOST_LEFT_OVER;
    Ok(is_likely.then(|| finish(problem, found)))
}

/// The result of the first search.
struct First<'a> {
    found: Found<'a>,
    /// Orientations were screened.
    searched: bool,
}

fn search<'a>(problem: &'a Problem<'a>) -> Result<First<'a>, FitError> {
    let monitor = problem.monitor;
    let registration = monitor.stage("screen", || register(problem))?;
    let searched = registration.searched;
    let found = Found::of(monitor, || monitor.stage("fit", || refine(registration)));
    Ok(First { found, searched })
}

fn finish<'a>(problem: &'a Problem<'a>, first: First<'a>) -> Solution<'a> {
    let monitor = problem.monitor;
    let First { mut found, searched } = first;
    if searched {
        found = monitor.stage("second search", || reconsider(found));
    }
    let solution = found.accept(monitor);
    let mut solution = monitor.stage("finish", || write_back(solution));
    if problem.options.coverage && !monitor.cancelled() {
        solution = monitor.stage("coverage", || cover(solution));
    }
    if monitor.cancelled() { solution } else { monitor.stage("walls", || hold_apart(solution)) }
}
