//! The places of the scan that the texels have their distances from.

use super::{Deviations, DistanceKind};
use crate::bvh::Bvh;
use crate::scan::Scan;
use glam::DVec3;
use rayon::prelude::*;

/// A place of the scan, in single precision: there is one for every texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::variance) struct Hit {
    /// The scan's triangle.
    pub(in crate::variance) triangle: u32,
    /// Weights of its corners.
    pub(in crate::variance) weights: [f32; 3],
}

/// By texel, the place that it has its distance from; none without a distance. The distances are of a `kind`, `bvh`
/// was built over the scan's triangles.
pub(in crate::variance) fn hits(
    deviations: &Deviations,
    kind: DistanceKind,
    scan: &Scan,
    bvh: &Bvh,
) -> Vec<Option<Hit>> {
    let (texels, limit) = (&deviations.texels, deviations.max_distance);
    let hit = |i: usize| {
        let along = f64::from(deviations.along(i));
        if along.is_nan() {
            return None;
        }
        let (place, normal) = (DVec3::from(texels.position[i]), DVec3::from(texels.normal[i].map(f64::from)));
        let met = match kind {
            DistanceKind::Normal | DistanceKind::AveragedNormal => bvh.closest_point(place + along * normal, limit),
            DistanceKind::Closest if scan.oriented => bvh.closest_point_facing(place, limit, normal.normalize(), 0.0),
            DistanceKind::Closest => bvh.closest_point(place, limit),
        }?;
        Some(Hit { triangle: met.triangle, weights: met.weights.map(|weight| weight as f32) })
    };
    (0..texels.len()).into_par_iter().map(hit).collect()
}
