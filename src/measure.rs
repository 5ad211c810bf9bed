//! Options of a measurement, which `variance` and `inspect` share.

use crate::cli::VarianceControls;
use crate::error::CommandError;
use gml_compiler::number;
use gml_runtime::export::measurement::Extras;
use gml_runtime::inspect::InspectError;
use gml_runtime::model::{LARGEST, SMALLEST};
use gml_runtime::scan::Scan;
use gml_runtime::variance::{DistanceKind, MeasureError, MeasureOptions, Resolution};

/// Options from the command line.
pub(crate) fn options(controls: &VarianceControls) -> Result<MeasureOptions, CommandError> {
    let mut options = MeasureOptions::default();
    options.resolution = controls.resolution;
    options.max_distance = controls.max_distance;
    options.max_angle = controls.max_angle;
    options.distance = controls.distance;
    options.matching = controls.matching;
    options.averaging_width = controls.averaging_width;
    if options.averaging_width.is_some() && options.distance != DistanceKind::AveragedNormal {
        return Err(CommandError::usage("--averaging-width requires --distance averaged-normal"));
    }
    options.form_cutoff = controls.form_cutoff;
    options.datum.clone_from(&controls.datum);
    options.fill_holes = controls.fill_holes;
    options.tolerance = controls.tolerance;
    options.verdict.rule = controls.decision;
    options.verdict.min_coverage = controls.min_coverage;
    options.verdict.device_uncertainty = controls.device_uncertainty.unwrap_or(0.0);
    options.verdict.footprint = controls.footprint;
    options.device = controls.device;
    options.sensitivity_maps = controls.sensitivities;
    Ok(options)
}

/// Bytes that a measurement takes for a texel: seen with textures of 2048 and 4096 texels a side.
const BYTES_A_TEXEL: f64 = 150.0;

/// Bytes that bands in which normals are averaged take, times the square of their width over the object's size: four
/// times of what a can showed, since the time grows with them.
const BYTES_A_BAND: f64 = 100.0;

/// Refuses a texture, or bands of averaged normals, that would take more memory than is allowed. The scan tells how
/// large the surface is, where the texels' width is asked for.
pub(crate) fn require_memory(controls: &VarianceControls, scan: &Scan) -> Result<(), CommandError> {
    let asked = match controls.resolution {
        Resolution::Side(side) => side,
        Resolution::Texel(width) => (extent(scan) / width).min(f64::from(LARGEST)) as u32,
    };
    let gigabytes = |bytes: f64| format!("{:.1}GB", (bytes / 1e8).ceil() / 10.0);
    let most = controls.memory as f64;
    if let (DistanceKind::AveragedNormal, Some(width)) = (controls.distance, controls.averaging_width) {
        let bytes = BYTES_A_BAND * (scan.mesh.bounds().diagonal() / width).powi(2);
        if bytes > most {
            return Err(CommandError::usage(format!(
                "--averaging-width: bands of {} mm may take {} of memory, more than the {} of --memory; choose wider ones, or \
                 --memory {}",
                number::plain(width),
                gigabytes(bytes),
                gigabytes(most),
                gigabytes(bytes)
            )));
        }
    }
    let side = asked.clamp(SMALLEST, LARGEST).next_power_of_two();
    let bytes = BYTES_A_TEXEL * f64::from(side).powi(2);
    if bytes <= most {
        return Ok(());
    }
    Err(CommandError::usage(format!(
        "--resolution: a texture of {side} x {side} texels takes about {} of memory, more than the {} of --memory; choose \
         fewer or wider texels, or --memory {}",
        gigabytes(bytes),
        gigabytes(most),
        gigabytes(bytes)
    )))
}

/// The root of the area of a scan; of a cloud, which has no triangles, the diagonal of its box. Millimetres.
fn extent(scan: &Scan) -> f64 {
    match scan.mesh.triangles.is_empty() {
        true => scan.mesh.bounds().diagonal(),
        false => scan.mesh.area().sqrt(),
    }
}

/// The files that the command line asks for. A table of parameters has no rows yet.
pub(crate) fn extras(controls: &VarianceControls) -> Extras {
    let VarianceControls { exr, points, export, scale, scene, .. } = controls;
    Extras { exr: *exr, points: *points, formats: export.clone(), scale: *scale, scene: *scene, ..Extras::default() }
}

impl From<MeasureError> for CommandError {
    fn from(error: MeasureError) -> Self {
        match error {
            MeasureError::AveragingWidth { .. } => Self::usage(format!("--averaging-width: {error}")),
            MeasureError::Datum { .. } => Self::usage(format!("--datum: {error}")),
            MeasureError::MaxDistance { .. } => Self::usage(format!("--max-distance: {error}")),
            _ => Self::failed(error),
        }
    }
}

impl From<InspectError> for CommandError {
    fn from(error: InspectError) -> Self {
        match error {
            InspectError::Measure(error) => error.into(),
            error => Self::failed(error),
        }
    }
}
