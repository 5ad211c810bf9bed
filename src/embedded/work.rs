//! Scans, fits, measurements and inspections.

use super::error::{EmbeddedError, ErrorKind};
use super::model::Model;
use crate::cli::{FitControls, ReadingArgs, ReportArgs, VarianceControls, VirtualScanArgs};
use crate::error::CommandError;
use crate::fit::Fitting;
use crate::inspection::Inspecting;
use crate::saved::SavedFit;
use crate::subject::Subject;
use crate::{fit as fitting, measure as measuring, outputs, record, scan as scanning};
use clap::{CommandFactory, Parser};
use gml_runtime::export::measurement::Extent;
use gml_runtime::fit::{FitOptions, FitResult};
use gml_runtime::inspect::Inspection;
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::progress::Progress;
use gml_runtime::scan::{self, Scan};
use gml_runtime::simulate::VirtualScan;
use gml_runtime::variance::{self, Measurement};
use std::path::Path;
use std::sync::Arc;

#[derive(Debug, Parser)]
#[command(no_binary_name = true)]
struct ReadLine {
    #[command(flatten)]
    reading: ReadingArgs,
}

#[derive(Debug, Parser)]
#[command(no_binary_name = true)]
struct FitLine {
    #[command(flatten)]
    fit: FitControls,
}

#[derive(Debug, Parser)]
#[command(no_binary_name = true)]
struct MeasureLine {
    #[command(flatten)]
    variance: VarianceControls,
}

#[derive(Debug, Parser)]
#[command(no_binary_name = true)]
struct ReportLine {
    #[command(flatten)]
    report: ReportArgs,
}

#[derive(Debug, Parser)]
#[command(no_binary_name = true)]
struct ScanLine {
    #[command(flatten)]
    args: VirtualScanArgs,
}

/// Options that were parsed; an error has the command's text.
pub(super) fn parsed<L: Parser>(words: &[String]) -> Result<L, EmbeddedError> {
    L::try_parse_from(words).map_err(|error| {
        let text = error.to_string();
        let text = text.strip_prefix("error: ").unwrap_or(&text);
        let text = text.split("\n\nUsage").next().unwrap_or(text).trim();
        EmbeddedError { kind: ErrorKind::Usage, text: text.to_owned() }
    })
}

/// An option's name, without dashes, and that of its value in the help, such as `LENGTH`; none of a flag.
pub type OptionName = (String, Option<String>);

/// The names of the options of reading, fitting, measuring and the virtual scanner.
#[must_use]
pub fn names_of_options() -> [Vec<OptionName>; 4] {
    let of = |command: clap::Command| {
        let options = command.get_arguments().filter_map(|arg| {
            let name = arg.get_long().filter(|name| *name != "help")?;
            let value = arg.get_value_names().and_then(|names| names.first()).map(ToString::to_string);
            Some((name.to_owned(), value.filter(|_| arg.get_action().takes_values())))
        });
        options.collect()
    };
    [of(ReadLine::command()), of(FitLine::command()), of(MeasureLine::command()), of(ScanLine::command())]
}

/// Reads and cleans a scan; `words` are options of reading.
///
/// # Errors
/// The options are wrong, or the file cannot be read.
pub fn read_scan(path: &Path, words: &[String], progress: &dyn Progress) -> Result<Scan, EmbeddedError> {
    let reading = parsed::<ReadLine>(words)?.reading;
    Ok(scan::read(path, &reading.options(), progress).map_err(fitting::unreadable)?)
}

/// A scan of points, or of a mesh, in millimetres, that comes from no file.
///
/// # Errors
/// There is nothing in it.
pub fn scan_of_points(mesh: TriangleMesh, name: &str) -> Result<Scan, EmbeddedError> {
    scan::from_mesh(mesh, name).map_err(|fault| EmbeddedError::failed(format!("{name}: {fault}")))
}

/// Fits a model to a scan, or to several of one object; `words` are options of fits. `earlier` is a fit to begin from.
///
/// # Errors
/// The options are wrong, or there is no fit.
pub fn fit(
    model: &Model,
    scans: &[Scan],
    words: &[String],
    earlier: Option<&FitResult>,
    progress: &dyn Progress,
) -> Result<FitResult, EmbeddedError> {
    let controls = parsed::<FitLine>(words)?.fit;
    let options = options(model, &controls, earlier)?;
    Ok(fitted(model, scans, &controls, &options, progress)?.0)
}

fn options(model: &Model, controls: &FitControls, earlier: Option<&FitResult>) -> Result<FitOptions, EmbeddedError> {
    if controls.trace.is_some() {
        return Err(CommandError::usage("--trace is the command's: the steps are not returned").into());
    }
    let Subject { program, provenance, .. } = &model.subject;
    let mut options = model.subject.options(controls, program)?;
    options.earlier = earlier.map(|fit| SavedFit::of(fit.clone()).earlier(program, provenance));
    Ok(options)
}

fn fitted(
    model: &Model,
    scans: &[Scan],
    controls: &FitControls,
    options: &FitOptions,
    progress: &dyn Progress,
) -> Result<(FitResult, Option<Scan>), EmbeddedError> {
    if scans.is_empty() {
        return Err(CommandError::usage("no scan is given").into());
    }
    let fitting = Fitting { subject: &model.subject, controls, search: &[], scans };
    let mut fitted = fitting.run(options, progress)?;
    fitting::unless_interrupted(&fitted.result)?;
    let scan = fitted.scan.as_ref().unwrap_or(&scans[0]);
    for warning in &scan.warnings {
        if !fitted.result.warnings.contains(warning) {
            fitted.result.warnings.push(warning.clone());
        }
    }
    Ok((fitted.result, fitted.scan))
}

/// Deviations, and where on the surface they are.
pub struct Measured {
    /// The deviations.
    pub measurement: Measurement,
    /// Surface parameters of every texel.
    pub uv: Vec<[f64; 2]>,
}

/// Measures the deviations of a scan from a fitted model; `words` are options of measurements.
///
/// # Errors
/// The options are wrong, the fit is that of another model, or the deviations cannot be measured.
pub fn measure(
    model: &Model,
    fit: &FitResult,
    scan: &Scan,
    words: &[String],
    progress: &dyn Progress,
) -> Result<Measured, EmbeddedError> {
    let controls = parsed::<MeasureLine>(words)?.variance;
    require_fit_of(model, fit)?;
    let mut options = measuring::options(&controls)?;
    variance::require_what_scan_has(scan, &options).map_err(CommandError::from)?;
    measuring::require_memory(&controls, scan)?;
    let program = model.program();
    let x: Vec<f64> = fit.parameters.iter().map(|p| p.value).collect();
    let instance = gml_runtime::model::Model::instantiate(program, &x).map_err(EmbeddedError::failed)?;
    let atlas = options.resolution.layout(program, &*instance).map_err(EmbeddedError::failed)?;
    let atlas = Arc::new(atlas);
    options.atlas = Some(atlas.clone());
    let inspection = Inspection::of_fit(program, fit.clone(), scan, &options, progress).map_err(CommandError::from)?;
    unless_cancelled(progress)?;
    let measurement = inspection.measurement;
    let texels = &measurement.deviations.texels;
    let place = |i: usize| {
        let (patch, [column, row]) = (texels.part[i] as usize, texels.place(i));
        let chart = &atlas.charts[patch];
        let (u, v) = atlas.parameters(patch, column - chart.x, row - chart.y);
        [u, v]
    };
    let uv = (0..texels.len()).map(place).collect();
    Ok(Measured { measurement, uv })
}

/// Refuses a fit of another model.
fn require_fit_of(model: &Model, fit: &FitResult) -> Result<(), EmbeddedError> {
    let names = model.program().parameters().iter().map(|p| p.name.as_str());
    if fit.parameters.iter().map(|p| p.name.as_str()).eq(names) {
        return Ok(());
    }
    let text = format!("the fit is of `{}` with other parameters than `{}` has", fit.model, model.program().name());
    Err(EmbeddedError { kind: ErrorKind::Usage, text })
}

/// Fits, measures and documents into a folder, as `gmlc inspect` does.
///
/// # Errors
/// The options are wrong, there is no result, or files cannot be written.
pub fn inspect(
    model: &Model,
    scans: &[Scan],
    [fit_words, measure_words, report_words]: [&[String]; 3],
    output: &Path,
    progress: &dyn Progress,
) -> Result<Inspection, EmbeddedError> {
    let controls = parsed::<FitLine>(fit_words)?.fit;
    let measured = parsed::<MeasureLine>(measure_words)?.variance;
    let report = parsed::<ReportLine>(report_words)?.report;
    let options = measuring::options(&measured)?;
    let mut record = record::of_embedded(&report, &model.subject.script.model, &[fit_words, measure_words])?;
    let sources: Vec<_> = scans.iter().map(|scan| scan.source.clone()).collect();
    record::add_inputs(&mut record, &sources, model.program(), None);
    let inputs = [&model.subject.script.model].into_iter().map(std::path::PathBuf::as_path);
    let of_scans = scans.iter().map(|scan| Path::new(&scan.source.path));
    outputs::require_folder_apart(output, true, inputs.chain(of_scans))?;
    let folder = outputs::begin(output)?;
    let fit_options = self::options(model, &controls, None)?;
    let (mut fit, joined) = fitted(model, scans, &controls, &fit_options, progress)?;
    fit.provenance = Some(record.clone());
    let scan = joined.as_ref().unwrap_or(&scans[0]);
    measuring::require_memory(&measured, scan)?;
    let inspecting = Inspecting {
        program: model.program(),
        scan,
        options: &options,
        controls: &measured,
        extent: Extent::All,
        record: &record,
    };
    let inspection = inspecting.measure(fit, progress)?;
    let written = inspecting.write(&inspection, true, &folder, progress);
    unless_cancelled(progress)?;
    written?;
    folder.finish(None).map_err(EmbeddedError::failed)?;
    Ok(inspection)
}

fn unless_cancelled(progress: &dyn Progress) -> Result<(), EmbeddedError> {
    if progress.cancelled() { Err(CommandError::interrupted().into()) } else { Ok(()) }
}

/// Scans a model with the virtual scanner, and writes the scan if there is an `output`; `x` are the values of its
/// parameters.
///
/// # Errors
/// The options are wrong, or the model cannot be scanned.
pub fn virtual_scan(
    model: &Model,
    x: &[f64],
    words: &[String],
    output: Option<&Path>,
    progress: &dyn Progress,
) -> Result<VirtualScan, EmbeddedError> {
    // Names of files are arguments of the command; without one, it is the format that has most.
    let script = model.subject.script.model.display().to_string();
    let named = output.map_or_else(|| "scan.e57".to_owned(), |path| path.display().to_string());
    let mut line = vec![script, "--output".to_owned(), named];
    line.extend(words.iter().cloned());
    let args = parsed::<ScanLine>(&line)?.args;
    let motion = gml_runtime::model::Motion::IDENTITY;
    let format = crate::convert::format_of(&args.output, args.format)?;
    let scan = scanning::scan_script(&args, model.program(), x, motion, progress)?;
    unless_cancelled(progress)?;
    if output.is_some() {
        scanning::write_scan(&args, format, &scan)?;
    }
    Ok(scan)
}

/// The truth of a virtual scan as JSON.
///
/// # Errors
/// Never in practice.
pub fn truth_of_scan(scan: &VirtualScan) -> Result<String, EmbeddedError> {
    serde_json::to_string(&scan.truth).map_err(EmbeddedError::failed)
}
