//! Options of a measurement.

use crate::model::Atlas;
use crate::variance::{Device, DistanceKind, Matching, Resolution, Tolerance, VerdictOptions};
use std::sync::Arc;

/// Options of [`measure`](super::measure).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct MeasureOptions {
    /// How fine the texture is.
    pub resolution: Resolution,
    /// The places of the patches on the texture, which several measurements may share; by default they are laid out for
    /// this one by `resolution`. A model with another number of patches has its own.
    pub atlas: Option<Arc<Atlas>>,
    /// Largest distance from the surface at which the scan is looked for, in millimetres; by default a tenth of the
    /// surface's diagonal.
    pub max_distance: Option<f64>,
    /// The largest angle between the normals of surface and scan, in radians; at most a right angle.
    pub max_angle: f64,
    /// The points of the scan to which distances are measured.
    pub distance: DistanceKind,
    /// Which of them count.
    pub matching: Matching,
    /// Width of the band beside an edge in which averaged normals turn back to the surface's own, in millimetres; by
    /// default a fiftieth of the surface's diagonal, at most a tenth.
    pub averaging_width: Option<f64>,
    /// Holes of the scan up to this size are closed, in millimetres; by default none.
    pub fill_holes: Option<f64>,
    /// The tolerance of parts to which the model gives none.
    pub tolerance: Option<Tolerance>,
    /// Cut-off of the filter behind which deviations of form are measured, in millimetres; by default nine distances
    /// between the scan's points, at most a fifth of the part.
    pub form_cutoff: Option<f64>,
    /// The part to which coaxiality, concentricity, parallelism and perpendicularity of the others are measured.
    pub datum: Option<String>,
    /// How it is decided whether parts conform to their tolerances.
    pub verdict: VerdictOptions,
    /// The device that casts the rays.
    pub device: Device,
    /// Whether maps of sensitivities are computed.
    pub sensitivity_maps: bool,
}

impl Default for MeasureOptions {
    fn default() -> Self {
        Self {
            resolution: Resolution::default(),
            atlas: None,
            max_distance: None,
            max_angle: std::f64::consts::FRAC_PI_2,
            distance: DistanceKind::Normal,
            matching: Matching::default(),
            averaging_width: None,
            fill_holes: None,
            tolerance: None,
            form_cutoff: None,
            datum: None,
            verdict: VerdictOptions::default(),
            device: Device::Auto,
            sensitivity_maps: false,
        }
    }
}
