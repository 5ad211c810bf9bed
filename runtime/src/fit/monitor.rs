//! Observation of a running fit: progress, warnings, times, and the trace of its steps.

use super::plan::Stage;
use crate::progress::{Piece, Progress, Silent};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

/// The objective after a step of an optimiser.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TracePoint {
    /// The stage of the fit: `refine` (Gauss-Newton on some points, scale by scale) or `polish` (at the final scale).
    pub stage: &'static str,
    /// Evaluations of the objective so far, in all stages.
    pub evaluations: u64,
    /// Number of points that took part.
    pub points: usize,
    /// The scale of the loss. Millimetres.
    pub sigma: f64,
    /// Mean loss over these points.
    pub objective: f64,
    /// Fraction of these points with a loss below 1/2.
    pub inliers: f64,
}

/// Records of a fit so far.
pub(crate) struct Records {
    /// In the order of the steps.
    pub(crate) trace: Vec<TracePoint>,
    /// In the order in which they came.
    pub(crate) warnings: Vec<String>,
    /// By stage.
    pub(crate) seconds: BTreeMap<String, f64>,
}

/// Where a fit is.
#[derive(Default)]
struct Position {
    /// `stage 2 of 5: finding the pose`.
    stage: String,
    /// Where the stage begins and ends in the whole fit, between 0 and 1.
    range: (f64, f64),
    /// How much of the stage is done.
    done: f64,
}

/// The observer of a fit. Nothing in it affects the fit but `cancelled`.
pub(crate) struct Monitor<'a> {
    progress: &'a dyn Progress,
    stages: Vec<Stage>,
    position: Mutex<Position>,
    /// Evaluations of the objective.
    pub(crate) evaluations: AtomicU64,
    /// The scan is many times smaller or larger than the model where the fit began.
    pub(crate) out_of_proportion: AtomicBool,
    trace: Mutex<Vec<TracePoint>>,
    warnings: Mutex<Vec<String>>,
    seconds: Mutex<BTreeMap<String, f64>>,
}

impl Default for Monitor<'_> {
    fn default() -> Self {
        Self::of_stages(&Silent, Vec::new())
    }
}

impl<'a> Monitor<'a> {
    /// A monitor that reports the stages to `progress`.
    pub(crate) fn of_stages(progress: &'a dyn Progress, stages: Vec<Stage>) -> Self {
        Self {
            progress,
            stages,
            position: Mutex::default(),
            evaluations: AtomicU64::new(0),
            out_of_proportion: AtomicBool::new(false),
            trace: Mutex::default(),
            warnings: Mutex::default(),
            seconds: Mutex::default(),
        }
    }

    /// Whether the user wants the fit to end.
    pub(crate) fn cancelled(&self) -> bool {
        self.progress.cancelled()
    }

    /// Runs a stage and adds its time to those of its name.
    pub(crate) fn stage<T>(&self, name: &str, run: impl FnOnce() -> T) -> T {
        self.enter(name);
        let begin = Instant::now();
        let outcome = run();
        *lock(&self.seconds).entry(name.to_owned()).or_default() += begin.elapsed().as_secs_f64();
        outcome
    }

    /// Shows that a stage begins.
    fn enter(&self, name: &str) {
        let Some(n) = self.stages.iter().position(|stage| stage.name == name) else { return };
        let upto = |n: usize| self.stages[..n].iter().map(|stage| stage.share).sum::<f64>();
        let whole = upto(self.stages.len());
        *lock(&self.position) = Position {
            stage: format!("stage {} of {}: {}", n + 1, self.stages.len(), self.stages[n].words),
            range: (upto(n) / whole, upto(n + 1) / whole),
            done: 0.0,
        };
        self.reach(0.0, "");
    }

    /// Shows how much of the stage is done, between 0 and 1, with a phrase of figures, which may be empty.
    pub(crate) fn reach(&self, done: f64, detail: &str) {
        let mut position = lock(&self.position);
        position.done = position.done.max(done);
        let (from, to) = position.range;
        self.progress.report(&position.stage, from + position.done * (to - from), detail);
    }

    /// A fit within the present stage, as progress.
    pub(crate) fn piece(&self) -> Piece<'a> {
        let Position { stage, range, .. } = &*lock(&self.position);
        Piece { whole: self.progress, name: stage.clone(), range: *range }
    }

    /// Adds a sentence for the user.
    pub(crate) fn warn(&self, warning: impl Into<String>) {
        lock(&self.warnings).push(warning.into());
    }

    /// Runs something of which it is still open whether it counts. The second value are its sentences for the user.
    pub(crate) fn aside<T>(&self, run: impl FnOnce() -> T) -> (T, Vec<String>) {
        let before = std::mem::take(&mut *lock(&self.warnings));
        let outcome = run();
        let sentences = std::mem::replace(&mut *lock(&self.warnings), before);
        (outcome, sentences)
    }

    /// Adds a step to the trace and shows it.
    pub(crate) fn note(&self, point: TracePoint) {
        let TracePoint { stage, objective, sigma, inliers, .. } = &point;
        let shown = format!("{stage}: objective {objective:.4}, sigma {sigma:.3} mm, inliers {:.1} %", 100.0 * inliers);
        self.reach(0.0, &shown);
        lock(&self.trace).push(point);
    }

    /// Number of evaluations of the objective so far.
    pub(crate) fn evaluations(&self) -> u64 {
        self.evaluations.load(Ordering::Relaxed)
    }

    /// Adds evaluations that another monitor counted.
    pub(crate) fn count(&self, evaluations: u64) {
        self.evaluations.fetch_add(evaluations, Ordering::Relaxed);
    }

    /// The records so far.
    pub(crate) fn records(&self) -> Records {
        let (trace, warnings) = (lock(&self.trace).clone(), lock(&self.warnings).clone());
        Records { trace, warnings, seconds: lock(&self.seconds).clone() }
    }
}

/// A lock's value, also where a thread panicked that held it: records are whole after every statement.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
