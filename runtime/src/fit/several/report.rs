//! The result of a fit of several scans.

use super::apart::Apart;
use super::{SeveralFit, Whole, carried};
use crate::fit::attempt::explained;
use crate::fit::infer::joint::JointUncertainty;
use crate::fit::infer::sandwich::Uncertainty;
use crate::fit::infer::{Inference, conclude_several, pose};
use crate::fit::optimise::joint::motion_of;
use crate::fit::options::FitError;
use crate::fit::problem::Problem;
use crate::fit::problem::level::Level;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Evaluation, Objective, Order, foot_cache};
use crate::fit::problem::parameterization::Estimate;
use crate::fit::refine::joint::{Joint, near_scale};
use crate::fit::refine::schedule::{Solution, foot_tolerance};
use crate::fit::report;
use crate::fit::result::{Agreement, FitResult, FittedScan, ShapeDifference};
use crate::fit::room::shown_to;
use crate::fit::tuning::{CHORD, CONVINCING, DIFFERENCES_NAMED, EXPLAINED, LEFT_BY_ALL, NAMED};
use crate::model::EvaluationError;
use crate::scan::Scan;
use gml_compiler::program::Quantity;
use nalgebra::DVector;

/// The result. What a fit of one scan says of its solution is said of all scans merged.
pub(super) fn result(
    whole: &Whole,
    joint: &Joint,
    of: &[Solution],
    uncertainty: Option<JointUncertainty>,
    apart: Vec<Apart>,
) -> Result<SeveralFit, FitError> {
    let Whole { model, scans, options, monitor, .. } = whole;
    let scan = super::merged(scans, &joint.estimate.motions);
    // The sentences of the merged problem are those of its scans.
    let problem = Problem::one_of_several(*model, &scan, options, monitor)?;
    let (mut solution, open) = (merged_solution(&problem, joint, of)?, uncertainty.as_ref());
    let mut first = open.map(|all| Uncertainty { undetermined: of_first(joint, all), ..all.of_scans[0].clone() });
    if let Some(uncertainty) = first.take() {
        let (settled, uncertainty) = conclude_several(solution, uncertainty);
        solution = settled;
        // Sentences on the pose are those of each scan.
        first = Some(Uncertainty { undetermined: Vec::new(), ..uncertainty });
    }
    solution.converged = joint.converged || open.is_some_and(JointUncertainty::is_held);
    if let Some(all) = open.filter(|all| !all.is_held()) {
        solution.converged = false;
        monitor.warn(format!(
            "the fit of all scans stopped short of the optimum, by {:.2} standard deviations",
            all.remaining
        ));
    }
    let chosen = first.as_ref().map(|u| report::determined(&solution, u)).unwrap_or_default();
    let motions = carried(&joint.estimate.motions, solution.estimate.motion);
    let near = joint.near();
    let mut fitted = Vec::new();
    for ((n, one), apart) in of.iter().enumerate().zip(apart) {
        let at = Solution { estimate: Estimate { motion: motions[n], ..solution.estimate.clone() }, ..one.clone() };
        let (name, uncertainty) = (name(whole, n), open.map(|all| &all.of_scans[n]));
        let foreign = is_foreign(inliers(&at), near[n], &apart);
        // Of two that do not agree with each other one sentence says it.
        let is_said = scans.len() > 2 || n > 0;
        warn_of_scan(whole, &name, &Said { near: near[n], foreign, is_said, apart: &apart }, &at);
        for sentence in uncertainty.map(|uncertainty| pose::undetermined(&at, uncertainty)).unwrap_or_default() {
            monitor.warn(format!("{name}: {sentence}"));
        }
        fitted.push(FittedScan {
            source: scans[n].source.clone(),
            pose: motions[n].into(),
            pose_covariance: uncertainty.and_then(|u| pose::joint(&at, u, &chosen)),
            inliers: inliers(&at),
            rms: at.evaluation.rms(),
            sigma: at.loss.sigma,
            noise: scans[n].noise,
            agreement: apart.agreement,
            foreign,
        });
    }
    if let Some(all) = open {
        all.common.iter().filter_map(|direction| common(whole, joint, direction)).for_each(|s| monitor.warn(s));
    }
    let inference = Inference { solution, uncertainty: first, tests: Vec::new(), bootstrap: None, rivals: Vec::new() };
    let fit = explained(inference).result;
    let shares = joint.shares();
    let mean =
        |value: &dyn Fn(&FittedScan) -> f64| fitted.iter().zip(&shares).map(|(one, share)| share * value(one)).sum();
    let inliers: f64 = mean(&|one| one.inliers);
    let squares: f64 = mean(&|one| one.inliers * one.rms * one.rms);
    let fit = FitResult {
        pose_covariance: fitted[0].pose_covariance.clone(),
        objective: of.iter().zip(&shares).map(|(one, share)| share * one.evaluation.value).sum(),
        inliers: inliers.min(1.0),
        rms: (squares / inliers.max(f64::MIN_POSITIVE)).sqrt(),
        scans: fitted,
        ..fit
    };
    Ok(SeveralFit { fit, scan })
}

/// The joint solution as one of the merged scan, at the widest of the scales.
fn merged_solution<'a>(
    problem: &'a Problem<'a>,
    joint: &Joint,
    of: &[Solution],
) -> Result<Solution<'a>, EvaluationError> {
    let estimate = joint.estimate.of(0);
    let base = problem.start_level().map_err(|_| EvaluationError::new("the model cannot be evaluated at the start"))?;
    let own = Level::new(problem, base.space.clone(), &estimate, CHORD)?;
    let mut space = own.space.clone();
    space.copy_scale(&joint.members[0].level.space);
    let level = Level { space, ..own };
    let sigma = of.iter().map(|one| one.loss.sigma).fold(0.0, f64::max);
    let loss = Loss { sigma, ..of[0].loss };
    let signs = of[0].signs.clone();
    let cache = foot_cache(&problem.points, sigma);
    let objective = Objective {
        signs: Some(&signs),
        tolerance: foot_tolerance(loss, problem.radius),
        cache: Some(cache.clone()),
        curved: true,
        cancellable: false,
        ..level.objective(&problem.points, loss)
    };
    let evaluation = objective.evaluate(&estimate, Order::Normal).unwrap_or_else(|| Evaluation::absent(&level.space));
    drop(objective);
    let (converged, iterations, apart_at) = (joint.converged, joint.iterations, None);
    Ok(Solution { level, estimate, evaluation, loss, signs, converged, cache, iterations, apart_at })
}

/// The undetermined directions of the shape and the first scan's motion in which no other motion takes part.
fn of_first(joint: &Joint, all: &JointUncertainty) -> Vec<DVector<f64>> {
    let free = joint.free();
    let own = |direction: &DVector<f64>| direction.rows(0, free + 6).into_owned();
    let alone = all.common.iter().filter(|d| d.rows(free + 6, d.len() - free - 6).amax() <= NAMED * d.amax());
    all.of_scans[0].undetermined.iter().cloned().chain(alone.map(own)).collect()
}

fn inliers(solution: &Solution) -> f64 {
    (solution.evaluation.inliers() / solution.level.problem.points.weight()).min(1.0)
}

/// The name of a scan's file; its number where it has none, or another scan has the same.
fn name(whole: &Whole, scan: usize) -> String {
    let path = |scan: &Scan| scan.source.path.clone();
    let own = path(&whole.scans[scan]);
    let is_unique = whole.scans.iter().filter(|other| path(other) == own).count() == 1;
    if own.is_empty() || !is_unique { format!("scan {}", scan + 1) } else { own }
}

/// Whether a scan may be of another object: the shape of all explains little of it, and one of its own more. What
/// neither explains is other things that it shows, as long as it is less than half.
fn is_foreign(share: f64, near: f64, apart: &Apart) -> bool {
    let [by_all, by_own] = apart.explained.unwrap_or([0.0, 1.0]);
    let agrees = apart.agreement.as_ref().map(|agreement| agreement.agrees);
    let is_clutter = by_own - by_all <= LEFT_BY_ALL && agrees != Some(false) && share >= EXPLAINED;
    // The shape of all may be that of another scan, which does not agree with this one and the rest.
    let is_of_rest = agrees == Some(true) && by_own > CONVINCING;
    (!(share >= EXPLAINED) || !(near > CONVINCING)) && !is_clutter && !is_of_rest
}

/// What is to be said of a scan.
struct Said<'a> {
    /// The share of points, chosen evenly in space, that are near the model.
    near: f64,
    foreign: bool,
    /// That it does not agree with the others is said here.
    is_said: bool,
    apart: &'a Apart,
}

/// Sentences on whether one of the scans shows the shape of all.
fn warn_of_scan(whole: &Whole, name: &str, said: &Said, at: &Solution) {
    let Said { near, foreign, is_said, apart } = said;
    let (monitor, scale) = (whole.monitor, near_scale(at.level.problem, at.loss));
    let share = 100.0 * inliers(at);
    // The two shares are of different points: where a scan is dense, many of the first are on a small area.
    let evenly = format!(
        "of points chosen evenly in space {:.0} % lie within {:.2} mm",
        100.0 * near,
        Loss::welsch(scale).half()
    );
    if *foreign {
        monitor.warn(format!(
            "{name} may be of another object, or in the wrong place: {share:.0} % of its points lie within {:.3} mm of \
             the model that explains the others; {evenly}",
            at.loss.half(),
        ));
    } else if !(*near > CONVINCING) {
        monitor.warn(format!(
            "{name} shows more than the object, which no other shape explains either (other things, or what the script \
             does not have): {evenly} of the model"
        ));
    }
    let disagrees = apart.agreement.as_ref().filter(|a| *is_said && !a.agrees);
    // Parameters of an object that no shape of the model explains say nothing.
    let is_of_family = apart.explained.is_some_and(|[_, by_own]| by_own > CONVINCING);
    if let Some(agreement) = disagrees.filter(|_| !foreign || is_of_family) {
        monitor.warn(disagreement(whole, name, agreement, apart.explained));
    }
}

/// A sentence on a scan that does not agree with the others on the shape.
fn disagreement(whole: &Whole, name: &str, agreement: &Agreement, explained: Option<[f64; 2]>) -> String {
    let parameters = whole.model.parameters();
    let told = |difference: &ShapeDifference| {
        let quantity = parameters.iter().find(|p| p.name == difference.name).map_or(Quantity::Real, |p| p.quantity);
        let shown =
            |value: f64, sd: f64| format!("{} +- {}", shown_to(value, sd, quantity), shown_to(sd, sd, quantity));
        let (here, there) = (shown(difference.value, difference.sd), shown(difference.others, difference.others_sd));
        format!("`{}` is {here} by this scan alone, and {there} by the others", difference.name)
    };
    let mut all: Vec<String> = agreement.differences.iter().take(DIFFERENCES_NAMED).map(told).collect();
    let more = agreement.differences.len() - all.len();
    if more > 0 {
        all.push(format!("{more} more differ"));
    }
    let which = match all.is_empty() {
        true if agreement.degrees == 0 => "no parameter can be compared".to_owned(),
        true => "no parameter differs clearly by itself, all of them together do".to_owned(),
        false => all.join("; "),
    };
    let shares = explained.map(|shares| shares.map(|share| 100.0 * share));
    let told = match shares {
        Some([by_all, by_own]) if by_own - by_all > 100.0 * LEFT_BY_ALL => {
            format!("; the shape of all explains {by_all:.1} % of it, a shape of its own {by_own:.1} %")
        }
        _ => String::new(),
    };
    format!(
        "{name} does not agree with the other scans on the shape (p = {:.1e}): {which}{told}. It may be of another \
         object, or the object has changed, or the model's family does not have its shape",
        agreement.p
    )
}

/// A sentence on a change of the shape and of poses that leaves every distance as it is.
fn common(whole: &Whole, joint: &Joint, direction: &DVector<f64>) -> Option<String> {
    let space = &joint.members[0].level.space;
    let free = joint.free();
    let largest = direction.amax();
    let changes = space.free.iter().zip(direction.iter()).filter(|(_, s)| s.abs() > NAMED * largest);
    let changes: Vec<String> =
        changes.map(|(i, s)| format!("{:+.2} `{}`", s / largest, whole.model.parameters()[*i].name)).collect();
    let moves = |scan: &usize| motion_of(free, *scan).any(|k| direction[k].abs() > NAMED * largest);
    let moved: Vec<String> = (0..joint.members.len()).filter(moves).map(|scan| name(whole, scan)).collect();
    match (changes.is_empty(), moved.is_empty()) {
        (true, _) => None,
        (false, true) => Some(format!(
            "the scans do not determine the combination {} (in millimetres of surface moved): it leaves every distance \
             as it is",
            changes.join(" ")
        )),
        (false, false) => Some(format!(
            "the scans do not determine a common change of {} and of the pose in {}: they have nothing in common that \
             holds the two together",
            changes.join(" "),
            moved.join(", ")
        )),
    }
}
