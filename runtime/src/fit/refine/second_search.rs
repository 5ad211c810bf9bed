//! A second search, where the scan contradicts what the first one led to, and a third one: with other shapes to begin
//! from, and with places of the scan beside the model's middle. The best solution counts, judged from both sides.

use super::schedule::{Solution, refine};
use super::unexplained;
use super::witness::{self, Witness};
use crate::fit::monitor::Monitor;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Objective, Order};
use crate::fit::problem::points::Points;
use crate::fit::problem::sides::Sides;
use crate::fit::register::register_again;
use crate::fit::tuning::{
    MOST_LEFT_OVER, RIVAL_CONTRADICTED, SECOND_AS_WELL, SECOND_BETTER, SECOND_ROUNDS, SQUEEZED, THIN_POINTS,
    UNEXPLAINED,
};

/// A solution with its sentences for the user, which count if it does.
pub(crate) struct Found<'a> {
    solution: Solution<'a>,
    sentences: Vec<String>,
}

impl<'a> Found<'a> {
    /// The solution that a stage comes to.
    pub(crate) fn of(monitor: &Monitor, stage: impl FnOnce() -> Solution<'a>) -> Self {
        let (solution, sentences) = monitor.aside(stage);
        Self { solution, sentences }
    }

    /// The share of the scan's points that it explains.
    pub(crate) fn explained(&self) -> f64 {
        self.solution.evaluation.inliers() / self.solution.level.problem.points.weight()
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
    if problem.monitor.cancelled() {
        return found;
    }
    let mut testimony = Testimony::of(&found.solution);
    for round in 1..=SECOND_ROUNDS {
        let is_doubtful =
            testimony.is_against() || (round == 1 && (is_incomplete(&found.solution) || is_squeezed(&found.solution)));
        if problem.monitor.cancelled() || !is_doubtful {
            break;
        }
        let Some(registration) = register_again(problem, round) else { break };
        let other = Found::of(problem.monitor, || refine(registration));
        let of_other = Testimony::of(&other.solution);
        if is_preferred((&other.solution, &of_other), (&found.solution, &testimony)) {
            (found, testimony) = (other, of_other);
        }
    }
    found
}

/// The scan's testimony against a solution.
#[derive(Default)]
struct Testimony {
    /// The area that stands where the scan shows empty space, and how much of it is no chance. Square millimetres; zero
    /// where the scan does not say.
    contradicted: (f64, f64),
    /// A part faces the other side of the scan.
    contested: bool,
}

impl Testimony {
    fn of(solution: &Solution) -> Self {
        let Some(sides) = Sides::of(&solution.level, &solution.estimate, solution.loss) else { return Self::default() };
        let patches = Witness::by(solution, &sides).and_then(|witness| witness.contradicted(&solution.estimate));
        let contradicted = patches.map(|patches| witness::total(&patches)).unwrap_or_default();
        Self { contradicted, contested: !sides.contested.is_empty() }
    }

    fn is_against(&self) -> bool {
        let (area, chance) = self.contradicted;
        self.contested || area > chance
    }
}

/// Whether pieces of the scan are left over, and not so much that it shows another thing.
fn is_incomplete(solution: &Solution) -> bool {
    if solution.evaluation.inliers() > (1.0 - UNEXPLAINED) * solution.level.problem.points.weight() {
        return false;
    }
    let pieces = unexplained::inliers(solution).and_then(|near| unexplained::pieces(solution, &near));
    (UNEXPLAINED..MOST_LEFT_OVER).contains(&pieces.into_iter().flatten().map(|piece| piece.share).sum())
}

/// Whether many parameters ended at bounds: parts that are in the wrong place are squeezed into what the scan leaves
/// them.
fn is_squeezed(solution: &Solution) -> bool {
    solution.level.space.at_bound(&solution.estimate).into_iter().filter(|at| *at).count() >= SQUEEZED
}

/// Whether the scan prefers a solution to another one: it contradicts clearly less of it and shows as much of it, or no
/// more of it and shows more.
fn is_preferred((solution, of_it): (&Solution, &Testimony), (to, of_other): (&Solution, &Testimony)) -> bool {
    let points = to.level.problem.points.every(THIN_POINTS);
    let sigma = solution.loss.sigma.max(to.loss.sigma);
    let [Some(here), Some(there)] = [solution, to].map(|s| mean_loss(s, &points, sigma)) else { return false };
    let ((area, _), (other, chance)) = (of_it.contradicted, of_other.contradicted);
    let difference = RIVAL_CONTRADICTED * chance;
    let no_more = here < SECOND_BETTER * there && area <= other + difference;
    no_more || (here < SECOND_AS_WELL * there && area < other - difference)
}

fn mean_loss(solution: &Solution, points: &Points, sigma: f64) -> Option<f64> {
    let loss = Loss { sigma, ..solution.loss };
    let objective = Objective { loss, ..solution.objective(points) };
    Some(objective.evaluate(&solution.estimate, Order::Value)?.value)
}
