//! Global registration: where the optimisation begins. Orientations that cover all rotations, other shapes, restarts of
//! parameters that shape only some parts, and parameter symmetries.

mod distance_field;
mod figure;
pub(crate) mod group;
pub(crate) mod proposals;
pub(crate) mod restart;
pub(crate) mod screening;
mod symmetry;

use super::options::FitError;
use super::problem::Problem;
use super::problem::isometry::Isometry;
use super::problem::level::Level;
use super::problem::parameterization::Estimate;
use restart::Seeds;
use screening::Candidate;

/// Where the refinement begins.
pub(crate) struct Registration<'a> {
    pub(crate) level: Level<'a>,
    pub(crate) candidate: Candidate,
    pub(crate) seeds: Seeds,
}

/// A fraction of inliers at the screening's scale that a wrong pose does not have.
const CONVINCING: f64 = 0.9;
/// Another pose must be better by this factor to be preferred to the one at the start.
const CLEARLY: f64 = 0.9;

/// Finds where to begin.
///
/// # Errors
/// The model cannot be evaluated at the start.
pub(crate) fn register<'a>(problem: &'a Problem<'a>) -> Result<Registration<'a>, FitError> {
    let level = problem.start_level()?;
    if let Some(doubt) = unit_doubt(level.space.radius, problem.radius) {
        problem.monitor.warn(doubt);
    }
    let start = level.space.estimate(&problem.start.x, Isometry::IDENTITY);
    let names = problem.model.parameters();
    let given = |i: &usize| problem.options.start.contains_key(&names[*i].name);
    let near = problem.options.no_pose || problem.rigid.indices.iter().any(given);
    let (candidate, reference) = begin(&level, &start, near, problem.pose.moving);
    Ok(Registration { level, candidate, seeds: Seeds { start, reference } })
}

/// Where the refinement begins: near the start, or at the best of all orientations; with the estimate that is the reference to
/// it (see `Seeds`). Near starts that lead to nothing convincing are given up where the pose may be searched.
fn begin(level: &Level, start: &Estimate, near: bool, searched: bool) -> (Candidate, Estimate) {
    let nearby = (near || !searched).then(|| screening::approach(level, start, searched));
    if let Some(found) = &nearby
        && (!searched || found.inliers > CONVINCING)
    {
        return (found.clone(), start.clone());
    }
    level.problem.monitor.progress.report("screening orientations", f64::NAN, "");
    let defaults = defaults(level, start);
    let elsewhere = screening::screen(level, start, &defaults);
    match (nearby, elsewhere) {
        (Some(near), Some(far)) if far.value < CLEARLY * near.value => (far, defaults),
        (Some(near), _) => (near, start.clone()),
        (None, Some(far)) => (far, defaults),
        (None, None) => (Candidate::new(level, start.clone()), start.clone()),
    }
}

/// The script's default shape where the start is.
fn defaults(level: &Level, start: &Estimate) -> Estimate {
    let defaults: Vec<f64> = level.problem.model.parameters().iter().map(|p| p.default).collect();
    level.space.estimate(&defaults, start.motion)
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
