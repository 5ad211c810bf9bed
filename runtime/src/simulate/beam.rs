//! Mixed pixels: a beam with a diameter that meets two surfaces at an edge returns a range between them.

use super::scene::{Scene, Surface};
use glam::DVec3;

/// Rays of a beam that meets a step, evenly over its cross-section: a share of it is right to a few hundredths.
const RAYS: usize = 32;

/// A collimated beam.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beam {
    radius: f64,
    /// Ranges that differ by more are those of two surfaces: one alone would be seen under more than the largest angle
    /// of incidence.
    step: f64,
}

/// The echo of a beam that meets two surfaces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mixture {
    pub(super) range: f64,
    pub(super) intensity: f64,
}

impl Beam {
    pub(super) fn new(diameter: f64, max_incidence: f64) -> Option<Self> {
        (diameter > 0.0).then(|| Self { radius: diameter / 2.0, step: diameter * max_incidence.tan() })
    }

    /// The mean range over the parts of the beam's cross-section that meet anything, if these lie in two surfaces. The
    /// beam's middle meets something at the range `middle`.
    pub(super) fn mixture(&self, scene: &Scene<'_>, eye: DVec3, direction: DVec3, middle: f64) -> Option<Mixture> {
        let (right, up) = direction.any_orthonormal_pair();
        let echo = |x: f64, y: f64| {
            let from = eye + self.radius * (x * right + y * up);
            scene.echo(from, direction)
        };
        let rim = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)];
        let diagonal = [(0.7, 0.7), (-0.7, 0.7), (-0.7, -0.7), (0.7, -0.7)];
        let ranges = rim.into_iter().chain(diagonal).filter_map(|(x, y)| Some(echo(x, y)?.range)).chain([middle]);
        let (low, high) = ranges.fold((f64::INFINITY, 0.0_f64), |(low, high), r| (low.min(r), high.max(r)));
        if high - low <= self.step {
            return None;
        }
        let (mut count, mut range, mut intensity) = (0.0, 0.0, 0.0);
        for i in 0..RAYS {
            // A sunflower's seeds (Vogel, 'A better way to construct the sunflower head', 1979).
            let r = ((i as f64 + 0.5) / RAYS as f64).sqrt();
            let (sin, cos) = (i as f64 * 2.399_963_229_728_653).sin_cos();
            if let Some(echo) = echo(r * cos, r * sin) {
                count += 1.0;
                range += echo.range;
                intensity += echo.intensity;
            }
        }
        (count > 0.0).then(|| Mixture { range: range / count, intensity: intensity / count })
    }
}

/// The strength of an echo: a diffuse surface (Lambert) of the reflectance of what it belongs to, at any range.
pub(super) fn intensity(surface: Surface, cosine: f64) -> f64 {
    let reflectance = match surface {
        Surface::Object => 1.0,
        Surface::Table => 0.5,
        Surface::Clutter => 0.8,
    };
    reflectance * cosine
}
