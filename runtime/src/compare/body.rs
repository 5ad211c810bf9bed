//! Areas and volumes of surfaces.

use super::prepared::Prepared;
use crate::figures::{NoVolume, Sums, over_patches, simply_enclosed};
use crate::model::Closedness;
use crate::variance::{MeasureError, enclosed_volume};
use serde::{Deserialize, Serialize};

/// The sizes of a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Corners of the bounding box: the least coordinates. Millimetres.
    pub low: [f64; 3],
    /// The greatest coordinates.
    pub high: [f64; 3],
    /// Area of all of the surface. Square millimetres.
    pub area: f64,
    /// The volume that it encloses, if it is closed. Cubic millimetres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume: Option<f64>,
    /// Why there is no volume.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub without_volume: Option<NoVolume>,
}

/// The sizes of a surface.
pub(super) fn of(prepared: &Prepared<'_>) -> Result<Body, MeasureError> {
    let surface = &prepared.surface;
    let mesh = &surface.tessellation.mesh;
    let bounds = mesh.bounds();
    let (area, volume) = match &surface.parametrised {
        None => {
            let enclosed = enclosed_volume(mesh).map(f64::abs).ok_or(NoVolume::Open);
            (mesh.area(), enclosed.and_then(|volume| simply_enclosed(mesh, None).map(|()| volume)))
        }
        Some(model) => {
            let instance = &*model.reach.instance;
            let integrals = over_patches(model.reach.model, instance, mesh.bounds().centre())?;
            let signed = |(i, inverted): (&Sums, &bool)| if *inverted { -i.volume } else { i.volume };
            let volume: f64 = integrals.iter().zip(&surface.inverted).map(signed).sum();
            // Winding numbers say whether bodies overlap: samples also count as buried where bodies only touch.
            let volume = if Closedness::of(model.reach.model, instance)?.is_closed() {
                simply_enclosed(mesh, None).map(|()| volume)
            } else {
                Err(NoVolume::Open)
            };
            (integrals.iter().map(|i| i.area).sum(), volume)
        }
    };
    let (low, high) = (bounds.low.into(), bounds.high.into());
    Ok(Body { low, high, area, volume: volume.ok(), without_volume: volume.err() })
}
