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
mod dispatch;
mod group;
mod lanes;
mod packet;
mod ray;
mod sweep;
#[cfg(test)]
mod tests;

pub(crate) use block::TriangleBlock;
pub use closest::ClosestPoint;
pub(crate) use closest::closest_weights;
pub(crate) use obvhs::bvh2::node::Bvh2Node;
pub(crate) use packet::{BothWays, HitCriteria, Line, PACKET};
pub use ray::Hit;

use crate::mesh::{Bounds, TriangleMesh};
use crate::robust::median;
use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use sweep::MAX_DEPTH;
use thiserror::Error;

/// Coordinates further than this from the mesh's centre are refused: third powers must stay within single precision.
/// Millimetres.
pub(crate) const MAX_EXTENT: f64 = 1e9;

/// A bounding volume hierarchy over a triangle mesh.
pub struct Bvh {
    /// Nodes; the leaf that starts at primitive 4 b holds the triangles of block b.
    tree: Bvh2,
    /// The triangles of each leaf.
    blocks: Vec<TriangleBlock>,
    /// The centre of the mesh's bounding box, which was subtracted from every position.
    centre: DVec3,
    /// Half the bounding box's sides, rounded up.
    half_extent: Vec3A,
    triangle_count: usize,
}

/// Why no hierarchy could be built over a mesh.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum BvhError {
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} (counted from 0) names vertex {vertex}, but there are only {vertices} vertices")]
    BadIndex {
        /// Index of the triangle.
        triangle: usize,
        /// The index it has.
        vertex: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// A triangle's corner is NaN or infinite.
    #[error("a corner of triangle {triangle} (counted from 0) is not finite")]
    BadPosition {
        /// Index of the triangle.
        triangle: usize,
    },
    /// The mesh is too wide.
    #[error(
        "it is {size:.3e} mm across, more than the 2e9 mm that can be searched; triangle {triangle} (counted from 1) lies farthest from the others, at ({:.6e}, {:.6e}, {:.6e}) mm: check the unit, or remove it",
        at[0], at[1], at[2]
    )]
    TooWide {
        /// The longest side of its box. Millimetres.
        size: f64,
        /// The number of the triangle.
        triangle: usize,
        /// Its first corner. Millimetres.
        at: [f64; 3],
    },
    /// More triangles than 32-bit indices can tell apart.
    #[error("{triangles} triangles are more than can be searched (2^28); decimate or split the mesh")]
    TooManyTriangles {
        /// The number of triangles.
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
        let (centre, half_extent) = bounds(mesh)?;
        Ok(Self::build_around(mesh, centre, half_extent))
    }

    /// A hierarchy over another mesh, which must be within the box of this one's, in the same single-precision
    /// coordinates: a ray through an edge that triangles of both share hits one of them.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub(crate) fn build_beside(&self, mesh: &TriangleMesh) -> Result<Self, BvhError> {
        bounds(mesh)?;
        Ok(Self::build_around(mesh, self.centre, self.half_extent))
    }

    fn build_around(mesh: &TriangleMesh, centre: DVec3, half_extent: Vec3A) -> Self {
        let corners = |triangle: usize| mesh.corners(mesh.triangles[triangle]).map(|p| (p - centre).as_vec3a());
        let boxes: Vec<Aabb> = (0..mesh.triangles.len()).map(|i| Aabb::from_points(&corners(i))).collect();
        let tree = sweep::build(&boxes);
        drop(boxes);
        let blocks = tree.primitive_indices.chunks_exact(4).map(|leaf| TriangleBlock::new(leaf, corners)).collect();
        Self { tree, blocks, centre, half_extent, triangle_count: mesh.triangles.len() }
    }

    /// The number of triangles.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangle_count
    }

    /// The number of triangles whose leaf a line through the mesh meets on average: some ten on a scan, and nearly all
    /// of a mesh whose triangles lie in each other. (The chance that a line through a convex body also meets one within
    /// it is the ratio of their surfaces.)
    #[must_use]
    pub fn overlap(&self) -> f64 {
        let area = |node: &Bvh2Node| f64::from(node.aabb().half_area());
        let Some(whole) = self.tree.nodes.first().map(area).filter(|area| *area > 0.0) else { return 0.0 };
        let leaves = self.tree.nodes.iter().filter(|node| node.is_leaf());
        leaves.map(|node| area(node) * f64::from(node.prim_count)).sum::<f64>() / whole
    }

    /// A point in single precision, relative to the centre.
    pub(crate) fn to_local(&self, p: DVec3) -> Vec3A {
        (p - self.centre).as_vec3a()
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

/// The error of a mesh that is too wide: it names the triangle that lies farthest from the middle of most.
fn too_wide(mesh: &TriangleMesh, bounds: Bounds) -> BvhError {
    let corner = |t: &[u32; 3]| mesh.corners(*t)[0];
    let middle = [0, 1, 2].map(|axis| {
        let mut all: Vec<f64> = mesh.triangles.iter().map(|t| corner(t)[axis]).collect();
        median(&mut all).unwrap_or(0.0)
    });
    let distance = |t: &[u32; 3]| (corner(t) - DVec3::from(middle)).length_squared();
    let farthest = (0..mesh.triangles.len())
        .max_by(|a, b| distance(&mesh.triangles[*a]).total_cmp(&distance(&mesh.triangles[*b])))
        .unwrap_or(0);
    let at = mesh.triangles.get(farthest).map_or([0.0; 3], |t| corner(t).into());
    BvhError::TooWide { size: bounds.size().max_element(), triangle: farthest + 1, at }
}

/// Centre and half sides of the box around all triangles; zeros where there are none.
fn bounds(mesh: &TriangleMesh) -> Result<(DVec3, Vec3A), BvhError> {
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        for &vertex in corners {
            let Some(p) = mesh.positions.get(vertex as usize) else {
                return Err(BvhError::BadIndex { triangle, vertex, vertices: mesh.positions.len() });
            };
            if !p.iter().all(|c| c.is_finite()) {
                return Err(BvhError::BadPosition { triangle });
            }
        }
    }
    let bounds: Bounds = mesh.triangles.iter().flat_map(|t| mesh.corners(*t)).collect();
    let centre = bounds.centre();
    let half = (bounds.high - centre).max(centre - bounds.low);
    if bounds.is_empty() {
        return Ok((DVec3::ZERO, Vec3A::ZERO));
    }
    if !half.cmple(DVec3::splat(MAX_EXTENT)).all() {
        return Err(too_wide(mesh, bounds));
    }
    Ok((centre, Vec3A::from_array(half.to_array().map(|side| (side as f32).next_up()))))
}
