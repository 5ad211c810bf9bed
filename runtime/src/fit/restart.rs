//! Second chances for parameters that shape only some parts (a handle): the rest of the model may fit well while they are
//! stuck in a wrong valley, or while the model is turned about the rest's axis of symmetry.

use super::gauss_newton::{self, Stop};
use super::loss::Welsch;
use super::objective::{Objective, Order};
use super::points::Points;
use super::proposals::halton;
use super::schedule::Setting;
use super::screening::Candidate;
use super::space::{Estimate, Space};
use glam::DVec3;
use nalgebra::{Matrix6, SymmetricEigen, Vector6};
use rayon::prelude::*;

/// Values of a group's parameters that are tried, beside the present ones and the start's.
const VARIANTS: usize = 48;
/// Angles about an axis of symmetry.
const ANGLES: u32 = 16;
/// The variants that are always optimised: the present values and the start's.
const KNOWN: usize = 2;
/// Others that are optimised.
const PURSUED: usize = 6;

/// Parameters that shape the same patches, and not all of them.
struct Group {
    /// Positions in the space's list of free parameters.
    members: Vec<usize>,
    patches: Vec<bool>,
}

/// Tries other values of every group of local parameters; returns the candidate, or a better one.
pub(crate) fn restart(
    setting: &Setting,
    start: &Estimate,
    points: &Points,
    scale: f64,
    candidate: Candidate,
) -> Candidate {
    let mut best = candidate;
    for group in groups(setting) {
        if let Some(better) = retry(setting, start, points, scale, &group, &best) {
            best = better;
        }
    }
    best
}

fn groups(setting: &Setting) -> Vec<Group> {
    let parts = setting.model.parts();
    let mut groups: Vec<Group> = Vec::new();
    for (k, i) in setting.space.free.iter().enumerate() {
        let patches: Vec<bool> = parts.iter().map(|p| p.active.contains(&(*i as u32))).collect();
        if patches.iter().all(|p| *p) || !patches.contains(&true) {
            continue;
        }
        match groups.iter_mut().find(|g| g.patches == patches) {
            Some(group) => group.members.push(k),
            None => groups.push(Group { members: vec![k], patches }),
        }
    }
    groups
}

fn retry(
    setting: &Setting,
    start: &Estimate,
    points: &Points,
    scale: f64,
    group: &Group,
    from: &Candidate,
) -> Option<Candidate> {
    let fine = Welsch { sigma: scale * setting.radius };
    let objective = Objective { signs: Some(&from.signs), ..setting.objective(&setting.space, points, fine) };
    // What the other patches explain says nothing about this group.
    let (rest, axis) = unexplained(&objective, &from.estimate, group)?;
    if rest.len() < 8 {
        return None;
    }
    let rest = rest.sample(250);
    let variants = variants(setting, start, group, from);
    let coarse = Welsch { sigma: 0.1 * setting.radius };
    let coarse = Objective { signs: Some(&from.signs), ..setting.objective(&setting.space, &rest, coarse) };
    let ranked: Vec<(usize, Candidate)> = variants
        .into_par_iter()
        .enumerate()
        .flat_map_iter(|(number, estimate)| {
            let placed = coarse.place(&estimate).ok();
            let turns = if axis.is_some() { ANGLES } else { 1 };
            let tried: Vec<(usize, Candidate)> = (0..turns)
                .filter_map(|turn| {
                    let mut at = estimate.clone();
                    if let Some((shift, rotation)) = axis {
                        let angle = std::f64::consts::TAU * f64::from(turn) / f64::from(ANGLES);
                        at.motion = at.motion.after_local(shift * angle, rotation * angle, setting.space.centre);
                    }
                    let value = coarse.evaluate_placed(placed.as_ref()?, &at, Order::Value)?.value;
                    Some((number, Candidate { estimate: at, value, signs: from.signs.clone() }))
                })
                .collect();
            tried
        })
        .collect();
    let ranked = diverse(setting, group, ranked);
    let mut pursued: Vec<Candidate> = ranked
        .into_par_iter()
        .filter_map(|candidate| pursue(setting, points, &rest, group, scale, candidate))
        .collect();
    pursued.sort_by(|a, b| a.value.total_cmp(&b.value));
    let least = pursued.first()?.value;
    // Among equals (a curve run backwards is the same curve) the one nearest to the start.
    let away = |c: &Candidate| setting.space.apart(&c.estimate, start);
    let best =
        pursued.into_iter().take_while(|c| c.value <= least * 1.002).min_by(|a, b| away(a).total_cmp(&away(b)))?;
    let present = objective.evaluate(&from.estimate, Order::Value)?.value;
    let better = best.value < present * 0.998 || (best.value <= present * 1.002 && away(&best) < away(from));
    better.then_some(best)
}

/// The best of the present values and of the start's, and the best others that are not nearly the same.
fn diverse(setting: &Setting, group: &Group, mut ranked: Vec<(usize, Candidate)>) -> Vec<Candidate> {
    ranked.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
    let mut chosen: Vec<Candidate> = Vec::new();
    for known in 0..KNOWN {
        chosen.extend(ranked.iter().find(|(number, _)| *number == known).map(|(_, c)| c.clone()));
    }
    let apart = |a: &Estimate, b: &Estimate| {
        let c = setting.space.centre;
        let turned = a.motion.rotation.angle_between(b.motion.rotation) > 0.1;
        turned || a.motion.apply(c).distance(b.motion.apply(c)) > 0.1 * setting.radius || {
            let moved = |k: &usize| setting.space.coordinate_distance(*k, a, b);
            group.members.iter().map(moved).fold(0.0, f64::max) > 0.15 * setting.radius
        }
    };
    for (_, candidate) in ranked {
        if chosen.len() < KNOWN + PURSUED && chosen.iter().all(|c| apart(&c.estimate, &candidate.estimate)) {
            chosen.push(candidate);
        }
    }
    chosen
}

/// Optimises the group on the unexplained points, then everything on all.
fn pursue(
    setting: &Setting,
    points: &Points,
    rest: &Points,
    group: &Group,
    scale: f64,
    candidate: Candidate,
) -> Option<Candidate> {
    let Candidate { estimate, signs, .. } = candidate;
    let x = setting.space.x(&estimate.z)?;
    let free: Vec<usize> = group.members.iter().map(|k| setting.space.free[*k]).collect();
    let mut local = Space::new(setting.model, &x, free, false);
    local.copy_scale(&setting.space);
    let at = local.estimate(&x, estimate.motion);
    let sided = |space, points, sigma: f64| Objective {
        signs: Some(&signs),
        ..setting.objective(space, points, Welsch { sigma: sigma * setting.radius })
    };
    let stop = Stop { iterations: 12, step: 1e-3 * setting.radius };
    let at = gauss_newton::minimise(&sided(&local, rest, 1.2 * scale), at, stop)?.estimate;
    let x = local.x(&at.z)?;
    let at = setting.space.estimate(&x, at.motion);
    let stop = Stop { iterations: 12, step: 5e-4 * setting.radius };
    let minimum = gauss_newton::minimise(&sided(&setting.space, points, scale), at, stop)?;
    Some(Candidate { estimate: minimum.estimate, value: minimum.evaluation.value, signs })
}

/// The present values, the start's, and values spread over the bounds.
fn variants(setting: &Setting, start: &Estimate, group: &Group, from: &Candidate) -> Vec<Estimate> {
    let with = |values: &dyn Fn(usize) -> f64| {
        let mut estimate = from.estimate.clone();
        for (n, k) in group.members.iter().enumerate() {
            estimate.z[*k] = values(n);
        }
        estimate
    };
    let ranges: Vec<(f64, f64)> =
        group.members.iter().map(|k| setting.space.search_range(*k, start.z[*k], setting.radius)).collect();
    let mut variants = vec![from.estimate.clone(), with(&|n| start.z[group.members[n]])];
    variants.extend((1..=VARIANTS).map(|i| {
        with(&|n| {
            let (low, high) = ranges[n];
            low + (high - low) * halton(i, n)
        })
    }));
    variants
}

/// The points that no patch outside the group explains, and the rotation (shift and turn a radian) that leaves those
/// patches' surface where it is, if there is one.
fn unexplained(objective: &Objective, at: &Estimate, group: &Group) -> Option<(Points, Option<(DVec3, DVec3)>)> {
    let mut placed = objective.place(at).ok()?;
    placed.facets.remove(|patch| group.patches[patch]);
    let centre = objective.space.centre;
    let radius = objective.space.radius;
    let half2 = objective.loss.half().powi(2);
    let mut explained = vec![false; objective.points.len()];
    let (mut gram, mut count) = (Matrix6::zeros(), 0.0);
    for (i, foot) in objective.feet(&placed, &at.motion) {
        if foot.d2 < half2 {
            explained[i] = true;
            let n = foot.normal.normalize_or_zero();
            let turn = (foot.point - centre).cross(n) / radius;
            let row = Vector6::new(n.x, n.y, n.z, turn.x, turn.y, turn.z);
            gram += row * row.transpose();
            count += 1.0;
        }
    }
    let rest = objective.points.pick((0..explained.len()).filter(|i| !explained[*i]));
    if count < 20.0 {
        return Some((rest, None));
    }
    let eigen = SymmetricEigen::new(gram / count);
    let axis = (0..6).filter(|k| eigen.eigenvalues[*k] < 1e-3).find_map(|k| {
        let e = eigen.eigenvectors.column(k);
        let turn = DVec3::new(e[3], e[4], e[5]) / radius;
        let rate = turn.length();
        // Mostly a translation (of a plane, along a cylinder) is no rotation.
        (rate * radius > 0.3).then(|| (DVec3::new(e[0], e[1], e[2]) / rate, turn / rate))
    });
    Some((rest, axis))
}
