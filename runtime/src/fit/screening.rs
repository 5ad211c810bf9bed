//! Where to begin: orientations that cover all rotations are tried coarsely, the best are taken further.

use super::field::DistanceField;
use super::figure::Figure;
use super::gauss_newton::{self, Stop};
use super::loss::Loss;
use super::motion::{Motion, random_rotation, rotations};
use super::objective::{Objective, Order};
use super::points::Points;
use super::proposals;
use super::restart::{Known, Scope, restart};
use super::setting::Setting;
use super::space::Estimate;
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
    pub(crate) fn new(setting: &Setting, estimate: Estimate) -> Self {
        Self { estimate, value: f64::INFINITY, inliers: 0.0, signs: vec![0; setting.model.parts().len()] }
    }
}

/// The best place to begin from near a start. `searched` says whether there are others, far from it.
pub(crate) fn approach(setting: &Setting, start: &Estimate, searched: bool) -> Candidate {
    let from = Candidate::new(setting, start.clone());
    let points = setting.thin.sample(1500);
    let mut scales = vec![0.3, 0.2];
    // A start so far off that hardly a point feels it is brought nearer with wider scales.
    while scales[0] < 20.0 && inliers(setting, &points, scales[0], &from) < 0.5 {
        scales.insert(0, 2.0 * scales[0]);
    }
    let found = advance(setting, vec![from.clone()], 500, &scales, false);
    let found = advance(setting, sides(setting, found), 1000, &[0.14, 0.1, FINE], true);
    let Some(mut found) = found.into_iter().next() else { return from };
    found.inliers = inliers(setting, &points, FINE, &found);
    // So far off, there are better places to begin from than any that differ by a part.
    if searched && found.inliers < HOPELESS {
        return found;
    }
    let mut found = restart(setting, Known { start, home: start }, &points, FINE, Scope::All, found);
    found.inliers = inliers(setting, &points, FINE, &found);
    found
}

/// The fraction of points near a candidate, by a scale of psi.
fn inliers(setting: &Setting, points: &Points, scale: f64, at: &Candidate) -> f64 {
    let objective = setting.objective(&setting.space, points, Loss::welsch(scale * setting.radius));
    let evaluation = objective.evaluate(&at.estimate, Order::Value);
    evaluation.map_or(0.0, |e| e.inliers() / points.len().max(1) as f64)
}

/// The best place to begin from: of all orientations, of the start's shape, the script's default shape and others that
/// resemble the scan.
pub(crate) fn screen(setting: &Setting, start: &Estimate, defaults: &Estimate) -> Option<Candidate> {
    let mut shapes = vec![start.clone()];
    if setting.space.apart(defaults, start) > 0.05 * setting.radius {
        shapes.push(defaults.clone());
    }
    shapes.extend(proposals::propose(setting, start, PROPOSALS));
    let mut candidates: Vec<Candidate> =
        shapes.iter().flat_map(|shape| distinct(setting, orientations(setting, shape), 12)).collect();
    candidates.sort_by(|a, b| a.value.total_cmp(&b.value));
    let candidates = distinct(setting, candidates, 20);
    let candidates = advance(setting, candidates, 350, &[0.3], false);
    let candidates = distinct(setting, candidates, 12);
    let candidates = advance(setting, candidates, 500, &[0.2], false);
    let candidates = distinct(setting, candidates, 5);
    let candidates = advance(setting, sides(setting, candidates), 1000, &[0.14, 0.1], true);
    let candidates = distinct(setting, candidates, 3);
    let candidates = advance(setting, candidates, 1500, &[FINE], true);
    let points = setting.thin.sample(1500);
    let known = Known { start, home: defaults };
    let mut best: Vec<Candidate> = distinct(setting, candidates, 2)
        .into_iter()
        .map(|candidate| restart(setting, known, &points, FINE, Scope::All, candidate))
        .collect();
    best.sort_by(|a, b| a.value.total_cmp(&b.value));
    best.into_iter().next()
}

/// Every orientation, moved rigidly to where it fits best, with the parameters of `shape`.
fn orientations(setting: &Setting, shape: &Estimate) -> Vec<Candidate> {
    let points = setting.thin.sample(350);
    let few = points.every(90);
    let loss = Loss::welsch(0.35 * setting.radius);
    let objective = setting.objective(&setting.space, &points, loss);
    let Ok(placed) = objective.place(shape) else { return Vec::new() };
    let Some(field) = DistanceField::new(&placed.facets, 0.5 * setting.radius) else { return Vec::new() };
    let (centre, ..) = placed.facets.moments();
    let target = points.centre();
    let turn = random_rotation(setting.seed);
    let mut motions = vec![shape.motion];
    motions.extend(rotations(ORIENTATIONS).into_iter().map(|r| Motion::taking(turn * r, centre, target)));
    let settle = |motions: Vec<Motion>, points: &Points, steps| {
        let settle = |motion| {
            let (motion, value) = field.settle(points, loss, motion, centre, steps);
            let estimate = Estimate { z: shape.z.clone(), motion };
            Candidate { value, ..Candidate::new(setting, estimate) }
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
fn advance(setting: &Setting, candidates: Vec<Candidate>, count: usize, scales: &[f64], sided: bool) -> Vec<Candidate> {
    let points = setting.thin.sample(count);
    let mut found: Vec<Candidate> = candidates
        .into_par_iter()
        .filter_map(|mut candidate| {
            for scale in scales {
                let loss = Loss::welsch(scale * setting.radius);
                let objective = Objective {
                    signs: sided.then_some(&candidate.signs),
                    ..setting.objective(&setting.space, &points, loss)
                };
                let stop = Stop { iterations: 8, step: 0.03 * loss.sigma };
                let Some(minimum) = gauss_newton::minimise(&objective, candidate.estimate.clone(), stop) else {
                    // Whoever does not want to wait any longer gets what there is.
                    return setting.progress.cancelled().then_some(candidate);
                };
                if !sided {
                    candidate.signs = setting.facing(&minimum.evaluation, &candidate.signs);
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
fn sides(setting: &Setting, candidates: Vec<Candidate>) -> Vec<Candidate> {
    let points = setting.thin.sample(2000);
    let loss = Loss::welsch(0.2 * setting.radius);
    let learn = |mut candidate: Candidate| {
        if let Some(there) =
            setting.objective(&setting.space, &points, loss).evaluate(&candidate.estimate, Order::Value)
        {
            candidate.signs = setting.facing(&there, &candidate.signs);
        }
        candidate
    };
    candidates.into_par_iter().map(learn).collect()
}

/// The best `count` candidates of which no two are the same: their parameters nearly, and where their parts are.
fn distinct(setting: &Setting, candidates: Vec<Candidate>, count: usize) -> Vec<Candidate> {
    let mut kept: Vec<(Candidate, Figure)> = Vec::new();
    // Neighbours in the list often have the same parameters.
    let mut shape: Option<(Vec<f64>, Figure)> = None;
    for candidate in candidates {
        if kept.len() == count {
            break;
        }
        let at = &candidate.estimate;
        if shape.as_ref().is_none_or(|(z, _)| *z != at.z) {
            shape = Figure::of(&setting.space, &at.z).map(|figure| (at.z.clone(), figure));
        }
        let Some((_, figure)) = &shape else { continue };
        let figure = figure.moved(at);
        let same = |(other, its): &(Candidate, Figure)| {
            setting.space.apart(at, &other.estimate) < 0.05 * setting.radius && figure.same(its, setting.radius)
        };
        if !kept.iter().any(same) {
            kept.push((candidate, figure));
        }
    }
    kept.into_iter().map(|(candidate, _)| candidate).collect()
}
