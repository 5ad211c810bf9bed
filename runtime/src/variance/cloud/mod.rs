//! Distances to a cloud of points, which has no surface that a ray could meet.
//!
//! Every point has a foot, the nearest place of the model that faces as the point does, and a height over it. About a
//! texel the points are taken whose feet lie in a disc, which is a cylinder about the texel's normal, as in M3C2
//! (Lague, Brodu and Leroux, 'Accurate 3D comparison of complex topography with terrestrial laser scanner', 2013). The
//! disc is as large as the spacing of the points about it asks for. A plane through their heights, fitted by least
//! squares, has at the texel the distance, and its standard uncertainty. Since heights are those over the model, its
//! own curvature, and steps of it, do not enter: only what the deviations themselves are curved in the disc is
//! smoothed.
//!
//! A point belongs to one place, the nearest: what other surfaces of the model, or the other side of a thin wall, have
//! for themselves is not measured again.

mod cylinder;
mod facings;
mod free_space;
mod summary;
#[cfg(test)]
mod tests;
mod unmatched;

pub(super) use cylinder::{Cylinders, Sample, cylinders};
pub(super) use facings::facings;
pub(super) use free_space::contradicted;
pub use summary::CylinderSummary;
pub(super) use unmatched::unmatched;

use super::points::PointFeet;
use crate::scan::{Neighbours, Scan, spacings};
use glam::DVec3;
use rayon::prelude::*;

/// Cosine of the largest angle between the model's normals at a texel and at the feet of points that are measured for
/// it: what is beyond a sharper edge is another face.
const SAME_FACE: f64 = 0.5;

/// A point is over its foot if what joins them leaves the normal by less than this share of the height, or of the
/// points' spacing: beyond a border of the model nothing is measured.
const ASIDE_HEIGHT: f64 = 0.25;
const ASIDE_SPACING: f64 = 0.5;

/// The feet of a cloud's points on the model. Lists are of one length; points without a foot are in none.
pub(in crate::variance) struct CloudFeet {
    /// Indices of the points.
    points: Vec<u32>,
    /// Their feet. Millimetres.
    places: Vec<[f64; 3]>,
    /// The model's outward unit normals there.
    normals: Vec<DVec3>,
    /// How far the points are along these, positive outside. Millimetres.
    heights: Vec<f64>,
    /// The parts that the feet are on.
    parts: Vec<u32>,
    /// How far apart the feet are thereabouts: the square of it is the area of one. Millimetres.
    spacing: Vec<f64>,
}

impl CloudFeet {
    /// Of the points of a scan.
    pub(in crate::variance) fn new(scan: &Scan, feet: &PointFeet) -> Self {
        let mut all = Self {
            points: Vec::new(),
            places: Vec::new(),
            normals: Vec::new(),
            heights: Vec::new(),
            parts: Vec::new(),
            spacing: Vec::new(),
        };
        for (i, foot) in feet.feet.iter().enumerate() {
            let Some(foot) = foot.filter(|foot| foot.normal != DVec3::ZERO) else { continue };
            all.points.push(i as u32);
            all.places.push(foot.point.into());
            all.normals.push(foot.normal);
            all.heights.push((DVec3::from(scan.mesh.positions[i]) - foot.point).dot(foot.normal));
            all.parts.push(foot.part);
        }
        let tree = Neighbours::new(&all.places);
        all.spacing = spacings(&all.places, &tree, |i, j| all.normals[i].dot(all.normals[j]) >= SAME_FACE);
        all.leave_out_those_beside(scan);
        all
    }

    /// Leaves out the points that are not over their feet.
    fn leave_out_those_beside(&mut self, scan: &Scan) {
        let is_over = |k: usize| {
            let offset = DVec3::from(scan.mesh.positions[self.points[k] as usize]) - DVec3::from(self.places[k]);
            let aside = (offset - self.heights[k] * self.normals[k]).length();
            aside <= (ASIDE_HEIGHT * self.heights[k].abs()).max(ASIDE_SPACING * self.spacing[k])
        };
        let over: Vec<bool> = (0..self.points.len()).map(is_over).collect();
        crate::mesh::retain_marked(&mut self.points, &over);
        crate::mesh::retain_marked(&mut self.places, &over);
        crate::mesh::retain_marked(&mut self.normals, &over);
        crate::mesh::retain_marked(&mut self.heights, &over);
        crate::mesh::retain_marked(&mut self.parts, &over);
        crate::mesh::retain_marked(&mut self.spacing, &over);
    }
}

/// The feet of a cloud's points, and how they are found.
pub(in crate::variance) struct Cloud<'a> {
    feet: &'a CloudFeet,
    tree: Neighbours,
}

/// Feet that are looked at for the nearest on the face of a texel: those on the other side of a wall may be nearer.
const LOOKED_AT: usize = 8;

impl<'a> Cloud<'a> {
    pub(in crate::variance) fn new(feet: &'a CloudFeet) -> Self {
        Self { feet, tree: Neighbours::new(&feet.places) }
    }

    /// How far apart the points are, by point with a foot. Millimetres.
    pub(in crate::variance) fn spacings(&self) -> &[f64] {
        &self.feet.spacing
    }

    /// Points per square millimetre, on average over those that have feet.
    pub(in crate::variance) fn density(&self) -> f64 {
        let area: f64 = self.feet.spacing.iter().map(|s| s * s).sum();
        self.feet.points.len() as f64 / area.max(f64::MIN_POSITIVE)
    }

    /// How far apart the points are about a place of the surface with an outward normal: that of the nearest foot on
    /// the same face, or else of the nearest. None where there are no points. Millimetres.
    fn spacing(&self, place: DVec3, normal: DVec3, cosine: f64) -> Option<f64> {
        let near = self.tree.nearest(place.into(), LOOKED_AT);
        let of_face = near.iter().find(|k| self.feet.normals[**k as usize].dot(normal) >= cosine);
        let nearest = of_face.or(near.first())?;
        Some(self.feet.spacing[*nearest as usize])
    }

    /// The area of the surface that a point stands for about a place with an outward normal. Square millimetres.
    pub(in crate::variance) fn area_of_point(&self, place: DVec3, normal: DVec3) -> Option<f64> {
        self.spacing(place, normal, SAME_FACE).map(|s| s * s)
    }

    /// By point of the scan, its neighbours on the surface, for some points of it.
    pub(in crate::variance) fn neighbours(&self, samples: &[u32], most: usize) -> Vec<Vec<u32>> {
        let about = |point: &u32| {
            let Ok(k) = self.feet.points.binary_search(point) else { return Vec::new() };
            let near = self.tree.nearest(self.feet.places[k], most + 1);
            near.into_iter().map(|j| self.feet.points[j as usize]).filter(|j| j != point).collect()
        };
        samples.par_iter().map(about).collect()
    }

    /// The points that have a foot on a part, as indices of the scan's points, their feet and the normals there: those
    /// whose nearest neighbours do not belong to another part.
    pub(in crate::variance) fn members(&self, parts: usize) -> Vec<Vec<(u32, DVec3, DVec3)>> {
        let mut members = vec![Vec::new(); parts];
        for (k, part) in self.feet.parts.iter().enumerate() {
            let near = self.tree.nearest(self.feet.places[k], LOOKED_AT);
            let is_inside = near.iter().all(|j| self.feet.parts[*j as usize] == *part);
            if let Some(members) = members.get_mut(*part as usize).filter(|_| is_inside) {
                members.push((self.feet.points[k], self.feet.places[k].into(), self.feet.normals[k]));
            }
        }
        members
    }
}
