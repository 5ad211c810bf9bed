//! `gmlc variance`.

use crate::cli::{ValueArgs, VarianceArgs};
use crate::error::CommandError;
use crate::progress::TerminalProgress;
use crate::saved::SavedFit;
use crate::script::{Valued, compile_valued};
use crate::{deviations, dimensions, fit, measure, outputs, record};
use gml_compiler::program::Program;
use gml_runtime::export::exchange::ParameterRow;
use gml_runtime::export::folder::FIT;
use gml_runtime::export::measurement;
use gml_runtime::inspect;
use gml_runtime::scan::{self, ReferenceMesh, Scan};
use gml_runtime::variance::{self, MeasureError, MeasureOptions, Measurement, ParameterCovariance, Reference};
use std::path::{Path, PathBuf};

pub(crate) fn run(args: &VarianceArgs) -> Result<(), CommandError> {
    let options = measure::options(&args.controls)?;
    let inputs = outputs::inputs([&args.reference, &args.scan.scan], args.values.params.as_ref());
    outputs::require_folder_apart(&args.output, false, inputs)?;
    let extension = args.reference.extension().unwrap_or_default();
    require_kind(args, &extension.to_ascii_lowercase().to_string_lossy())?;
    let mut record = record::of_process(&args.report, &args.reference)?;
    let mut extras = measure::extras(&args.controls);
    let folder;
    let mut measured = if extension.eq_ignore_ascii_case("gml") {
        let valued = compile_valued(&args.reference, &args.compile, &args.values)?;
        let Valued { program, x, motion, fit, saved } = valued;
        let covariance = fit.as_ref().and_then(inspect::covariance);
        let scan = fit::read_scan(&args.scan)?;
        measure::require_memory(&args.controls, &scan)?;
        variance::require_triangles(&scan).map_err(CommandError::failed)?;
        record::add_inputs(&mut record, &scan.source, &program, args.values.params.as_deref());
        folder = outputs::begin(&args.output)?;
        let other = saved.as_ref().map(|saved| saved.about_scan(&scan.source)).transpose()?.flatten();
        let reference = Reference::Model { model: &program, x: &x, motion };
        measure_from(&args.reference, reference, &scan, covariance, &options).map(|mut measured| {
            let doubt = saved.as_ref().and_then(SavedFit::doubt);
            measured.report.warnings.extend(doubt.into_iter().chain(other));
            match &fit {
                Some(fit) => inspect::judge_measures(&mut measured.report, fit, options.verdict),
                None => measured.report.warnings.extend(dimensions::without_fit(&program)),
            }
            measured.report.warnings.extend(unfitted(&program, &args.values));
            extras.parameters = match &fit {
                Some(fit) => ParameterRow::of_fit(fit),
                None => ParameterRow::of_model(&program, &x),
            };
            measured
        })
    } else {
        let ReferenceMesh { mesh, warnings, .. } =
            scan::read_mesh(&args.reference, args.reference_unit.unwrap_or_default()).map_err(CommandError::failed)?;
        let scan = fit::read_scan(&args.scan)?;
        measure::require_memory(&args.controls, &scan)?;
        variance::require_triangles(&scan).map_err(CommandError::failed)?;
        record::add_scan(&mut record, &scan.source);
        record::add_file(&mut record, "reference", &args.reference);
        folder = outputs::begin(&args.output)?;
        measure_from(&args.reference, Reference::Mesh(&mesh), &scan, None, &options).map(|mut measured| {
            measured.report.warnings.extend(warnings);
            measured
        })
    }?;
    measured.report.provenance = Some(record);
    measurement::write(folder.path(), &measured, &extras).map_err(|e| outputs::failed(&folder, e))?;
    let is_fit = |params: &PathBuf| params.canonicalize().ok() == args.output.join(FIT).canonicalize().ok();
    folder.finish(args.values.params.as_ref().filter(|p| is_fit(p)).map(|_| FIT)).map_err(CommandError::failed)?;
    print!("{}", deviations::summary(&measured.report));
    deviations::judge(&measured.report)
}

/// Refuses a reference of another kind, and options that its kind has no use for.
fn require_kind(args: &VarianceArgs, extension: &str) -> Result<(), CommandError> {
    let refuse = |why: &str| Err(CommandError::usage(format!("{}: {why}", args.reference.display())));
    let has_values = args.values.params.is_some() || !args.values.values.is_empty() || !args.compile.inputs.is_empty();
    match extension {
        "json" => {
            refuse("the reference is a script (.gml) or a mesh; name the script of the fit, and the fit by --params")
        }
        "gml" if args.reference_unit.is_some() => {
            refuse("--reference-unit requires a reference mesh; a script states the units of its lengths")
        }
        "gml" => Ok(()),
        _ if has_values => {
            refuse("--params, -p and --input require a script (.gml); a reference mesh has no parameters")
        }
        _ if args.controls.sensitivities => {
            refuse("--sensitivities requires a script (.gml); a reference mesh has no parameters")
        }
        _ => Ok(()),
    }
}

/// A sentence on a model whose values are not all those of a fit: deviations from it are those from an assumption.
fn unfitted(program: &Program, args: &ValueArgs) -> Option<String> {
    let known = program.parameters().iter().map(|p| p.name.as_str());
    let (given, others): (Vec<&str>, Vec<&str>) =
        known.partition(|name| args.values.iter().any(|(given, _)| given.trim() == *name));
    let given: Vec<String> = given.into_iter().map(|name| format!("`{name}`")).collect();
    let (names, are) = (given.join(", "), if given.len() == 1 { "is" } else { "are" });
    Some(match (args.params.is_some(), given.is_empty(), others.is_empty()) {
        (true, true, _) => return None,
        (true, false, true) => format!("the model is not the fitted one: {names} {are} as given, and the pose is the fit's"),
        (true, false, false) => {
            format!("the model is not the fitted one: {names} {are} as given; the other parameters and the pose are the fit's")
        }
        (false, true, true) => "the model was not placed: its pose is the script's".to_owned(),
        (false, true, false) => {
            "the model was neither fitted nor placed: its parameters are the script's defaults, and its pose is the script's \
             (`gmlc fit` finds both, --params takes them)"
                .to_owned()
        }
        (false, false, true) => {
            format!("the model was neither fitted nor placed: {names} {are} as given, and the pose is the script's")
        }
        (false, false, false) => format!(
            "the model was neither fitted nor placed: {names} {are} as given, the other parameters are the script's defaults, and \
             the pose is the script's"
        ),
    })
}

/// Measures; errors of a reference mesh name its file.
fn measure_from(
    file: &Path,
    reference: Reference<'_>,
    scan: &Scan,
    covariance: Option<ParameterCovariance<'_>>,
    options: &MeasureOptions,
) -> Result<Measurement, CommandError> {
    let progress = TerminalProgress::new();
    let measured = variance::measure(reference, scan, covariance, options, &progress);
    progress.finish();
    measured.map_err(|error| match error {
        MeasureError::Reference(why) => CommandError::Failed(format!("{}: {why}", file.display())),
        error => error.into(),
    })
}
