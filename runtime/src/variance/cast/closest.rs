//! Distances to the closest points of the scan.

use super::{Distances, Rays};
use crate::bvh::ClosestPoint;
use crate::mesh::{BoundaryEdge, TriangleMesh};
use glam::DVec3;
use rayon::prelude::*;

/// The distance from every texel to the closest point of the scan among the triangles on the texel's own side (less
/// than a right angle between the normals, if sides matter): outward if that point lies on the normal's side, otherwise
/// inward. A texel has none if the point is further away than the maximum distance, if its triangle makes a larger
/// angle than the rays admit, or if it is on a boundary edge and not perpendicularly below: the scan ends there, and
/// nothing was measured beside it. Without the scan's mesh, boundary edges are like any others.
pub(super) fn find(rays: &Rays, scan: Option<&TriangleMesh>) -> Distances {
    let boundary = scan.map(|mesh| (mesh, BoundaryEdges::new(mesh)));
    let distances = (0..rays.len()).into_par_iter();
    let distances = distances.map(|i| nearest(rays, boundary.as_ref(), i).unwrap_or([f32::NAN; 2]));
    let (outward, inward) = distances.map(|[outward, inward]| (outward, inward)).unzip();
    Distances { outward, inward }
}

fn nearest(rays: &Rays, boundary: Option<&(&TriangleMesh, BoundaryEdges)>, i: usize) -> Option<[f32; 2]> {
    let (_, direction) = rays.get(i)?;
    let position = DVec3::from(rays.texels.position[i]);
    let normal = direction.as_dvec3();
    let limit = f64::from(rays.max_distance);
    let closest = match rays.facing > 0.0 {
        true => {
            within_the_angle(rays, position, normal, rays.scan.closest_point_facing(position, limit, normal, 0.0)?)?
        }
        false => rays.scan.closest_point(position, limit)?,
    };
    let offset = closest.point - position;
    if let Some((scan, edges)) = boundary
        && edges.contain(&closest)
    {
        let across = scan.triangle_normal(scan.triangles[closest.triangle as usize])?;
        if offset.reject_from_normalized(across).length() > f64::from(rays.tolerance) {
            return None;
        }
    }
    let distance = closest.distance as f32;
    let side = offset.dot(normal);
    Some(match () {
        () if distance <= rays.tolerance => [0.0, 0.0],
        () if side >= 0.0 => [distance, f32::NAN],
        () => [f32::NAN, distance],
    })
}

/// The closest point, if a triangle that contains it makes no larger angle with the texel than the rays admit. Were the
/// closest point sought among such triangles only, a texel beside a steep slope would get the distance to wherever the
/// slope flattens out, far off to the side.
fn within_the_angle(rays: &Rays, position: DVec3, normal: DVec3, closest: ClosestPoint) -> Option<ClosestPoint> {
    if rays.cosine == 0.0 {
        return Some(closest);
    }
    // At an edge any of its triangles may have been found.
    let limit = closest.distance + f64::from(rays.tolerance);
    rays.scan.closest_point_facing(position, limit, normal, rays.cosine)
}

/// The edges that belong to a single triangle of a mesh.
struct BoundaryEdges {
    /// Bit k of a triangle is set if its edge opposite to corner k is one.
    edges: Vec<u8>,
    /// Bit k of a triangle is set if its corner k is on one, possibly another triangle's.
    corners: Vec<u8>,
}

impl BoundaryEdges {
    fn new(mesh: &TriangleMesh) -> Self {
        let mut edges = vec![0; mesh.triangles.len()];
        let mut on_boundary = vec![false; mesh.positions.len()];
        for BoundaryEdge { ends, triangle } in mesh.boundary_edges() {
            let corners = mesh.triangles[triangle as usize];
            let bits = (0..3).map(|k| u8::from(!ends.contains(&corners[k])) << k);
            edges[triangle as usize] |= bits.sum::<u8>();
            ends.iter().for_each(|v| on_boundary[*v as usize] = true);
        }
        let corners = |t: &[u32; 3]| (0..3).map(|k| u8::from(on_boundary[t[k] as usize]) << k).sum();
        Self { edges, corners: mesh.triangles.par_iter().map(corners).collect() }
    }

    fn contain(&self, closest: &ClosestPoint) -> bool {
        let triangle = closest.triangle as usize;
        let zero: Vec<usize> = (0..3).filter(|k| closest.weights[*k] == 0.0).collect();
        match zero[..] {
            [edge] => self.edges[triangle] >> edge & 1 == 1,
            [a, b] => self.corners[triangle] >> (3 - a - b) & 1 == 1,
            _ => false,
        }
    }
}
