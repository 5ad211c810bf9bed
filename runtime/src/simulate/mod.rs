//! The virtual laser scanner: a scan of an object whose truth is known.
//!
//! Structured light casts rays from view points all around the object; surface that none of them sees is missing. Every
//! range has noise, some are outliers, some are lost. Neighbouring points of a view become triangles unless they graze
//! or span a step; where views overlap, each place is kept from the view that sees it best, so that there is one layer.
//! A panorama keeps the points of every station in a grid of their own; a scanner led by hand makes one cloud from many
//! places; computed tomography has the whole surface. Holes may be punched, and a table and other objects may stand
//! there too. All of it is put into a random pose, which is reported. The same options give the same scan, whatever the
//! number of threads.

mod beam;
mod ct;
mod error;
mod exact;
mod field;
mod hand_held;
mod holes;
mod instrument;
mod layer;
mod noise;
mod panorama;
mod pose;
mod probe;
mod scanner;
mod scene;
mod structured;
mod subdivide;
mod surroundings;
#[cfg(test)]
mod tests;
mod truth;
mod view;

use crate::bvh::Bvh;
use crate::mesh::{Bounds, TriangleMesh};
use crate::progress::Progress;
pub use error::SimulationError;
pub use exact::ExactSurface;
use glam::DVec3;
pub use scanner::{Kind, Scanner};
use scene::Scene;
use surroundings::Surroundings;
pub use truth::{Surfaces, Truth, VirtualScan};
use view::View;

/// The most rays of all views together.
const MOST_RAYS: f64 = 1e9;
/// The most rays of one view: its range image is held in memory.
const MOST_RAYS_A_VIEW: f64 = 2.5e7;
/// The most points of a scan: 35 bytes each, 9 GB.
const MOST_POINTS: usize = 250_000_000;
/// The streams of random numbers: the pose's, the holes', the probes', the clutter's, the field's, the stations', and
/// from the last on one a row of rays.
const POSE_STREAM: u64 = 0;
const HOLE_STREAM: u64 = 1;
const PROBE_STREAM: u64 = 2;
const CLUTTER_STREAM: u64 = 3;
const FIELD_STREAM: u64 = 4;
const STATION_STREAM: u64 = 5;
const DROPOUT_STREAM: u64 = 16;

/// What is scanned.
struct Object<'a> {
    mesh: &'a TriangleMesh,
    /// Of the ball around its box.
    centre: DVec3,
    radius: f64,
}

/// Scans `mesh` (millimetres, z up).
///
/// # Errors
/// See [`SimulationError`].
pub fn scan(mesh: &TriangleMesh, scanner: &Scanner, progress: &dyn Progress) -> Result<VirtualScan, SimulationError> {
    scan_mesh(mesh, None, scanner, progress)
}

/// Scans the exact surface of a model (millimetres, z up): its triangles say which part of it a ray meets.
///
/// # Errors
/// See [`SimulationError`].
pub fn scan_exact(
    surface: ExactSurface<'_>,
    scanner: &Scanner,
    progress: &dyn Progress,
) -> Result<VirtualScan, SimulationError> {
    let moved = surface.motion;
    let mut scan = scan_mesh(&surface.tessellation.mesh, Some(surface), scanner, progress)?;
    // From the script's own position, not from where the triangles were moved to.
    scan.truth.pose = scan.truth.pose.after(&moved);
    scan.truth.euler = pose::euler(&scan.truth.pose);
    Ok(scan)
}

/// Refuses a scanner that would take too many rays on an object of this size (the diagonal of its box, in
/// millimetres), before anything is made for its spacing.
///
/// # Errors
/// If even rays as wide apart as its points are too many.
pub fn require_affordable(scanner: &Scanner, size: f64) -> Result<(), SimulationError> {
    scanner.check()?;
    let views = View::around(DVec3::ZERO, size / 2.0, scanner.views);
    views.first().map_or(Ok(()), |view| few_enough(view, scanner, scanner.spacing, size))
}

fn few_enough(view: &View, scanner: &Scanner, pitch: f64, size: f64) -> Result<(), SimulationError> {
    let rays = view.side(pitch).powi(2);
    let places = match scanner.kind {
        Kind::StructuredLight => scanner.views,
        Kind::Panorama | Kind::HandHeld | Kind::Ct => 1,
    };
    let limit = MOST_RAYS_A_VIEW.min(MOST_RAYS / places.max(1) as f64);
    if rays > limit {
        return Err(SimulationError::TooFine { spacing: scanner.spacing, size, rays, limit });
    }
    Ok(())
}

fn scan_mesh(
    mesh: &TriangleMesh,
    exact: Option<ExactSurface<'_>>,
    scanner: &Scanner,
    progress: &dyn Progress,
) -> Result<VirtualScan, SimulationError> {
    scanner.check()?;
    let alone = scanner.clutter == 0 && !scanner.table;
    if !alone {
        // What is put beside a mesh takes its corners for valid.
        Bvh::build(mesh)?;
    }
    let is_empty = mesh.triangles.is_empty();
    let around = if alone || is_empty { None } else { Some(Surroundings::of(mesh, scanner)) };
    let scene = Scene::new(mesh, around.as_ref(), exact, scanner.spacing)?;
    let bounds: Bounds = mesh.triangles.iter().flat_map(|t| mesh.corners(*t)).collect();
    let object = Object { mesh, centre: bounds.centre(), radius: bounds.diagonal() / 2.0 };
    if object.radius <= 0.0 {
        return Err(SimulationError::NoSurface);
    }
    match scanner.kind {
        Kind::StructuredLight => structured::scan(&object, &scene, scanner, progress),
        Kind::Panorama => panorama::scan(&object, &scene, scanner, progress),
        Kind::HandHeld => hand_held::scan(&object, &scene, scanner, progress),
        Kind::Ct => {
            let all = around.as_ref().map_or(mesh, |around| &around.mesh);
            ct::scan(&object, all, &scene, scanner, progress)
        }
    }
}
