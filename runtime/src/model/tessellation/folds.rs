//! Folds: narrow triangles, as are left in corners where the gaps between trimmed patches were closed, that lie on
//! others or run against them; and those of a patch that face away from it.

use super::refine::Refinement;
use crate::mesh::retain_marked;
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// The most triangles that are turned over together: folds have a few.
const MOST_TURNED: usize = 24;
/// The most sides that are turned to take back folds: a thousand times what the examples take.
const MOST_TURNS: usize = 1_000_000;
/// The part of the area that faces away by which a turn must make it less: above rounding.
const LESS: f64 = 1e-6;
/// Triangles that are lower than this part of the chord are not looked at.
const LOW: f64 = 1e-3;

/// Drops pairs of narrow triangles that lie on each other back to back, as they are left in some corners: nothing is
/// between them, and the others at their edges close without them.
pub(super) fn drop(mesh: &mut Refinement<'_>, is_trimmed: &[bool]) {
    let number = mesh.mesh.position_numbers();
    let mut waiting: HashMap<[u32; 3], usize> = HashMap::new();
    let mut kept = vec![true; mesh.mesh.triangles.len()];
    for (triangle, corners) in mesh.mesh.triangles.iter().enumerate() {
        if !is_trimmed[mesh.patches[triangle] as usize] || !is_narrow(mesh, triangle) {
            continue;
        }
        let turned = |[a, b, c]: [u32; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap_or_default();
        let [a, b, c] = corners.map(|i| number[i as usize]);
        match waiting.remove(&turned([a, c, b])) {
            Some(other) => (kept[triangle], kept[other]) = (false, false),
            None => _ = waiting.insert(turned([a, b, c]), triangle),
        }
    }
    retain_marked(&mut mesh.mesh.triangles, &kept);
    retain_marked(&mut mesh.patches, &kept);
}

/// Turns groups of a few narrow triangles over that run against all others at their edges, as they are left where a gap
/// beside a fold was closed.
pub(super) fn turn(mesh: &mut Refinement<'_>, is_trimmed: &[bool]) {
    let number = mesh.mesh.position_numbers();
    let sides = |corners: [u32; 3]| sides(corners.map(|i| number[i as usize]));
    let mut at_side: HashMap<(u32, u32), Vec<usize>> = HashMap::new();
    for (triangle, corners) in mesh.mesh.triangles.iter().enumerate() {
        sides(*corners).into_iter().for_each(|side| at_side.entry(side).or_default().push(triangle));
    }
    let at = |side: (u32, u32)| at_side.get(&side).map_or(&[][..], Vec::as_slice);
    let runs_against = |(a, b): (u32, u32)| at((a, b)).len() == 2 && at((b, a)).is_empty();
    let mut first: Vec<usize> =
        at_side.iter().filter(|(side, _)| runs_against(**side)).flat_map(|(_, t)| t).copied().collect();
    first.sort_unstable();
    let mut turned = vec![false; mesh.mesh.triangles.len()];
    for first in first {
        let mut group = vec![first];
        let mut k = 0;
        while k < group.len() && group.len() <= MOST_TURNED {
            for (a, b) in sides(mesh.mesh.triangles[group[k]]) {
                let beside = at((b, a)).iter().filter(|other| !group.contains(other)).copied();
                let beside: Vec<usize> = beside.collect();
                group.extend(beside);
            }
            k += 1;
        }
        let may_turn = |t: &usize| !turned[*t] && is_trimmed[mesh.patches[*t] as usize] && is_narrow(mesh, *t);
        if group.len() <= MOST_TURNED && group.iter().all(may_turn) {
            group.iter().for_each(|t| turned[*t] = true);
        }
    }
    for (corners, _) in mesh.mesh.triangles.iter_mut().zip(&turned).filter(|(_, turned)| **turned) {
        corners.swap(0, 1);
    }
}

/// Takes back folds of a smooth surface: triangles that face away from it. They are left where edges that are straight
/// in space are not so in u and v, as on a plane whose lines converge: the middle of such an edge lies beside it, and
/// chords do not tell. Their edges are turned while less area faces away by that.
pub(super) fn unfold(mesh: &mut Refinement<'_>) {
    let is_away = |mesh: &Refinement<'_>, t: &usize| {
        area_away(mesh, mesh.mesh.triangles[*t]) > LOW * mesh.chord * mesh.longest_side(*t)
    };
    let mut away: Vec<usize> = (0..mesh.mesh.triangles.len()).filter(|t| is_away(mesh, t)).collect();
    let folded: HashSet<u32> = away.iter().map(|t| mesh.patches[*t]).collect();
    let mut at_side: HashMap<(u32, u32), Vec<usize>> = HashMap::new();
    for t in (0..mesh.mesh.triangles.len()).filter(|t| folded.contains(&mesh.patches[*t])) {
        sides(mesh.mesh.triangles[t]).into_iter().for_each(|side| at_side.entry(side).or_default().push(t));
    }
    let mut turns = 0;
    while let Some(t) = away.pop().filter(|_| turns < MOST_TURNS) {
        let Some((other, turned)) = best_turn(mesh, &at_side, t) else { continue };
        for (t, corners) in [t, other].into_iter().zip(turned) {
            for side in sides(mesh.mesh.triangles[t]) {
                at_side.entry(side).and_modify(|at| at.retain(|other| *other != t));
            }
            mesh.mesh.triangles[t] = corners;
        }
        for t in [t, other] {
            sides(mesh.mesh.triangles[t]).into_iter().for_each(|side| at_side.entry(side).or_default().push(t));
        }
        away.extend([t, other].into_iter().filter(|t| is_away(mesh, t)));
        turns += 1;
    }
}

/// The sides of a triangle, each from one corner to the next.
fn sides([a, b, c]: [u32; 3]) -> [(u32, u32); 3] {
    [(a, b), (b, c), (c, a)]
}

/// The turn of a side of a triangle that leaves the least area facing away, if any leaves less: the triangle beyond
/// that side, and what both become.
fn best_turn(
    mesh: &Refinement<'_>,
    at_side: &HashMap<(u32, u32), Vec<usize>>,
    t: usize,
) -> Option<(usize, [[u32; 3]; 2])> {
    let at = |side: (u32, u32)| at_side.get(&side).map_or(&[][..], Vec::as_slice);
    let corners = mesh.mesh.triangles[t];
    let turns = sides(corners).into_iter().filter_map(|(a, b)| {
        let (&[_], &[other]) = (at((a, b)), at((b, a))) else { return None };
        let opposite = |corners: [u32; 3]| corners.into_iter().find(|i| *i != a && *i != b);
        let (c, d) = (opposite(corners)?, opposite(mesh.mesh.triangles[other])?);
        if c == d || !at((c, d)).is_empty() || !at((d, c)).is_empty() {
            return None;
        }
        let turned = [[a, d, c], [d, b, c]];
        let area = |of: [[u32; 3]; 2]| of.map(|corners| area_away(mesh, corners)).iter().sum::<f64>();
        let (before, after) = (area([corners, mesh.mesh.triangles[other]]), area(turned));
        let is_less = after < before * (1.0 - LESS) && turned.iter().all(|corners| faces_up(mesh, *corners));
        is_less.then_some((after - before, (other, turned)))
    });
    turns.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, turn)| turn)
}

/// Twice the area of a triangle if it faces away from the surface's normals at its corners, otherwise 0.
fn area_away(mesh: &Refinement<'_>, corners: [u32; 3]) -> f64 {
    let normal: DVec3 = corners.iter().map(|i| DVec3::from_array(mesh.mesh.normals[*i as usize])).sum();
    let [a, b, c] = mesh.mesh.corners(corners);
    (-(b - a).cross(c - a).dot(normal.normalize_or_zero())).max(0.0)
}

/// Whether corners run in u and v as they do in others. At poles one of these says nothing.
fn faces_up(mesh: &Refinement<'_>, corners: [u32; 3]) -> bool {
    let [a, b, c] = corners.map(|i| mesh.origins[i as usize]);
    let is_pole = [a, b, c].iter().any(|at| mesh.pole(at).is_some());
    is_pole || (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u) > 0.0
}

/// Whether a triangle is no higher than a chord over its longest side.
fn is_narrow(mesh: &Refinement<'_>, triangle: usize) -> bool {
    let [a, b, c] = mesh.mesh.corners(mesh.mesh.triangles[triangle]);
    (b - a).cross(c - a).length() <= mesh.chord * mesh.longest_side(triangle)
}
