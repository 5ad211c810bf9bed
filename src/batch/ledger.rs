//! What of a batch is done: a row in the folder of each scan, written with its results.

use super::plan::{Plan, Scan};
use crate::error::CommandError;
use crate::outputs;
use gml_runtime::export::folder::{self, ROW};
use gml_runtime::export::json;
use gml_runtime::export::measurement::DISTANCES;
use gml_runtime::export::population::SCANS;
use gml_runtime::population::{Outcome, Row, SCHEMA};
use std::path::PathBuf;
use std::time::Instant;

/// The folder of a scan's results.
pub(super) fn folder_of(plan: &Plan<'_>, scan: &Scan) -> PathBuf {
    plan.args.output.join(SCANS).join(&scan.name)
}

/// The files of a result that the batch reads again.
const RESULTS: [&str; 2] = [folder::FIT, DISTANCES];

/// The row of a scan that is done; none if there is none, if it is of another scan, script or option, or if files of
/// the result are gone. What has failed is done, too, unless it is to be tried again.
pub(super) fn done(plan: &Plan<'_>, scan: &Scan) -> Option<Row> {
    let folder = folder_of(plan, scan);
    // A process may have been killed while it put the files into their place.
    folder::complete(&folder).ok()?;
    let text = std::fs::read_to_string(folder.join(ROW)).ok()?;
    let row: Row = serde_json::from_str(&text).ok()?;
    let of = if let Outcome::Copy { of } = &row.outcome { Some(of) } else { None };
    let is_same = row.schema == SCHEMA && row.key == scan.key && row.name == scan.name && of == scan.copy_of.as_ref();
    let again = plan.args.retry && row.failure().is_some();
    let is_whole = row.inspected().is_none() || RESULTS.iter().all(|file| folder.join(file).is_file());
    // The same file may have another path now.
    (is_same && !again && is_whole).then(|| Row { scan: scan.path.display().to_string(), ..row })
}

/// A row of a scan whose work began at a time.
pub(super) fn row(plan: &Plan<'_>, scan: &Scan, time: String, begun: Instant, outcome: Outcome) -> Row {
    Row {
        schema: SCHEMA,
        scan: scan.path.display().to_string(),
        name: scan.name.clone(),
        scan_sha256: scan.sha256.clone().unwrap_or_default(),
        key: scan.key.clone(),
        tool: plan.record.tool.clone(),
        time,
        seconds: begun.elapsed().as_secs_f64(),
        outcome,
    }
}

/// Keeps the row of a scan without a result, in the place of results that it may have had before.
pub(super) fn keep_without_result(plan: &Plan<'_>, scan: &Scan, row: &Row) -> Result<(), CommandError> {
    let folder = outputs::begin(&folder_of(plan, scan))?;
    json::write(&folder.path().join(ROW), row).map_err(|e| outputs::failed_write(&folder, e))?;
    folder.finish(None).map_err(outputs::unwritable)
}
