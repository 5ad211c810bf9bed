//! `gmlc inspect`: fit, measure and document.

use crate::cli::InspectArgs;
use crate::error::CommandError;
use crate::progress::TerminalProgress;
use crate::subject::Subject;
use crate::{deviations, fit, measure, mesh};
use gml_runtime::export::json;
use gml_runtime::inspect::{InspectError, Inspection, Origin};
use gml_runtime::variance::{self, MeasureOptions};

pub(crate) fn run(args: &InspectArgs) -> Result<(), CommandError> {
    // Errors in the command line are reported before any work is done.
    let options = measure::options(&args.variance)?;
    let subject = Subject::compiled(&args.script, args.params.as_deref(), &args.search, &args.fit)?;
    inspect(&subject, args, &options, &TerminalProgress::until(fit::on_interrupt()?))
}

/// Inspects a scan with a compiled script.
pub(crate) fn inspect(
    subject: &Subject,
    args: &InspectArgs,
    options: &MeasureOptions,
    progress: &TerminalProgress,
) -> Result<(), CommandError> {
    let fit_options = subject.options(&args.fit, &subject.program)?;
    let scan = fit::read_scan(&args.scan)?;
    // Before the fit, which takes longer.
    variance::require_triangles(&scan)?;
    // A search may end with a model of other parts.
    if args.search.is_empty() {
        let parts: Vec<String> = subject.program.parts().iter().map(|part| part.name.clone()).collect();
        variance::require_datum(options.datum.as_deref(), &parts, |_| true)?;
    }
    mesh::make_folder(&args.output)?;
    let fitting = fit::Fitting { subject, controls: &args.fit, search: &args.search, scan: &scan };
    let (searched, fitted) = fitting.run(&fit_options, progress)?;
    // The fit is kept even if something fails afterwards.
    json::write(&args.output.join("fit.json"), &fitted).map_err(CommandError::failed)?;
    fit::write_trace(args.fit.trace.as_deref(), &fitted)?;
    fit::unless_interrupted(&fitted)?;

    let program = searched.as_ref().unwrap_or(&subject.program);
    let inspection = Inspection::of_fit(program, fitted, &scan, options, progress);
    let inspection = inspection.map_err(|e| match e {
        InspectError::Measure(error) => error.into(),
        error => CommandError::failed(error),
    })?;
    let origin = Origin {
        model: &args.script.model.display().to_string(),
        date: &chrono::Utc::now().format("%Y-%m-%d %H:%M UTC").to_string(),
        tool: concat!("gmlc ", env!("CARGO_PKG_VERSION")),
    };
    let written = inspection.write(&args.output, &scan, origin, measure::extras(&args.variance), progress);
    progress.finish();
    written.map_err(CommandError::failed)?;

    let report = &inspection.measurement.report;
    // What both say of the scan is said once.
    let mut fitted = inspection.fit.clone();
    fitted.warnings.retain(|warning| !report.warnings.contains(warning));
    print!("{}\n{}", fit::summary(&fitted), deviations::summary(report));
    println!("written to {}: report.html, model.x3d, fit.json, variance.json and pictures", args.output.display());
    // Deviations from a model that was not fitted are no verdict on the object, but they are said.
    match (fit::judge(&inspection.fit), deviations::judge(report)) {
        (Err(unreliable), Err(deviations)) => {
            deviations.print();
            Err(unreliable)
        }
        (fit, deviations) => fit.and(deviations),
    }
}
