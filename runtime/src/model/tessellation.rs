//! A model's surface as triangles that remember where they come from.

use crate::mesh::TriangleMesh;

/// A point of a model: a patch and its parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfacePoint {
    /// Index of the patch.
    pub patch: u32,
    /// First surface parameter, in [0, 1].
    pub u: f64,
    /// Second surface parameter, in [0, 1].
    pub v: f64,
}

/// A tessellated model.
#[derive(Clone, Debug, Default)]
pub struct Tessellation {
    /// Positions, unit normals of the exact surface (outward), texture coordinates in the atlas; one group a patch,
    /// named like the part.
    pub mesh: TriangleMesh,
    /// Where every vertex comes from, so that any point of any triangle maps back to the exact surface.
    pub origins: Vec<SurfacePoint>,
}
