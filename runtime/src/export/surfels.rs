//! Points of a cloud as small triangles, for pictures (surface elements: Pfister et al., 'Surfels', 2000).

use crate::mesh::TriangleMesh;
use crate::scan::{Neighbours, spacings};
use glam::DVec3;
use std::borrow::Cow;

/// Distance of a triangle's corners from its point, in spacings of the points: those of neighbours just overlap.
const SIZE: f64 = 1.4;

/// A triangle is no larger than so many times the usual one: what is far from everything is a speck.
const LARGEST: f64 = 3.0;

/// What is drawn of a mesh: itself, or for points without triangles a triangle each, across its normal; of more points
/// than `most` as many, evenly in their order, in triangles that are as much larger.
pub(crate) fn shown(mesh: &TriangleMesh, most: usize) -> Cow<'_, TriangleMesh> {
    if !mesh.triangles.is_empty() || mesh.positions.is_empty() {
        return Cow::Borrowed(mesh);
    }
    let step = mesh.positions.len().div_ceil(most.max(1)).max(1);
    let points: Vec<[f64; 3]> = mesh.positions.iter().step_by(step).copied().collect();
    let normals: Vec<DVec3> = (0..mesh.positions.len())
        .step_by(step)
        .map(|i| mesh.normals.get(i).map_or(DVec3::Z, |n| DVec3::from(*n).normalize_or(DVec3::Z)))
        .collect();
    let tree = Neighbours::new(&points);
    // The signs of normals may be guesses.
    let spacing = spacings(&points, &tree, |i, j| normals[i].dot(normals[j]).abs() > 0.5);
    let usual = crate::robust::median(&mut spacing.clone()).unwrap_or(0.0);
    let mut drawn = TriangleMesh::default();
    for ((point, normal), spacing) in points.iter().zip(&normals).zip(spacing) {
        let size = SIZE * if spacing > 0.0 { spacing.min(LARGEST * usual) } else { usual };
        let (a, b) = normal.any_orthonormal_pair();
        let first = drawn.positions.len() as u32;
        for turns in [0.0, 1.0 / 3.0, 2.0 / 3.0] {
            let (s, c) = (std::f64::consts::TAU * turns).sin_cos();
            drawn.positions.push((DVec3::from(*point) + size * (c * a + s * b)).into());
            drawn.normals.push((*normal).into());
        }
        drawn.triangles.push([first, first + 1, first + 2]);
    }
    Cow::Owned(drawn)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfels_cover_a_surface_and_face_as_their_points_do() {
        let positions: Vec<[f64; 3]> = (0..2500).map(|k| [f64::from(k % 50), f64::from(k / 50), 0.0]).collect();
        let normals = vec![[0.0, 0.0, -1.0]; positions.len()];
        let cloud = TriangleMesh { positions, normals, ..TriangleMesh::default() };
        for (most, count) in [(10_000, 2500), (1000, 834)] {
            let drawn = shown(&cloud, most);
            assert_eq!(drawn.triangles.len(), count);
            let facing = drawn.triangles.iter().filter_map(|t| drawn.triangle_normal(*t));
            assert!(facing.map(|n| n[2]).all(|z| z < -0.999));
            // An equilateral triangle about a point whose corners are 1.4 away has 2.55 of its square's area.
            let covered = drawn.area() / 2500.0;
            assert!((1.5..4.0).contains(&covered), "{covered}");
        }
        let mesh = TriangleMesh { triangles: vec![[0, 1, 50]], ..cloud };
        assert_eq!(shown(&mesh, 10).triangles.len(), 1);
    }
}
