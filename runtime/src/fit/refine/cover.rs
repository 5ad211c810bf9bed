//! The stage of a fit in which the coverage term takes part: after everything else has been found.

use super::schedule::{POLISH, Solution, polish};
use crate::fit::problem::coverage::{Coverage, Scanned, places};
use crate::fit::problem::level::Level;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::points::Points;
use crate::fit::result::Covered;
use crate::fit::tuning::{COVERAGE_FINEST, COVERAGE_SCALES, THIN_POINTS};
use std::sync::Arc;

/// Goes on from an optimum with the term; the same with a warning where that cannot be.
pub(crate) fn cover(solution: Solution) -> Solution {
    let problem = solution.level.problem;
    let coverage = match coverage_at(&solution) {
        Ok(coverage) => coverage,
        Err(why) => {
            problem.monitor.warn(format!("ends are not held to the scan: {why}"));
            return solution;
        }
    };
    let sample = problem.points.every(THIN_POINTS);
    let mut covered = solution;
    for (n, scale) in COVERAGE_SCALES.into_iter().enumerate() {
        problem.monitor.reach(n as f64 / (COVERAGE_SCALES.len() + 1) as f64, "");
        covered = polish_with(coverage.at_scale(scale * problem.radius), covered, &sample);
    }
    let scale = (COVERAGE_FINEST * problem.radius).max(covered.loss.sigma);
    polish_with(coverage.at_scale(scale), covered, &problem.points)
}

fn polish_with<'a>(coverage: Coverage<'a>, from: Solution<'a>, points: &Points) -> Solution<'a> {
    let (level, guess) = from.into_guess();
    polish(Level { coverage: Some(Arc::new(coverage)), ..level }, points, guess, Some(POLISH))
}

/// The term for the model as a solution has it.
fn coverage_at<'a>(solution: &Solution<'a>) -> Result<Coverage<'a>, String> {
    let Level { problem, space, .. } = &solution.level;
    let x = space.x(&solution.estimate.z).ok_or("the bounds of the parameters leave no room")?;
    let instance = problem.model.instantiate(&x).map_err(|e| e.to_string())?;
    let places = places(problem.model, &*instance, problem.radius).map_err(|e| e.to_string())?;
    let scanned = Scanned::new(problem.scan, problem.oriented, problem.radius).map_err(|e| e.to_string())?;
    Ok(Coverage::new(scanned, places, solution.signs.clone(), Loss::welsch(COVERAGE_SCALES[0] * problem.radius)))
}

/// The share of the model that was scanned; None where the term took no part.
pub(crate) fn covered(solution: &Solution) -> Option<Covered> {
    let Level { problem, space, coverage, .. } = &solution.level;
    let coverage = coverage.as_ref()?;
    let x = space.x(&solution.estimate.z)?;
    let instance = problem.model.instantiate(&x).ok()?;
    let share = coverage.share(&*instance, &solution.estimate.motion)?;
    Some(Covered { share, sigma: coverage.sigma() })
}
