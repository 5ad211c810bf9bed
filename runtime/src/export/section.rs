//! Sections: where a plane cuts a mesh.

use crate::mesh::TriangleMesh;
use glam::DVec3;

/// The line along which a plane cuts a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Segment {
    /// Its ends. Millimetres.
    pub(super) ends: [DVec3; 2],
    /// The number of the triangle.
    pub(super) triangle: usize,
    /// For each end the two corners of the triangle that it lies between, from 0 to 2, and the share of the second one.
    pub(super) between: [([usize; 2], f64); 2],
}

/// The segments of a mesh in the plane through a point (millimetres) with a normal. Triangles with vertices that do not
/// exist or are not finite are left out.
pub(super) fn segments(mesh: &TriangleMesh, through: DVec3, normal: DVec3) -> Vec<Segment> {
    let sides: Vec<f64> = mesh.positions.iter().map(|p| (DVec3::from_array(*p) - through).dot(normal)).collect();
    let segment = |(triangle, vertices): (usize, &[u32; 3])| {
        let side = |k: usize| sides.get(vertices[k] as usize).copied().filter(|side| side.is_finite());
        let sides = [side(0)?, side(1)?, side(2)?];
        let corners = mesh.corners(*vertices);
        // A corner in the plane counts to one side, so that a plane crosses two edges of a triangle or none.
        let crossed = [0, 1, 2].map(|k| {
            let (a, b) = (k, (k + 1) % 3);
            let share = sides[a] / (sides[a] - sides[b]);
            ((sides[a] > 0.0) != (sides[b] > 0.0)).then_some(([a, b], share))
        });
        let mut crossed = crossed.into_iter().flatten();
        let between = [crossed.next()?, crossed.next()?];
        let ends = between.map(|([a, b], share)| corners[a].lerp(corners[b], share));
        Some(Segment { ends, triangle, between })
    };
    mesh.triangles.iter().enumerate().filter_map(segment).collect()
}

#[cfg(test)]
mod tests {
    use super::segments;
    use crate::mesh::TriangleMesh;
    use glam::DVec3;

    #[test]
    fn a_plane_cuts_two_edges() {
        let mesh = TriangleMesh {
            positions: vec![[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [9.0, 9.0, 9.0], [f64::NAN; 3]],
            triangles: vec![[0, 1, 2], [1, 2, 3], [0, 1, 4], [0, 1, 7]],
            ..TriangleMesh::default()
        };
        let cut = segments(&mesh, DVec3::new(1.0, 0.0, 0.0), DVec3::X);
        assert_eq!(cut[0].ends, [DVec3::new(1.0, 0.0, 0.0), DVec3::new(1.0, 3.0, 0.0)]);
        assert_eq!(cut[0].between, [([0, 1], 0.25), ([1, 2], 0.75)]);
        assert_eq!(cut.iter().map(|segment| segment.triangle).collect::<Vec<_>>(), [0, 1]);
    }
}
