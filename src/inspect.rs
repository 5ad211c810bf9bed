//! `gmlc inspect`: fit, measure and document.

use crate::cli::InspectArgs;
use crate::error::CommandError;
use crate::fit::Fitted;
use crate::inspection::Inspecting;
use crate::progress::TerminalProgress;
use crate::subject::Subject;
use crate::{deviations, fit, interrupt, measure, outputs, record, several};
use gml_runtime::export::folder::{FIT, REPORT, ResultFolder};
use gml_runtime::export::json;
use gml_runtime::export::measurement::Extent;
use gml_runtime::fit::FitOptions;
use gml_runtime::inspect::Inspection;
use gml_runtime::progress::Progress;
use gml_runtime::record::Record;
use gml_runtime::variance::{self, MeasureOptions};

pub(crate) fn run(args: &InspectArgs) -> Result<(), CommandError> {
    // Errors in the command line are reported before any work is done.
    let options = measure::options(&args.variance)?;
    let subject = if args.no_fit {
        Subject::fitted(&args.script, args.params.as_ref())?
    } else {
        Subject::compiled(&args.script, args.params.as_deref(), &args.search, &args.fit)?
    };
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
    let given = || several::paths(&args.scan, &args.more);
    let inputs = outputs::inputs([&args.script.model].into_iter().chain(given()), args.params.as_ref());
    outputs::require_folder_apart(&args.output, !args.no_fit, inputs)?;
    outputs::require_files(&args.fit.trace)?;
    if let Some(trace) = &args.fit.trace {
        let stated = record::fields_file(&args.script.model);
        let inputs = outputs::inputs([&stated].into_iter().chain(given()), args.params.as_ref());
        outputs::require_apart(trace, inputs)?;
        outputs::require_apart_from_scripts(trace, &subject.program)?;
    }
    let fit_options = subject.options(&args.fit, &subject.program)?;
    let scans = several::read(&args.scan, &args.more)?;
    record::add_inputs(&mut record, &several::sources(&scans), &subject.program, args.params.as_deref());
    // Before the fit, which takes longer.
    for scan in &scans {
        variance::require_what_scan_has(scan, options)?;
        measure::require_memory(&args.variance, scan)?;
    }
    // A search may end with a model of other parts.
    if args.search.is_empty() {
        let parts: Vec<String> = subject.program.parts().iter().map(|part| part.name.clone()).collect();
        variance::require_datum(options.datum.as_deref(), &parts, |_| true)?;
    }
    let folder = outputs::begin(&args.output)?;
    let fitting = fit::Fitting { subject, controls: &args.fit, search: &args.search, scans: &scans };
    let documented = document(&fitting, &fit_options, args, options, &record, progress, &folder);
    progress.finish();
    let inspection = match documented {
        Ok(inspection) => inspection,
        Err(error) => {
            if !args.no_fit {
                keep_fit(folder);
            }
            return Err(error);
        }
    };
    let kept = outputs::is_fit_of(&args.output, args.params.as_deref());
    outputs::finish(folder, &args.output, kept.then_some(FIT), REPORT)?;

    let report = &inspection.measurement.report;
    if args.result.is_json() {
        let output = args.output.display().to_string();
        outputs::print_json(&serde_json::json!({ "output": output, "fit": inspection.fit, "variance": report }))?;
    }
    // What both say of the scan is said once.
    let mut fitted = inspection.fit.clone();
    fitted.warnings.retain(|warning| !report.warnings.contains(warning));
    args.result.text(&format!("{}\n{}", fit::summary(&fitted), deviations::summary(report)));
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
    progress: &dyn Progress,
    folder: &ResultFolder,
) -> Result<Inspection, CommandError> {
    let subject = fitting.subject;
    let mut warnings = Vec::new();
    let Fitted { program: searched, result, scan } = match subject.saved.as_ref().filter(|_| args.no_fit) {
        Some(saved) => {
            let scan = several::in_frame_of_fit(fitting.scans.to_vec(), &saved.poses())?;
            warnings.extend(saved.about_scan(&scan.source)?);
            let result = saved.clone().into_measured(&subject.program, &subject.provenance);
            Fitted { program: None, result, scan: Some(scan) }
        }
        None => fitted(fitting, fit_options, args, record, progress, folder)?,
    };
    let scan = scan.as_ref().unwrap_or(&fitting.scans[0]);
    let program = searched.as_ref().unwrap_or(&subject.program);
    let inspecting = Inspecting { program, scan, options, controls: &args.variance, extent: Extent::All, record };
    let mut inspection = inspecting.measure(result, progress)?;
    inspection.measurement.report.warnings.extend(warnings);
    let is_kept = outputs::is_fit_of(&args.output, args.params.as_deref());
    inspecting.write(&inspection, !is_kept, folder, progress)?;
    Ok(inspection)
}

/// Fits, and writes the fit into the folder: of one that is interrupted the best so far is kept. Once it is written, a
/// signal ends all at once.
fn fitted(
    fitting: &fit::Fitting<'_>,
    options: &FitOptions,
    args: &InspectArgs,
    record: &Record,
    progress: &dyn Progress,
    folder: &ResultFolder,
) -> Result<Fitted, CommandError> {
    let _grace = interrupt::grace();
    let mut fitted = fitting.run(options, progress)?;
    fitted.result.provenance = Some(record.clone());
    json::write(&folder.path().join(FIT), &fitted.result).map_err(|e| outputs::failed_write(folder, e))?;
    fit::write_trace(args.fit.trace.as_deref(), &fitted.result)?;
    fit::unless_interrupted(&fitted.result)?;
    Ok(fitted)
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
