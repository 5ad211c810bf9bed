//! Options of a measurement, which `variance` and `inspect` share.

use crate::cli::{DeviceArg, DistanceArg, VarianceControls};
use crate::error::CommandError;
use crate::values;
use gml_runtime::model::{LARGEST, SMALLEST};
use gml_runtime::variance::{Device, DistanceKind, MeasureError, MeasureOptions, Resolution, Tolerance};

/// Options from the command line.
pub(crate) fn options(controls: &VarianceControls) -> Result<MeasureOptions, CommandError> {
    let length =
        |option: &str, text: &Option<String>| text.as_ref().map(|t| values::positive_length(option, t)).transpose();
    let mut options = MeasureOptions::default();
    options.resolution = resolution(&controls.resolution)?;
    options.max_distance = length("--max-distance", &controls.max_distance)?;
    options.max_angle = values::acute_angle("--max-angle", &controls.max_angle)?;
    options.distance = match controls.distance {
        DistanceArg::Normal => DistanceKind::Normal,
        DistanceArg::AveragedNormal => DistanceKind::AveragedNormal,
        DistanceArg::Closest => DistanceKind::Closest,
    };
    options.averaging_width = length("--averaging-width", &controls.averaging_width)?;
    if options.averaging_width.is_some() && options.distance != DistanceKind::AveragedNormal {
        return Err(CommandError::usage("--averaging-width requires --distance averaged-normal"));
    }
    options.fill_holes = length("--fill-holes", &controls.fill_holes)?;
    options.tolerance = match &controls.tolerance {
        Some(text) => {
            let (lower, upper) = values::tolerance("--tolerance", text)?;
            Some(Tolerance { lower, upper })
        }
        None => None,
    };
    options.device = match controls.device {
        DeviceArg::Auto => Device::Auto,
        DeviceArg::Cpu => Device::Cpu,
        DeviceArg::Gpu => Device::Gpu,
    };
    options.sensitivity_maps = controls.sensitivities;
    Ok(options)
}

/// Reads a number of texels, which must be a power of two because X3D viewers resample other textures, or a length.
fn resolution(text: &str) -> Result<Resolution, CommandError> {
    let Ok(size) = text.trim().parse::<u32>() else {
        return values::positive_length("--resolution", text).map(Resolution::Texel);
    };
    if size.is_power_of_two() && (SMALLEST..=LARGEST).contains(&size) {
        return Ok(Resolution::Side(size));
    }
    Err(CommandError::usage(format!(
        "--resolution {size}: must be a power of two from {SMALLEST} to {LARGEST}, such as 1024, or a length such as 0.2mm"
    )))
}

impl From<MeasureError> for CommandError {
    fn from(error: MeasureError) -> Self {
        match error {
            MeasureError::AveragingWidth { .. } => Self::usage(format!("--averaging-width: {error}")),
            _ => Self::failed(error),
        }
    }
}
