//! Distances to the closest points of the scan instead of along the normal.

use super::trace::{Distances, Rays};
use crate::bvh::ClosestPoint;
use crate::mesh::TriangleMesh;
use glam::DVec3;
use rayon::prelude::*;

/// For every texel the distance to the closest point of the scan among the triangles that face as the rays want, outward where that
/// point lies on the normal's side, inward where on the other. None where it is further than the maximum distance, or
/// on a free edge and not straight below: there the scan ends, and what is beside it was not measured.
/// Without the scan's mesh free edges are like others.
pub(super) fn trace(rays: &Rays, scan: Option<&TriangleMesh>) -> Distances {
    let ends = scan.map(|mesh| (mesh, FreeEdges::of(mesh)));
    let found = (0..rays.len()).into_par_iter().map(|i| nearest(rays, ends.as_ref(), i).unwrap_or([f32::NAN; 2]));
    let (outward, inward) = found.map(|[outward, inward]| (outward, inward)).unzip();
    Distances { outward, inward }
}

fn nearest(rays: &Rays, ends: Option<&(&TriangleMesh, FreeEdges)>, i: usize) -> Option<[f32; 2]> {
    let (_, direction) = rays.get(i)?;
    let position = DVec3::from(rays.texels.position[i]);
    let normal = direction.as_dvec3();
    let found = rays.scan.closest_point_within(
        position.to_array(),
        f64::from(rays.max_distance),
        normal.to_array(),
        (rays.facing > 0.0).then_some(rays.cosine),
    )?;
    let offset = DVec3::from(found.point) - position;
    if let Some((scan, free)) = ends
        && free.has(&found)
    {
        let across = DVec3::from(scan.triangle_normal(scan.triangles[found.triangle as usize])?);
        if offset.reject_from_normalized(across).length() > f64::from(rays.tolerance) {
            return None;
        }
    }
    let distance = found.distance as f32;
    let side = offset.dot(normal);
    Some(match () {
        () if distance <= rays.tolerance => [0.0, 0.0],
        () if side >= 0.0 => [distance, f32::NAN],
        () => [f32::NAN, distance],
    })
}

/// The edges of a mesh that one triangle has.
struct FreeEdges {
    /// Bit k of a triangle: its edge opposite to corner k.
    edges: Vec<u8>,
    /// Bit k: its corner k is on a free edge, be it another triangle's.
    corners: Vec<u8>,
}

impl FreeEdges {
    fn of(mesh: &TriangleMesh) -> FreeEdges {
        let key = |triangle: &[u32; 3], k: usize| {
            let (a, b) = (triangle[(k + 1) % 3], triangle[(k + 2) % 3]);
            u64::from(a.min(b)) << 32 | u64::from(a.max(b))
        };
        let mut all: Vec<u64> = mesh.triangles.par_iter().flat_map_iter(|t| (0..3).map(|k| key(t, k))).collect();
        all.par_sort_unstable();
        let single: Vec<u64> = all.chunk_by(|a, b| a == b).filter(|run| run.len() == 1).map(|run| run[0]).collect();
        drop(all);
        let mut vertices = vec![false; mesh.positions.len()];
        for edge in &single {
            vertices[(edge >> 32) as usize] = true;
            vertices[(edge & u64::from(u32::MAX)) as usize] = true;
        }
        let bits = |f: &dyn Fn(usize) -> bool| (0..3).map(|k| u8::from(f(k)) << k).sum();
        let edges = |t: &[u32; 3]| bits(&|k| single.binary_search(&key(t, k)).is_ok());
        let corners = |t: &[u32; 3]| bits(&|k| vertices[t[k] as usize]);
        FreeEdges {
            edges: mesh.triangles.par_iter().map(edges).collect(),
            corners: mesh.triangles.par_iter().map(corners).collect(),
        }
    }

    /// Whether a closest point is on one of them.
    fn has(&self, found: &ClosestPoint) -> bool {
        let triangle = found.triangle as usize;
        let zero: Vec<usize> = (0..3).filter(|k| found.weights[*k] == 0.0).collect();
        match zero[..] {
            [edge] => self.edges[triangle] >> edge & 1 == 1,
            [a, b] => self.corners[triangle] >> (3 - a - b) & 1 == 1,
            _ => false,
        }
    }
}
