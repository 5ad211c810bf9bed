//! What of a scan does not hang together with the rest of it.

use super::attributes::Attributes;
use super::neighbours::Neighbours;
use super::outliers::outliers;
use crate::disjoint_sets::DisjointSets;
use crate::mesh::{TriangleMesh, renumber_used, retain_marked};
use crate::robust::median;
use glam::DVec3;

/// Points of a cloud hang together with so many neighbours ...
const NEIGHBOURS: usize = 12;
/// ... that are no farther than so many times the median distance of the nearest.
const REACH: f64 = 6.0;

/// Leaves out the points of a cloud that lie on no surface; returns their number. Those of a mesh stay.
pub(super) fn drop_outliers(mesh: &mut TriangleMesh, attributes: &mut Attributes) -> usize {
    if !mesh.triangles.is_empty() {
        return 0;
    }
    let indices: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let found = outliers(&Neighbours::new(&mesh.positions), &mesh.positions, &indices);
    let kept: Vec<bool> = found.iter().map(|outlier| !outlier).collect();
    retain(mesh, attributes, &kept)
}

/// Leaves out all but the largest piece: of a mesh that with the largest area, of a cloud that with the most points.
/// Returns the number of points that are gone.
pub(super) fn keep_largest(mesh: &mut TriangleMesh, attributes: &mut Attributes) -> usize {
    let pieces = pieces(mesh);
    let sizes = sizes(mesh, &pieces);
    let largest = (0..sizes.len()).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b]).then(b.cmp(a))).unwrap_or(0);
    let kept: Vec<bool> = pieces.iter().map(|piece| *piece as usize == largest).collect();
    retain(mesh, attributes, &kept)
}

/// By vertex, the size of the piece whose least vertex it is, or 0: the area, of a cloud the number of points.
pub(super) fn sizes(mesh: &TriangleMesh, pieces: &[u32]) -> Vec<f64> {
    let mut sizes = vec![0.0; mesh.positions.len()];
    if mesh.triangles.is_empty() {
        pieces.iter().for_each(|piece| sizes[*piece as usize] += 1.0);
    }
    for triangle in &mesh.triangles {
        sizes[pieces[triangle[0] as usize] as usize] += mesh.triangle_area(*triangle);
    }
    sizes
}

/// By vertex, the least vertex of its piece.
pub(super) fn pieces(mesh: &TriangleMesh) -> Vec<u32> {
    let mut sets = DisjointSets::new(mesh.positions.len());
    if mesh.triangles.is_empty() {
        for [a, b] in links(&mesh.positions) {
            sets.join(a, b);
        }
    }
    for [a, b, c] in &mesh.triangles {
        sets.join(*a, *b);
        sets.join(*b, *c);
    }
    (0..mesh.positions.len() as u32).map(|i| sets.root(i)).collect()
}

/// Pairs of points of a cloud that hang together.
fn links(positions: &[[f64; 3]]) -> Vec<[u32; 2]> {
    let tree = Neighbours::new(positions);
    let near: Vec<Vec<u32>> = tree.at_each(NEIGHBOURS + 1, |_, near| near.to_vec());
    let distance = |a: u32, b: u32| DVec3::from(positions[a as usize]).distance(DVec3::from(positions[b as usize]));
    let mut spacings: Vec<f64> =
        near.iter().enumerate().filter_map(|(i, near)| Some(distance(i as u32, *near.get(1)?))).collect();
    let reach = REACH * median(&mut spacings).unwrap_or(0.0);
    let linked = |(i, near): (usize, &Vec<u32>)| {
        let i = i as u32;
        near.iter().filter(|j| distance(i, **j) <= reach).map(|j| [i, *j]).collect::<Vec<_>>()
    };
    near.iter().enumerate().flat_map(linked).collect()
}

fn retain(mesh: &mut TriangleMesh, attributes: &mut Attributes, kept: &[bool]) -> usize {
    let before = mesh.positions.len();
    if mesh.triangles.is_empty() {
        retain_marked(&mut mesh.positions, kept);
        retain_marked(&mut mesh.normals, kept);
        attributes.retain_marked(kept);
        return before - mesh.positions.len();
    }
    mesh.triangles.retain(|t| t.iter().all(|v| kept[*v as usize]));
    let used = renumber_used(&mut mesh.triangles, before);
    retain_marked(&mut mesh.positions, &used);
    retain_marked(&mut mesh.normals, &used);
    attributes.retain_marked(&used);
    before - mesh.positions.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two strips of a hundred points, the second of half the length, with triangles or without.
    fn strips(triangles: bool) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        for (begin, count) in [(0.0, 50), (200.0, 25)] {
            for i in 0..count {
                let first = mesh.positions.len() as u32;
                mesh.positions.extend([[begin + f64::from(i), 0.0, 0.0], [begin + f64::from(i), 1.0, 0.0]]);
                if triangles && i > 0 {
                    mesh.triangles.extend([[first - 2, first, first - 1], [first, first + 1, first - 1]]);
                }
            }
        }
        mesh.normals = vec![[0.0, 0.0, 1.0]; mesh.positions.len()];
        mesh
    }

    #[test]
    fn the_largest_piece_stays() {
        for triangles in [false, true] {
            let mut mesh = strips(triangles);
            let intensities: Vec<f32> = (0..150).map(|i| i as f32).collect();
            let mut attributes = Attributes { intensities, ..Attributes::default() };
            assert_eq!(keep_largest(&mut mesh, &mut attributes), 50);
            assert_eq!((mesh.positions.len(), mesh.normals.len(), attributes.intensities.len()), (100, 100, 100));
            assert!(mesh.positions.iter().all(|p| p[0] < 100.0));
            assert_eq!(mesh.triangles.len(), if triangles { 98 } else { 0 });
            assert_eq!(keep_largest(&mut mesh, &mut attributes), 0);
        }
    }
}
