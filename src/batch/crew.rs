//! Several scans of a batch at once.

use super::plan::{Plan, Scan};
use super::{ledger, task};
use crate::cli::StartFrom;
use crate::error::CommandError;
use crate::interrupt;
use crate::progress::TerminalProgress;
use gml_runtime::population::Row;
use gml_runtime::progress::Progress;
use rayon::ThreadPoolBuilder;
use serde::{Deserialize, Serialize};
use std::num::NonZero;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::available_parallelism;

/// Scans in a row of which each fit begins where that before it ended: what came out does not depend on how many are
/// worked on at once, and an error does not go on for ever.
const CHAIN: usize = 16;

/// Does what is not done yet. Rows are in the order of the scans; none of those that an interruption left.
pub(super) fn work(plan: &Plan<'_>, scans: &[Scan]) -> Result<Vec<Option<Row>>, CommandError> {
    let rows: Vec<Option<Row>> = scans.iter().map(|scan| ledger::done(plan, scan)).collect();
    let done = rows.iter().flatten().count();
    if done > 0 {
        note!("{done} of {} scans are done", scans.len());
    }
    let processors = available_parallelism().map_or(1, NonZero::get);
    let pending = scans.len() - done;
    let jobs = plan.args.jobs.map_or(processors, |jobs| jobs as usize).clamp(1, pending.max(1));
    let crew = Crew {
        plan,
        scans,
        length: length(plan),
        next: AtomicUsize::new(0),
        shared: Mutex::new(Shared { rows, finished: 0, failed: 0, error: None }),
        progress: TerminalProgress::new(),
        pending,
        stop: interrupt::flag(),
    };
    // Processors that no scan has are used within those that there are.
    let threads = (processors / jobs).max(1);
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            let crew = &crew;
            let name = "scan".to_owned();
            let spawned =
                std::thread::Builder::new().name(name).stack_size(STACK).spawn_scoped(scope, move || crew.run(threads));
            if let Err(error) = spawned {
                crew.fail(CommandError::failed(error));
            }
        }
    });
    crew.progress.finish();
    let shared = crew.shared.into_inner().unwrap_or_else(PoisonError::into_inner);
    shared.error.map_or(Ok(shared.rows), Err)
}

/// Scans that one worker does in their order, the first of which begins at the defaults.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Job {
    scans: Vec<Scan>,
}

/// The number of scans in a job.
fn length(plan: &Plan<'_>) -> usize {
    if plan.args.start_from == StartFrom::Previous { CHAIN } else { 1 }
}

/// The jobs with a scan that is not done, by absolute paths, and the number of scans that are done.
pub(crate) fn jobs(plan: &Plan<'_>, scans: &[Scan]) -> Result<(Vec<Job>, usize), CommandError> {
    let is_done: Vec<bool> = scans.iter().map(|scan| ledger::done(plan, scan).is_some()).collect();
    let absolute = |scan: &Scan| {
        let path = std::path::absolute(&scan.path).map_err(CommandError::failed)?;
        Ok(Scan { path, ..scan.clone() })
    };
    let length = length(plan);
    let pending = scans.chunks(length).zip(is_done.chunks(length)).filter(|(_, done)| done.contains(&false));
    let job = |(scans, _): (&[Scan], &[bool])| {
        Ok(Job { scans: scans.iter().map(absolute).collect::<Result<_, CommandError>>()? })
    };
    let jobs = pending.map(job).collect::<Result<Vec<Job>, CommandError>>()?;
    Ok((jobs, is_done.iter().filter(|done| **done).count()))
}

/// Does what of a job is not done. Returns the names of its scans, and whether each has a result.
pub(crate) fn work_job(
    plan: &Plan<'_>,
    job: &Job,
    progress: &dyn Progress,
) -> Result<Vec<(String, bool)>, CommandError> {
    let mut names = Vec::new();
    for (at, scan) in job.scans.iter().enumerate() {
        let row = match ledger::done(plan, scan) {
            Some(row) => Some(row),
            None => task::inspect(plan, scan, at.checked_sub(1).map(|before| &job.scans[before]), progress)?,
        };
        let Some(row) = row else { return Err(CommandError::interrupted()) };
        names.push((row.name.clone(), row.failure().is_none()));
    }
    Ok(names)
}

/// As much as the main thread of most systems has.
const STACK: usize = 8 << 20;

struct Crew<'a> {
    plan: &'a Plan<'a>,
    scans: &'a [Scan],
    /// Scans that one worker does in their order.
    length: usize,
    /// The first scan of the next such run.
    next: AtomicUsize,
    shared: Mutex<Shared>,
    progress: TerminalProgress,
    /// Scans that were not done at the beginning.
    pending: usize,
    stop: Arc<AtomicBool>,
}

struct Shared {
    rows: Vec<Option<Row>>,
    finished: usize,
    failed: usize,
    /// Why the work cannot go on: results cannot be written.
    error: Option<CommandError>,
}

impl Crew<'_> {
    /// Takes runs of scans until there are none.
    fn run(&self, threads: usize) {
        let pool = match ThreadPoolBuilder::new().num_threads(threads).build() {
            Ok(pool) => pool,
            Err(error) => return self.fail(CommandError::failed(error)),
        };
        loop {
            let first = self.next.fetch_add(self.length, Ordering::Relaxed);
            if first >= self.scans.len() || self.is_over() {
                return;
            }
            for at in first..(first + self.length).min(self.scans.len()) {
                if self.is_over() {
                    return;
                }
                if self.lock().rows[at].is_some() {
                    continue;
                }
                let previous = (at > first).then(|| &self.scans[at - 1]);
                let watch = Watch { stop: &self.stop };
                match pool.install(|| task::inspect(self.plan, &self.scans[at], previous, &watch)) {
                    Ok(Some(row)) => self.keep(at, row),
                    Ok(None) => return,
                    Err(error) => return self.fail(error),
                }
            }
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.lock().error.is_some()
    }

    fn fail(&self, error: CommandError) {
        self.lock().error.get_or_insert(error);
    }

    fn keep(&self, at: usize, row: Row) {
        let mut shared = self.lock();
        shared.finished += 1;
        shared.failed += usize::from(row.failure().is_some());
        let Shared { finished, failed, .. } = *shared;
        let failures = if failed > 0 { format!(", {failed} without a result") } else { String::new() };
        let detail = format!("{finished} of {}{failures}; {}", self.pending, row.name);
        shared.rows[at] = Some(row);
        // Under the lock: reports come one at a time.
        self.progress.report("inspecting", finished as f64 / self.pending.max(1) as f64, &detail);
    }
}

/// Says nothing, and asks whether the user wants the work to end.
struct Watch<'a> {
    stop: &'a AtomicBool,
}

impl Progress for Watch<'_> {
    fn report(&self, _stage: &str, _done: f64, _detail: &str) {}

    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
