//! The stage of a fit in which walls that pass through each other at the optimum are held apart, as a `require` of
//! the script would hold them.

use super::schedule::{Guess, POLISH, Solution, polish};
use crate::fit::problem::level::Level;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::points::Points;
use crate::fit::problem::separation::Separation;
use crate::fit::problem::walls::{Walls, described, seem_to_pass};
use crate::fit::result::PassedPart;
use crate::fit::tuning::{APART_START, SCALE_FASTEST};
use std::sync::Arc;

/// Goes on from an optimum at which walls pass through each other to the best place where they do not; any other
/// solution is returned as it is. The walls' points leave the basin of a loss whose scale is below the depth by which
/// they pass: the scale comes down from above that once more.
pub(crate) fn hold_apart(solution: Solution) -> Solution {
    let Some((walls, passed)) = passed(&solution) else {
        return Solution { apart_at: Some(solution.estimate.z.clone()), ..solution };
    };
    if !all_shown(&solution, &passed) {
        return solution;
    }
    let walls = Arc::new(walls);
    let problem = solution.level.problem;
    let (loss, before) = (solution.loss, solution.evaluation.value);
    let deepest = passed.iter().map(|part| part.depth).fold(0.0, f64::max);
    let mut sigma = (APART_START * deepest).max(loss.sigma);
    let mut apart = solution;
    while sigma > loss.sigma && !problem.monitor.cancelled() {
        apart = polish_with(&walls, apart, Loss { sigma, ..loss }, &problem.thin);
        sigma = (SCALE_FASTEST * sigma).max(loss.sigma);
    }
    apart = polish_with(&walls, apart, loss, &problem.points);
    problem.monitor.warn(format!(
        "where the model is nearest to the scan, walls of it pass through each other ({}): they are held apart, and the \
         mean loss is {:.4} instead of {before:.4}; standard deviations are those without that border",
        described(&passed),
        apart.evaluation.value
    ));
    apart
}

fn polish_with<'a>(walls: &Arc<Walls>, from: Solution<'a>, loss: Loss, points: &Points) -> Solution<'a> {
    let (level, guess) = from.into_guess();
    let separation = Separation { walls: walls.clone(), sigma: loss.sigma };
    polish(Level { separation: Some(Arc::new(separation)), ..level }, points, Guess { loss, ..guess }, Some(POLISH))
}

/// The walls of the model as a solution has it, and the parts that have passed through them there. None where none
/// has.
pub(crate) fn passed(solution: &Solution) -> Option<(Walls, Vec<PassedPart>)> {
    if solution.apart_at.as_ref() == Some(&solution.estimate.z) {
        return None;
    }
    let Level { problem, space, layout, .. } = &solution.level;
    let model = problem.model;
    let instance = model.instantiate(&space.x(&solution.estimate.z)?).ok()?;
    if !seem_to_pass(&layout.facets(&*instance)) {
        return None;
    }
    let walls = Walls::of(model, &*instance).ok()?;
    let passed = walls.passed(model, &*instance, &solution.estimate.motion);
    (!passed.is_empty()).then_some((walls, passed))
}

/// Whether the scan shows all parts that have passed through a wall, and the walls: a part that it hardly shows is not
/// determined, and holding it apart would move what is.
fn all_shown(solution: &Solution, passed: &[PassedPart]) -> bool {
    let is_shown = |name: &String| {
        let patch = solution.level.problem.model.parts().iter().position(|part| part.name == *name);
        patch.is_some_and(|patch| !solution.evaluation.patches[patch].is_hidden())
    };
    passed.iter().all(|part| is_shown(&part.part) && part.through.iter().all(is_shown))
}
