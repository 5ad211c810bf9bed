//! A bounding volume hierarchy over a triangle mesh: nearest hits of rays and closest points.
//!
//! The tree is an `obvhs` [`Bvh2`], but built here: a sweep over sorted centroids for the least
//! N_L A_L + N_R A_R, at most four triangles a leaf (Schinko et al., 'Variance Analysis and Comparison in
//! Computer-Aided Design', sect. 4). Positions are single precision after the origin has been moved to the centre of
//! the mesh. Queries take and give millimetres in the mesh's own coordinates.
//!
//! Rays never slip between triangles that share an edge or a vertex: see [`nearest_hit`](Bvh::nearest_hit).

mod block;
mod closest;
mod group;
mod lanes;
mod packet;
#[cfg(test)]
mod packet_tests;
mod ray;
mod sweep;
#[cfg(test)]
mod tests;
mod wide;

pub use closest::ClosestPoint;
pub(crate) use packet::{BothWays, Line, PACKET, Search};
pub use ray::Hit;
use sweep::MAX_DEPTH;

use crate::mesh::TriangleMesh;
pub(crate) use block::TriangleBlock;
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
pub(crate) use obvhs::bvh2::node::Bvh2Node;
use thiserror::Error;

/// Coordinates further than this from the mesh's centre are refused: third powers must stay within single precision.
/// Millimetres.
const MAX_EXTENT: f64 = 1e9;

/// A bounding volume hierarchy over a triangle mesh.
pub struct Bvh {
    /// Nodes; the leaf that starts at primitive 4 b holds the triangles of block b.
    tree: Bvh2,
    /// The triangles of each leaf.
    blocks: Vec<TriangleBlock>,
    /// What was subtracted from every position.
    center: [f64; 3],
    /// Half the bounding box's sides, rounded up.
    half_extent: Vec3A,
    triangle_count: usize,
}

/// Why no hierarchy could be built over a mesh.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum BvhError {
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, but there are only {vertices} vertices")]
    BadIndex {
        /// Which triangle.
        triangle: usize,
        /// The index it has.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A triangle's corner is NaN or infinite, or lies too far from the mesh's centre.
    #[error("a corner of triangle {triangle} is not finite or more than 1e9 mm from the mesh's centre")]
    BadPosition {
        /// Which triangle.
        triangle: usize,
    },
    /// More triangles than 32-bit indices can tell apart.
    #[error("{triangles} triangles are more than a hierarchy can hold (2^28)")]
    TooManyTriangles {
        /// How many there are.
        triangles: usize,
    },
}

impl Bvh {
    /// Builds the hierarchy, on rayon's threads; the result does not depend on how many there are. Vertices that no
    /// triangle uses play no role. A mesh without triangles gives a hierarchy that nothing hits.
    ///
    /// # Errors
    /// An index out of range, a position that is not finite or too large, more than 2^28 triangles.
    pub fn build(mesh: &TriangleMesh) -> Result<Self, BvhError> {
        if mesh.triangles.len() > 1 << 28 {
            return Err(BvhError::TooManyTriangles { triangles: mesh.triangles.len() });
        }
        let (center, half_extent) = bounds(mesh)?;
        Ok(Self::build_around(mesh, center, half_extent))
    }

    /// A hierarchy over another mesh, which must be within the box of this one's, in the same single-precision coordinates: a ray through
    /// an edge that triangles of both share hits one of them.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub(crate) fn build_beside(&self, mesh: &TriangleMesh) -> Result<Self, BvhError> {
        bounds(mesh)?;
        Ok(Self::build_around(mesh, self.center, self.half_extent))
    }

    fn build_around(mesh: &TriangleMesh, center: [f64; 3], half_extent: Vec3A) -> Self {
        let corners = |triangle: usize| {
            mesh.triangles[triangle].map(|vertex| {
                let p = mesh.positions[vertex as usize];
                Vec3A::from_array(std::array::from_fn(|k| (p[k] - center[k]) as f32))
            })
        };
        let boxes: Vec<Aabb> = (0..mesh.triangles.len()).map(|i| Aabb::from_points(&corners(i))).collect();
        let tree = sweep::build(&boxes);
        drop(boxes);
        let blocks = tree.primitive_indices.chunks_exact(4).map(|leaf| TriangleBlock::new(leaf, corners)).collect();
        Self { tree, blocks, center, half_extent, triangle_count: mesh.triangles.len() }
    }

    /// How many triangles there are.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangle_count
    }

    /// The centre of the mesh's bounding box: the origin of the single-precision coordinates.
    #[must_use]
    pub fn center(&self) -> [f64; 3] {
        self.center
    }

    /// A point in single precision, relative to the centre.
    pub(crate) fn to_local(&self, p: [f64; 3]) -> Vec3A {
        Vec3A::from_array(std::array::from_fn(|k| (p[k] - self.center[k]) as f32))
    }

    /// Half the sides of the mesh's bounding box.
    pub(crate) fn half_extent(&self) -> Vec3A {
        self.half_extent
    }

    /// The nodes, root first, the children of an inner node side by side; and the triangles, of which the leaf that
    /// starts at primitive 4 b has block b.
    pub(crate) fn parts(&self) -> (&[Bvh2Node], &[TriangleBlock]) {
        (&self.tree.nodes, &self.blocks)
    }

    /// A distance that single precision cannot tell from zero: 2^-20 of the largest coordinate. Millimetres.
    #[must_use]
    pub fn tolerance(&self) -> f32 {
        self.half_extent.max_element() * f32::EPSILON * 8.0
    }
}

/// Centre and half sides of the box around all triangles; (0, 0) where there are none.
fn bounds(mesh: &TriangleMesh) -> Result<([f64; 3], Vec3A), BvhError> {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        for &vertex in corners {
            let Some(p) = mesh.positions.get(vertex as usize) else {
                return Err(BvhError::BadIndex { triangle, vertex, vertices: mesh.positions.len() });
            };
            for k in 0..3 {
                if !p[k].is_finite() {
                    return Err(BvhError::BadPosition { triangle });
                }
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
    }
    if mesh.triangles.is_empty() {
        return Ok(([0.0; 3], Vec3A::ZERO));
    }
    let center: [f64; 3] = std::array::from_fn(|k| 0.5 * low[k] + 0.5 * high[k]);
    let half: [f64; 3] = std::array::from_fn(|k| (high[k] - center[k]).max(center[k] - low[k]));
    if half.iter().any(|&side| side.is_nan() || side > MAX_EXTENT) {
        let far = |corners: &[u32; 3]| {
            corners.iter().any(|&v| (0..3).any(|k| (mesh.positions[v as usize][k] - center[k]).abs() > MAX_EXTENT))
        };
        let triangle = mesh.triangles.iter().position(far).unwrap_or(0);
        return Err(BvhError::BadPosition { triangle });
    }
    Ok((center, Vec3A::from_array(half.map(|side| (side as f32).next_up()))))
}
