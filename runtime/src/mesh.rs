//! Triangle meshes, the plain data that stages exchange. Millimetres, doubles.

use glam::DVec3;

/// An indexed triangle mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions.
    pub positions: Vec<[f64; 3]>,
    /// Unit vertex normals: none, or as many as positions.
    pub normals: Vec<[f64; 3]>,
    /// Texture coordinates, v upwards: none, or as many as positions.
    pub texcoords: Vec<[f64; 2]>,
    /// Vertex indices, each below `positions.len()`; counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Named runs of triangles in ascending order; none, or they cover all triangles.
    pub groups: Vec<Group>,
}

impl TriangleMesh {
    /// A triangle's unit normal by the right-hand rule; none where it has no area.
    #[must_use]
    pub fn triangle_normal(&self, triangle: [u32; 3]) -> Option<[f64; 3]> {
        let [a, b, c] = triangle.map(|i| DVec3::from(self.positions[i as usize]));
        (b - a).cross(c - a).try_normalize().map(Into::into)
    }

    /// A triangle's area in square millimetres.
    #[must_use]
    pub fn triangle_area(&self, triangle: [u32; 3]) -> f64 {
        let [a, b, c] = triangle.map(|i| DVec3::from(self.positions[i as usize]));
        (b - a).cross(c - a).length() / 2.0
    }

    /// Diagonal of the box around all positions; 0 if there are none. Millimetres.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        self.bounds().map_or(0.0, |(low, high)| DVec3::from(low).distance(DVec3::from(high)))
    }

    /// The smallest box around all positions: least and greatest corner; none where there are no positions.
    #[must_use]
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        let first = DVec3::from(*self.positions.first()?);
        let (low, high) = self
            .positions
            .iter()
            .map(|&p| DVec3::from(p))
            .fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
        Some((low.into(), high.into()))
    }
}

/// A named run of triangles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// Name of the part.
    pub name: String,
    /// First triangle.
    pub start: usize,
    /// One past the last.
    pub end: usize,
}
