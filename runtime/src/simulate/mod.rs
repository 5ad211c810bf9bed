//! The virtual laser scanner: a scan of a model whose truth is known.
//!
//! Rays are cast from view points all around the object; surface that none of them sees is missing. Every range has
//! Gaussian noise, some are outliers, some are lost. Neighbouring points of a view become triangles unless they graze
//! or span a step; where views overlap, each place is kept from the view that sees it best, so that there is one layer.
//! Holes may be punched. All of it is put into a random pose, which is reported. The same options give the same scan,
//! whatever the number of threads.

mod exact;
mod layer;
mod pose;
mod scene;
#[cfg(test)]
mod tests;
mod view;

use crate::bvh::BvhError;
use crate::mesh::{Bounds, TriangleMesh};
use crate::model::Motion;
use crate::progress::Progress;
pub use exact::ExactSurface;
use glam::DVec3;
use layer::Layer;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::Scene;
use serde::{Deserialize, Serialize};
use thiserror::Error;
use view::View;

/// The most rays of all views together.
const MOST_RAYS: f64 = 1e9;
/// The most rays of one view: its range image is held in memory.
const MOST_RAYS_A_VIEW: f64 = 2.5e7;
/// The number of places at which the surface is probed to find the rays' pitch.
const PROBES: usize = 4000;
/// The streams of random numbers: the pose's, the holes', the probes', and from the last on one a row of rays.
const POSE_STREAM: u64 = 0;
const HOLE_STREAM: u64 = 1;
const PROBE_STREAM: u64 = 2;
const DROPOUT_STREAM: u64 = 16;

/// The properties of the scanner, and the pose and the holes of the object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scanner {
    /// View points, spread evenly over the sphere around the object.
    pub views: usize,
    /// Mean distance of neighbouring points on the object. Millimetres.
    pub spacing: f64,
    /// Standard deviation of the range noise, along the view direction. Millimetres.
    pub noise: f64,
    /// Fraction of the points that are outliers.
    pub outliers: f64,
    /// Outliers are off by up to this, evenly, towards or away from the scanner. Millimetres.
    pub outlier_range: f64,
    /// Fraction of the points that are lost.
    pub dropouts: f64,
    /// Largest angle between view direction and surface normal at which the scanner sees anything. Radians.
    pub max_incidence: f64,
    /// Holes to punch.
    pub holes: usize,
    /// Radius of the holes. Millimetres.
    pub hole_radius: f64,
    /// Whether the object is put into a random pose.
    pub random_pose: bool,
    /// The pose's translation is drawn from a cube of this half side. Millimetres.
    pub reach: f64,
    /// The seed of all random numbers.
    pub seed: u64,
}

impl Default for Scanner {
    fn default() -> Self {
        Self {
            views: 24,
            spacing: 0.8,
            noise: 0.3,
            outliers: 0.001,
            outlier_range: 20.0,
            dropouts: 0.002,
            max_incidence: 75_f64.to_radians(),
            holes: 0,
            hole_radius: 5.0,
            random_pose: true,
            reach: 100.0,
            seed: 0,
        }
    }
}

/// A scan and its truth.
#[derive(Clone, Debug)]
pub struct VirtualScan {
    /// Measured points and their triangles, facing the scanner, in the scanner's coordinates: the model moved by
    /// `truth.pose`. No normals.
    pub mesh: TriangleMesh,
    /// Its truth.
    pub truth: Truth,
}

/// The truth of a virtual scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// The object's pose: a point p of the model was scanned at `rotation` p + `translation`.
    pub pose: Motion,
    /// The rotation as angles about x, then y, then z. Radians.
    pub euler: [f64; 3],
    /// The options.
    pub scanner: Scanner,
    /// Distance between rays at the object's centre. Millimetres.
    pub pitch: f64,
    /// Fraction of the model's area that a view sees (before dropouts and holes).
    pub coverage: f64,
    /// Points of the scan.
    pub points: usize,
    /// Triangles of the scan.
    pub triangles: usize,
    /// Outliers among the points.
    pub outliers: usize,
    /// Rays whose points were lost, over all views.
    pub dropouts: usize,
}

/// The reason why nothing could be scanned.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SimulationError {
    /// An option is out of its range.
    #[error("the scanner's {option} is {value}, but must be {range}")]
    Option {
        /// Its name.
        option: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        range: &'static str,
    },
    /// Memory and time would not suffice.
    #[error(
        "a spacing of {spacing} mm on an object {size:.0} mm large takes {rays:.1e} rays, more than {limit:.1e}; choose a wider spacing"
    )]
    TooFine {
        /// The spacing.
        spacing: f64,
        /// Diameter of the object. Millimetres.
        size: f64,
        /// Rays that it would take.
        rays: f64,
        /// Most rays.
        limit: f64,
    },
    /// The model has no surface.
    #[error("the model has no surface to scan: no triangle with an area")]
    NoSurface,
    /// The views see nothing of it.
    #[error(
        "no ray of the {views} views meets the surface; take a smaller spacing than the surface is wide, or more views (--spacing, --views)"
    )]
    NothingSeen {
        /// The number of views.
        views: usize,
    },
    /// The holes took all of it.
    #[error("the holes, of radius {radius} mm, leave nothing; punch fewer (--holes), or none")]
    NothingLeft {
        /// Their radius.
        radius: f64,
    },
    /// The mesh cannot be ray-cast.
    #[error("the model cannot be scanned: {0}")]
    Mesh(#[from] BvhError),
    /// The user ended the work.
    #[error("cancelled")]
    Cancelled,
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
    let limit = MOST_RAYS_A_VIEW.min(MOST_RAYS / scanner.views.max(1) as f64);
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
    let scene = Scene::new(mesh, exact, scanner.spacing)?;
    let bounds: Bounds = mesh.triangles.iter().flat_map(|t| mesh.corners(*t)).collect();
    let (centre, radius) = (bounds.centre(), bounds.diagonal() / 2.0);
    if radius <= 0.0 {
        return Err(SimulationError::NoSurface);
    }
    let views = View::around(centre, radius, scanner.views);
    let least_cosine = scanner.max_incidence.cos();
    let seen = probe(mesh, &views, &scene, scanner, least_cosine)?;
    few_enough(&views[0], scanner, seen.pitch, 2.0 * radius)?;
    let mut layer = Layer::default();
    let mut dropouts = 0;
    for (number, view) in views.iter().enumerate() {
        if progress.cancelled() {
            return Err(SimulationError::Cancelled);
        }
        progress.report("scanning", number as f64 / views.len() as f64, &format!("view {}", number + 1));
        let image = view.scan(number, seen.pitch, &scene, scanner);
        dropouts += image.dropouts;
        layer.add(&image, number, &views, &scene, least_cosine);
    }
    if layer.triangles.is_empty() {
        return Err(SimulationError::NothingSeen { views: views.len() });
    }
    punch_holes(&mut layer, scanner);
    if layer.triangles.is_empty() {
        return Err(SimulationError::NothingLeft { radius: scanner.hole_radius });
    }
    Ok(finish(layer, scanner, &seen, dropouts))
}

impl Scanner {
    fn check(&self) -> Result<(), SimulationError> {
        let half = std::f64::consts::FRAC_PI_2;
        let options = [
            ("number of views", self.views as f64, self.views >= 1 && self.views <= 10_000, "between 1 and 10000"),
            ("spacing", self.spacing, self.spacing > 0.0 && self.spacing.is_finite(), "positive"),
            ("noise", self.noise, self.noise >= 0.0 && self.noise.is_finite(), "zero or positive"),
            ("fraction of outliers", self.outliers, (0.0..=1.0).contains(&self.outliers), "between 0 and 1"),
            ("fraction of dropouts", self.dropouts, (0.0..=1.0).contains(&self.dropouts), "between 0 and 1"),
            ("outlier range", self.outlier_range, (0.0..1e9).contains(&self.outlier_range), "zero or positive"),
            (
                "largest incidence angle",
                self.max_incidence,
                self.max_incidence > 0.0 && self.max_incidence < half,
                "between 0 and 90 degrees",
            ),
            ("number of holes", self.holes as f64, self.holes <= 100_000, "at most 100000"),
            ("hole radius", self.hole_radius, (0.0..1e9).contains(&self.hole_radius), "zero or positive"),
            ("reach", self.reach, (0.0..1e9).contains(&self.reach), "zero or positive"),
        ];
        match options.into_iter().find(|option| !option.2) {
            Some((option, value, _, range)) => Err(SimulationError::Option { option, value, range }),
            None => Ok(()),
        }
    }

    fn random(&self, stream: u64) -> ChaCha8Rng {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(stream);
        random
    }
}

struct Seen {
    pitch: f64,
    coverage: f64,
}

/// The share of the surface that is seen, and the pitch of the rays at which that share gets one point a squared
/// spacing on average: each place gets (density of its best view) / pitch^2 points a unit of area.
fn probe(
    mesh: &TriangleMesh,
    views: &[View],
    scene: &Scene<'_>,
    scanner: &Scanner,
    least_cosine: f64,
) -> Result<Seen, SimulationError> {
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
            let (s, t): (f64, f64) = (random.random(), random.random());
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
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

/// Removes the triangles that lie around randomly chosen ones and face the same way: the other side of a thin wall
/// stays.
fn punch_holes(layer: &mut Layer, scanner: &Scanner) {
    let mut random = scanner.random(HOLE_STREAM);
    let holes: Vec<(DVec3, DVec3)> = (0..scanner.holes)
        .map(|_| layer.place(&layer.triangles[random.random_range(0..layer.triangles.len())]))
        .collect();
    if holes.is_empty() {
        return;
    }
    let places: Vec<(DVec3, DVec3)> = layer.triangles.iter().map(|triangle| layer.place(triangle)).collect();
    let inside = |&(point, normal): &(DVec3, DVec3)| {
        holes.iter().any(|hole| hole.0.distance(point) < scanner.hole_radius && hole.1.dot(normal) > 0.0)
    };
    let mut gone = places.iter().map(inside).collect::<Vec<_>>().into_iter();
    layer.retain(|_| gone.next() == Some(false));
}

fn finish(layer: Layer, scanner: &Scanner, seen: &Seen, dropouts: usize) -> VirtualScan {
    let pose = if scanner.random_pose {
        pose::random(&mut scanner.random(POSE_STREAM), scanner.reach)
    } else {
        Motion::IDENTITY
    };
    let truth = Truth {
        pose,
        euler: pose::euler(&pose),
        scanner: scanner.clone(),
        pitch: seen.pitch,
        coverage: seen.coverage,
        points: layer.samples.len(),
        triangles: layer.triangles.len(),
        outliers: layer.samples.iter().filter(|sample| sample.outlier).count(),
        dropouts,
    };
    let positions = layer.samples.iter().map(|sample| pose.point(sample.measured.into())).collect();
    VirtualScan { mesh: TriangleMesh { positions, triangles: layer.triangles, ..TriangleMesh::default() }, truth }
}
