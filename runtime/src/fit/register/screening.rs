//! Screening: candidates near the start, or in orientations that cover all rotations.

use super::Seeds;
use super::candidate::{Candidate, by_value, climb, distinct, objective};
use super::distance_field::DistanceField;
use super::restart::{Restart, Scope, restart};
use super::shape_proposals::propose;
use crate::fit::options::FitOptions;
use crate::fit::problem::isometry::{Isometry, random_rotation, rotations};
use crate::fit::problem::level::Level;
use crate::fit::problem::objective::Order;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::points::Points;
use crate::fit::tuning::{
    ALIGNED_AGAIN, ALIGNMENT_FEW, ALIGNMENT_POINTS, ALIGNMENT_SCALE, BESIDE, CAPTURED, CLEARLY_BETTER, COMPARED, FINE,
    GLOBAL_RUNGS, HOPELESS, NEAR_RUNGS, ORIENTATIONS, PER_SHAPE, POSE_RUNGS, RESTARTED, Rung, SAME_PARAMETERS, WIDEST,
};
use glam::DVec3;
use rayon::prelude::*;

/// Shares of the time of a global search until all orientations are aligned, and until the best are optimised. Then
/// parts are restarted.
const ORIENTED: f64 = 0.05;
const CLIMBED: f64 = 0.1;

/// The best place to begin from near the start, with its inlier ratio. `searched` says whether there are others, far
/// from it.
pub(crate) fn near(level: &Level, seeds: &Seeds, searched: bool) -> (Candidate, f64) {
    let from = Candidate::new(level, seeds.start.clone());
    let points = level.problem.thin.sample(COMPARED);
    let FitOptions { earlier, start, .. } = level.problem.options;
    if earlier.is_some() && start.is_empty() {
        // Wide scales of the loss would only lead away from where the earlier fit ended.
        let ratio = inlier_ratio(level, &points, FINE, &from);
        if ratio > level.problem.convincing() {
            return (from, ratio);
        }
    }
    // A start so far off that hardly a point feels it is brought nearer with wider scales.
    let [first, last] = NEAR_RUNGS;
    let mut scales = first.scales.to_vec();
    while scales[0] < WIDEST && inlier_ratio(level, &points, scales[0], &from) < CAPTURED {
        scales.insert(0, 2.0 * scales[0]);
    }
    let candidates = climb(level, vec![from.clone()], &[Rung { scales: &scales, ..first }, last]);
    let Some(candidate) = candidates.into_iter().next() else { return (from, 0.0) };
    let ratio = inlier_ratio(level, &points, FINE, &candidate);
    // So far off, there are better places to begin from than any that differ by a part.
    if searched && ratio < HOPELESS {
        return (candidate, ratio);
    }
    let candidate = restart(&plan(level, seeds, &points, (0.0, CLIMBED)), candidate);
    let ratio = inlier_ratio(level, &points, FINE, &candidate);
    (candidate, ratio)
}

/// The share of points near a candidate, by a scale of the loss.
fn inlier_ratio(level: &Level, points: &Points, scale: f64, at: &Candidate) -> f64 {
    let evaluation = objective(level, points, scale, None).evaluate(&at.estimate, Order::Value);
    evaluation.map_or(0.0, |e| e.inliers() / points.weight())
}

fn plan<'s>(level: &'s Level<'s>, seeds: &'s Seeds, points: &'s Points, span: (f64, f64)) -> Restart<'s> {
    Restart { level, seeds, points, scale: FINE, scope: Scope::All, span }
}

/// The best place to begin from of all orientations, of the start's shape, the script's default shape and others that
/// resemble the scan. In later rounds, and if what is found is not convincing, the scan may be a part of the object:
/// its middle is then not the model's, and the orientations are tried once more with places beside the model's middle.
pub(super) fn anywhere(level: &Level, seeds: &Seeds, round: usize) -> Option<Candidate> {
    let Seeds { start, reference: defaults } = seeds;
    let mut shapes = vec![start.clone()];
    if level.space.apart(defaults, start) > SAME_PARAMETERS * level.problem.radius {
        shapes.push(defaults.clone());
    }
    shapes.extend(propose(level, start, round));
    let points = level.problem.thin.sample(COMPARED);
    let whole = best_of(level, seeds, &shapes, &points, Middle::Same);
    let convincing = |c: &Candidate| inlier_ratio(level, &points, FINE, c) > level.problem.convincing();
    if round == 0 && whole.as_ref().is_some_and(convincing) || level.problem.monitor.cancelled() {
        return whole;
    }
    let part = best_of(level, seeds, &shapes, &points, Middle::Beside);
    by_value(whole.into_iter().chain(part).collect()).into_iter().next()
}

/// The best place to begin from of all orientations of the start's shape, if it is convincing: parts are not restarted.
pub(super) fn of_known_shape(level: &Level, seeds: &Seeds) -> Option<Candidate> {
    let oriented = distinct(level, orientations(level, &seeds.start, Middle::Same), PER_SHAPE);
    let candidate = climb(level, oriented, &GLOBAL_RUNGS).into_iter().next()?;
    let points = level.problem.thin.sample(COMPARED);
    (inlier_ratio(level, &points, FINE, &candidate) > level.problem.convincing()).then_some(candidate)
}

/// Whether the objective of a candidate is clearly below that of another one, at one scale and over the same points.
pub(super) fn is_clearly_better(level: &Level, candidate: &Candidate, other: &Candidate) -> bool {
    let points = level.problem.thin.sample(COMPARED);
    let value = |at: &Candidate| {
        let evaluation = objective(level, &points, FINE, None).evaluate(&at.estimate, Order::Value);
        evaluation.map_or(f64::INFINITY, |e| e.value)
    };
    value(candidate) < CLEARLY_BETTER * value(other)
}

/// Candidates for the pose alone of a model whose shape is known, in all orientations, best first: the parameters of
/// `level` are held. The scan may show any part of the model.
pub(crate) fn poses(level: &Level) -> Vec<Candidate> {
    let shape = Estimate { z: Vec::new(), motion: Isometry::IDENTITY };
    let oriented = [Middle::Same, Middle::Beside].into_iter();
    let oriented = oriented.flat_map(|middle| distinct(level, orientations(level, &shape, middle), PER_SHAPE));
    climb(level, by_value(oriented.collect()), &POSE_RUNGS)
}

/// Where the middle of the scan is on the model.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Middle {
    /// In its middle.
    Same,
    /// Beside it, in one of six directions.
    Beside,
}

impl Middle {
    /// Places on a model by its own middle and its radius of gyration. Millimetres.
    fn places(self, centre: DVec3, gyration: f64) -> Vec<DVec3> {
        match self {
            Self::Same => vec![centre],
            Self::Beside => {
                DVec3::AXES.iter().flat_map(|a| [-1.0, 1.0].map(|s| centre + s * BESIDE * gyration * *a)).collect()
            }
        }
    }
}

/// The best candidate over some shapes in all orientations, by the points by which candidates are compared.
fn best_of(level: &Level, seeds: &Seeds, shapes: &[Estimate], points: &Points, middle: Middle) -> Option<Candidate> {
    let monitor = level.problem.monitor;
    let count = shapes.len();
    let oriented = shapes.iter().enumerate().flat_map(|(n, shape)| {
        let done = ORIENTED * n as f64 / count as f64;
        monitor.reach(done, &format!("orientations of shape {} of {count}", n + 1));
        distinct(level, orientations(level, shape, middle), PER_SHAPE)
    });
    let oriented = by_value(oriented.collect());
    monitor.reach(ORIENTED, "the best orientations");
    let candidates = climb(level, oriented, &GLOBAL_RUNGS);
    let candidates = distinct(level, candidates, RESTARTED).into_iter();
    let begin = |n: usize| CLIMBED + (1.0 - CLIMBED) * n as f64 / RESTARTED as f64;
    let restarted = candidates
        .enumerate()
        .map(|(n, candidate)| restart(&plan(level, seeds, points, (begin(n), begin(n + 1))), candidate));
    by_value(restarted.collect()).into_iter().next()
}

/// Every orientation with the parameters of `shape`, aligned rigidly with the scan; best first.
fn orientations(level: &Level, shape: &Estimate, middle: Middle) -> Vec<Candidate> {
    let points = level.problem.thin.sample(ALIGNMENT_POINTS);
    let few = points.every(ALIGNMENT_FEW);
    let objective = objective(level, &points, ALIGNMENT_SCALE, None);
    let Ok(placed) = objective.place(shape) else { return Vec::new() };
    let Some(field) = DistanceField::new(&placed.facets, level.problem.radius) else { return Vec::new() };
    let (centre, gyration) = placed.facets.moments();
    let align = |motions: Vec<Isometry>, points: &Points| {
        let align = |motion| {
            let (motion, value) = field.align(points, objective.loss, motion, centre);
            Candidate { value, ..Candidate::new(level, Estimate { z: shape.z.clone(), motion }) }
        };
        by_value(motions.into_par_iter().map(align).collect())
    };
    let turn = random_rotation(level.problem.options.seed);
    let mut motions = vec![shape.motion];
    let places = middle.places(centre, gyration);
    for rotation in rotations(ORIENTATIONS) {
        motions.extend(places.iter().map(|place| Isometry::taking(turn * rotation, *place, points.mean())));
    }
    // Few points tell the hopeless orientations.
    let aligned = align(motions, &few);
    align(aligned.into_iter().take(ALIGNED_AGAIN).map(|c| c.estimate.motion).collect(), &points)
}
