//! `gmlc inspect`: fit, measure and document.

use crate::cli::InspectArgs;
use crate::error::CommandError;
use crate::progress::TerminalProgress;
use crate::subject::Subject;
use crate::{deviations, fit, interrupt, measure, outputs, record};
use gml_runtime::export::folder::{FIT, REPORT, ResultFolder};
use gml_runtime::export::json;
use gml_runtime::fit::FitOptions;
use gml_runtime::inspect::{InspectError, Inspection};
use gml_runtime::record::Record;
use gml_runtime::variance::{self, MeasureOptions};
use std::path::Path;

pub(crate) fn run(args: &InspectArgs) -> Result<(), CommandError> {
    // Errors in the command line are reported before any work is done.
    let options = measure::options(&args.variance)?;
    let subject = Subject::compiled(&args.script, args.params.as_deref(), &args.search, &args.fit)?;
    let record = record::of_process(&args.report, &args.script.model)?;
    inspect(&subject, args, &options, record, &TerminalProgress::new())
}

/// Inspects a scan with a compiled script.
pub(crate) fn inspect(
    subject: &Subject,
    args: &InspectArgs,
    options: &MeasureOptions,
    mut record: Record,
    progress: &TerminalProgress,
) -> Result<(), CommandError> {
    let inputs = outputs::inputs([&args.script.model, &args.scan.scan], args.params.as_ref());
    outputs::require_folder_apart(&args.output, true, inputs)?;
    outputs::require_files(&args.fit.trace)?;
    if let Some(trace) = &args.fit.trace {
        outputs::require_apart(trace, outputs::inputs([&args.scan.scan], args.params.as_ref()))?;
        outputs::require_apart_from_scripts(trace, &subject.program)?;
    }
    let fit_options = subject.options(&args.fit, &subject.program)?;
    let scan = fit::read_scan(&args.scan)?;
    record::add_inputs(&mut record, &scan.source, &subject.program, args.params.as_deref());
    // Before the fit, which takes longer.
    variance::require_triangles(&scan)?;
    measure::require_memory(&args.variance, &scan)?;
    // A search may end with a model of other parts.
    if args.search.is_empty() {
        let parts: Vec<String> = subject.program.parts().iter().map(|part| part.name.clone()).collect();
        variance::require_datum(options.datum.as_deref(), &parts, |_| true)?;
    }
    let folder = outputs::begin(&args.output)?;
    let fitting = fit::Fitting { subject, controls: &args.fit, search: &args.search, scan: &scan };
    let inspection = match document(&fitting, &fit_options, args, options, &record, progress, &folder) {
        Ok(inspection) => inspection,
        Err(error) => {
            progress.finish();
            keep_fit(folder);
            return Err(error);
        }
    };
    outputs::finish(folder, &args.output, None, REPORT)?;
    args.fit.trace.iter().for_each(|trace| outputs::wrote(trace));

    let report = &inspection.measurement.report;
    // What both say of the scan is said once.
    let mut fitted = inspection.fit.clone();
    fitted.warnings.retain(|warning| !report.warnings.contains(warning));
    print!("{}\n{}", fit::summary(&fitted), deviations::summary(report));
    // Deviations from a model that was not fitted are no verdict on the object, but they are said.
    match (fit::judge(&inspection.fit), deviations::judge(report)) {
        (Err(unreliable), Err(deviations)) => {
            deviations.print();
            Err(unreliable)
        }
        (fit, deviations) => fit.and(deviations),
    }
}

/// Fits, measures, and writes everything into a folder of results.
fn document(
    fitting: &fit::Fitting<'_>,
    fit_options: &FitOptions,
    args: &InspectArgs,
    options: &MeasureOptions,
    record: &Record,
    progress: &TerminalProgress,
    folder: &ResultFolder,
) -> Result<Inspection, CommandError> {
    // Of a fit that is interrupted the best so far is kept; once it is written, a signal ends all at once.
    let grace = interrupt::grace();
    let (searched, mut fitted) = fitting.run(fit_options, progress)?;
    fitted.provenance = Some(record.clone());
    json::write(&folder.path().join(FIT), &fitted).map_err(|e| outputs::failed_write(folder, e))?;
    fit::write_trace(args.fit.trace.as_deref(), &fitted)?;
    fit::unless_interrupted(&fitted)?;
    drop(grace);

    let program = searched.as_ref().unwrap_or(&fitting.subject.program);
    let inspection = Inspection::of_fit(program, fitted, fitting.scan, options, progress);
    let mut inspection = inspection.map_err(|e| match e {
        InspectError::Measure(error) => error.into(),
        error => CommandError::failed(error),
    })?;
    inspection.measurement.report.provenance = Some(record.clone());
    let texts = program.sources().scripts();
    let scripts: Vec<(String, String)> =
        texts.map(|file| (record::file_name(Path::new(file.name.as_str())), file.text.to_string())).collect();
    let written = inspection.write(folder.path(), fitting.scan, &scripts, measure::extras(&args.variance), progress);
    progress.finish();
    written.map_err(|e| outputs::failed(folder, e))?;
    Ok(inspection)
}

/// Keeps the fit even if something failed after it.
fn keep_fit(folder: ResultFolder) {
    if !folder.path().join(FIT).exists() {
        return;
    }
    match folder.keep_fit() {
        Ok(path) => eprintln!("the fit is in {}", path.display()),
        Err(error) => eprintln!("warning: {error}"),
    }
}
