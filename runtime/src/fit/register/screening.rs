//! Where to begin: orientations that cover all rotations are tried coarsely, the best are taken further.

use super::distance_field::DistanceField;
use super::figure::Figure;
use super::proposals;
use super::restart::{Scope, Seeds, restart};
use crate::fit::problem::isometry::{Isometry, random_rotation, rotations};
use crate::fit::problem::level::Level;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Objective, Order};
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::points::Points;
use crate::fit::refine::gauss_newton::{self, Stop};
use rayon::prelude::*;

/// The finest scale of psi here, as a fraction of the scan's radius.
pub(crate) const FINE: f64 = 0.07;
/// Shapes beside the start's and the default.
const PROPOSALS: usize = 4;
/// Orientations that are tried, and those of them that are looked at more closely.
const ORIENTATIONS: usize = 200;
const PROMISING: usize = 80;

/// A fraction of inliers below which a place is given up for another one.
const HOPELESS: f64 = 0.5;

/// A place to begin from, and the objective there.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub(crate) estimate: Estimate,
    pub(crate) value: f64,
    /// Fraction of inliers, where known.
    pub(crate) inliers: f64,
    /// Per patch, which way is out, as learnt so far (see `Facing`).
    pub(crate) signs: Vec<i8>,
}

impl Candidate {
    /// A candidate of which nothing is known.
    pub(crate) fn new(level: &Level, estimate: Estimate) -> Self {
        Self { estimate, value: f64::INFINITY, inliers: 0.0, signs: vec![0; level.problem.model.parts().len()] }
    }
}

/// The best place to begin from near a start. `searched` says whether there are others, far from it.
pub(crate) fn approach(level: &Level, start: &Estimate, searched: bool) -> Candidate {
    let from = Candidate::new(level, start.clone());
    let points = level.problem.thin.sample(1500);
    let mut scales = vec![0.3, 0.2];
    // A start so far off that hardly a point feels it is brought nearer with wider scales.
    while scales[0] < 20.0 && inliers(level, &points, scales[0], &from) < 0.5 {
        scales.insert(0, 2.0 * scales[0]);
    }
    let found = advance(level, vec![from.clone()], 500, &scales, false);
    let found = advance(level, sides(level, found), 1000, &[0.14, 0.1, FINE], true);
    let Some(mut found) = found.into_iter().next() else { return from };
    found.inliers = inliers(level, &points, FINE, &found);
    // So far off, there are better places to begin from than any that differ by a part.
    if searched && found.inliers < HOPELESS {
        return found;
    }
    let mut found =
        restart(level, &Seeds { start: start.clone(), reference: start.clone() }, &points, FINE, Scope::All, found);
    found.inliers = inliers(level, &points, FINE, &found);
    found
}

/// The fraction of points near a candidate, by a scale of psi.
fn inliers(level: &Level, points: &Points, scale: f64, at: &Candidate) -> f64 {
    let objective = level.objective(points, Loss::welsch(scale * level.problem.radius));
    let evaluation = objective.evaluate(&at.estimate, Order::Value);
    evaluation.map_or(0.0, |e| e.inliers() / points.len().max(1) as f64)
}

/// The best place to begin from: of all orientations, of the start's shape, the script's default shape and others that
/// resemble the scan.
pub(crate) fn screen(level: &Level, start: &Estimate, defaults: &Estimate) -> Option<Candidate> {
    let mut shapes = vec![start.clone()];
    if level.space.apart(defaults, start) > 0.05 * level.problem.radius {
        shapes.push(defaults.clone());
    }
    shapes.extend(proposals::propose(level, start, PROPOSALS));
    let mut candidates: Vec<Candidate> =
        shapes.iter().flat_map(|shape| distinct(level, orientations(level, shape), 12)).collect();
    candidates.sort_by(|a, b| a.value.total_cmp(&b.value));
    let candidates = distinct(level, candidates, 20);
    let candidates = advance(level, candidates, 350, &[0.3], false);
    let candidates = distinct(level, candidates, 12);
    let candidates = advance(level, candidates, 500, &[0.2], false);
    let candidates = distinct(level, candidates, 5);
    let candidates = advance(level, sides(level, candidates), 1000, &[0.14, 0.1], true);
    let candidates = distinct(level, candidates, 3);
    let candidates = advance(level, candidates, 1500, &[FINE], true);
    let points = level.problem.thin.sample(1500);
    let seeds = Seeds { start: start.clone(), reference: defaults.clone() };
    let mut best: Vec<Candidate> = distinct(level, candidates, 2)
        .into_iter()
        .map(|candidate| restart(level, &seeds, &points, FINE, Scope::All, candidate))
        .collect();
    best.sort_by(|a, b| a.value.total_cmp(&b.value));
    best.into_iter().next()
}

/// Every orientation, moved rigidly to where it fits best, with the parameters of `shape`.
fn orientations(level: &Level, shape: &Estimate) -> Vec<Candidate> {
    let points = level.problem.thin.sample(350);
    let few = points.every(90);
    let loss = Loss::welsch(0.35 * level.problem.radius);
    let objective = level.objective(&points, loss);
    let Ok(placed) = objective.place(shape) else { return Vec::new() };
    let Some(field) = DistanceField::new(&placed.facets, 0.5 * level.problem.radius) else { return Vec::new() };
    let (centre, _) = placed.facets.moments();
    let target = points.centre();
    let turn = random_rotation(level.problem.options.seed);
    let mut motions = vec![shape.motion];
    motions.extend(rotations(ORIENTATIONS).into_iter().map(|r| Isometry::taking(turn * r, centre, target)));
    let settle = |motions: Vec<Isometry>, points: &Points, steps| {
        let settle = |motion| {
            let (motion, value) = field.settle(points, loss, motion, centre, steps);
            let estimate = Estimate { z: shape.z.clone(), motion };
            Candidate { value, ..Candidate::new(level, estimate) }
        };
        let mut found: Vec<Candidate> = motions.into_par_iter().map(settle).collect();
        found.sort_by(|a, b| a.value.total_cmp(&b.value));
        found
    };
    // Few points tell the hopeless orientations.
    let found = settle(motions, &few, 8);
    settle(found.into_iter().take(PROMISING).map(|c| c.estimate.motion).collect(), &points, 8)
}

/// Optimises all coordinates of every candidate through scales of psi (fractions of the radius). Where the scales are
/// coarser than walls are thick, the sides are still to be learnt; after that they are `sided`.
fn advance(level: &Level, candidates: Vec<Candidate>, count: usize, scales: &[f64], sided: bool) -> Vec<Candidate> {
    let points = level.problem.thin.sample(count);
    let mut found: Vec<Candidate> = candidates
        .into_par_iter()
        .filter_map(|mut candidate| {
            for scale in scales {
                let loss = Loss::welsch(scale * level.problem.radius);
                let objective =
                    Objective { signs: sided.then_some(&candidate.signs), ..level.objective(&points, loss) };
                let stop = Stop { iterations: 8, step: 0.03 * loss.sigma };
                let Some(minimum) = gauss_newton::minimise(&objective, candidate.estimate.clone(), stop) else {
                    // Whoever does not want to wait any longer gets what there is.
                    return level.problem.monitor.progress.cancelled().then_some(candidate);
                };
                if !sided {
                    candidate.signs = level.problem.facing(&minimum.evaluation, &candidate.signs);
                }
                candidate.estimate = minimum.estimate;
                candidate.value = minimum.evaluation.value;
            }
            Some(candidate)
        })
        .collect();
    found.sort_by(|a, b| a.value.total_cmp(&b.value));
    found
}

/// Learns which way the patches face from more points than the candidates were fitted to: small patches have few.
fn sides(level: &Level, candidates: Vec<Candidate>) -> Vec<Candidate> {
    let points = level.problem.thin.sample(2000);
    let loss = Loss::welsch(0.2 * level.problem.radius);
    let learn = |mut candidate: Candidate| {
        if let Some(there) = level.objective(&points, loss).evaluate(&candidate.estimate, Order::Value) {
            candidate.signs = level.problem.facing(&there, &candidate.signs);
        }
        candidate
    };
    candidates.into_par_iter().map(learn).collect()
}

/// The best `count` candidates of which no two are the same: their parameters nearly, and where their parts are.
fn distinct(level: &Level, candidates: Vec<Candidate>, count: usize) -> Vec<Candidate> {
    let mut kept: Vec<(Candidate, Figure)> = Vec::new();
    // Neighbours in the list often have the same parameters.
    let mut shape: Option<(Vec<f64>, Figure)> = None;
    for candidate in candidates {
        if kept.len() == count {
            break;
        }
        let at = &candidate.estimate;
        if shape.as_ref().is_none_or(|(z, _)| *z != at.z) {
            shape = Figure::of(&level.space, &at.z).map(|figure| (at.z.clone(), figure));
        }
        let Some((_, figure)) = &shape else { continue };
        let figure = figure.moved(at);
        let same = |(other, its): &(Candidate, Figure)| {
            level.space.apart(at, &other.estimate) < 0.05 * level.problem.radius
                && figure.same(its, level.problem.radius)
        };
        if !kept.iter().any(same) {
            kept.push((candidate, figure));
        }
    }
    kept.into_iter().map(|(candidate, _)| candidate).collect()
}
