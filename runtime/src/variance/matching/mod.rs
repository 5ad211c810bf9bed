//! Whether the place of the scan that a texel's ray meets is that texel's own: beside an edge or a thin wall the ray
//! passes its own surface and meets that of a neighbour.

mod scraps;
#[cfg(test)]
mod tests;

use super::{Deviations, DistanceKind};
use crate::bvh::{Bvh, ClosestPoint};
use crate::model::Tessellation;
use crate::scan::{Scan, spikes};
use glam::DVec3;
use rayon::prelude::*;
use scraps::scraps;

/// Deviations within so many standard deviations of the scan's noise are not questioned: noise alone makes a place of
/// the scan nearer to another surface then. With 3, a box of 60 x 40 x 30 mm loses 0.52 % of its good area beside its
/// edges, with 4 it loses 0.32 %; of its wrong hits all are refused with either.
const NOISE: f64 = 4.0;

/// A hit belongs elsewhere if another place of the model is nearer to it than this share of the deviation, as it is
/// where the shortest way to the model makes more than 45 degrees with the ray. With 0.5, of the wrong hits on shapes
/// that deviate by 2 mm between 0.1 and 2.2 % more remain, and 0.01 to 0.07 % less of the good area is lost.
const NEARER: f64 = 0.7;

/// Cosine of the largest angle between the normals of the scan at a hit and of the model's surface that it may belong
/// to. Without a limit a dent in a thin wall belongs to the other side of that wall: 9.4 % of the good area of a mug
/// with dents of 2 mm in a wall of 1.5 mm was lost. With 45 instead of these 60 degrees up to 0.1 % of the wrong hits
/// remain that are refused now, among them the largest.
const ALIKE: f32 = 0.5;

/// The distance from a hit up to which its triangle is sought, in units of distances' rounding: a hit is a distance
/// times a direction, both in single precision, from the texel.
const ROUNDING: f64 = 16.0;

/// Which places of the scan count as those of a texel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Matching {
    /// Those that are the texel's own as seen from the scan, too.
    #[default]
    Mutual,
    /// All that its ray meets, as in the paper.
    All,
}

impl Matching {
    /// The name in variance.json.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Mutual => "mutual",
            Self::All => "all",
        }
    }
}

/// Removes the distances to places of the scan that belong to other places of the model, or to spikes of the scan, and
/// marks texels that have none left as ambiguous. The distances are of a `kind`; `bvh` was built over the scan, `model`
/// over the tessellation. Returns the number of the scan's spikes.
pub(in crate::variance) fn refuse_foreign(
    deviations: &mut Deviations,
    kind: DistanceKind,
    scan: &Scan,
    bvh: &Bvh,
    tessellation: &Tessellation,
    model: &Bvh,
) -> usize {
    let chord = tessellation.chord;
    let (spikes, scraps) = (spikes(&scan.mesh, scan.noise), scraps(&scan.mesh));
    let judge = Judge { deviations, kind, scan, bvh, model, chord, spikes, scraps };
    let refused = (0..deviations.outward.len()).into_par_iter();
    let refused: Vec<(usize, [bool; 2])> = refused.filter_map(|i| Some((i, judge.refused(i)?))).collect();
    let count = judge.spikes.iter().filter(|spike| **spike).count();
    deviations.refuse(&refused);
    count
}

struct Judge<'a> {
    deviations: &'a Deviations,
    kind: DistanceKind,
    scan: &'a Scan,
    bvh: &'a Bvh,
    model: &'a Bvh,
    /// The distance between the model's triangles and its surface. Millimetres.
    chord: f64,
    /// By vertex of the scan, whether it is a spike.
    spikes: Vec<bool>,
    /// By vertex of the scan, whether it is of a scrap.
    scraps: Vec<bool>,
}

impl Judge<'_> {
    /// Whether the distances of texel i along +normal and -normal are refused; none if neither is.
    fn refused(&self, i: usize) -> Option<[bool; 2]> {
        let distances = [self.deviations.outward[i], -self.deviations.inward[i]];
        let refused = distances.map(|along| self.is_foreign(i, f64::from(along)));
        refused.contains(&true).then_some(refused)
    }

    /// Whether what the ray of texel i meets at a signed distance belongs elsewhere. Millimetres.
    fn is_foreign(&self, i: usize, along: f64) -> bool {
        // Along an averaged normal a scan that is parallel to the surface is farther than it is from the surface.
        let deviation = along.abs() * f64::from(self.deviations.cosine.get(i).copied().unwrap_or(1.0));
        let nearer = NEARER * deviation - self.chord;
        // Written so that NaN ends here.
        if !(deviation > NOISE * self.scan.noise && nearer > 0.0) {
            return false;
        }
        let Some(met) = self.met(i, along) else { return false };
        let mesh = &self.scan.mesh;
        let corners = mesh.triangles[met.triangle as usize];
        if corners.iter().any(|corner| self.spikes[*corner as usize]) {
            return true;
        }
        // The normal of a scrap is that of a few triangles, which face anywhere.
        if self.scraps[corners[0] as usize] {
            return self.model.closest_point(met.point, nearer).is_some();
        }
        // Normals of vertices are means over their triangles, those of single triangles are much noisier.
        let normal = |k: usize| met.weights[k] * DVec3::from_array(mesh.normals[corners[k] as usize]);
        let Some(normal) = (0..3).map(normal).sum::<DVec3>().try_normalize() else { return false };
        let is_near = |normal| self.model.closest_point_facing(met.point, nearer, normal, ALIKE).is_some();
        match self.scan.oriented {
            true => self.normal(i).dot(normal) <= 0.0 || is_near(normal),
            false => is_near(normal) || is_near(-normal),
        }
    }

    /// The unit normal of texel i.
    fn normal(&self, i: usize) -> DVec3 {
        DVec3::from_array(self.deviations.texels.normal[i].map(f64::from)).normalize_or_zero()
    }

    /// The place of the scan at a signed distance from texel i: on its ray, or the closest one.
    fn met(&self, i: usize, along: f64) -> Option<ClosestPoint> {
        let normal = self.normal(i);
        let position = DVec3::from_array(self.deviations.texels.position[i]);
        let rounding = ROUNDING * self.deviations.precision;
        let (from, reach) = match self.kind {
            DistanceKind::Normal | DistanceKind::AveragedNormal => (position + along * normal, rounding),
            DistanceKind::Closest => (position, along.abs() + rounding),
        };
        match self.scan.oriented {
            true => self.bvh.closest_point_facing(from, reach, normal, 0.0),
            false => self.bvh.closest_point(from, reach),
        }
    }
}
