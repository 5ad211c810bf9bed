//! Distances from texels to the scan: along normals by casting rays, natively or on a GPU, or to the closest point.

mod bindings;
mod closest;
mod cpu;
mod gpu;
#[cfg(test)]
pub(super) mod tests;

use super::Deviations;
use super::holes::FilledHoles;
use crate::bvh::{Bvh, BvhError};
use crate::mesh::TriangleMesh;
use crate::model::Texels;
use glam::Vec3A;
use gpu::{Gpu, GpuError};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The device that casts the rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Device {
    /// A real GPU if there is one, otherwise native code.
    #[default]
    Auto,
    /// Native code.
    Cpu,
    /// A GPU, or failing that a software implementation of one (which is slower than native code).
    Gpu,
}

/// The triangles of the scan that count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Facing {
    /// Triangles whose normal makes at most this angle with the model's (radians, at most a right angle). The other
    /// side of a thin wall, and anything else that a ray meets from behind, is not what should be measured.
    Within(f64),
    /// All triangles; for scans whose triangles are not oriented.
    Any,
}

impl Facing {
    /// Less than a right angle.
    pub const SAME: Self = Self::Within(std::f64::consts::FRAC_PI_2);

    /// Whether the side matters (1 or 0), and the least cosine.
    fn limits(self) -> (f32, f32) {
        match self {
            // The cosine of a right angle is not zero in doubles.
            Self::Within(angle) if angle < std::f64::consts::FRAC_PI_2 => (1.0, angle.max(0.0).cos() as f32),
            Self::Within(_) => (1.0, 0.0),
            Self::Any => (0.0, 0.0),
        }
    }
}

impl Default for Facing {
    fn default() -> Self {
        Self::SAME
    }
}

/// Deviations and the device that found them.
#[derive(Clone, Debug)]
pub struct Cast {
    /// The distances.
    pub deviations: Deviations,
    /// The device that cast the rays: `cpu`, or `gpu: ` and the adapter's name.
    pub device: String,
    /// A sentence for the user if another device than the requested one cast the rays.
    pub notice: Option<String>,
}

/// Why no rays can be cast.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum CastError {
    /// The maximum distance is out of range.
    #[error("the maximum distance must be a positive number of millimetres below 1e12, not {0}")]
    MaxDistance(f64),
    /// No hierarchy can be built over the scan.
    #[error(transparent)]
    Hierarchy(#[from] BvhError),
}

/// Casts rays from every texel along +normal and along -normal to the nearest points of the scan, at most
/// `max_distance` millimetres away, among the triangles that `facing` admits (\[VA\] alg. 2). Where the scan passes
/// through the texel, as far as single precision can tell, both distances are zero. A texel whose position or normal is
/// not finite, or whose normal is zero, has no data.
///
/// If a GPU fails, native code takes over and the result's notice says so.
///
/// # Errors
/// If `max_distance` is not positive and finite.
pub fn cast(texels: Texels, scan: &Bvh, max_distance: f64, facing: Facing, device: Device) -> Result<Cast, CastError> {
    let rays = Rays::new(&texels, scan, max_distance, facing)?;
    let (distances, device, notice) = match cast_on_gpu(&rays, device) {
        Some(Ok((distances, name))) => (distances, format!("gpu: {name}"), None),
        Some(Err(error)) => (cpu::cast(&rays), "cpu".to_owned(), Some(format!("native code cast the rays: {error}"))),
        None => (cpu::cast(&rays), "cpu".to_owned(), None),
    };
    Ok(Cast { deviations: distances.with(texels, max_distance, scan.tolerance()), device, notice })
}

/// As [`cast`], but with the distance from every texel to the closest point of the scan, positive if that point lies on
/// the side of the texel's normal. `scan` was built over `mesh`. A texel whose closest point is on a boundary edge of
/// the mesh has no data, unless it lies perpendicularly above it: nothing was measured beside a hole.
///
/// # Errors
/// As [`cast`].
pub(in crate::variance) fn closest(
    texels: Texels,
    scan: &Bvh,
    mesh: &TriangleMesh,
    max_distance: f64,
    facing: Facing,
) -> Result<Cast, CastError> {
    let rays = Rays::new(&texels, scan, max_distance, facing)?;
    let distances = closest::find(&rays, Some(mesh));
    Ok(Cast {
        deviations: distances.with(texels, max_distance, scan.tolerance()),
        device: "cpu".to_owned(),
        notice: None,
    })
}

/// The points of the scan to which distances are measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DistanceKind {
    /// Along the model's normal, as displacement shaders draw it.
    #[default]
    Normal,
    /// Along normals that are averaged where patches meet.
    AveragedNormal,
    /// To the closest point of the scan.
    Closest,
}

impl DistanceKind {
    /// The name in variance.json.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::AveragedNormal => "averaged-normal",
            Self::Closest => "closest",
        }
    }
}

/// Marks texels that are nearer to a closed hole of the scan than to the scan itself as filled and removes their
/// distances; of other texels removes a distance that lies behind a closed hole. `scan`, `facing` and `kind` are those
/// with which the deviations were found.
///
/// # Errors
/// As [`cast`], or if no hierarchy can be built over the holes.
pub(in crate::variance) fn hide_behind_filled(
    deviations: &mut Deviations,
    holes: &FilledHoles,
    scan: &Bvh,
    facing: Facing,
    kind: DistanceKind,
) -> Result<(), CastError> {
    if holes.mesh.triangles.is_empty() {
        return Ok(());
    }
    let bvh = scan.build_beside(&holes.mesh)?;
    let rays = Rays::new(&deviations.texels, &bvh, deviations.max_distance, facing)?;
    let to_holes = match kind {
        DistanceKind::Normal | DistanceKind::AveragedNormal => cpu::cast(&rays),
        DistanceKind::Closest => closest::find(&rays, None),
    };
    // NaN, which stands for no hit, is further than any distance.
    let nearer = |a: f32, b: f32| a < b || b.is_nan() && !a.is_nan();
    deviations.filled = vec![false; deviations.outward.len()];
    for (i, hole) in to_holes.outward.into_iter().zip(to_holes.inward).enumerate() {
        let (outward, inward) = (&mut deviations.outward[i], &mut deviations.inward[i]);
        if nearer(hole.0.min(hole.1), outward.min(*inward)) {
            deviations.filled[i] = true;
            (*outward, *inward) = (f32::NAN, f32::NAN);
            continue;
        }
        for (distance, hole) in [(outward, hole.0), (inward, hole.1)] {
            if nearer(hole, *distance) {
                *distance = f32::NAN;
            }
        }
    }
    Ok(())
}

/// None if no GPU is requested, or if none is required and there is none.
fn cast_on_gpu(rays: &Rays, device: Device) -> Option<Result<(Distances, String), GpuError>> {
    if device == Device::Cpu {
        return None;
    }
    match (device, Gpu::open(device == Device::Gpu)) {
        (Device::Auto, Err(GpuError::NoAdapter)) => None,
        (_, Ok(gpu)) => Some(gpu.cast(rays).map(|distances| (distances, gpu.name().to_owned()))),
        (_, Err(error)) => Some(Err(error)),
    }
}

/// Distances along +normal and -normal, one per ray; NaN where nothing is hit.
#[derive(Clone, Debug, Default, PartialEq)]
struct Distances {
    outward: Vec<f32>,
    inward: Vec<f32>,
}

impl Distances {
    fn with(self, texels: Texels, max_distance: f64, precision: f32) -> Deviations {
        let precision = precision.into();
        Deviations { precision, ..Deviations::new(texels, max_distance, self.outward, self.inward) }
    }
}

/// The rays of all texels, and what they are cast at.
struct Rays<'a> {
    texels: &'a Texels,
    scan: &'a Bvh,
    max_distance: f32,
    /// Hits this far from a ray's origin, ahead or behind, are at distance zero in both directions.
    tolerance: f32,
    /// 1 if only triangles count that face as the model does, 0 if all count.
    facing: f32,
    /// The least cosine of the angle between their normals; 0 if every angle below a right one is allowed.
    cosine: f32,
}

impl<'a> Rays<'a> {
    fn new(texels: &'a Texels, scan: &'a Bvh, max_distance: f64, facing: Facing) -> Result<Self, CastError> {
        if !(max_distance > 0.0 && max_distance < 1e12) || (max_distance as f32) == 0.0 {
            return Err(CastError::MaxDistance(max_distance));
        }
        let (facing, cosine) = facing.limits();
        let (max_distance, tolerance) = (max_distance as f32, scan.tolerance());
        Ok(Self { texels, scan, max_distance, tolerance, facing, cosine })
    }

    fn len(&self) -> usize {
        self.texels.position.len()
    }

    /// Origin, relative to the scan's centre, and unit direction of ray i; none if they are not finite, or if the
    /// origin is too far away for the ray to reach the scan.
    fn get(&self, i: usize) -> Option<(Vec3A, Vec3A)> {
        let origin = self.scan.to_local(self.texels.position[i].into());
        let normal = Vec3A::from_array(self.texels.normal[i]);
        let length = normal.length();
        let near = origin.abs().cmple(self.scan.half_extent() + 2.0 * self.max_distance + self.tolerance).all();
        (near && length.is_finite() && length > 0.0).then(|| (origin, normal / length))
    }
}
