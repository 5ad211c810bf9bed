//! Global registration: where the refinement begins. Orientations that cover all rotations, other shapes, restarts of
//! parameters that shape only some parts, and parameter symmetries.

pub(crate) mod area;
pub(crate) mod candidate;
mod distance_field;
pub(crate) mod group;
mod part_moments;
pub(crate) mod restart;
pub(crate) mod screening;
mod shape_proposals;
mod symmetry;

use super::options::FitError;
use super::problem::Problem;
use super::problem::level::Level;
use super::problem::parameterization::Estimate;
use super::tuning::{ANOTHER_UNIT, CLEARLY_BETTER};
use crate::scan::Unit;
use candidate::Candidate;
use std::sync::atomic::Ordering;

/// The start of the refinement.
pub(crate) struct Registration<'a> {
    pub(crate) level: Level<'a>,
    pub(crate) candidate: Candidate,
    pub(crate) seeds: Seeds,
    /// It was looked for in all orientations.
    pub(crate) searched: bool,
}

/// Values that parameters may well have.
#[derive(Clone, Debug)]
pub(crate) struct Seeds {
    /// The user's.
    pub(crate) start: Estimate,
    /// Those that decide between two names for the same surface: the start's if that is near, else the script's
    /// defaults.
    pub(crate) reference: Estimate,
}

/// Finds where to begin: near the start, or at the best of all orientations. Near starts that lead to nothing
/// convincing are given up where the pose may be searched.
///
/// # Errors
/// The model cannot be evaluated at the start.
pub(crate) fn register<'a>(problem: &'a Problem<'a>) -> Result<Registration<'a>, FitError> {
    let level = problem.start_level()?;
    warn_of_unit(problem, level.space.radius);
    let start = level.space.estimate(&problem.start.x, problem.start_motion());
    let names = problem.model.parameters();
    let given = |i: &usize| problem.options.start.contains_key(&names[*i].name);
    let searched = problem.pose.moving;
    let earlier = problem.options.earlier.is_some();
    let given_near = problem.options.no_pose || earlier || problem.rigid.indices.iter().any(given);
    let at_start = Seeds { start: start.clone(), reference: start };
    let mut near = None;
    if given_near || !searched {
        let (candidate, inlier_ratio) = screening::near(&level, &at_start, searched);
        if !searched || inlier_ratio > problem.convincing() {
            // Another scan's end has the right shape, but perhaps not the pose: one that is upside down may convince.
            let is_other = searched && earlier && problem.converged().is_none();
            let elsewhere = is_other.then(|| screening::of_known_shape(&level, &at_start)).flatten();
            let better = elsewhere.filter(|other| screening::is_clearly_better(&level, other, &candidate));
            let searched = better.is_some();
            let candidate = better.unwrap_or(candidate);
            return Ok(Registration { level, candidate, seeds: at_start, searched });
        }
        near = Some(candidate);
    }
    problem.monitor.reach(0.0, "screening orientations");
    // The shape of an earlier fit is as good as known, of a part of the same kind that lies elsewhere, too.
    if let Some(candidate) = earlier.then(|| screening::of_known_shape(&level, &at_start)).flatten() {
        return Ok(Registration { level, candidate, seeds: at_start, searched: true });
    }
    let anywhere = Seeds::far(&level);
    let far = screening::anywhere(&level, &anywhere, 0);
    let (candidate, seeds) = match (near, far) {
        (Some(near), Some(far)) if far.value < CLEARLY_BETTER * near.value => (far, anywhere),
        (None, Some(far)) => (far, anywhere),
        (Some(near), _) => (near, at_start),
        (None, None) => (Candidate::new(&level, anywhere.start), at_start),
    };
    Ok(Registration { level, candidate, seeds, searched: true })
}

/// Finds another place to begin, in all orientations, where those of earlier rounds led to a solution that the scan
/// contradicts; the first round is 0, and has other shapes to begin from than later ones. None where there is none.
pub(crate) fn register_again<'a>(problem: &'a Problem<'a>, round: usize) -> Option<Registration<'a>> {
    let level = problem.start_level().ok()?;
    let seeds = Seeds::far(&level);
    let candidate = screening::anywhere(&level, &seeds, round)?;
    Some(Registration { level, candidate, seeds, searched: true })
}

impl Seeds {
    /// The user's start and the script's defaults, for a search in all orientations.
    fn far(level: &Level) -> Self {
        let problem = level.problem;
        let start = level.space.estimate(&problem.start.x, problem.start_motion());
        let defaults: Vec<f64> = problem.model.parameters().iter().map(|p| p.default).collect();
        let reference = level.space.estimate(&defaults, start.motion);
        Self { start, reference }
    }
}

/// Warns where the scan's radius of gyration is out of all proportion to the model's (millimetres), and names the unit
/// of length that would make them alike.
pub(crate) fn warn_of_unit(problem: &Problem, model: f64) {
    let scan = problem.radius;
    let (ratio, word) = if scan < model { (model / scan, "smaller") } else { (scan / model, "larger") };
    if ratio > ANOTHER_UNIT {
        problem.monitor.out_of_proportion.store(true, Ordering::Relaxed);
        let advice = likely_unit(&problem.scan.source.unit, model / scan);
        problem
            .monitor
            .warn(format!("the scan is {ratio:.0} times {word} than the model where the fit began: {advice}"));
    }
}

/// The mend for a scan, read in a unit, that must be made larger by about `factor`.
fn likely_unit(unit: &str, factor: f64) -> String {
    let off = |other: f64| (factor / other).ln().abs();
    let present = unit.parse::<Unit>().unwrap_or_default().millimetres();
    let nearest = Unit::ALL.into_iter().min_by(|a, b| {
        let [a, b] = [a, b].map(|unit| off(unit.millimetres() / present));
        a.total_cmp(&b)
    });
    // Inches and millimetres are as often exchanged in one direction as in the other.
    let inverse = [1.0 / 25.4, 0.1, 1e-3].into_iter().min_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap_or(1.0);
    match nearest {
        Some(likely) if off(likely.millimetres() / present) <= off(inverse) => {
            format!("its unit of length is likely {likely} (--unit {likely}), not {unit}")
        }
        _ => format!(
            "its coordinates were likely multiplied by {} on their way, so divide them by that",
            (10.0 / inverse).round() / 10.0
        ),
    }
}
