//! Candidates for the place from which the refinement begins.

use super::part_moments::PartMoments;
use crate::fit::optimise::gauss_newton::{self, Stop};
use crate::fit::problem::level::Level;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Objective, Order};
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::points::Points;
use crate::fit::tuning::{RUNG_ITERATIONS, RUNG_STEP, Rung, SAME_PARAMETERS, SIDES_POINTS, SIDES_SCALE};
use rayon::prelude::*;

/// A place to begin from.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub(crate) estimate: Estimate,
    /// The objective where the candidate was last evaluated.
    pub(crate) value: f64,
    /// Per patch, which way is out, as learnt so far (see `Facing`).
    pub(crate) signs: Vec<i8>,
}

impl Candidate {
    /// A candidate of which nothing is known.
    pub(crate) fn new(level: &Level, estimate: Estimate) -> Self {
        Self { estimate, value: f64::INFINITY, signs: vec![0; level.problem.model.parts().len()] }
    }
}

/// The objective over some points at a scale of the loss in radii of the scan, with the sides of patches where they are
/// known.
pub(crate) fn objective<'s>(
    level: &'s Level<'s>,
    points: &'s Points,
    scale: f64,
    signs: Option<&'s [i8]>,
) -> Objective<'s> {
    Objective { signs, ..level.objective(points, Loss::welsch(scale * level.problem.radius)) }
}

/// Minimises an objective from a candidate, and learns anew which way patches face if `sides` says so. None where the
/// model does not exist or the fit is cancelled.
pub(crate) fn minimise(
    level: &Level,
    objective: &Objective,
    from: &Candidate,
    stop: Stop,
    sides: bool,
) -> Option<Candidate> {
    let minimum = gauss_newton::minimise(objective, from.estimate.clone(), stop)?;
    let signs = if sides { level.problem.facing(&minimum.evaluation, &from.signs) } else { from.signs.clone() };
    Some(Candidate { estimate: minimum.estimate, value: minimum.evaluation.value, signs })
}

/// Candidates by their values, best first.
pub(crate) fn by_value(mut candidates: Vec<Candidate>) -> Vec<Candidate> {
    candidates.sort_by(|a, b| a.value.total_cmp(&b.value));
    candidates
}

/// Anneals candidates (best first) rung by rung: the best distinct ones of every rung go on to the next.
pub(crate) fn climb(level: &Level, mut candidates: Vec<Candidate>, rungs: &[Rung]) -> Vec<Candidate> {
    let mut sided = false;
    for rung in rungs {
        candidates = distinct(level, candidates, rung.candidates);
        if rung.sided && !sided {
            candidates = learn_sides(level, candidates);
        }
        sided = rung.sided;
        candidates = anneal(level, candidates, rung);
    }
    candidates
}

/// Minimises over all coordinates of every candidate at the rung's scales in turn.
fn anneal(level: &Level, candidates: Vec<Candidate>, rung: &Rung) -> Vec<Candidate> {
    let points = level.problem.thin.sample(rung.points);
    let anneal = |mut candidate: Candidate| {
        for scale in rung.scales {
            let objective = objective(level, &points, *scale, rung.sided.then_some(candidate.signs.as_slice()));
            let stop = Stop { iterations: RUNG_ITERATIONS, step: RUNG_STEP * objective.loss.sigma };
            match minimise(level, &objective, &candidate, stop, !rung.sided) {
                Some(better) => candidate = better,
                // Once the fit is cancelled the candidates stay as they are.
                None => return level.problem.monitor.cancelled().then_some(candidate),
            }
        }
        Some(candidate)
    };
    by_value(candidates.into_par_iter().filter_map(anneal).collect())
}

/// Learns which way the patches face from more points than the candidates were fitted to: small patches have few.
fn learn_sides(level: &Level, candidates: Vec<Candidate>) -> Vec<Candidate> {
    let points = level.problem.thin.sample(SIDES_POINTS);
    let learn = |mut candidate: Candidate| {
        let objective = objective(level, &points, SIDES_SCALE, None);
        if let Some(evaluation) = objective.evaluate(&candidate.estimate, Order::Value) {
            candidate.signs = level.problem.facing(&evaluation, &candidate.signs);
        }
        candidate
    };
    candidates.into_par_iter().map(learn).collect()
}

/// The best `count` candidates of which no two have nearly the same parameters and their parts at the same places.
pub(crate) fn distinct(level: &Level, candidates: Vec<Candidate>, count: usize) -> Vec<Candidate> {
    let radius = level.problem.radius;
    let mut chosen: Vec<(Candidate, PartMoments)> = Vec::new();
    // Neighbours in the list often have the same parameters.
    let mut shape: Option<(Vec<f64>, PartMoments)> = None;
    for candidate in candidates {
        if chosen.len() == count {
            break;
        }
        let Estimate { z, motion } = &candidate.estimate;
        if shape.as_ref().is_none_or(|(last, _)| last != z) {
            shape = PartMoments::of(&level.space, z).map(|moments| (z.clone(), moments));
        }
        let Some((_, moments)) = &shape else { continue };
        let moments = moments.moved(motion);
        let same = |(other, moments_of_other): &(Candidate, PartMoments)| {
            level.space.apart(&candidate.estimate, &other.estimate) < SAME_PARAMETERS * radius
                && moments.same(moments_of_other, radius)
        };
        if !chosen.iter().any(same) {
            chosen.push((candidate, moments));
        }
    }
    chosen.into_iter().map(|(candidate, _)| candidate).collect()
}
