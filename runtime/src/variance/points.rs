//! Signed distances of the scan's points from the surface: the other way round than from the texels.

use super::agreement::{Limits, PointAgreement};
use super::class::Class;
use super::distribution::{Distribution, Sample};
use super::moments::Moments;
use super::surface::{Parametrised, target};
use crate::bvh::Bvh;
use crate::feet::signed::{Place, SignedFoot};
use crate::mesh::TriangleMesh;
use crate::scan::{Attributes, Scan, ScanParts};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// The distances of the points of a scan from the surface, which they are nearest to. In JSON the statistics of all
/// points stand beside `parts`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointDistances {
    /// Number of points.
    pub points: usize,
    /// Number of points that are farther from the surface than the maximum distance.
    pub beyond: usize,
    /// Number of points that have no surface within the maximum distance but such as faces another way: by more than
    /// the largest angle between the normals.
    pub facing_away: usize,
    /// `measured / points`; 0 if there are none.
    pub share: f64,
    /// Statistics of the points that have a distance, every point counted alike.
    #[serde(flatten)]
    pub overall: PointStatistics,
    /// The same of those whose nearest surface is that of a part, in the order of the parts.
    pub parts: Vec<PartPoints>,
}

/// Statistics of the points of one part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartPoints {
    /// The name of the part.
    pub name: String,
    /// The statistics; their fields stand beside the name in JSON.
    #[serde(flatten)]
    pub statistics: PointStatistics,
}

/// Statistics of the distances of points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointStatistics {
    /// Number of points that have a distance.
    pub measured: usize,
    /// How many of them are within the limits, over and under them.
    #[serde(default)]
    pub agreement: PointAgreement,
    /// Their distances.
    #[serde(flatten)]
    pub moments: Moments,
    /// The point with the largest distance either way, if there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest: Option<LargestDistance>,
}

/// The largest of some distances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LargestDistance {
    /// Signed. Millimetres.
    pub distance: f64,
    /// The point, in the scan's frame. Millimetres.
    pub place: [f64; 3],
    /// The part whose surface is the nearest.
    pub part: String,
}

/// A point of the scan that has a distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointDistance {
    /// Signed distance from the surface, positive outside. Millimetres.
    pub distance: f64,
    /// Index of the part whose surface is the nearest.
    pub part: u32,
}

/// Points of a scan with their distances.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasuredPoints {
    /// The points. Millimetres.
    pub positions: Vec<[f64; 3]>,
    /// The distance of each; none where it is beyond the maximum distance or faces another way.
    pub distances: Vec<Option<PointDistance>>,
    /// Whether a point has no distance because the surface near it faces another way. As many as points.
    pub facing_away: Vec<bool>,
    /// The number of the scan that each comes from, where several were put together.
    pub parts: ScanParts,
    /// The scan's colours, in sRGB; as many as points, or none.
    pub colours: Vec<[u8; 3]>,
    /// The scan's intensities, likewise.
    pub intensities: Vec<f32>,
}

impl MeasuredPoints {
    /// The class of point i.
    #[must_use]
    pub fn class(&self, i: usize) -> Class {
        match self.distances.get(i) {
            Some(Some(_)) => Class::Measured,
            _ if self.facing_away.get(i).copied().unwrap_or(false) => Class::FacingAway,
            _ => Class::Beyond,
        }
    }
}

/// The surface from which points are measured.
pub(in crate::variance) struct PointSearch<'a> {
    /// The model; none for a reference mesh.
    pub(in crate::variance) parametrised: Option<&'a Parametrised<'a>>,
    /// By part, whether the model's outer side is the other one than written.
    pub(in crate::variance) inverted: &'a [bool],
    /// The surface as triangles, which are the surface itself of a reference mesh.
    pub(in crate::variance) mesh: &'a TriangleMesh,
}

/// Parts of a surface, in their order.
#[derive(Clone, Copy)]
pub(in crate::variance) struct PointParts<'a> {
    /// Their names.
    pub(in crate::variance) names: &'a [String],
    /// The distances that agree, by part.
    pub(in crate::variance) limits: &'a [Limits],
    /// Distances that differ by less are equal. Millimetres.
    pub(in crate::variance) precision: f64,
}

/// The nearest places of the surface of a scan's points.
pub(in crate::variance) struct PointFeet {
    /// By point; none where it is beyond the maximum distance or faces another way.
    pub(in crate::variance) feet: Vec<Option<SignedFoot>>,
    /// By point, whether it has no foot but on surface that faces another way.
    facing_away: Vec<bool>,
}

impl PointSearch<'_> {
    /// The feet of some places. `bvh` is the hierarchy over the triangles.
    pub(in crate::variance) fn feet_of(
        &self,
        bvh: &Bvh,
        places: &[Place],
        max_distance: f64,
    ) -> Vec<Option<SignedFoot>> {
        let layout = self.parametrised.map(Parametrised::layout);
        let target = target(self.parametrised.zip(layout.as_ref()), self.inverted, self.mesh, bvh);
        target.feet(places, max_distance)
    }

    /// The feet of all points of a scan. `bvh` is the hierarchy over the triangles, `max_angle` the largest angle
    /// between the scan's normals and the surface's, in radians, at most a right angle.
    pub(in crate::variance) fn feet(&self, bvh: &Bvh, scan: &Scan, max_distance: f64, max_angle: f64) -> PointFeet {
        let layout = self.parametrised.map(Parametrised::layout);
        let target = target(self.parametrised.zip(layout.as_ref()), self.inverted, self.mesh, bvh);
        let places = places(scan);
        let cosine = max_angle.cos();
        // Facets face as the surface does to their own fineness only, so that a right angle is no limit here.
        let limited = max_angle < FRAC_PI_2;
        let agrees =
            |place: &Place, foot: &SignedFoot| !limited || place.normal.is_none_or(|n| n.dot(foot.normal) >= cosine);
        let mut feet = target.feet(&places, max_distance);
        for (place, foot) in places.iter().zip(&mut feet) {
            *foot = foot.take().filter(|foot| agrees(place, foot));
        }
        let left: Vec<usize> = (0..feet.len()).filter(|i| feet[*i].is_none()).collect();
        let either_way: Vec<Place> = left.iter().map(|i| Place { normal: None, ..places[*i] }).collect();
        let mut facing_away = vec![false; feet.len()];
        for (i, foot) in left.iter().zip(target.feet(&either_way, max_distance)) {
            facing_away[*i] = foot.is_some();
        }
        PointFeet { feet, facing_away }
    }
}

impl PointFeet {
    /// The distances of all points of the scan that has these feet.
    pub(in crate::variance) fn distances(
        &self,
        scan: &Scan,
        parts: PointParts<'_>,
    ) -> (PointDistances, MeasuredPoints) {
        let distance = |foot: &SignedFoot| PointDistance { distance: foot.distance, part: foot.part };
        let distances: Vec<Option<PointDistance>> = self.feet.iter().map(|foot| foot.as_ref().map(distance)).collect();
        let facing_away = self.facing_away.clone();
        let Attributes { colours, intensities, parts: scans, .. } = scan.attributes.clone();
        let positions = scan.mesh.positions.clone();
        let measured = MeasuredPoints { positions, distances, facing_away, parts: scans, colours, intensities };
        let all = measured.positions.iter().zip(&measured.distances);
        let all: Vec<([f64; 3], PointDistance)> = all.filter_map(|(place, d)| Some((*place, (*d)?))).collect();
        let mut of_parts = vec![Vec::new(); parts.names.len()];
        for point in &all {
            if let Some(points) = of_parts.get_mut(point.1.part as usize) {
                points.push(*point);
            }
        }
        let overall = statistics(&all, parts);
        let facing_away = self.facing_away.iter().filter(|away| **away).count();
        let part = |(name, points): (&String, &Vec<([f64; 3], PointDistance)>)| PartPoints {
            name: name.clone(),
            statistics: statistics(points, parts),
        };
        let distances = PointDistances {
            points: self.feet.len(),
            beyond: self.feet.len() - all.len() - facing_away,
            facing_away,
            share: overall.measured as f64 / self.feet.len().max(1) as f64,
            parts: parts.names.iter().zip(&of_parts).map(part).collect(),
            overall,
        };
        (distances, measured)
    }
}

/// The points of a scan, with their normals where the sides of the scan are known.
pub(in crate::variance) fn places(scan: &Scan) -> Vec<Place> {
    let mesh = &scan.mesh;
    let normal = |i: usize| mesh.normals.get(i).filter(|_| scan.oriented).and_then(|n| DVec3::from(*n).try_normalize());
    mesh.positions.iter().enumerate().map(|(i, p)| Place { point: (*p).into(), normal: normal(i) }).collect()
}

fn statistics(
    all: &[([f64; 3], PointDistance)],
    PointParts { names, limits, precision }: PointParts<'_>,
) -> PointStatistics {
    let samples = all.iter().map(|(_, d)| Sample::new(d.distance as f32, 0.0)).collect();
    let [_, moments] = Distribution::new(samples).moments();
    let limited = all.iter().filter_map(|(_, d)| Some((d.distance, *limits.get(d.part as usize)?)));
    let agreement = PointAgreement::of(limited, precision);
    // Of equals the first.
    let largest = all.iter().rev().max_by(|a, b| a.1.distance.abs().total_cmp(&b.1.distance.abs()));
    let largest = largest.map(|(place, d)| LargestDistance {
        distance: d.distance,
        place: *place,
        part: names.get(d.part as usize).cloned().unwrap_or_default(),
    });
    PointStatistics { measured: all.len(), agreement, moments, largest }
}

#[cfg(test)]
mod tests;
