//! Triangles cut until no edge is longer than a length, alike on both sides of every edge.

use crate::mesh::TriangleMesh;
use foldhash::fast::RandomState;
use glam::DVec3;
use std::collections::HashMap;

/// Pieces of a mesh.
pub(super) struct Pieces {
    /// With every position once.
    pub(super) mesh: TriangleMesh,
    /// By piece, the triangle that it is of.
    pub(super) from: Vec<u32>,
}

/// Cuts the edges that are longer than `longest` in their middles, again and again; none where that takes more than
/// `most` triangles.
pub(super) fn subdivide(mesh: &TriangleMesh, longest: f64, most: usize) -> Option<Pieces> {
    let numbers = mesh.position_numbers();
    let mut positions: Vec<[f64; 3]> = Vec::new();
    for (p, number) in mesh.positions.iter().zip(&numbers) {
        if *number as usize == positions.len() {
            positions.push(*p);
        }
    }
    let mut triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|v| numbers[v as usize])).collect();
    let mut from: Vec<u32> = (0..triangles.len() as u32).collect();
    loop {
        let mut middles: HashMap<[u32; 2], u32, RandomState> = HashMap::default();
        let (mut next, mut next_from) = (Vec::with_capacity(triangles.len()), Vec::with_capacity(triangles.len()));
        for (triangle, from) in triangles.iter().zip(&from) {
            let cuts = [0, 1, 2].map(|k| {
                let edge = [triangle[k], triangle[(k + 1) % 3]];
                middle(edge, longest, &mut positions, &mut middles)
            });
            cut(*triangle, cuts, &positions, &mut next);
            next_from.resize(next.len(), *from);
            if next.len() > most {
                return None;
            }
        }
        if middles.is_empty() {
            return Some(Pieces { mesh: TriangleMesh { positions, triangles, ..TriangleMesh::default() }, from });
        }
        (triangles, from) = (next, next_from);
    }
}

/// The vertex in the middle of an edge, if it is too long.
fn middle(
    [a, b]: [u32; 2],
    longest: f64,
    positions: &mut Vec<[f64; 3]>,
    middles: &mut HashMap<[u32; 2], u32, RandomState>,
) -> Option<u32> {
    let [p, q] = [a, b].map(|v| DVec3::from_array(positions[v as usize]));
    let between = 0.5 * (p + q);
    // Far from the origin, an edge may have no middle of its own.
    if p.distance(q) <= longest || between == p || between == q {
        return None;
    }
    Some(*middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
        positions.push(between.to_array());
        positions.len() as u32 - 1
    }))
}

/// The pieces of a triangle whose edges are cut in some middles.
fn cut(triangle: [u32; 3], cuts: [Option<u32>; 3], positions: &[[f64; 3]], pieces: &mut Vec<[u32; 3]>) {
    let count = cuts.iter().flatten().count();
    // Turned so that a single cut is in the first edge, and a single whole edge is the last.
    let turn = match count {
        1 => (0..3).find(|k| cuts[*k].is_some()),
        2 => (0..3).find(|k| cuts[(k + 2) % 3].is_none()),
        _ => None,
    };
    let at = |k: usize| (turn.unwrap_or(0) + k) % 3;
    let [a, b, c] = [0, 1, 2].map(|k| triangle[at(k)]);
    match [0, 1, 2].map(|k| cuts[at(k)]) {
        [Some(m), Some(n), Some(p)] => pieces.extend([[a, m, p], [m, b, n], [p, n, c], [m, n, p]]),
        [Some(m), Some(n), None] => {
            let length = |v: u32, w: u32| {
                DVec3::from_array(positions[v as usize]).distance(DVec3::from_array(positions[w as usize]))
            };
            let rest = if length(a, n) <= length(m, c) { [[a, m, n], [a, n, c]] } else { [[a, m, c], [m, n, c]] };
            pieces.push([m, b, n]);
            pieces.extend(rest);
        }
        [Some(m), ..] => pieces.extend([[a, m, c], [m, b, c]]),
        _ => pieces.push([a, b, c]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closed_mesh_stays_closed_and_keeps_its_area() {
        let positions = vec![[0.0; 3], [7.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 1.0]];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let mesh = TriangleMesh { positions, triangles, ..TriangleMesh::default() };
        let pieces = subdivide(&mesh, 0.5, 100_000).unwrap();
        assert!(pieces.mesh.boundary_edges().is_empty());
        assert!((pieces.mesh.area() - mesh.area()).abs() < 1e-9);
        for t in &pieces.mesh.triangles {
            let [a, b, c] = pieces.mesh.corners(*t);
            assert!(a.distance(b).max(b.distance(c)).max(c.distance(a)) <= 0.5);
        }
        assert!(subdivide(&mesh, 0.5, 100).is_none());
    }
}
