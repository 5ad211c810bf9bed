//! Space that the scan shows to be empty, and the model's surface that stands in it. The objective looks from the
//! scan to the model; this looks back. A scanner saw each surface from somewhere in front of it, so that what of
//! the model stands in front of scanned surfaces, with no scan near it, is contradicted. Surface behind them, or
//! where nothing was scanned, is not.

use super::coverage::{across, all_places};
use super::level::Level;
use super::parameterization::Estimate;
use crate::bvh::Bvh;
use crate::fit::tuning::EMPTY_AWAY_SIGMAS;
use crate::mesh::TriangleMesh;
use crate::model::Partials;
use crate::scan::{EmptySpace, Scan};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Triangles that a line through the scan meets on average, beyond which its points are taken for a cloud: rays among
/// needles that lie in each other take minutes (20,000 triangles of a cone about one corner: 4,000). Scans have some
/// 10.
const MOST_OVERLAP: f64 = 300.0;

/// The scan as a witness of empty space.
pub(crate) struct FreeSpace {
    bvh: Bvh,
    /// The surface of a cloud, or of a mesh of needles.
    discs: Option<TriangleMesh>,
    /// Model surface nearer to the scan than this may be where it is by the scan's noise or gaps. Millimetres.
    near: f64,
}

/// The contradicted surface of a patch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Contradicted {
    /// The whole patch. Square millimetres.
    pub(crate) of: f64,
    /// The contradicted area. Square millimetres.
    pub(crate) area: f64,
    /// The place in the middle of that, in the scan's frame.
    pub(crate) place: DVec3,
}

impl FreeSpace {
    /// Of a scan whose points are `spacing` (millimetres) apart. None for scans whose sides are not known: they do not
    /// say which side was seen.
    pub(crate) fn of(scan: &Scan, spacing: f64) -> Option<Self> {
        if !scan.oriented {
            return None;
        }
        let near = EmptySpace::nearness(scan.noise, spacing);
        if !scan.mesh.triangles.is_empty() {
            let bvh = Bvh::build(&scan.mesh).ok()?;
            if bvh.overlap() <= MOST_OVERLAP {
                return Some(Self { bvh, discs: None, near });
            }
        }
        let discs = discs(&scan.mesh, spacing)?;
        Some(Self { bvh: Bvh::build(&discs).ok()?, discs: Some(discs), near })
    }

    /// The contradicted surface of every patch; `sigma` (millimetres) is the scale of the loss, `reversed` says that
    /// the scan's triangles face the other way. None where the model does not exist.
    pub(crate) fn contradicted(
        &self,
        level: &Level,
        at: &Estimate,
        sigma: f64,
        reversed: bool,
    ) -> Option<Vec<Contradicted>> {
        let problem = level.problem;
        let instance = problem.model.instantiate(&level.space.x(&at.z)?).ok()?;
        let mut contradicted = vec![Contradicted::default(); problem.model.parts().len()];
        let near = self.near.max(EMPTY_AWAY_SIGMAS * sigma);
        let surface = self.discs.as_ref().unwrap_or(&problem.scan.mesh);
        let space = EmptySpace::new(surface, &self.bvh, reversed, near);
        for places in all_places(problem.model, &*instance) {
            let mut partials = vec![Partials::default(); places.u.len()];
            instance.partials(places.patch, &places.u, &places.v, &mut partials).ok()?;
            let in_empty_space = |p: &Partials| {
                let point = at.motion.apply(DVec3::from_array(p.point));
                let normal = at.motion.rotation * across(p).normalize_or_zero();
                space.contains(point, normal).then_some(point)
            };
            let found: Vec<Option<DVec3>> = partials.par_iter().map(in_empty_space).collect();
            let of_patch = &mut contradicted[places.patch];
            for (point, area) in found.into_iter().zip(&places.area) {
                of_patch.of += area;
                if let Some(point) = point {
                    of_patch.area += area;
                    of_patch.place += *area * point;
                }
            }
            of_patch.place /= of_patch.area.max(f64::MIN_POSITIVE);
        }
        Some(contradicted)
    }
}

/// The points of a cloud as small triangles across their normals, which close the surface between neighbours. None
/// where a point has no normal.
fn discs(cloud: &TriangleMesh, spacing: f64) -> Option<TriangleMesh> {
    if cloud.normals.len() != cloud.positions.len() {
        return None;
    }
    // The circle inside of the triangle reaches to the next point.
    let radius = 2.0 * spacing;
    let mut mesh = TriangleMesh::default();
    for (p, n) in cloud.positions.iter().zip(&cloud.normals) {
        let (p, n) = (DVec3::from_array(*p), DVec3::from_array(*n).normalize_or_zero());
        if n == DVec3::ZERO {
            continue;
        }
        let first = u32::try_from(mesh.positions.len()).ok()?;
        let a = n.any_orthonormal_vector();
        let b = n.cross(a);
        mesh.positions.extend((0..3).map(|k| {
            let (sin, cos) = (TAU * f64::from(k) / 3.0).sin_cos();
            (p + radius * (cos * a + sin * b)).to_array()
        }));
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    Some(mesh)
}
