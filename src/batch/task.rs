//! The work on one scan of a batch.

use super::ledger;
use super::plan::{Plan, Scan};
use crate::error::CommandError;
use crate::fit::Fitting;
use crate::inspection::Inspecting;
use crate::saved::SavedFit;
use crate::{fit, measure, outputs, record};
use gml_runtime::export::folder::{FIT, ROW, ResultFolder};
use gml_runtime::export::json;
use gml_runtime::fit::{EarlierFit, FitOptions};
use gml_runtime::population::{Inspected, Outcome, Row};
use gml_runtime::progress::Progress;
use gml_runtime::{scan, variance};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// Inspects a scan and writes its results and its row; `previous` is the scan before it, if the fit is to begin there.
/// None if the work was interrupted: then nothing is written.
pub(super) fn inspect(
    plan: &Plan<'_>,
    scan: &Scan,
    previous: Option<&Scan>,
    progress: &dyn Progress,
) -> Result<Option<Row>, CommandError> {
    let (time, begun) = (record::now(), Instant::now());
    let failed = |reason: String| {
        let row = ledger::row(plan, scan, time.clone(), begun, Outcome::Failed { reason });
        ledger::keep_without_result(plan, scan, &row)?;
        Ok(Some(row))
    };
    if let Err(reason) = &scan.sha256 {
        return failed(reason.clone());
    }
    if let Some(original) = &scan.copy_of {
        let row = ledger::row(plan, scan, time.clone(), begun, Outcome::Copy { of: original.clone() });
        ledger::keep_without_result(plan, scan, &row)?;
        return Ok(Some(row));
    }
    let work = || -> Result<Row, CommandError> {
        let folder = outputs::begin(&ledger::folder_of(plan, scan))?;
        let inspected = documented(plan, scan, previous, &folder, progress)?;
        let row = ledger::row(plan, scan, time.clone(), begun, Outcome::Inspected(Box::new(inspected)));
        json::write(&folder.path().join(ROW), &row).map_err(|e| outputs::failed_write(&folder, e))?;
        folder.finish(None).map_err(outputs::unwritable)?;
        Ok(row)
    };
    // One scan must not end the work on all others, whatever is wrong.
    match catch_unwind(AssertUnwindSafe(work)) {
        _ if progress.cancelled() => Ok(None),
        Ok(Ok(row)) => Ok(Some(row)),
        // That is not the scan's fault: on a full disk, all others would have no result either.
        Ok(Err(error @ CommandError::Unwritable(_))) => Err(error),
        Ok(Err(error)) => failed(error.reason()),
        Err(_) => failed("an error in gmlc itself; its message is above".to_owned()),
    }
}

/// Fits, measures, and writes the documents into a folder.
fn documented(
    plan: &Plan<'_>,
    scan: &Scan,
    previous: Option<&Scan>,
    folder: &ResultFolder,
    progress: &dyn Progress,
) -> Result<Inspected, CommandError> {
    let Plan { args, subject, measure_options, .. } = plan;
    let scanned = scan::read(&scan.path, &args.reading.options(), progress).map_err(fit::unreadable)?;
    variance::require_what_scan_has(&scanned, measure_options)?;
    measure::require_memory(&args.variance, &scanned)?;
    let mut record = plan.record.clone();
    record::add_scan(&mut record, &scanned.source);
    let options = options(plan, previous);
    let scans = std::slice::from_ref(&scanned);
    let fitting = Fitting { subject, controls: &args.fit, search: &[], scans };
    let mut result = fitting.run(&options, progress)?.result;
    fit::unless_interrupted(&result)?;
    result.provenance = Some(record.clone());
    let inspecting = Inspecting {
        program: &subject.program,
        scan: &scanned,
        options: measure_options,
        controls: &args.variance,
        extent: args.documents,
        record: &record,
    };
    let inspection = inspecting.measure(result, progress)?;
    inspecting.write(&inspection, true, folder, progress)?;
    Ok(Inspected::of(&inspection.fit, &inspection.measurement.report))
}

/// The options of a fit that begins where that of another scan ended, if that can be relied on.
fn options(plan: &Plan<'_>, previous: Option<&Scan>) -> FitOptions {
    let mut options = plan.fit_options.clone();
    if let Some(earlier) = previous.and_then(|previous| end_of(plan, previous)) {
        options.earlier = Some(earlier);
    }
    options
}

/// Where the fit of a scan of this batch ended.
fn end_of(plan: &Plan<'_>, scan: &Scan) -> Option<EarlierFit> {
    ledger::done(plan, scan)?.sound()?;
    let saved = SavedFit::read(&ledger::folder_of(plan, scan).join(FIT)).ok()?;
    Some(saved.earlier(&plan.subject.program, &plan.subject.provenance))
}
