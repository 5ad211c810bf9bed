//! How much of an object is in sight.

use super::error::SimulationError;
use super::scanner::Scanner;
use super::scene::Scene;
use super::view::View;
use super::{Object, PROBE_STREAM};
use crate::sampling::in_triangle;
use rand::RngExt;

/// The number of places at which the surface is probed to find the rays' pitch.
const PROBES: usize = 4000;

pub(super) struct Seen {
    pub(super) pitch: f64,
    pub(super) coverage: f64,
}

/// The share of the surface that is seen, and the pitch of the rays at which that share gets one point a squared
/// spacing on average: each place gets (density of its best view) / pitch^2 points a unit of area.
pub(super) fn probe(
    object: &Object<'_>,
    views: &[View],
    scene: &Scene<'_>,
    scanner: &Scanner,
) -> Result<Seen, SimulationError> {
    let (mesh, least_cosine) = (object.mesh, scanner.least_cosine());
    let mut random = scanner.random(PROBE_STREAM);
    let total = mesh.area();
    if !(total > 0.0 && total.is_finite()) {
        return Err(SimulationError::NoSurface);
    }
    let step = total / PROBES as f64;
    let (mut area, mut next) = (0.0, step / 2.0);
    let (mut probes, mut seen, mut seen_sides, mut density) = (0_usize, 0_usize, 0_usize, 0.0);
    for &triangle in &mesh.triangles {
        area += mesh.triangle_area(triangle);
        while next < area {
            next += step;
            probes += 1;
            let Some(normal) = mesh.triangle_normal(triangle) else { continue };
            let [a, b, c] = mesh.corners(triangle);
            let (s, t) = in_triangle(random.random(), random.random());
            let point = a + s * (b - a) + t * (c - a);
            // The surface may be seen from either side: a sheet has no inside.
            let sides = [normal, -normal].map(|side| scene.best_view(views, point, side, least_cosine));
            seen += usize::from(sides.iter().any(Option::is_some));
            for &(view, cosine) in sides.iter().flatten() {
                seen_sides += 1;
                density += views[view].density(point, cosine);
            }
        }
    }
    if seen == 0 {
        return Err(SimulationError::NothingSeen { views: views.len() });
    }
    Ok(Seen { pitch: scanner.spacing * (density / seen_sides as f64).sqrt(), coverage: seen as f64 / probes as f64 })
}
