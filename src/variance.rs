//! `gmlc variance`.

use crate::cli::{ValueArgs, VarianceArgs};
use crate::error::CommandError;
use crate::progress::TerminalProgress;
use crate::saved::SavedFit;
use crate::script::{Valued, compile_valued};
use crate::{deviations, dimensions, measure, outputs, record, several, table};
use gml_compiler::program::Program;
use gml_runtime::export::exchange::ParameterRow;
use gml_runtime::export::folder::{FIT, REPORT, ResultFolder};
use gml_runtime::export::measurement::Extras;
use gml_runtime::export::report::Scripts;
use gml_runtime::fit::FitResult;
use gml_runtime::inspect::{self, Documents};
use gml_runtime::model::Motion;
use gml_runtime::record::Record;
use gml_runtime::scan::{self, ReferenceMesh, Scan, ScanSource, Unit};
use gml_runtime::variance::{self, MeasureError, MeasureOptions, Measurement, ParameterCovariance, Reference};
use std::path::Path;

pub(crate) fn run(args: &VarianceArgs) -> Result<(), CommandError> {
    let options = measure::options(&args.controls)?;
    let given = [&args.reference].into_iter().chain(several::paths(&args.scan, &args.more));
    let inputs = outputs::inputs(given, args.values.params.as_ref());
    outputs::require_folder_apart(&args.output, false, inputs)?;
    let extension = args.reference.extension().unwrap_or_default();
    require_kind(args, &extension.to_ascii_lowercase().to_string_lossy())?;
    let record = record::of_process(&args.report, &args.reference)?;
    let measured = if extension.eq_ignore_ascii_case("gml") {
        from_model(args, &options, record)
    } else {
        from_mesh(args, &options, record)
    }?;
    let Measured { folder, scan, name, measurement, fit, upright, scripts, parameters } = measured;
    let documents = Documents { name: &name, fit: fit.as_ref(), measurement: &measurement, upright, scripts: &scripts };
    let progress = TerminalProgress::new();
    let extras = Extras { parameters, ..measure::extras(&args.controls) };
    let written = documents.write(folder.path(), &scan, extras, &progress);
    progress.finish();
    written.map_err(|e| outputs::failed(&folder, e))?;
    let kept = outputs::is_fit_of(&args.output, args.values.params.as_deref()) || !outputs::is_inspection(&args.output);
    outputs::finish(folder, &args.output, kept.then_some(FIT), REPORT)?;
    let report = &measurement.report;
    if args.result.is_json() {
        outputs::print_json(report)?;
    }
    args.result.text(&deviations::summary(report));
    deviations::judge(report)
}

/// A measurement, and what its documents show besides.
struct Measured {
    folder: ResultFolder,
    scan: Scan,
    name: String,
    measurement: Measurement,
    /// The fit whose model was measured.
    fit: Option<FitResult>,
    upright: Motion,
    scripts: Scripts,
    /// The values of a model; empty for a mesh.
    parameters: Vec<ParameterRow>,
}

fn from_model(args: &VarianceArgs, options: &MeasureOptions, mut record: Record) -> Result<Measured, CommandError> {
    let valued = compile_valued(&args.reference, &args.compile, &args.values)?;
    let Valued { program, x, motion, fit, saved } = valued;
    let poses = saved.as_ref().map(SavedFit::poses).unwrap_or_default();
    let Read { scan, sources } = read_scan(args, options, &poses)?;
    record::add_inputs(&mut record, &sources, &program, args.values.params.as_deref());
    let folder = outputs::begin(&args.output)?;
    let other = saved.as_ref().map(|saved| saved.about_scan(&scan.source)).transpose()?.flatten();
    let reference = Reference::Model { model: &program, x: &x, motion };
    let covariance = fit.as_ref().and_then(inspect::covariance);
    let mut measurement = measure_from(&args.reference, reference, &scan, covariance, options)?;
    let report = &mut measurement.report;
    let doubt = saved.as_ref().and_then(SavedFit::doubt);
    report.warnings.extend(doubt.into_iter().chain(other));
    match &fit {
        Some(fit) => inspect::judge_measures(report, fit, options.verdict),
        None => report.warnings.extend(dimensions::without_fit(&program)),
    }
    report.warnings.extend(unfitted(&program, &args.values));
    report.provenance = Some(record);
    let upright = inspect::upright(&program, &x, &motion).map_err(CommandError::failed)?;
    let (name, scripts) = (program.name().to_owned(), record::scripts(&program));
    let parameters = fit.as_ref().map_or_else(|| ParameterRow::of_model(&program, &x), ParameterRow::of_fit);
    Ok(Measured { folder, scan, name, measurement, fit, upright, scripts, parameters })
}

fn from_mesh(args: &VarianceArgs, options: &MeasureOptions, mut record: Record) -> Result<Measured, CommandError> {
    let ReferenceMesh { mesh, unit, warnings, .. } =
        scan::read_mesh(&args.reference, args.reference_unit).map_err(CommandError::failed)?;
    let Read { scan, sources } = read_scan(args, options, &[])?;
    sources.iter().for_each(|source| record::add_scan(&mut record, source));
    record::add_file(&mut record, "reference", &args.reference);
    let folder = outputs::begin(&args.output)?;
    let mut measurement = measure_from(&args.reference, Reference::Mesh(&mesh), &scan, None, options)?;
    let report = &mut measurement.report;
    report.warnings.extend(warnings);
    let scan_unit = &scan.source.unit;
    report.warnings.extend(other_unit(mesh.bounds().diagonal(), &unit, scan.mesh.bounds().diagonal(), scan_unit));
    report.provenance = Some(record);
    let name = record::file_name(&args.reference);
    // Which way is up in a mesh is not known: that of its coordinates, as most programs have it.
    let (fit, upright, scripts, parameters) = (None, Motion::IDENTITY, Scripts::default(), Vec::new());
    Ok(Measured { folder, scan, name, measurement, fit, upright, scripts, parameters })
}

/// A scan, and the files that it came from.
struct Read {
    scan: Scan,
    sources: Vec<ScanSource>,
}

/// Reads the scans, and makes one of several by the poses of a fit of all of them.
fn read_scan(args: &VarianceArgs, options: &MeasureOptions, poses: &[Motion]) -> Result<Read, CommandError> {
    let scans = several::read(&args.scan, &args.more)?;
    let sources = several::sources(&scans);
    // A fit of several scans says nothing of those that have one frame anyway.
    let poses = if args.more.same_pose { &[] } else { poses };
    let scan = several::in_frame_of_fit(scans, poses)?;
    measure::require_memory(&args.controls, &scan)?;
    variance::require_what_scan_has(&scan, options)?;
    Ok(Read { scan, sources })
}

/// Sizes of one object in one unit differ by less than this factor, whatever was scanned of it.
const SAME_SIZE: f64 = 1.3;

/// A sentence on a reference mesh and a scan whose sizes would be the same if the mesh's file were in another unit.
fn other_unit(mesh: f64, unit: &str, scan: f64, scan_unit: &str) -> Option<String> {
    let are_same = |a: f64, b: f64| a > 0.0 && b > 0.0 && a.max(b) < SAME_SIZE * a.min(b);
    if are_same(mesh, scan) {
        return None;
    }
    let own: Unit = unit.parse().ok()?;
    let size = |other: Unit| mesh / own.millimetres() * other.millimetres();
    let meant = Unit::ALL.into_iter().find(|other| are_same(size(*other), scan))?;
    let [mesh, scan] = [mesh, scan].map(table::number);
    Some(format!(
        "the reference mesh is {mesh} mm large and the scan {scan} mm, as if one of them were in another unit: \
         --reference-unit is {unit}, which would be {meant} for a scan in {scan_unit} (--unit)"
    ))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_tell_of_units_that_are_mixed_up() {
        assert_eq!(other_unit(50.0, "mm", 48.0, "mm"), None);
        assert_eq!(other_unit(50.0, "mm", 170.0, "mm"), None, "no unit explains that");
        let inches = other_unit(2.0, "mm", 50.8, "mm").expect("a sentence");
        assert!(inches.contains("which would be in for a scan in mm"), "{inches}");
        let metres = other_unit(0.05, "mm", 49.0, "mm").expect("a sentence");
        assert!(metres.contains("would be m for"), "{metres}");
    }
}
