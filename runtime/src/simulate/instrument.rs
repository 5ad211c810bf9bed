//! From the rays of a place of the scanner to its measurements.

use super::beam::{self, Beam};
use super::exact::SurfaceHit;
use super::holes::Holes;
use super::noise::{Noise, Place};
use super::scanner::Scanner;
use super::scene::{Scene, Surface};
use glam::DVec3;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

/// What measures: the scanner in front of the scene.
pub(super) struct Instrument<'a> {
    pub(super) scanner: &'a Scanner,
    pub(super) scene: &'a Scene<'a>,
    pub(super) holes: Holes,
    noise: Noise,
    beam: Option<Beam>,
    least_cosine: f64,
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
    pub(super) intensity: f32,
    pub(super) surface: Surface,
    pub(super) outlier: bool,
    pub(super) mixed: bool,
}

/// The measurements of some rays, none where a ray returned nothing.
pub(super) struct Measured {
    pub(super) samples: Vec<Option<Sample>>,
    /// Rays whose points were lost.
    pub(super) dropouts: usize,
}

impl<'a> Instrument<'a> {
    /// Clouds lose the points in the holes while they are measured.
    pub(super) fn new(scanner: &'a Scanner, scene: &'a Scene<'a>, holes: Holes) -> Self {
        let (noise, least_cosine) = (Noise::new(scanner), scanner.least_cosine());
        Self { scanner, scene, holes, noise, beam: Beam::new(scanner.beam, scanner.max_incidence), least_cosine }
    }

    /// Measures along rays of unit directions from a place of the scanner, which has a number.
    pub(super) fn measure(&self, eye: DVec3, directions: &[DVec3], station: u64, random: &mut impl Rng) -> Measured {
        let scanner = self.scanner;
        let mut dropouts = 0;
        let measure = |(hit, direction): (Option<SurfaceHit>, &DVec3)| {
            // Drawn for every ray, so that what one ray meets does not change what the next one draws.
            let (white, kind, outlier): (f64, f64, f64) =
                (StandardNormal.sample(random), random.random(), random.random());
            let SurfaceHit { point, normal, surface } = hit?;
            let cosine = -normal.dot(*direction);
            if cosine < self.least_cosine || self.holes.contain(point, normal) {
                return None;
            }
            if kind < scanner.dropouts {
                dropouts += 1;
                return None;
            }
            // A fraction of the points that are there: of all that is not lost.
            let is_outlier = kind < scanner.dropouts + scanner.outliers * (1.0 - scanner.dropouts);
            let place = Place { point, range: point.distance(eye), cosine, station };
            let error = self.noise.error(place, white)
                + if is_outlier { scanner.outlier_range * (2.0 * outlier - 1.0) } else { 0.0 };
            let mixture = self.beam.and_then(|beam| beam.mixture(self.scene, eye, *direction, place.range));
            let (from, intensity) = match mixture {
                Some(mixture) => (eye + mixture.range * *direction, mixture.intensity),
                None => (point, beam::intensity(surface, cosine)),
            };
            Some(Sample {
                point,
                normal,
                measured: from + *direction * error,
                intensity: intensity as f32,
                surface,
                outlier: is_outlier,
                mixed: mixture.is_some(),
            })
        };
        let samples = self.scene.cast(eye, directions).into_iter().zip(directions).map(measure).collect();
        Measured { samples, dropouts }
    }
}
