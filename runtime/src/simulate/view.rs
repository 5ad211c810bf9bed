//! One view point: its rays and their range image.

use super::exact::SurfaceHit;
use super::scene::Scene;
use super::{DROPOUT_STREAM, Scanner};
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
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

/// The measurement of one ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// The point where the ray truly met the surface.
    pub(super) point: DVec3,
    /// Unit normal at that point, towards the scanner.
    pub(super) normal: DVec3,
    /// The point that the scanner measured.
    pub(super) measured: DVec3,
    pub(super) outlier: bool,
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
                let (right, up) = outward.any_orthonormal_pair();
                // The silhouette of a sphere of that radius, seen in the plane through its centre.
                let half_width = radius / (1.0 - STAND_OFF.powi(-2)).sqrt();
                Self { eye: centre + outward * distance, centre, right, up, half_width }
            })
            .collect()
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
    pub(super) fn scan(&self, number: usize, pitch: f64, scene: &Scene<'_>, scanner: &Scanner) -> RangeImage {
        let width = self.side(pitch) as usize;
        let least_cosine = scanner.max_incidence.cos();
        let rows: Vec<(Vec<Option<Sample>>, usize)> = (0..width)
            .into_par_iter()
            .map(|row| {
                let mut random = ChaCha8Rng::seed_from_u64(scanner.seed);
                random.set_stream(DROPOUT_STREAM + ((number as u64) << 32) + row as u64);
                let mut dropouts = 0;
                let direction = |column: usize| {
                    let at = |i: usize| i as f64 * pitch - self.half_width;
                    let direction = self.centre + at(column) * self.right + at(row) * self.up - self.eye;
                    direction.normalize()
                };
                let directions: Vec<DVec3> = (0..width).map(direction).collect();
                let measure = |(hit, direction): (Option<SurfaceHit>, &DVec3)| {
                    // Drawn for every ray, so that what one ray meets does not change what the next one draws.
                    let (noise, kind, outlier): (f64, f64, f64) =
                        (StandardNormal.sample(&mut random), random.random(), random.random());
                    let SurfaceHit { point, normal } = hit?;
                    if -normal.dot(*direction) < least_cosine {
                        return None;
                    }
                    if kind < scanner.dropouts {
                        dropouts += 1;
                        return None;
                    }
                    let is_outlier = kind < scanner.dropouts + scanner.outliers;
                    let error = scanner.noise * noise
                        + if is_outlier { scanner.outlier_range * (2.0 * outlier - 1.0) } else { 0.0 };
                    Some(Sample { point, normal, measured: point + *direction * error, outlier: is_outlier })
                };
                let samples = scene.cast(self.eye, &directions).into_iter().zip(&directions).map(measure).collect();
                (samples, dropouts)
            })
            .collect();
        let dropouts = rows.iter().map(|row| row.1).sum();
        RangeImage { width, samples: rows.into_iter().flat_map(|row| row.0).collect(), dropouts }
    }
}
