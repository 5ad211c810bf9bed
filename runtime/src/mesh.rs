//! Triangle meshes, the plain data that stages exchange. Millimetres, doubles.

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
