//! Triangles of the scan that bridge an edge of the surface: their corners were measured, on one face and on the other;
//! what is between them was not.

use super::shape::Recognised;
use crate::bvh::Bvh;
use crate::feet::signed::SignedFoot;
use crate::mesh::TriangleMesh;
use crate::variance::Deviations;
use glam::DVec3;
use rayon::prelude::*;

/// Cosine of the largest angle between the surface's normals at the corners of a triangle, 30 degrees: chamfers turn by
/// 45 degrees, and cylinders of two spacings by as much as this.
const SMOOTH: f64 = 0.86;

/// A texel meets a triangle that is so near to the place where its ray ended: in roundings of single precision.
const MET: f64 = 8.0;

/// By texel, whether its ray ended on a triangle that bridges an edge; empty where no triangle does. `feet` are those
/// of the scan's points. Texels of parts without a form are not looked at.
pub(in crate::variance) fn on_bridges(
    deviations: &Deviations,
    shapes: &[Option<Recognised>],
    mesh: &TriangleMesh,
    feet: &[Option<SignedFoot>],
) -> Vec<bool> {
    let bridges = bridges(mesh, feet);
    let Ok(bvh) = Bvh::build(&bridges) else { return Vec::new() };
    // Distances are rounded at the size of the whole scan.
    let near = MET * f64::from(bvh.tolerance()).max(deviations.precision);
    let texels = &deviations.texels;
    let is_met = |i: usize| {
        let along = f64::from(deviations.along(i));
        let has_form = shapes.get(texels.part[i] as usize).is_some_and(Option::is_some);
        if !has_form || along.is_nan() {
            return false;
        }
        let normal = DVec3::from(texels.normal[i].map(f64::from));
        bvh.closest_point(DVec3::from(texels.position[i]) + along * normal, near).is_some()
    };
    (0..texels.len()).into_par_iter().map(is_met).collect()
}

/// The triangles that bridge an edge.
fn bridges(mesh: &TriangleMesh, feet: &[Option<SignedFoot>]) -> TriangleMesh {
    let turns = |[a, b]: [u32; 2]| match (&feet[a as usize], &feet[b as usize]) {
        (Some(a), Some(b)) => a.normal.dot(b.normal) < SMOOTH,
        _ => false,
    };
    let bridges = |[a, b, c]: &[u32; 3]| [[*a, *b], [*b, *c], [*c, *a]].into_iter().any(turns);
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().copied().filter(bridges).collect();
    let positions = if triangles.is_empty() { Vec::new() } else { mesh.positions.clone() };
    TriangleMesh { positions, triangles, ..TriangleMesh::default() }
}
