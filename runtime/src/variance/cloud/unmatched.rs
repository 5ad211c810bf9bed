//! The points of a cloud that the model does not explain.

use crate::disjoint_sets::DisjointSets;
use crate::mesh::{Bounds, TriangleMesh};
use crate::robust::median;
use crate::scan::{Neighbours, Scan, spacings};
use crate::variance::points::PointFeet;
use crate::variance::scanned::Scanned;
use crate::variance::unmatched::{Piece, Unmatched, UnmatchedSummary};
use glam::DVec3;

/// Points of a piece are no farther apart than so many spacings of the scan's points, and each is joined to so many of
/// its nearest at most.
const JOINED: f64 = 2.0;
const NEAREST: usize = 9;

/// A point stands for the area of so many spacings of the scan's points at most: dust is no surface.
const WIDEST: f64 = 2.0;

/// Finds the points without a foot within the maximum distance on surface that faces as they do.
pub(in crate::variance) fn unmatched(scan: &Scan, feet: &PointFeet, scanned: &Scanned<'_>) -> Unmatched {
    let left: Vec<usize> = (0..feet.feet.len()).filter(|i| feet.feet[*i].is_none()).collect();
    let positions: Vec<[f64; 3]> = left.iter().map(|i| scan.mesh.positions[*i]).collect();
    let tree = Neighbours::new(&positions);
    let mut spacing = spacings(&positions, &tree, |_, _| true);
    let explained = scanned.spacing();
    let of_all = [explained, &spacing[..]].concat();
    let usual = median(&mut of_all.clone()).unwrap_or(0.0);
    spacing.iter_mut().for_each(|s| *s = s.min(WIDEST * usual));
    let mut sets = DisjointSets::new(left.len());
    let distance = |a: usize, b: usize| DVec3::from(positions[a]).distance(DVec3::from(positions[b]));
    for (i, near) in tree.at_each(NEAREST, |_, near| near.to_vec()).into_iter().enumerate() {
        let near = near.into_iter().filter(|j| distance(i, *j as usize) <= JOINED * usual);
        near.for_each(|j| sets.join(i as u32, j));
    }
    let mut of_root = vec![usize::MAX; left.len()];
    let mut pieces: Vec<(Piece, Vec<usize>)> = Vec::new();
    let mut members: Vec<Vec<usize>> = Vec::new();
    for i in 0..left.len() {
        let root = sets.root(i as u32) as usize;
        if of_root[root] == usize::MAX {
            of_root[root] = members.len();
            members.push(Vec::new());
        }
        members[of_root[root]].push(i);
    }
    pieces.extend(members.into_iter().map(|members| (piece(&positions, &spacing, &members), members)));
    // The sort is stable: pieces of one size stay in the order of the scan.
    pieces.sort_by(|a, b| b.0.area.total_cmp(&a.0.area));
    let whole = explained.iter().chain(&spacing).map(|s| s * s).sum();
    let summary = UnmatchedSummary::of_pieces(pieces.iter().map(|(piece, _)| piece), whole);
    let of_pieces: Vec<usize> = pieces.iter().flat_map(|(_, members)| members.iter().map(|i| left[*i])).collect();
    let mesh = TriangleMesh {
        positions: of_pieces.iter().map(|i| scan.mesh.positions[*i]).collect(),
        normals: of_pieces.iter().map(|i| scan.mesh.normals[*i]).collect(),
        ..TriangleMesh::default()
    };
    Unmatched { mesh, summary }
}

fn piece(positions: &[[f64; 3]], spacing: &[f64], members: &[usize]) -> Piece {
    let at = |i: &usize| DVec3::from(positions[*i]);
    let bounds: Bounds = members.iter().map(at).collect();
    let area: f64 = members.iter().map(|i| spacing[*i].powi(2)).sum();
    let centre = members.iter().map(at).sum::<DVec3>() / members.len() as f64;
    let Bounds { low, high } = bounds;
    Piece { area, triangles: 0, points: members.len(), centre: centre.into(), low: low.into(), high: high.into() }
}
