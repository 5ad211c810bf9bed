//! Triangles of the scan that say nothing of the face that sees them: those that bridge an edge or a step of the
//! surface, whose corners were measured, on one face and on the other, and what is between them was not; and those of
//! other faces.

use crate::bvh::Bvh;
use crate::feet::signed::SignedFoot;
use crate::mesh::TriangleMesh;
use crate::model::Texels;
use crate::variance::hits::Hit;
use crate::variance::noise::SMOOTH;
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

/// Cosine of the most by which a triangle of a face may be turned against it, 60 degrees, and the height of one that
/// says how it is turned, in standard deviations of the noise.
const TURNED: f64 = 0.5;
const LOW: f64 = 3.0;

/// A surface with the feet of the scan's points on it.
#[derive(Clone, Copy)]
pub(in crate::variance) struct ScannedSurface<'a> {
    pub(in crate::variance) feet: &'a [Option<SignedFoot>],
    /// The hierarchy over the surface's triangles.
    pub(in crate::variance) bvh: &'a Bvh,
}

impl ScannedSurface<'_> {
    /// By texel, whether what it sees of the scan is a triangle that bridges an edge or a step, or one that faces
    /// another way. `hits` are the places that the texels have their distances from,
    /// `noise` is in millimetres.
    pub(in crate::variance) fn on_bridges(
        &self,
        mesh: &TriangleMesh,
        noise: f64,
        texels: &Texels,
        hits: &[Option<Hit>],
    ) -> Vec<bool> {
        let bridges = self.bridges(mesh, noise);
        let is_bridge = |(i, hit): (usize, &Option<Hit>)| {
            hit.is_some_and(|hit| {
                let triangle = mesh.corners(mesh.triangles[hit.triangle as usize]);
                bridges[hit.triangle as usize] || faces_away(triangle, texels.normal[i], noise)
            })
        };
        hits.par_iter().enumerate().map(is_bridge).collect()
    }

    /// By triangle, whether it bridges an edge or a step, or has a corner that has no place on the surface.
    fn bridges(&self, mesh: &TriangleMesh, noise: f64) -> Vec<bool> {
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
        mesh.triangles.par_iter().map(bridges).collect()
    }

    /// Whether the surface leaves the line between two feet.
    fn is_step(&self, a: &SignedFoot, b: &SignedFoot, noise: f64) -> bool {
        let off = (STEP_NOISE * noise).max(STEP_LENGTH * a.point.distance(b.point));
        self.bvh.closest_point(a.point.midpoint(b.point), off).is_none()
    }
}

/// Whether a triangle is turned against a surface that a ray met it from, so far that it is another face's: beside the
/// end of a face that has moved aside, rays meet the wall below it. What is as low as noise may lie any way.
fn faces_away(corners: [DVec3; 3], normal: [f32; 3], noise: f64) -> bool {
    let normal = DVec3::from(normal.map(f64::from));
    let [a, b, c] = corners;
    let cross = (b - a).cross(c - a);
    let longest = longest_side(corners);
    cross.dot(normal).abs() < TURNED * cross.length() && cross.length() > LOW * noise * longest
}

/// The length of a triangle's longest side. Millimetres.
pub(super) fn longest_side([a, b, c]: [DVec3; 3]) -> f64 {
    [b - a, c - b, a - c].map(DVec3::length).into_iter().fold(0.0, f64::max)
}
