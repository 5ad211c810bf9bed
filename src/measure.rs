//! Options of a measurement, which `variance` and `inspect` share.

use crate::cli::VarianceControls;
use crate::error::CommandError;
use gml_runtime::export::measurement::Extras;
use gml_runtime::variance::{DistanceKind, MeasureError, MeasureOptions};

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

/// The files that the command line asks for.
pub(crate) fn extras(controls: &VarianceControls) -> Extras {
    Extras { exr: controls.exr, points: controls.points }
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
