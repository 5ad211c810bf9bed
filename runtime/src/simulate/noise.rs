//! The noise of a range.

use super::field::Field;
use super::scanner::{Kind, Scanner};
use glam::DVec3;

/// The noise of a scanner: normally distributed with the standard deviation sqrt(noise^2 + (noise_range r)^2), r the
/// range, divided by the cosine of the incidence angle where that is asked for. A share of the variance is correlated
/// in space, the rest is white.
pub(super) struct Noise {
    noise: f64,
    range: f64,
    by_angle: bool,
    /// The correlated share, and the roots of the white and of the correlated share.
    field: Option<(Field, f64, f64)>,
    /// Whether stations have fields of their own.
    apart: bool,
}

/// A place whose range is measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) point: DVec3,
    /// Millimetres.
    pub(super) range: f64,
    /// Cosine of the incidence angle, positive.
    pub(super) cosine: f64,
    pub(super) station: u64,
}

impl Noise {
    pub(super) fn new(scanner: &Scanner) -> Self {
        let is_correlated = scanner.correlation > 0.0 && scanner.correlated > 0.0;
        let field = is_correlated.then(|| {
            let field = Field::new(scanner, scanner.correlation);
            (field, (1.0 - scanner.correlated).sqrt(), scanner.correlated.sqrt())
        });
        Self {
            noise: scanner.noise,
            range: scanner.noise_range,
            by_angle: scanner.noise_angle,
            field,
            apart: matches!(scanner.kind, Kind::StructuredLight | Kind::Panorama),
        }
    }

    /// The standard deviation at a range and a cosine.
    pub(super) fn deviation(&self, range: f64, cosine: f64) -> f64 {
        let deviation = if self.range > 0.0 { self.noise.hypot(self.range * range) } else { self.noise };
        if self.by_angle { deviation / cosine.max(1e-3) } else { deviation }
    }

    /// The error of a range, from a standard normal deviate of its own.
    pub(super) fn error(&self, place: Place, white: f64) -> f64 {
        let deviation = self.deviation(place.range, place.cosine);
        match &self.field {
            Some((field, of_white, of_field)) if deviation > 0.0 => {
                let number = if self.apart { place.station } else { 0 };
                deviation * (of_white * white + of_field * field.at(place.point, number))
            }
            _ => deviation * white,
        }
    }
}
