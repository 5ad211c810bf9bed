//! `gmlc variance`.

use crate::cli::{ScriptArgs, VarianceArgs};
use crate::error::CommandError;
use crate::measure::{self, Settings, Surface};
use crate::progress::TerminalProgress;
use crate::{deviations, fit, script, textures};
use gml_runtime::scan;

pub(crate) fn run(args: &VarianceArgs) -> Result<(), CommandError> {
    let settings = Settings::of(&args.controls)?;
    let surface = surface(args, &settings)?;
    let scan = fit::read_scan(&args.scan)?;
    let progress = TerminalProgress::new();
    let measured = measure::measure(surface, &scan, None, &settings, &progress);
    progress.finish();
    let measured = measured?;
    textures::write(&args.output, &measured)?;
    print!("{}", deviations::summary(&measured.report));
    deviations::judge(&measured.report)
}

/// A script with its parameters, or a mesh: the file's name says which.
fn surface(args: &VarianceArgs, settings: &Settings) -> Result<Surface, CommandError> {
    let name = args.reference.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    if name == "gml" {
        let script =
            ScriptArgs { model: args.reference.clone(), inputs: args.inputs.clone(), limits: args.limits.clone() };
        let program = script::compile(&script)?;
        let (x, motion) = script::parameters(&program, &args.values)?;
        return Surface::of_program(&program, &x, &motion, settings);
    }
    if args.values.params.is_some() || !args.values.values.is_empty() || !args.inputs.is_empty() {
        return Err(CommandError::usage(format!(
            "{}: --params, -p and --input are for scripts (.gml); a reference mesh has no parameters",
            args.reference.display()
        )));
    }
    let unit = args.reference_unit.parse().map_err(|e| CommandError::usage(format!("--reference-unit: {e}")))?;
    let mesh = scan::read_mesh(&args.reference, unit).map_err(CommandError::failed)?;
    if settings.sensitivities {
        return Err(CommandError::usage("--sensitivities is for scripts (.gml); a reference mesh has no parameters"));
    }
    Surface::of_mesh(&mesh, settings.resolution)
}
