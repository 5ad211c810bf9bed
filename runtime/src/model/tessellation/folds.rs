//! Folds: narrow triangles, as are left in corners where the gaps between trimmed patches were closed, that lie on
//! others or run against them.

use super::refine::Refinement;
use crate::mesh::retain_marked;
use std::collections::HashMap;

/// The most triangles that are turned over together: folds have a few.
const MOST_TURNED: usize = 24;

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
    let sides = |corners: [u32; 3]| {
        let [a, b, c] = corners.map(|i| number[i as usize]);
        [(a, b), (b, c), (c, a)]
    };
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

/// Whether a triangle is no higher than a chord over its longest side.
fn is_narrow(mesh: &Refinement<'_>, triangle: usize) -> bool {
    let [a, b, c] = mesh.mesh.corners(mesh.mesh.triangles[triangle]);
    (b - a).cross(c - a).length() <= mesh.chord * mesh.longest_side(triangle)
}
