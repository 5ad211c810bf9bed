//! The least surface that explains the scan: where the scan leaves a value open, an open end of the model that has
//! grown beyond it comes back to where the scan ends, and a part of which nothing was seen where the scan shows empty
//! space becomes as small as it may be. Neither says anything of the object: such values have no standard deviation.

use super::convergence::Assessed;
use super::sandwich::Uncertainty;
use crate::fit::problem::free_space::Contradicted;
use crate::fit::problem::level::Level;
use crate::fit::problem::objective::{Objective, Order};
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::points::Points;
use crate::fit::refine::schedule::Solution;
use crate::fit::refine::witness::{self, Witness};
use crate::fit::register::area::area;
use crate::fit::result::WithoutSd;
use crate::fit::tuning::{
    DETERMINED, LEAST_AREA_GAIN, LEAST_FIRST_STEP, LEAST_LAST_STEP, LEAST_MIXTURES, LEAST_POINTS, LEAST_PROTEST,
    LEAST_ROUNDS, RIVAL_CONTRADICTED,
};
use crate::sampling::halton;
use nalgebra::DVector;

/// Moves what the scan does not determine to the least surface.
pub(crate) fn settle(assessed: Assessed) -> Assessed {
    let Assessed { mut solution, uncertainty, warning } = assessed;
    let Some(mut uncertainty) = uncertainty else { return Assessed { solution, uncertainty, warning } };
    let determined = uncertainty.without.iter().all(Option::is_none) && uncertainty.undetermined.is_empty();
    // Where terms take part that hold the ends or the walls, these decide.
    let is_held = solution.level.coverage.is_some() || solution.level.separation.is_some();
    if !determined && !is_held {
        let (open, estimate) = least(&solution, &uncertainty);
        let points = &solution.level.problem.points;
        let evaluated = estimate.and_then(|at| Some((solution.objective(points).evaluate(&at, Order::Normal)?, at)));
        if let Some((evaluation, estimate)) = evaluated {
            let free = solution.level.space.free.len();
            for k in (0..free).filter(|k| open.iter().any(|d| d[*k].abs() >= DETERMINED)) {
                uncertainty.without[k] = Some(WithoutSd::ScanEnds);
            }
            (solution.estimate, solution.evaluation) = (estimate, evaluation);
        }
    }
    Assessed { solution, uncertainty: Some(uncertainty), warning }
}

/// The directions that the scan leaves open, and the place along them with the least surface; None where no surface
/// can be saved, or only by moving more of the model to where the scan shows empty space.
fn least(solution: &Solution, uncertainty: &Uncertainty) -> (Vec<DVector<f64>>, Option<Estimate>) {
    let witness = Witness::of(solution);
    let contradicted = |at: &Estimate| witness.as_ref()?.contradicted(at);
    let present = contradicted(&solution.estimate);
    let open = open_directions(solution, uncertainty, present.as_deref());
    if open.is_empty() {
        return (open, None);
    }
    let sample = solution.level.problem.points.every(LEAST_POINTS);
    let shrink = Shrink { solution, points: &sample, effective_points: uncertainty.effective_points };
    let keeps_out = |at: &Estimate| {
        let Some((before, chance)) = present.as_deref().map(witness::total) else { return true };
        contradicted(at).is_none_or(|there| witness::total(&there).0 <= before + RIVAL_CONTRADICTED * chance)
    };
    let estimate = shrink.along(&open).filter(keeps_out);
    (open, estimate)
}

/// The directions (unit, in scaled local coordinates) in which no distance changes, and that move parts of which
/// something was scanned or where the scan shows empty space. A part of which the scan says nothing stays where it
/// began.
fn open_directions(
    solution: &Solution,
    uncertainty: &Uncertainty,
    contradicted: Option<&[Contradicted]>,
) -> Vec<DVector<f64>> {
    let Level { problem, space, .. } = &solution.level;
    let parts = problem.model.parts();
    let patches = &solution.evaluation.patches;
    let stands_in_empty_space = |patch: usize| contradicted.is_some_and(|c| c[patch].area > 0.0);
    let concerns = |k: usize| {
        let Some(i) = space.free.get(k) else { return true };
        space.followers(*i).any(|i| {
            (0..parts.len()).any(|patch| {
                let seen = !patches[patch].is_hidden() || stands_in_empty_space(patch);
                seen && parts[patch].active.contains(&(i as u32))
            })
        })
    };
    let mut open: Vec<DVector<f64>> = uncertainty.undetermined.clone();
    let in_some = |open: &[DVector<f64>], k: usize| open.iter().any(|d| d[k].abs() > DETERMINED);
    for k in 0..space.dim() {
        let undetermined = matches!(uncertainty.without[k], Some(WithoutSd::NotDetermined | WithoutSd::ScanEnds));
        if undetermined && !in_some(&open, k) {
            open.push(DVector::from_fn(space.dim(), |j, _| f64::from(u8::from(j == k))));
        }
    }
    open.retain(|d| (0..d.len()).all(|k| d[k].abs() < DETERMINED || concerns(k)));
    open
}

/// The search for less surface.
struct Shrink<'s> {
    solution: &'s Solution<'s>,
    points: &'s Points,
    effective_points: f64,
}

impl Shrink<'_> {
    /// Goes along some directions, both ways, as long as the surface becomes less and the scan does not protest. None
    /// where nothing can be gained.
    fn along(&self, open: &[DVector<f64>]) -> Option<Estimate> {
        let Level { problem, .. } = &self.solution.level;
        let objective = Objective { cancellable: true, ..self.solution.objective(self.points) };
        let before = objective.evaluate(&self.solution.estimate, Order::Value)?.value;
        // Twice the logarithm of the likelihood ratio.
        let protest = |at: &Estimate| {
            let after = objective.evaluate(at, Order::Value)?.value;
            Some(self.effective_points * (after / before.max(f64::MIN_POSITIVE)).ln())
        };
        let whole = |at: &Estimate| area(&self.solution.level, at, |_| true);
        let first = whole(&self.solution.estimate)?;
        let (mut at, mut least) = (self.solution.estimate.clone(), first);
        for n in 0..LEAST_ROUNDS {
            let round = least;
            for way in ways(open, n) {
                let mut step = LEAST_FIRST_STEP * problem.radius;
                while step > LEAST_LAST_STEP * problem.radius && !problem.monitor.cancelled() {
                    let there = self.solution.level.space.retract(&at, (&way * step).as_slice());
                    let less = whole(&there).filter(|area| *area < least * (1.0 - LEAST_AREA_GAIN));
                    match less.filter(|_| protest(&there).is_some_and(|protest| protest < LEAST_PROTEST)) {
                        Some(area) => (at, least, step) = (there, area, 2.0 * step),
                        None => step *= 0.5,
                    }
                }
            }
            if !(least < round * (1.0 - LEAST_AREA_GAIN)) {
                break;
            }
        }
        (least < first).then_some(at)
    }
}

/// Both ways along every direction, and along mixtures of them, other ones in every round: both ends of a pipe that may
/// also slide come to where the scan ends along different ones.
fn ways(open: &[DVector<f64>], round: u32) -> Vec<DVector<f64>> {
    let mut ways = open.to_vec();
    if open.len() > 1 {
        ways.extend((0..LEAST_MIXTURES).map(|n| {
            let share = |axis: usize| 2.0 * halton(1 + (round * LEAST_MIXTURES + n) as usize, axis) - 1.0;
            open.iter().enumerate().map(|(axis, d)| d * share(axis)).sum::<DVector<f64>>().normalize()
        }));
    }
    ways.into_iter().flat_map(|way| [-&way, way]).collect()
}
