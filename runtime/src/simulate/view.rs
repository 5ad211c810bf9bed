//! One view point: its rays and their range image.

use super::DROPOUT_STREAM;
use super::instrument::{Instrument, Measured, Sample};
use super::truth::Frame;
use glam::DVec3;
use rayon::prelude::*;

/// The scanner stands this many radii of the object from its centre.
const STAND_OFF: f64 = 4.0;

/// A view point. Its rays pass through a square grid in the plane through the object's centre that faces it.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) eye: DVec3,
    centre: DVec3,
    right: DVec3,
    up: DVec3,
    /// Half the grid's side: all of the object is in sight.
    half_width: f64,
}

/// A grid of samples, row by row; none where a ray returned nothing.
pub(super) struct RangeImage {
    pub(super) width: usize,
    pub(super) samples: Vec<Option<Sample>>,
    pub(super) dropouts: usize,
}

impl View {
    /// Views spread evenly over the sphere around the object, from the top to the bottom (a golden spiral).
    pub(super) fn around(centre: DVec3, radius: f64, count: usize) -> Vec<Self> {
        let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let distance = STAND_OFF * radius;
        (0..count)
            .map(|i| {
                let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
                let (sin, cos) = (i as f64 * golden_angle).sin_cos();
                let outward = DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z;
                Self { eye: centre + outward * distance, ..Self::towards(outward, centre, radius) }
            })
            .collect()
    }

    /// A view from any place.
    pub(super) fn from(eye: DVec3, centre: DVec3, radius: f64) -> Self {
        let outward = (eye - centre).try_normalize().unwrap_or(DVec3::Z);
        Self { eye, ..Self::towards(outward, centre, radius) }
    }

    fn towards(outward: DVec3, centre: DVec3, radius: f64) -> Self {
        let (right, up) = outward.any_orthonormal_pair();
        // The silhouette of a sphere of that radius, seen in the plane through its centre.
        let half_width = radius / (1.0 - STAND_OFF.powi(-2)).sqrt();
        Self { eye: centre, centre, right, up, half_width }
    }

    /// Points of the surface per ray, relative to a surface at the centre that faces the view: a square millimetre of
    /// surface at `point` gets this many over the squared pitch.
    pub(super) fn density(&self, point: DVec3, cosine: f64) -> f64 {
        let (ray, axis) = (point - self.eye, self.centre - self.eye);
        let off_axis = ray.dot(axis) / (ray.length() * axis.length());
        cosine * axis.length_squared() / (ray.length_squared() * off_axis.powi(3))
    }

    /// Rays along one side of the grid.
    pub(super) fn side(&self, pitch: f64) -> f64 {
        (2.0 * self.half_width / pitch).ceil() + 1.0
    }

    /// Casts all rays. Every row has random numbers of its own, so that threads may share the work.
    pub(super) fn scan(&self, number: usize, pitch: f64, instrument: &Instrument<'_>) -> RangeImage {
        let width = self.side(pitch) as usize;
        let rows: Vec<Measured> = (0..width)
            .into_par_iter()
            .map(|row| {
                let mut random = instrument.scanner.random(DROPOUT_STREAM + ((number as u64) << 32) + row as u64);
                let direction = |column: usize| {
                    let at = |i: usize| i as f64 * pitch - self.half_width;
                    let direction = self.centre + at(column) * self.right + at(row) * self.up - self.eye;
                    direction.normalize()
                };
                let directions: Vec<DVec3> = (0..width).map(direction).collect();
                instrument.measure(self.eye, &directions, number as u64, &mut random)
            })
            .collect();
        let dropouts = rows.iter().map(|row| row.dropouts).sum();
        RangeImage { width, samples: rows.into_iter().flat_map(|row| row.samples).collect(), dropouts }
    }

    /// Its frame: rays have the coordinates of the grid along the first two axes.
    pub(super) fn frame(&self) -> Frame {
        Frame { eye: self.eye, axes: [self.right, self.up, self.right.cross(self.up)] }
    }
}

impl RangeImage {
    /// The samples of a column.
    pub(super) fn column(&self, column: usize) -> impl Iterator<Item = &Option<Sample>> {
        self.samples.iter().skip(column).step_by(self.width)
    }
}
