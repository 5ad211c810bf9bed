//! A second search, where the scan contradicts what the first one led to, and a third one: with other shapes to begin
//! from, and with places of the scan beside the model's middle. The best solution counts, judged from both sides.

use super::schedule::{Solution, refine};
use super::witness::{self, Witness};
use crate::fit::monitor::Monitor;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Objective, Order};
use crate::fit::problem::points::Points;
use crate::fit::problem::sides::Sides;
use crate::fit::register::register_again;
use crate::fit::tuning::{
    CLEARLY_BETTER, DOUBTED_INLIERS, RIVAL_CONTRADICTED, SECOND_AS_WELL, SECOND_ROUNDS, THIN_POINTS,
};

/// A solution with its sentences for the user, which count if it does.
pub(crate) struct Found<'a> {
    solution: Solution<'a>,
    sentences: Vec<String>,
}

impl<'a> Found<'a> {
    /// What a stage finds.
    pub(crate) fn of(monitor: &Monitor, stage: impl FnOnce() -> Solution<'a>) -> Self {
        let (solution, sentences) = monitor.aside(stage);
        Self { solution, sentences }
    }

    /// The solution, which counts.
    pub(crate) fn accept(self, monitor: &Monitor) -> Solution<'a> {
        self.sentences.into_iter().for_each(|sentence| monitor.warn(sentence));
        self.solution
    }
}

/// Searches once more if the scan contradicts a solution, and returns the better one.
pub(crate) fn reconsider(mut found: Found) -> Found {
    let problem = found.solution.level.problem;
    for round in 1..=SECOND_ROUNDS {
        let is_doubtful = is_contradicted(&found.solution) || (round == 1 && is_incomplete(&found.solution));
        if problem.monitor.cancelled() || !is_doubtful {
            break;
        }
        let Some(registration) = register_again(problem, round) else { break };
        let other = Found::of(problem.monitor, || refine(registration));
        if is_preferred(&other.solution, &found.solution) {
            found = other;
        }
    }
    found
}

/// Whether a part of the model stands where the scan shows empty space, or faces the other side of the scan.
fn is_contradicted(solution: &Solution) -> bool {
    contradicted(solution).is_some_and(|(area, chance)| area > chance) || {
        let sides = Sides::of(&solution.level, &solution.estimate, solution.loss);
        sides.is_some_and(|sides| !sides.contested.is_empty())
    }
}

/// Whether some of the scan is left over, and not so much that it shows another thing.
fn is_incomplete(solution: &Solution) -> bool {
    DOUBTED_INLIERS.contains(&(solution.evaluation.inliers() / solution.level.problem.points.weight()))
}

/// The area that the scan contradicts, and how much of it is no chance. Square millimetres. None where the scan does
/// not say.
fn contradicted(solution: &Solution) -> Option<(f64, f64)> {
    Some(witness::total(&Witness::of(solution)?.contradicted(&solution.estimate)?))
}

/// Whether the scan prefers a solution to another one: it contradicts clearly less of it and shows as much of it, or no
/// more of it and shows clearly more.
fn is_preferred(solution: &Solution, to: &Solution) -> bool {
    let points = to.level.problem.points.every(THIN_POINTS);
    let sigma = solution.loss.sigma.max(to.loss.sigma);
    let [Some(here), Some(there)] = [solution, to].map(|s| mean_loss(s, &points, sigma)) else { return false };
    let [(area, _), (other, chance)] = [solution, to].map(|s| contradicted(s).unwrap_or_default());
    let difference = RIVAL_CONTRADICTED * chance;
    let no_more = here < CLEARLY_BETTER * there && area <= other + difference;
    no_more || (here < SECOND_AS_WELL * there && area < other - difference)
}

fn mean_loss(solution: &Solution, points: &Points, sigma: f64) -> Option<f64> {
    let loss = Loss { sigma, ..solution.loss };
    let objective = Objective { loss, ..solution.objective(points) };
    Some(objective.evaluate(&solution.estimate, Order::Value)?.value)
}
