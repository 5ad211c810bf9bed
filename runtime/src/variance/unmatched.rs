//! The parts of the scan that the model does not explain: \[VA\] casts rays from the model only, so that what is far
//! from it or faces another way would be lost without notice.

use crate::bvh::Bvh;
use crate::disjoint_sets::DisjointSets;
use crate::mesh::{Bounds, Group, TriangleMesh};
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Vertices of a grid cell that are compared with each vertex around it: bounds the work where many lie in one place.
const CROWD: usize = 64;

/// Number of pieces that are listed.
const LISTED: usize = 10;

/// The triangles of a scan that the model does not explain.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::variance) struct Unmatched {
    /// The triangles, with the vertices that they use; one group per piece, the largest first.
    pub(in crate::variance) mesh: TriangleMesh,
    /// Its figures.
    pub(in crate::variance) summary: UnmatchedSummary,
}

/// Figures of the part of a scan that the model does not explain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UnmatchedSummary {
    /// Area of the unexplained triangles; in a cloud that which unexplained points stand for by their spacing. Square
    /// millimetres.
    pub area: f64,
    /// `area` divided by the scan's area; 0 if that is 0.
    pub share: f64,
    /// Number of triangles.
    pub triangles: usize,
    /// Number of points of a cloud, which has no triangles.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub points: usize,
    /// Number of pieces. Triangles of one piece share vertices, or lie as close to each other as their corners do
    /// (scanners leave slits between the views).
    pub pieces: usize,
    /// The largest pieces.
    pub largest: Vec<Piece>,
}

/// A connected piece of the scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// Area; in a cloud that which its points stand for by their spacing. Square millimetres.
    pub area: f64,
    /// Number of triangles.
    pub triangles: usize,
    /// Number of points of a cloud.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub points: usize,
    /// Centre of gravity of the area, in the scan's coordinates. Millimetres.
    #[serde(alias = "center")]
    pub centre: [f64; 3],
    /// Least corner of the bounding box. Millimetres.
    pub low: [f64; 3],
    /// Greatest corner of the bounding box. Millimetres.
    pub high: [f64; 3],
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl UnmatchedSummary {
    /// Whether the model explains the whole scan.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.triangles == 0 && self.points == 0
    }

    /// Of the pieces, the largest first; `whole` is the area of the scan. Square millimetres.
    pub(in crate::variance) fn of_pieces<'p>(
        pieces: impl ExactSizeIterator<Item = &'p Piece> + Clone,
        whole: f64,
    ) -> Self {
        // The sum of nothing is -0.
        let area = 0.0 + pieces.clone().map(|piece| piece.area).sum::<f64>();
        Self {
            area,
            share: if whole > 0.0 { area / whole } else { 0.0 },
            triangles: pieces.clone().map(|piece| piece.triangles).sum(),
            points: pieces.clone().map(|piece| piece.points).sum(),
            pieces: pieces.len(),
            largest: pieces.take(LISTED).cloned().collect(),
        }
    }
}

impl Unmatched {
    /// Finds the triangles whose centre of gravity has no point of `model` within `max_distance` millimetres. If
    /// `oriented`, only triangles of the model count that face as the scan's triangle does (less than a right angle
    /// between the normals).
    pub(in crate::variance) fn new(scan: &TriangleMesh, model: &Bvh, max_distance: f64, oriented: bool) -> Self {
        let explained = |triangle: &[u32; 3]| {
            let centre = centre(scan, *triangle);
            let closest = match scan.triangle_normal(*triangle).filter(|_| oriented) {
                Some(normal) => model.closest_point_facing(centre, max_distance, normal, 0.0),
                None => model.closest_point(centre, max_distance),
            };
            closest.is_some()
        };
        let left: Vec<[u32; 3]> = scan.triangles.par_iter().filter(|t| !explained(t)).copied().collect();
        let mut pieces: Vec<(Piece, Vec<[u32; 3]>)> =
            pieces(scan, &left).into_iter().map(|triangles| (piece(scan, &triangles), triangles)).collect();
        // The sort is stable: pieces of one size stay in the order of the scan.
        pieces.sort_by(|a, b| b.0.area.total_cmp(&a.0.area));
        let summary = UnmatchedSummary::of_pieces(pieces.iter().map(|(piece, _)| piece), scan.area());
        let mut mesh = scan.submesh(pieces.iter().flat_map(|(_, triangles)| triangles).copied());
        for (k, (piece, _)) in pieces.iter().enumerate() {
            let start = mesh.groups.last().map_or(0, |g| g.end);
            mesh.groups.push(Group { name: format!("piece{k}"), start, end: start + piece.triangles });
        }
        Self { mesh, summary }
    }
}

fn centre(mesh: &TriangleMesh, triangle: [u32; 3]) -> DVec3 {
    triangle.iter().map(|i| DVec3::from(mesh.positions[*i as usize])).sum::<DVec3>() / 3.0
}

/// Groups triangles into pieces, in the order of the pieces' first triangles.
fn pieces(scan: &TriangleMesh, triangles: &[[u32; 3]]) -> Vec<Vec<[u32; 3]>> {
    let mut sets = DisjointSets::new(scan.positions.len());
    for [a, b, c] in triangles {
        sets.join(*a, *b);
        sets.join(*a, *c);
    }
    join_neighbours(scan, triangles, &mut sets);
    let mut piece_of = vec![usize::MAX; scan.positions.len()];
    let mut pieces: Vec<Vec<[u32; 3]>> = Vec::new();
    for triangle in triangles {
        let root = sets.root(triangle[0]) as usize;
        if piece_of[root] == usize::MAX {
            piece_of[root] = pieces.len();
            pieces.push(Vec::new());
        }
        pieces[piece_of[root]].push(*triangle);
    }
    pieces
}

/// Joins vertices that are no further apart than twice the median edge.
fn join_neighbours(scan: &TriangleMesh, triangles: &[[u32; 3]], sets: &mut DisjointSets) {
    let at = |vertex: u32| DVec3::from(scan.positions[vertex as usize]);
    let mut edges: Vec<f64> = triangles.iter().map(|[a, b, _]| (at(*a) - at(*b)).length()).collect();
    if edges.is_empty() {
        return;
    }
    let middle = edges.len() / 2;
    let reach = 2.0 * *edges.select_nth_unstable_by(middle, f64::total_cmp).1;
    if reach.is_nan() || reach <= 0.0 {
        return;
    }
    let mut vertices: Vec<u32> = triangles.iter().flatten().copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    let cell = |p: DVec3| (p / reach).floor().to_array().map(|c| c.clamp(-1e15, 1e15) as i64);
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    for vertex in &vertices {
        cells.entry(cell(at(*vertex))).or_default().push(*vertex);
    }
    for vertex in &vertices {
        let [x, y, z] = cell(at(*vertex));
        for near in (0..27).filter_map(|k| cells.get(&[x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1])) {
            // Only the first few of a crowded cell are compared: the others are joined to these in their own turn.
            for other in near.iter().take(CROWD).filter(|other| at(**other).distance(at(*vertex)) <= reach) {
                sets.join(*vertex, *other);
            }
        }
    }
}

fn piece(mesh: &TriangleMesh, triangles: &[[u32; 3]]) -> Piece {
    let (mut area, mut moment) = (0.0, DVec3::ZERO);
    for triangle in triangles {
        let triangle_area = mesh.triangle_area(*triangle);
        area += triangle_area;
        moment += triangle_area * centre(mesh, *triangle);
    }
    let bounds: Bounds = triangles.iter().flat_map(|t| mesh.corners(*t)).collect();
    let Bounds { low, high } = bounds;
    let centre = if area > 0.0 { moment / area } else { bounds.centre() };
    Piece { area, triangles: triangles.len(), points: 0, centre: centre.into(), low: low.into(), high: high.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squares of unit cells in the plane z, from corner to corner, facing up or down.
    fn plate(low: [i32; 2], high: [i32; 2], z: f64, up: bool) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        let (w, h) = ((high[0] - low[0]) as u32, (high[1] - low[1]) as u32);
        for y in low[1]..=high[1] {
            mesh.positions.extend((low[0]..=high[0]).map(|x| [f64::from(x), f64::from(y), z]));
        }
        for j in 0..h {
            for i in 0..w {
                let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| j * (w + 1) + i);
                let both = [[a, b, c], [a, c, d]];
                mesh.triangles.extend(if up { both } else { both.map(|[a, b, c]| [a, c, b]) });
            }
        }
        mesh
    }

    fn together(meshes: &[TriangleMesh]) -> TriangleMesh {
        let mut all = TriangleMesh::default();
        for mesh in meshes {
            let first = all.positions.len() as u32;
            all.positions.extend(&mesh.positions);
            all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + first)));
        }
        all
    }

    #[test]
    fn what_is_beyond_beside_or_turned_is_found_with_its_area() {
        let model = plate([0, 0], [10, 10], 0.0, true);
        let scan = together(&[
            plate([0, 0], [10, 10], 0.5, true),
            // Too high; beside the model, but for the first column of cells; and the other side of a thin wall.
            plate([0, 0], [4, 5], 3.0, true),
            plate([10, 0], [14, 2], 0.0, true),
            plate([2, 2], [5, 5], -0.2, false),
        ]);
        let found = Unmatched::new(&scan, &Bvh::build(&model).expect("a mesh"), 1.0, true);
        let areas: Vec<f64> = found.summary.largest.iter().map(|p| p.area).collect();
        assert_eq!(areas, [20.0, 9.0, 6.0]);
        assert_eq!((found.summary.pieces, found.summary.triangles), (3, 70));
        assert_eq!(found.summary.area, 35.0);
        assert!((found.summary.share - 35.0 / 137.0).abs() < 1e-12);
        assert_eq!(found.summary.largest[0].centre, [2.0, 2.5, 3.0]);
        assert_eq!((found.summary.largest[2].low, found.summary.largest[2].high), ([11.0, 0.0, 0.0], [14.0, 2.0, 0.0]));
        let mesh = &found.mesh;
        assert_eq!(mesh.groups.iter().map(|g| g.end - g.start).collect::<Vec<_>>(), [40, 18, 12]);
        let area = mesh.area();
        assert!((area - 35.0).abs() < 1e-9, "{area}");
    }

    #[test]
    fn without_orientation_both_sides_count() {
        let model = Bvh::build(&plate([0, 0], [10, 10], 0.0, true)).expect("a mesh");
        let found = Unmatched::new(&plate([2, 2], [5, 5], -0.2, false), &model, 1.0, false);
        assert_eq!(found, Unmatched::default());
        assert!(found.summary.area.is_sign_positive() && found.summary.share.is_sign_positive(), "-0");
    }
}
