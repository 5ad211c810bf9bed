//! `gmlc batch`: many scans of objects of one kind, each inspected, and what they say together.

mod crew;
mod given;
mod ledger;
mod plan;
mod shown;
mod task;

use crate::cli::BatchArgs;
use crate::error::CommandError;
use crate::{interrupt, outputs, record};
pub(crate) use crew::{Job, jobs, work_job};
use gml_runtime::export::image;
use gml_runtime::export::measurement::{DISTANCES, SAG};
use gml_runtime::export::population::{PAGE, PopulationDocuments, SCANS};
use gml_runtime::fit::placing_parameters;
use gml_runtime::population::{DeviationMap, Inspected, Movements, Row, Summary};
use gml_runtime::record::Record;
use gml_runtime::variance::without_sag;
pub(crate) use plan::{Plan, Scan};
use std::path::Path;

pub(crate) fn run(args: &BatchArgs) -> Result<(), CommandError> {
    if args.dask.is_some() {
        return Err(CommandError::usage(
            "--dask: this command is without Python; that of the package has it: pip install 'gmlc[dask]'",
        ));
    }
    let (plan, scans) = planned(args, record::of_process(&args.report, &args.script.model)?)?;
    // What is finished is kept, and told of.
    let _grace = interrupt::grace();
    let rows = crew::work(&plan, &scans)?;
    let finished: Vec<Row> = rows.iter().flatten().cloned().collect();
    let summary = document(&plan, &finished)?;
    if args.result.is_json() {
        outputs::print_json(&summary)?;
    }
    args.result.text(&shown::summary(&summary, &finished));
    outputs::wrote(&args.output.join(PAGE));
    let missing = rows.len() - finished.len();
    if missing > 0 {
        return Err(CommandError::Failed(format!(
            "interrupted: {missing} of {} scans are not done; the same command goes on with them",
            rows.len()
        )));
    }
    judge(&finished)
}

/// The plan of a batch, and its scans.
pub(crate) fn planned(args: &BatchArgs, record: Record) -> Result<(Plan<'_>, Vec<Scan>), CommandError> {
    if args.fit.trace.is_some() {
        return Err(CommandError::usage("--trace is for one scan: gmlc inspect writes it"));
    }
    let paths = given::scans(&args.scans, &args.list, &args.output)?;
    let plan = Plan::new(args, record)?;
    outputs::make_folder(&args.output.join(SCANS))?;
    let scans = plan.scans(&paths)?;
    Ok((plan, scans))
}

/// Writes the tables and the page.
fn document(plan: &Plan<'_>, rows: &[Row]) -> Result<Summary, CommandError> {
    let program = &plan.subject.program;
    let size = plan.texture.tessellation.mesh.bounds().diagonal();
    let placing = placing_parameters(program, &plan.start, size).unwrap_or_default();
    let movements = Movements::of(program, &plan.start).ok();
    let model = program.name().to_owned();
    let mut summary = Summary::of(&model, rows, &placing, movements.as_ref());
    if let Some(device) = plan.args.variance.device_uncertainty.filter(|device| *device > 0.0) {
        summary = summary.with_device_uncertainty(device);
    }
    let map = shared_deviations(&plan.args.output, rows, &mut summary.warnings);
    let origin = format!("Made by {} on {}.", plan.record.tool, plan.record.time);
    let documents = PopulationDocuments {
        rows,
        summary: &summary,
        map: map.as_ref().map(|map| (map, &*plan.texture)),
        origin: &origin,
    };
    documents.write(&plan.args.output).map_err(CommandError::failed)?;
    Ok(summary)
}

/// The deviations of all objects whose fit can be relied on, at the same places.
fn shared_deviations(output: &Path, rows: &[Row], warnings: &mut Vec<String>) -> Option<DeviationMap> {
    let mut map = DeviationMap::default();
    let mut unread = 0;
    let first = rows.iter().find_map(Row::sound)?;
    let is_alike = |i: &Inspected| i.inputs == first.inputs;
    for row in rows.iter().filter(|row| row.sound().is_some_and(is_alike)) {
        let added = deviations(&output.join(SCANS).join(&row.name)).is_some_and(|d| map.add(&d).is_ok());
        unread += usize::from(!added);
    }
    if unread > 0 {
        warnings.push(format!(
            "{DISTANCES} of {unread} scans cannot be read: the map of the mean deviation is without them"
        ));
    }
    (map.textures() > 1).then_some(map)
}

/// The deviations of one object, from the folder of its results: the distances without the sag of the scan's
/// triangles, which is much alike in all scans, so that no mean over scans is free of it. None if a file cannot be
/// read.
fn deviations(folder: &Path) -> Option<Vec<f32>> {
    let read = |name: &str| Some(image::read_tiff_f32(&std::fs::read(folder.join(name)).ok()?).ok()?.2);
    let mut distances = read(DISTANCES)?;
    // Of clouds there is none.
    if folder.join(SAG).is_file() {
        let sag = read(SAG)?;
        distances.iter_mut().zip(sag).for_each(|(distance, sag)| *distance = without_sag(*distance, sag));
    }
    Some(distances)
}

/// The exit status: of all scans the worst.
fn judge(rows: &[Row]) -> Result<(), CommandError> {
    let failed = rows.iter().filter(|row| row.failure().is_some()).count();
    if failed > 0 {
        let all = rows.len();
        return Err(CommandError::Failed(format!("{failed} of {all} scans have no result; --retry tries them again")));
    }
    let all = || rows.iter().filter_map(|row| Some((row, row.inspected()?)));
    let named = |verdict: &str| {
        let is = move |(_, i): &(&Row, &Inspected)| i.verdict.as_deref() == Some(verdict);
        all().filter(is).map(|(row, _)| format!("{verdict}: {}", row.name)).collect::<Vec<String>>()
    };
    let (beyond, undecided) = (named("does not conform"), named("undecided"));
    let unsound = rows.iter().filter(|row| row.sound().is_none()).count();
    if !beyond.is_empty() {
        return Err(CommandError::DoesNotConform(beyond));
    }
    if unsound > 0 {
        return Err(CommandError::Unreliable(format!("{unsound} of {} fits cannot be relied on", rows.len())));
    }
    if undecided.is_empty() { Ok(()) } else { Err(CommandError::Undecided(undecided)) }
}
