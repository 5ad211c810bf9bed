//! The fit as a whole: the pose is recognised, orientations are screened, and the best candidate is taken to the optimum.

use super::bootstrap;
use super::frame::Frame;
use super::hypothesis;
use super::motion::Motion;
use super::options::{FitError, FitOptions, Start};
use super::points::Points;
use super::pose;
use super::report::{self, Outcome};
use super::restart::Known;
use super::result::FitResult;
use super::screening::{self, Candidate};
use super::setting::Setting;
use super::space::Estimate;
use super::unshown;
use crate::model::Model;
use crate::progress::Progress;
use crate::scan::Scan;
use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;
use std::time::Instant;

/// A fraction of inliers at the screening's scale that a wrong pose does not have.
const CONVINCING: f64 = 0.9;
/// Another pose must be better by this factor to be preferred to the one at the start.
const CLEARLY: f64 = 0.9;

/// Fits a model to a scan. The scan's frame is the script's: a script with pose parameters gets them, one without gets a
/// pose beside its parameters.
///
/// # Errors
/// Options that name what is not there, a scan or a model with nothing in it, or a model that cannot be evaluated where the
/// fit begins. A fit that finds nothing convincing is not an error: `inliers`, `converged` and `warnings` say so. One that
/// `progress` cancels ends soon with the best so far, marked as `interrupted`.
pub fn fit(
    model: &dyn Model,
    scan: &Scan,
    options: &FitOptions,
    progress: &dyn Progress,
) -> Result<FitResult, FitError> {
    let mut clock = Clock::default();
    let Start { x, fixed, ties } = options.resolve(model)?;
    if model.parts().is_empty() {
        return Err(FitError::EmptyModel);
    }
    progress.report("preparing", f64::NAN, "");
    let points = Points::of(scan);
    // Clutter has no say in where the object is and how large.
    let surfaces = points.on_surfaces(scan);
    let radius = surfaces.gyration();
    if points.len() < 4 || !(radius > 0.0) {
        return Err(FitError::EmptyScan { points: points.len() });
    }
    let rigid = pose::recognise(model, &x, radius)?;
    let bound: Vec<bool> = (0..x.len()).map(|i| fixed[i] || ties.iter().any(|(a, b)| *a == i || *b == i)).collect();
    let following = |i: &usize| ties.iter().any(|(_, b)| b == i);
    let frame = Frame::choose(model, options, &rigid, &bound);
    let evaluations = AtomicU64::new(0);
    let free = frame.free(&fixed).into_iter().filter(|i| !following(i)).collect();
    let mut setting = Setting::new(model, (&points, &surfaces), &x, (free, &ties), frame.moving, radius, &evaluations)?;
    setting.progress = progress;
    setting.oriented &= scan.oriented && !options.ignore_normals;
    setting.seed = options.seed;
    let size = setting.space.radius;
    clock.lap("prepare");

    let start = setting.space.estimate(&x, Motion::IDENTITY);
    let near =
        options.no_pose || rigid.indices.iter().any(|i| options.start.contains_key(&model.parameters()[*i].name));
    let mut iterations = 0;
    let (begin, home) = setting.begin(&start, near, frame.moving && !options.no_pose);
    clock.lap("screen");
    progress.report("fitting", f64::NAN, "");
    let mut last = setting.descend(
        begin,
        Known { start: &start, home: &home },
        scan.noise,
        options,
        frame.write_back,
        &mut iterations,
    );
    clock.lap("fit");

    let mut warnings = frame.warnings;
    warnings.extend(unit_doubt(size, radius));
    if frame.write_back {
        last = setting.written_back(last, &rigid, &fixed, &mut iterations, &mut warnings);
    }
    clock.lap("finish");
    if options.coverage && !setting.progress.cancelled() {
        last = setting.cover(last, scan, &mut iterations, &mut warnings);
        clock.lap("coverage");
    }
    let tests = hypothesis::test(&setting, &last, options, &fixed, &mut warnings);
    // Whoever does not want to wait any longer gets no standard deviations.
    let mut uncertainty = if progress.cancelled() { None } else { setting.uncertainty(&last) };
    if let Some(uncertainty) = &mut uncertainty {
        unshown::mark(&setting, &last, uncertainty, &mut warnings);
    }
    clock.lap("uncertainty");
    let bootstrap = bootstrap::run(&setting, &last, uncertainty.as_ref(), options.bootstrap);
    if options.bootstrap > 0 {
        clock.lap("bootstrap");
    }
    Ok(report::result(
        &setting,
        scan,
        Outcome {
            last,
            uncertainty,
            tests,
            bootstrap,
            fixed,
            rigid,
            iterations,
            warnings,
            seconds: clock.laps,
            report_pose: frame.report_pose,
        },
    ))
}

impl Setting<'_> {
    /// Where the descent begins: what lies near the start, or the best of all orientations; with the estimate that is home to
    /// it (see `Known`). Near starts that lead to nothing convincing are given up where the pose may be searched.
    fn begin(&self, start: &Estimate, near: bool, searched: bool) -> (Candidate, Estimate) {
        let nearby = (near || !searched).then(|| screening::approach(self, start, searched));
        if let Some(found) = &nearby
            && (!searched || found.inliers > CONVINCING)
        {
            return (found.clone(), start.clone());
        }
        self.progress.report("screening orientations", f64::NAN, "");
        let defaults = self.defaults(start);
        let elsewhere = screening::screen(self, start, &defaults);
        match (nearby, elsewhere) {
            (Some(near), Some(far)) if far.value < CLEARLY * near.value => (far, defaults),
            (Some(near), _) => (near, start.clone()),
            (None, Some(far)) => (far, defaults),
            (None, None) => (Candidate::new(self, start.clone()), start.clone()),
        }
    }

    /// The script's default shape where the start is.
    fn defaults(&self, start: &Estimate) -> Estimate {
        let defaults: Vec<f64> = self.model.parameters().iter().map(|p| p.default).collect();
        self.space.estimate(&defaults, start.motion)
    }
}

/// A scan so many times larger or smaller than the model at its start was hardly read in its unit: 25.4 of inches is the least.
const ANOTHER_UNIT: f64 = 15.0;

/// A sentence where a scan of one radius of gyration is out of all proportion to a model of another one (millimetres).
fn unit_doubt(model: f64, scan: f64) -> Option<String> {
    let (ratio, word) = if scan < model { (model / scan, "smaller") } else { (scan / model, "larger") };
    (ratio > ANOTHER_UNIT).then(|| {
        format!("the scan is {ratio:.0} times {word} than the model where the fit began: is its unit of length right (--unit m, cm or in)?")
    })
}

/// Times by stage. They are reported and decide nothing.
struct Clock {
    last: Instant,
    laps: BTreeMap<String, f64>,
}

impl Default for Clock {
    fn default() -> Self {
        Self { last: Instant::now(), laps: BTreeMap::new() }
    }
}

impl Clock {
    fn lap(&mut self, stage: &str) {
        *self.laps.entry(stage.to_owned()).or_default() += self.last.elapsed().as_secs_f64();
        self.last = Instant::now();
    }
}
