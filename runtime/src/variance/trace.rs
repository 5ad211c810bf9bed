//! Casting the rays: where, and what came of it.

use super::trace_gpu::{Gpu, GpuError};
use super::{Deviations, FilledHoles, closest, trace_cpu};
use crate::bvh::{Bvh, BvhError};
use crate::mesh::TriangleMesh;
use crate::model::Texels;
use glam::Vec3A;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// What casts the rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Device {
    /// A real GPU where there is one, else native code.
    #[default]
    Auto,
    /// Native code.
    Cpu,
    /// A GPU, or failing that software that acts as one (which is slower than native code).
    Gpu,
}

/// Which of the scan's triangles count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Facing {
    /// Those whose normal makes at most this angle with the model's (radians, at most a right angle): the other side of a thin wall,
    /// and whatever else a ray meets from behind, is not what was to be measured there.
    Within(f64),
    /// All; for scans whose triangles are not oriented.
    Any,
}

impl Facing {
    /// Less than a right angle.
    pub const SAME: Facing = Facing::Within(std::f64::consts::FRAC_PI_2);

    /// Whether the side matters, and the least cosine.
    fn limits(self) -> (f32, f32) {
        match self {
            // The cosine of a right angle is not zero in doubles.
            Facing::Within(angle) if angle < std::f64::consts::FRAC_PI_2 => (1.0, angle.max(0.0).cos() as f32),
            Facing::Within(_) => (1.0, 0.0),
            Facing::Any => (0.0, 0.0),
        }
    }
}

impl Default for Facing {
    fn default() -> Facing {
        Facing::SAME
    }
}

/// Deviations and how they were found.
#[derive(Clone, Debug)]
pub struct Trace {
    /// What was found.
    pub deviations: Deviations,
    /// What cast the rays: `cpu`, or `gpu: ` and the adapter's name.
    pub device: String,
    /// A sentence for the user where the rays were cast by something else than asked for.
    pub notice: Option<String>,
}

/// Why no rays can be cast.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum TraceError {
    /// The maximum distance makes no sense.
    #[error("the maximum distance must be a positive number of millimetres below 1e12, not {0}")]
    MaxDistance(f64),
    /// What is to be hit has no hierarchy.
    #[error(transparent)]
    Hierarchy(#[from] BvhError),
}

/// For every texel the distances to the nearest points of the scan along +normal and along -normal, at most
/// `max_distance`, among the triangles that `facing` admits. Where the scan passes
/// through the texel, as far as single precision can tell, both distances are zero. A texel whose position or normal
/// is not finite, or whose normal is zero, has no data.
///
/// Where a GPU fails, native code takes over and the result's notice says so.
///
/// # Errors
/// Where `max_distance` is not positive and finite.
pub fn trace(
    texels: Texels,
    scan: &Bvh,
    max_distance: f64,
    facing: Facing,
    device: Device,
) -> Result<Trace, TraceError> {
    let rays = Rays::new(&texels, scan, max_distance, facing)?;
    let (found, device, notice) = match on_gpu(&rays, device) {
        Some(Ok((found, name))) => (found, format!("gpu: {name}"), None),
        Some(Err(error)) => {
            (trace_cpu::trace(&rays), "cpu".to_owned(), Some(format!("rays were cast by native code: {error}")))
        }
        None => (trace_cpu::trace(&rays), "cpu".to_owned(), None),
    };
    let Distances { outward, inward } = found;
    let deviations = Deviations { texels, max_distance, outward, inward, filled: Vec::new(), cosine: Vec::new() };
    Ok(Trace { deviations, device, notice })
}

/// As [`trace`], for every texel the distance to the closest point of the scan, positive where that lies on the side of the
/// texel's normal. `mesh` is what `scan` was built over. A texel whose closest point is on a free edge of the mesh has no data, unless it
/// lies straight above it: what is beside a hole was not measured.
///
/// # Errors
/// As [`trace`].
pub fn trace_closest(
    texels: Texels,
    scan: &Bvh,
    mesh: &TriangleMesh,
    max_distance: f64,
    facing: Facing,
) -> Result<Trace, TraceError> {
    let rays = Rays::new(&texels, scan, max_distance, facing)?;
    let Distances { outward, inward } = closest::trace(&rays, Some(mesh));
    let deviations = Deviations { texels, max_distance, outward, inward, filled: Vec::new(), cosine: Vec::new() };
    Ok(Trace { deviations, device: "cpu".to_owned(), notice: None })
}

/// What distances are measured to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Towards {
    /// What lies along the normal: [`trace`].
    Normal,
    /// The closest point: [`trace_closest`].
    Closest,
}

/// Takes the distances from texels to which a closed hole of the scan is nearer than the scan itself, and marks them as
/// filled; of other texels a distance behind a closed hole is taken. `facing` and `towards` are those of the trace, `scan` is what it was made with.
///
/// # Errors
/// As [`trace`], or where the holes have no hierarchy.
pub fn hide_behind_filled(
    deviations: &mut Deviations,
    holes: &FilledHoles,
    scan: &Bvh,
    facing: Facing,
    towards: Towards,
) -> Result<(), TraceError> {
    if holes.mesh.triangles.is_empty() {
        return Ok(());
    }
    let bvh = scan.build_beside(&holes.mesh)?;
    let found = {
        let rays = Rays::new(&deviations.texels, &bvh, deviations.max_distance, facing)?;
        match towards {
            Towards::Normal => trace_cpu::trace(&rays),
            Towards::Closest => closest::trace(&rays, None),
        }
    };
    // NaN, where there is nothing, is further than anything.
    let nearer = |a: f32, b: f32| a < b || b.is_nan() && !a.is_nan();
    deviations.filled = vec![false; deviations.outward.len()];
    for (i, (out, inw)) in found.outward.into_iter().zip(found.inward).enumerate() {
        let nearest = deviations.outward[i].min(deviations.inward[i]);
        if nearer(out.min(inw), nearest) {
            deviations.filled[i] = true;
            (deviations.outward[i], deviations.inward[i]) = (f32::NAN, f32::NAN);
            continue;
        }
        for (own, hole) in [(&mut deviations.outward[i], out), (&mut deviations.inward[i], inw)] {
            if nearer(hole, *own) {
                *own = f32::NAN;
            }
        }
    }
    Ok(())
}

/// None where a GPU is not asked for, or not insisted on and absent.
fn on_gpu(rays: &Rays, device: Device) -> Option<Result<(Distances, String), GpuError>> {
    if device == Device::Cpu {
        return None;
    }
    let gpu = match (device, Gpu::open(device == Device::Gpu)) {
        (Device::Auto, Err(GpuError::NoAdapter)) => return None,
        (_, Ok(gpu)) => gpu,
        (_, Err(error)) => return Some(Err(error)),
    };
    Some(gpu.trace(rays).map(|found| (found, gpu.name().to_owned())))
}

/// Distances along +normal and -normal, one a ray; NaN where nothing is hit.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Distances {
    pub(super) outward: Vec<f32>,
    pub(super) inward: Vec<f32>,
}

/// The rays of all texels, and what they are cast at.
pub(super) struct Rays<'a> {
    pub(super) texels: &'a Texels,
    pub(super) scan: &'a Bvh,
    pub(super) max_distance: f32,
    /// Hits this far from a ray's origin, ahead or behind, are at distance zero in both directions.
    pub(super) tolerance: f32,
    /// 1 where only triangles count that face as the model does, 0 where all.
    pub(super) facing: f32,
    /// The least cosine of the angle between their normals; 0 where all of those count.
    pub(super) cosine: f32,
}

impl<'a> Rays<'a> {
    fn new(texels: &'a Texels, scan: &'a Bvh, max_distance: f64, facing: Facing) -> Result<Self, TraceError> {
        if !(max_distance > 0.0 && max_distance < 1e12) || (max_distance as f32) == 0.0 {
            return Err(TraceError::MaxDistance(max_distance));
        }
        let (facing, cosine) = facing.limits();
        let (max_distance, tolerance) = (max_distance as f32, scan.tolerance());
        Ok(Self { texels, scan, max_distance, tolerance, facing, cosine })
    }

    pub(super) fn len(&self) -> usize {
        self.texels.position.len()
    }

    /// Origin, relative to the scan's centre, and unit direction of ray i; none where they are not finite, or where
    /// the origin is so far away that the ray cannot reach the scan.
    pub(super) fn get(&self, i: usize) -> Option<(Vec3A, Vec3A)> {
        let origin = self.scan.to_local(self.texels.position[i]);
        let normal = Vec3A::from_array(self.texels.normal[i]);
        let length = normal.length();
        let near = origin.abs().cmple(self.scan.half_extent() + 2.0 * self.max_distance + self.tolerance).all();
        (near && length.is_finite() && length > 0.0).then(|| (origin, normal / length))
    }
}

#[cfg(test)]
pub(super) mod tests;
