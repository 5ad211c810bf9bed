//! What stages after the distances look at of a scan: its triangles, or the points of a cloud.

use super::Deviations;
use super::cloud::Cloud;
use crate::bvh::Bvh;
use crate::mesh::TriangleMesh;
use glam::DVec3;

/// A scan, prepared for questions about its surface.
#[derive(Clone, Copy)]
pub(in crate::variance) enum Scanned<'a> {
    /// Triangles with the hierarchy over them.
    Triangles { mesh: &'a TriangleMesh, bvh: &'a Bvh },
    /// Points, and their feet on the model; none where no point has one.
    Points { mesh: &'a TriangleMesh, cloud: Option<&'a Cloud<'a>> },
}

impl Scanned<'_> {
    /// The area of the surface that a point of the scan stands for where a texel has its distance: a mesh has half as
    /// many vertices as triangles. Square millimetres.
    pub(in crate::variance) fn area_of_point(&self, deviations: &Deviations, i: usize) -> Option<f64> {
        let texels = &deviations.texels;
        let (place, normal) = (DVec3::from(texels.position[i]), DVec3::from(texels.normal[i].map(f64::from)));
        match self {
            Self::Triangles { mesh, bvh } => {
                let met = place + f64::from(deviations.along(i)) * normal;
                let closest = bvh.closest_point(met, deviations.max_distance)?;
                Some(2.0 * mesh.triangle_area(*mesh.triangles.get(closest.triangle as usize)?))
            }
            Self::Points { cloud, .. } => (*cloud)?.area_of_point(place, normal),
        }
    }

    /// Points of the scan per square millimetre of its surface, on average.
    pub(in crate::variance) fn density(&self) -> f64 {
        match self {
            Self::Triangles { mesh, .. } => mesh.positions.len() as f64 / mesh.area().max(f64::MIN_POSITIVE),
            Self::Points { cloud, .. } => cloud.map_or(0.0, Cloud::density),
        }
    }

    /// How far apart the points of a cloud are, by point with a foot; nothing of triangles. Millimetres.
    pub(in crate::variance) fn spacing(&self) -> &[f64] {
        match self {
            Self::Triangles { .. } => &[],
            Self::Points { cloud, .. } => cloud.map_or(&[], Cloud::spacings),
        }
    }
}
