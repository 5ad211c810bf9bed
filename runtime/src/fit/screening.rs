//! Where to begin: orientations that cover all rotations are tried coarsely, the best are taken further.

use super::gauss_newton::{self, Minimum, Stop};
use super::loss::Welsch;
use super::motion::{Motion, rotations};
use super::objective::Order;
use super::schedule::Setting;
use super::space::{Estimate, Space};
use rayon::prelude::*;

/// Orientations that are tried.
const ORIENTATIONS: usize = 120;

/// A place to begin from, and the objective there.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub(crate) estimate: Estimate,
    pub(crate) value: f64,
}

/// Candidates for the pose and the parameters, best first, from all orientations. `start` is one of them.
pub(crate) fn screen(setting: &Setting, start: &Estimate) -> Vec<Candidate> {
    let rigid = setting.rigid(start);
    let candidates = orientations(setting, &rigid, start);
    let candidates = distinct(setting, candidates, 16);
    let candidates = advance(setting, candidates, 700, &[0.3, 0.2], 8);
    let candidates = distinct(setting, candidates, 5);
    let candidates = advance(setting, candidates, 2000, &[0.14, 0.1, 0.07], 8);
    distinct(setting, candidates, 3)
}

/// Every orientation, moved rigidly to where it fits best.
fn orientations(setting: &Setting, rigid: &Space, start: &Estimate) -> Vec<Candidate> {
    let points = setting.points.sample(400);
    let loss = Welsch { sigma: 0.35 * setting.radius };
    let objective = setting.objective(rigid, &points, loss);
    let home = Estimate { z: Vec::new(), motion: start.motion };
    let Ok(placed) = objective.place(&home) else { return Vec::new() };
    let (centre, ..) = placed.facets.moments();
    let target = points.centre();
    let mut motions = vec![start.motion];
    motions.extend(rotations(ORIENTATIONS).into_iter().map(|r| Motion::taking(r, centre, target)));
    let mut found: Vec<Candidate> = motions
        .into_par_iter()
        .filter_map(|motion| {
            let mut at = Estimate { z: Vec::new(), motion };
            let mut evaluation = objective.evaluate_placed(&placed, &at, Order::Normal)?;
            for _ in 0..6 {
                let step = gauss_newton::damped_step(&evaluation, &rigid.room(&at), 1e-3)?;
                let next = rigid.retract(&at, step.as_slice());
                let there = objective.evaluate_placed(&placed, &next, Order::Normal)?;
                if there.value >= evaluation.value {
                    break;
                }
                at = next;
                evaluation = there;
            }
            Some(Candidate { estimate: Estimate { z: start.z.clone(), motion: at.motion }, value: evaluation.value })
        })
        .collect();
    found.sort_by(|a, b| a.value.total_cmp(&b.value));
    found
}

/// Optimises all coordinates of every candidate through scales of psi (fractions of the radius).
fn advance(
    setting: &Setting,
    candidates: Vec<Candidate>,
    count: usize,
    scales: &[f64],
    iterations: u32,
) -> Vec<Candidate> {
    let points = setting.points.sample(count);
    let mut found: Vec<Candidate> = candidates
        .into_par_iter()
        .filter_map(|candidate| {
            let mut at = candidate.estimate;
            let mut value = candidate.value;
            for scale in scales {
                let objective = setting.objective(&setting.space, &points, Welsch { sigma: scale * setting.radius });
                let stop = Stop { iterations, step: 2e-3 * setting.radius };
                let Minimum { estimate, evaluation, .. } = gauss_newton::minimise(&objective, at, stop)?;
                at = estimate;
                value = evaluation.value;
            }
            Some(Candidate { estimate: at, value })
        })
        .collect();
    found.sort_by(|a, b| a.value.total_cmp(&b.value));
    found
}

/// The best `count` candidates of which no two are the same.
fn distinct(setting: &Setting, candidates: Vec<Candidate>, count: usize) -> Vec<Candidate> {
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in candidates {
        if kept.len() == count {
            break;
        }
        let same = |other: &Candidate| {
            let (a, b) = (&candidate.estimate, &other.estimate);
            let turn = a.motion.rotation.angle_between(b.motion.rotation);
            let c = setting.space.centre;
            turn < 0.15
                && a.motion.apply(c).distance(b.motion.apply(c)) < 0.05 * setting.radius
                && setting.space.apart(a, b) < 0.05 * setting.radius
        };
        if !kept.iter().any(same) {
            kept.push(candidate);
        }
    }
    kept
}
