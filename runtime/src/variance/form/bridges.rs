//! Triangles of the scan that bridge an edge or a step of the surface: their corners were measured, on one face and on
//! the other; what is between them was not.

use crate::bvh::Bvh;
use crate::feet::signed::SignedFoot;
use crate::mesh::TriangleMesh;
use crate::variance::noise::SMOOTH;
use crate::variance::{Deviations, DistanceKind};
use glam::DVec3;
use rayon::prelude::*;

/// Between points of two parts the surface may be so far from the line that joins their feet, in standard deviations of
/// the noise and in lengths of that line: a step between parallel faces is farther away than that, and what joins two
/// faces without a bend is not.
const STEP_NOISE: f64 = 0.25;
const STEP_LENGTH: f64 = 0.02;

/// A foot is not believed that is so many standard deviations of the noise away while some surface, whichever way it
/// faces, is at half that distance: the point's normal is that of triangles across an edge.
const DOUBTED: f64 = 4.0;
const NEARER: f64 = 0.5;

/// A texel meets a triangle that is so near to the place where its ray ended: in roundings of single precision.
const MET: f64 = 8.0;

/// A surface with the feet of the scan's points on it.
#[derive(Clone, Copy)]
pub(in crate::variance) struct ScannedSurface<'a> {
    pub(in crate::variance) feet: &'a [Option<SignedFoot>],
    /// The hierarchy over the surface's triangles.
    pub(in crate::variance) bvh: &'a Bvh,
}

/// By texel, whether what it sees of the scan is a triangle that bridges an edge or a step; empty where no triangle
/// does.
pub(in crate::variance) fn on_bridges(
    deviations: &Deviations,
    kind: DistanceKind,
    mesh: &TriangleMesh,
    surface: ScannedSurface<'_>,
) -> Vec<bool> {
    let bridges = surface.bridges(mesh, deviations.noise);
    let Ok(bvh) = Bvh::build(&bridges) else { return Vec::new() };
    let near = MET * f64::from(bvh.tolerance()).max(deviations.precision);
    let texels = &deviations.texels;
    let is_met = |i: usize| {
        let along = f64::from(deviations.along(i));
        if along.is_nan() {
            return false;
        }
        let (position, normal) = (DVec3::from(texels.position[i]), DVec3::from(texels.normal[i].map(f64::from)));
        // The closest point is in any direction: it is on a bridge if a bridge is as near.
        let (from, reach) = match kind {
            DistanceKind::Closest => (position, along.abs() + near),
            DistanceKind::Normal | DistanceKind::AveragedNormal => (position + along * normal, near),
        };
        bvh.closest_point(from, reach).is_some()
    };
    (0..texels.len()).into_par_iter().map(is_met).collect()
}

impl ScannedSurface<'_> {
    /// The triangles that bridge an edge or a step, or have a corner that has no place on the surface.
    fn bridges(&self, mesh: &TriangleMesh, noise: f64) -> TriangleMesh {
        let believed = |(foot, position): (&Option<SignedFoot>, &[f64; 3])| {
            foot.filter(|foot| {
                let far = foot.distance.abs();
                far <= DOUBTED * noise || self.bvh.closest_point((*position).into(), NEARER * far).is_none()
            })
        };
        let feet: Vec<Option<SignedFoot>> = self.feet.par_iter().zip(&mesh.positions).map(believed).collect();
        let turns = |[a, b]: [u32; 2]| match (&feet[a as usize], &feet[b as usize]) {
            (Some(a), Some(b)) => a.normal.dot(b.normal) < SMOOTH || (a.part != b.part && self.is_step(a, b, noise)),
            _ => true,
        };
        let bridges = |[a, b, c]: &[u32; 3]| [[*a, *b], [*b, *c], [*c, *a]].into_iter().any(turns);
        let triangles: Vec<[u32; 3]> = mesh.triangles.par_iter().copied().filter(bridges).collect();
        let positions = if triangles.is_empty() { Vec::new() } else { mesh.positions.clone() };
        TriangleMesh { positions, triangles, ..TriangleMesh::default() }
    }

    /// Whether the surface leaves the line between two feet.
    fn is_step(&self, a: &SignedFoot, b: &SignedFoot, noise: f64) -> bool {
        let off = (STEP_NOISE * noise).max(STEP_LENGTH * a.point.distance(b.point));
        self.bvh.closest_point(a.point.midpoint(b.point), off).is_none()
    }
}
