//! The place of the scan that a texel has its distance from.

use super::{Deviations, DistanceKind};
use crate::bvh::{Bvh, ClosestPoint};
use crate::scan::Scan;
use glam::DVec3;

/// The place of the scan that texel i has its distance from; none without a distance. The distances are of a `kind`,
/// `bvh` was built over the scan's triangles.
pub(in crate::variance) fn hit(
    deviations: &Deviations,
    i: usize,
    kind: DistanceKind,
    scan: &Scan,
    bvh: &Bvh,
) -> Option<ClosestPoint> {
    let (along, limit) = (f64::from(deviations.along(i)), deviations.max_distance);
    if along.is_nan() {
        return None;
    }
    let texels = &deviations.texels;
    let (place, normal) = (DVec3::from(texels.position[i]), DVec3::from(texels.normal[i].map(f64::from)));
    match kind {
        DistanceKind::Normal | DistanceKind::AveragedNormal => bvh.closest_point(place + along * normal, limit),
        DistanceKind::Closest if scan.oriented => bvh.closest_point_facing(place, limit, normal.normalize(), 0.0),
        DistanceKind::Closest => bvh.closest_point(place, limit),
    }
}
