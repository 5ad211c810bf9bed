//! The model's surface as the scan sees it: scanned, not seen, or in space that the scan shows to be empty. The
//! objective looks from the scan to the model; this looks back. A scanner saw each surface from somewhere in front of
//! it, so that what of the model stands in front of scanned surfaces, with no scan near it, is contradicted. What lies
//! behind them, or where nothing was scanned, is not.

use super::coverage::all_places;
use super::level::Level;
use super::parameterization::Estimate;
use crate::bvh::Bvh;
use crate::fit::sampling::direction;
use crate::fit::tuning::{
    EMPTY_AWAY_NOISE, EMPTY_AWAY_SIGMAS, EMPTY_BACK, EMPTY_DIRECTIONS, EMPTY_FRONT, EMPTY_SEEN_FROM_FRONT,
};
use crate::mesh::TriangleMesh;
use crate::model::Partials;
use crate::scan::Scan;
use glam::DVec3;
use rayon::prelude::*;

/// The scan as a witness of empty space.
pub(crate) struct FreeSpace {
    bvh: Bvh,
    /// What is nearer to the scan may be there by its noise, or by its gaps. Millimetres.
    near: f64,
}

/// How the scan speaks of a place of the model's surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Seen {
    /// The scan passes by it, facing the same way.
    Scanned,
    /// The scan does not show it, and does not speak against it.
    Unseen,
    /// It stands where the scan shows empty space.
    Contradicted,
}

/// The areas of a patch by how the scan speaks of them. Square millimetres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Areas {
    pub(crate) whole: f64,
    pub(crate) unseen: f64,
    pub(crate) contradicted: f64,
    /// The place in the middle of what is contradicted, in the scan's frame.
    pub(crate) place: DVec3,
}

impl FreeSpace {
    /// Of a scan whose points are `spacing` (millimetres) apart. None for clouds and meshes whose sides are not known:
    /// they do not say which side was seen.
    pub(crate) fn of(scan: &Scan, spacing: f64) -> Option<Self> {
        if scan.mesh.triangles.is_empty() || !scan.oriented {
            return None;
        }
        let bvh = Bvh::build(&scan.mesh).ok()?;
        Some(Self { bvh, near: EMPTY_AWAY_NOISE * scan.noise + spacing })
    }

    /// The areas of all patches; `sigma` (millimetres) is the scale of the loss, `reversed` says that the scan's
    /// triangles face the other way. None where the model does not exist.
    pub(crate) fn areas(&self, level: &Level, at: &Estimate, sigma: f64, reversed: bool) -> Option<Vec<Areas>> {
        let problem = level.problem;
        let instance = problem.model.instantiate(&level.space.x(&at.z)?).ok()?;
        let mut areas = vec![Areas::default(); problem.model.parts().len()];
        let near = self.near.max(EMPTY_AWAY_SIGMAS * sigma);
        let side = if reversed { -1.0 } else { 1.0 };
        for places in all_places(problem.model, &*instance) {
            let mut partials = vec![Partials::default(); places.u.len()];
            instance.partials(places.patch, &places.u, &places.v, &mut partials).ok()?;
            let seen = |p: &Partials| {
                let normal = DVec3::from_array(p.du).cross(DVec3::from_array(p.dv)).normalize_or_zero();
                let (point, normal) = (at.motion.apply(DVec3::from_array(p.point)), at.motion.rotation * normal);
                (point, self.seen(&problem.scan.mesh, point, normal, side, near))
            };
            let seen: Vec<(DVec3, Seen)> = partials.par_iter().map(seen).collect();
            let sums = &mut areas[places.patch];
            for ((point, seen), area) in seen.into_iter().zip(&places.area) {
                sums.whole += area;
                match seen {
                    Seen::Scanned => {}
                    Seen::Unseen => sums.unseen += area,
                    Seen::Contradicted => {
                        sums.contradicted += area;
                        sums.place += *area * point;
                    }
                }
            }
            sums.place /= sums.contradicted.max(f64::MIN_POSITIVE);
        }
        Some(areas)
    }

    /// How the scan speaks of a place: it is scanned where the scan is nearer than `near` (millimetres), and
    /// contradicted where nothing of it is, and from a little behind the place many directions lead to the front of a
    /// scanned surface, and none to the back of one.
    fn seen(&self, scan: &TriangleMesh, p: DVec3, normal: DVec3, side: f64, near: f64) -> Seen {
        if self.bvh.closest_point_facing(p, near, side * normal, 0.0).is_some() {
            return Seen::Scanned;
        }
        if self.bvh.closest_point(p, near).is_some() {
            return Seen::Unseen;
        }
        let from = p - normal * (0.5 * near);
        let mut from_front = 0;
        for k in 0..EMPTY_DIRECTIONS {
            let direction = direction(k);
            let Some(hit) = self.bvh.nearest_hit(from, direction, f64::INFINITY) else { continue };
            let [a, b, c] = scan.corners(scan.triangles[hit.triangle as usize]);
            let cosine = side * (b - a).cross(c - a).normalize_or_zero().dot(direction);
            if cosine > EMPTY_BACK {
                return Seen::Unseen;
            }
            from_front += usize::from(cosine < EMPTY_FRONT);
        }
        if from_front >= EMPTY_SEEN_FROM_FRONT { Seen::Contradicted } else { Seen::Unseen }
    }
}
