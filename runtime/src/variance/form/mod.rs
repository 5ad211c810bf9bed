//! Deviations of form: flatness, roundness, cylindricity and so on, independent of position and size.
//!
//! The form of a part is recognised from its exact surface ([`recognise`]). The measured points (texels displaced by
//! their distances) go through a Gaussian filter, and what is left is compared with the form in the position and size
//! that suit it best: by least squares, and by the narrowest zone (minimum zone, ISO 1101; Chebyshev approximation).
//! From the widths is taken what noise adds to them.

mod associated;
mod bridges;
mod datum;
mod dents;
mod figure;
mod filter;
mod grid;
mod linear;
mod members;
mod moved_edges;
mod noise;
mod quadric;
mod relation;
mod revolved;
mod roundness;
mod shape;
mod smooth;
#[cfg(test)]
mod tests;
mod zone;

pub(super) use bridges::ScannedSurface;
pub(super) use dents::Around;
pub use figure::PointMeasure;
pub(super) use figure::point_measures;
pub(super) use members::Members;
pub(super) use moved_edges::across_moved_edges;
pub(super) use noise::ScanNoise;
pub use noise::WithoutNoise;
pub use relation::{DatumRelations, Relation};
pub(super) use relation::{relations, unfit};
pub use shape::Shape;
pub(super) use shape::{Recognised, recognise};

use super::Deviations;
use associated::in_position;
use datum::Datum;
pub(super) use filter::Point;
use glam::DVec3;
use grid::Grid;
use noise::Simulation;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use smooth::{Smooth, default_cutoff, least_cutoff};

/// The smallest number of points for a form.
const FEWEST: usize = 50;

/// Cosine of the largest angle by which an averaged normal counts as the surface's own.
const UNTURNED: f32 = 0.9999;

/// A width that is clearly more than noise is a lower limit if it is decided at a rim, or within this part of the
/// cut-off of surface that was not measured: over so short a way filtered values hardly change, but to the rim of a
/// part a form may go on. It finds 18 of 18 warped discs of 20 mm of which the last half millimetre had no distances,
/// at a cut-off of 9 mm.
const BESIDE_GAP: f64 = 0.25;

/// The deviation of a part from its form.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FormDeviation {
    /// The form of its surface.
    pub shape: Shape,
    /// Cut-off of the Gaussian filter: the wave length of which half passes. Millimetres.
    pub cutoff: f64,
    /// Number of points (texels with a distance) that were filtered.
    pub points: usize,
    /// Number of outliers that are left out: more than four robust standard deviations from the filtered surface about
    /// them, unless two fifths of a disc about them are, too (see docs/output.md).
    pub outlying: usize,
    /// Its zone; none for general surfaces of revolution, which only have sections.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zone: Option<Zone>,
    /// The roundness of surfaces about an axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roundness: Option<Roundness>,
    /// The straightness of the generators of cylinders and cones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub straightness: Option<Straightness>,
}

/// A width of a part's form.
#[derive(Clone, Copy, Debug)]
pub struct Characteristic<'a> {
    /// Its name.
    pub name: &'a str,
    /// Width about the curve or surface of least squares. Millimetres.
    pub least_squares: f64,
    /// Width of the narrowest zone. Millimetres.
    pub minimum_zone: f64,
    /// The narrowest width without what noise adds.
    pub without_noise: WithoutNoise,
    /// Whether it is decided beside surface that was not measured, where the form may go on.
    pub lower_limit: bool,
}

impl FormDeviation {
    /// The widths that the part has.
    pub fn characteristics(&self) -> impl Iterator<Item = Characteristic<'_>> {
        let zone = self.zone.as_ref().map(|z| Characteristic {
            name: &z.characteristic,
            least_squares: z.least_squares,
            minimum_zone: z.minimum_zone,
            without_noise: z.without_noise,
            lower_limit: z.lower_limit,
        });
        let roundness = self.roundness.map(|r| ("roundness", r.least_squares, r.minimum_zone, r.without_noise));
        let straightness =
            self.straightness.map(|s| ("straightness", s.least_squares, s.minimum_zone, s.without_noise));
        let of = |(name, least_squares, minimum_zone, without_noise)| Characteristic {
            name,
            least_squares,
            minimum_zone,
            without_noise,
            lower_limit: false,
        };
        zone.into_iter().chain(roundness.into_iter().chain(straightness).map(of))
    }

    /// The share of the points that are left out.
    #[must_use]
    pub fn left_out(&self) -> f64 {
        self.outlying as f64 / self.points.max(1) as f64
    }
}

/// The zone between two surfaces of one form that contains the filtered points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Zone {
    /// Name of its width: flatness, cylindricity, conicity or sphericity.
    pub characteristic: String,
    /// Its width about the surface of least squares. Millimetres.
    pub least_squares: f64,
    /// Width of the narrowest zone. Millimetres.
    pub minimum_zone: f64,
    /// The narrowest width without what noise adds.
    #[serde(flatten)]
    pub without_noise: WithoutNoise,
    /// The points on the zone's lower and upper surface, in the scan's coordinates. Millimetres.
    pub at: [[f64; 3]; 2],
    /// Whether one of these lies at the rim of what was measured, or beside surface of the part that was not: the form
    /// may go on there, and the width is a lower limit.
    #[serde(default)]
    pub lower_limit: bool,
    /// Both widths of all points as they are, without the filter and with the outliers. Millimetres.
    pub unfiltered: [f64; 2],
}

/// Roundness of the sections at right angles to a part's axis: the worst of them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Roundness {
    /// Width of the ring about the circle of least squares, perpendicular to the surface (on a cylinder, in the
    /// section's plane). Millimetres.
    pub least_squares: f64,
    /// Width of the narrowest ring, perpendicular to the surface. Millimetres.
    pub minimum_zone: f64,
    /// The narrowest width without what noise adds.
    #[serde(flatten)]
    pub without_noise: WithoutNoise,
    /// Both widths in the plane of that section (ISO 12181-1). Millimetres.
    pub in_plane: [f64; 2],
    /// Position of the worst section: a point of the axis, in the scan's coordinates. Millimetres.
    pub at: [f64; 3],
    /// Number of sections with values all around, and beside which no step runs around.
    pub sections: usize,
    /// Median over the sections of the narrowest ring's width. Millimetres.
    pub median: f64,
}

/// Straightness of the lines along a part's axis: the worst of them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Straightness {
    /// Width about the line of least squares. Millimetres.
    pub least_squares: f64,
    /// Least distance of two parallel lines that contain it. Millimetres.
    pub minimum_zone: f64,
    /// That without what noise adds.
    #[serde(flatten)]
    pub without_noise: WithoutNoise,
    /// Angle of the worst generator about the axis, from the direction of the first. Degrees.
    pub angle: f64,
    /// Number of generators.
    pub generators: usize,
}

/// The deviations of form of the parts that have a form and enough points. `shapes` are the parts' forms; `cutoff` is
/// the filter's, in millimetres, where one was asked for.
#[must_use]
pub(in crate::variance) fn form_deviations(
    deviations: &Deviations,
    shapes: &[Option<Recognised>],
    noise: ScanNoise,
    cutoff: Option<f64>,
) -> Vec<Option<FormDeviation>> {
    let mut members: Vec<Vec<Point>> = vec![Vec::new(); shapes.len()];
    let mut gaps: Vec<Vec<DVec3>> = vec![Vec::new(); shapes.len()];
    // Averaged normals are not the surface's.
    let unturned = |i: usize| deviations.cosine.get(i).is_none_or(|c| *c >= UNTURNED);
    for (i, part) in deviations.texels.part.iter().enumerate() {
        let part = *part as usize;
        if !shapes.get(part).is_some_and(Option::is_some) || deviations.is_buried(i) {
            continue;
        }
        if deviations.signed(i).is_nan() || deviations.is_bridged(i) {
            gaps[part].push(DVec3::from(deviations.texels.position[i].map(f64::from)));
        } else if unturned(i) {
            members[part].push(Point::measured(deviations, i));
        }
    }
    let of_part = |((shape, points), gaps): ((&Option<Recognised>, Vec<Point>), Vec<DVec3>)| {
        let shape = shape.as_ref()?;
        if points.len() < FEWEST {
            return None;
        }
        let cutoff = cutoff.unwrap_or_else(|| default_cutoff(noise, &points)).max(least_cutoff(&points));
        let mut form = form(shape, &points, noise, cutoff, deviations.precision)?;
        let left_out = form.left_out();
        if let Some(zone) = &mut form.zone {
            let is_beside = |at: &[f64; 3]| gaps.iter().any(|gap| gap.distance((*at).into()) < BESIDE_GAP * cutoff);
            // Where nearly all of a surface is exact, as between two meshes, what is not is left out as stray points
            // are.
            let is_partial = left_out > MANY_LEFT_OUT;
            zone.lower_limit = is_partial
                || zone.without_noise.is_clearly_above(0.0) && (zone.lower_limit || zone.at.iter().any(is_beside));
        }
        Some(form)
    };
    shapes.par_iter().zip(members).zip(gaps).map(of_part).collect()
}

/// A share of points left out beyond which these are no stray points of a scanner, of which there are some 1 %: a zone
/// without them is a lower limit.
const MANY_LEFT_OUT: f64 = 0.05;

fn form(shape: &Recognised, points: &[Point], noise: ScanNoise, cutoff: f64, precision: f64) -> Option<FormDeviation> {
    let (shape, points) = &in_position(shape, points);
    let area = points.iter().map(|point| point.area).sum();
    let spacing = 1.0 / noise.density_among(points.len(), area).sqrt();
    let smooth = Smooth::new(points, cutoff, (precision, spacing));
    let simulation = Simulation::new(&smooth.cells, points.len(), noise, cutoff);
    let grid = shape.axis.and_then(|axis| Grid::new(&smooth.cells, axis, &simulation, (cutoff, precision)));
    let straight = matches!(shape.shape, Shape::Cylinder | Shape::Cone);
    Some(FormDeviation {
        shape: shape.shape,
        cutoff,
        points: points.len(),
        outlying: smooth.outlying(),
        zone: shape.datum().and_then(|datum| zone_of(&smooth, shape.shape, datum, points, &simulation)),
        roundness: grid.as_ref().and_then(|grid| roundness_of(grid, &smooth, &simulation)),
        straightness: grid.as_ref().filter(|_| straight).and_then(|grid| straightness_of(grid, &smooth, &simulation)),
    })
}

fn zone_of(smooth: &Smooth, shape: Shape, datum: Datum, points: &[Point], simulation: &Simulation) -> Option<Zone> {
    let found = zone::zone(&smooth.surface(&simulation.held(&smooth.cells, &smooth.filter)), datum)?;
    let every: Vec<DVec3> = points.iter().map(|p| p.place.displaced(p.deviation)).collect();
    let unfiltered = zone::zone(&every, datum)?;
    let spread = |values: &[f64]| {
        let surface = smooth.surface(&smooth.filter.apply(values));
        (!surface.is_empty()).then(|| zone::spread(&surface, found.datum))
    };
    Some(Zone {
        characteristic: zone::characteristic(shape)?.to_owned(),
        least_squares: found.least_squares,
        minimum_zone: found.minimum_zone,
        without_noise: simulation.corrected(found.minimum_zone, &smooth.cells.values, spread),
        at: found.ends.map(Into::into),
        lower_limit: found.ends.iter().any(|end| smooth.is_at_rim(*end)),
        unfiltered: [unfiltered.least_squares, unfiltered.minimum_zone],
    })
}

fn roundness_of(grid: &Grid, smooth: &Smooth, simulation: &Simulation) -> Option<Roundness> {
    let values = grid.apply(&smooth.cells.values);
    let rings: Vec<_> =
        grid.even().filter_map(|section| Some((section, roundness::rings(grid, section, &values)?))).collect();
    let (section, worst) = rings.iter().max_by(|a, b| a.1.minimum_zone.total_cmp(&b.1.minimum_zone))?;
    let mut narrowest: Vec<f64> = rings.iter().map(|(_, widths)| widths.minimum_zone).collect();
    // In the section's plane the deviations from the same curve are longer, all alike.
    let longer = 1.0 / section.outward.abs();
    let spread = |values: &[f64]| roundness::spread_of_rings(grid, &grid.apply(values));
    Some(Roundness {
        least_squares: worst.least_squares,
        minimum_zone: worst.minimum_zone,
        without_noise: simulation.corrected(worst.minimum_zone, &smooth.cells.values, spread),
        in_plane: [worst.least_squares * longer, worst.minimum_zone * longer],
        at: section.middle.into(),
        sections: rings.len(),
        median: crate::robust::median(&mut narrowest)?,
    })
}

fn straightness_of(grid: &Grid, smooth: &Smooth, simulation: &Simulation) -> Option<Straightness> {
    let values = grid.apply(&smooth.cells.values);
    let all: Vec<_> = roundness::generators(grid)
        .filter_map(|angle| Some((angle, roundness::straightness(grid, &values, angle)?)))
        .collect();
    let (angle, worst) = all.iter().max_by(|a, b| a.1.minimum_zone.total_cmp(&b.1.minimum_zone))?;
    let spread = |values: &[f64]| roundness::spread_of_lines(grid, &grid.apply(values));
    Some(Straightness {
        least_squares: worst.least_squares,
        minimum_zone: worst.minimum_zone,
        without_noise: simulation.corrected(worst.minimum_zone, &smooth.cells.values, spread),
        angle: 360.0 * *angle as f64 / grid.angles as f64,
        generators: all.len(),
    })
}
