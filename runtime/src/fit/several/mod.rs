//! One object in several scans: one shape, and a pose in each, all solved together. The model registers the scans,
//! which need not overlap (docs/decisions/0062-several-scans.md).

mod apart;
mod copies;
mod merge;
mod place;
mod report;

use super::infer::joint::{JointUncertainty, assess};
use super::measures;
use super::monitor::Monitor;
use super::optimise::joint::JointEstimate;
use super::options::{EarlierFit, FitError, FitOptions};
use super::plan;
use super::problem::Problem;
use super::problem::isometry::Isometry;
use super::problem::level::Level;
use super::problem::loss::Loss;
use super::problem::parameterization::Estimate;
use super::refine::joint::Joint;
use super::refine::schedule::{POLISH, Solution};
use super::refine::solve::solve;
use super::register::warn_of_unit;
use super::result::FitResult;
use super::tuning::{CONVINCING, LEADERS, SEARCHES};
use crate::model::Model;
use crate::progress::Progress;
use crate::scan::Scan;
pub use copies::copied;
pub use merge::in_first_frame;
use merge::merged;

/// The fit of one object to several scans.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct SeveralFit {
    /// The fit; `pose` and all places are in the frame of the first scan.
    pub fit: FitResult,
    /// All scans as one, in that frame.
    pub scan: Scan,
}

/// Fits a model to several scans of one object: its parameters are common to all, and its pose is another one in each.
/// The poses are beside the script's parameters, of which those that move the whole model keep their start values.
///
/// # Errors
/// Those of [`crate::fit::fit()`]; options that several scans have no use for.
///
/// # Panics
/// If there are no scans.
pub fn fit_several(
    model: &dyn Model,
    scans: &[Scan],
    options: &FitOptions,
    progress: &dyn Progress,
) -> Result<SeveralFit, FitError> {
    if let [scan] = scans {
        return Ok(SeveralFit { fit: super::fit(model, scan, options, progress)?, scan: scan.clone() });
    }
    refuse(options)?;
    let monitor = Monitor::of_stages(progress, plan::several());
    let prepared = scans.iter().map(|scan| Problem::one_of_several(model, scan, options, &monitor));
    let problems = monitor.stage("prepare", || prepared.collect::<Result<Vec<Problem>, FitError>>())?;
    warn(&problems, &monitor);
    let whole = Whole { model, scans, options, monitor: &monitor, problems: problems.iter().collect() };
    let joint = whole.solve()?;
    let mut several = whole.concluded(joint)?;
    several.fit.measures = several.fit.measured(model, &measures::nominal(model, options));
    several.fit.seconds = monitor.records().seconds;
    Ok(several)
}

/// Refuses options that several scans have no use for.
fn refuse(options: &FitOptions) -> Result<(), FitError> {
    let refuse = |why| Err(FitError::Several(why));
    if options.no_pose {
        return refuse(
            "each has a pose of its own: --no-pose is for scans in one frame, which --same-pose takes for one",
        );
    }
    if options.coverage {
        return refuse("there is no --coverage: it holds the model's ends to those of one scan (--same-pose)");
    }
    if options.bootstrap > 0 {
        return refuse("there is no --bootstrap: it draws from the points of one scan (--same-pose)");
    }
    Ok(())
}

/// Sentences on all scans before they are fitted.
fn warn(problems: &[Problem], monitor: &Monitor) {
    let first = &problems[0];
    if !first.rigid.indices.is_empty() {
        let name = |i: &usize| format!("`{}`", first.model.parameters()[*i].name);
        let names: Vec<String> = first.rigid.indices.iter().map(name).collect();
        monitor.warn(format!(
            "{} move the whole model: they keep their start values, and the pose in each scan is reported beside the \
             parameters",
            names.join(", ")
        ));
    }
    let held = |name: &&String| first.options.start.contains_key(*name);
    if first.options.fixed.iter().any(|name| held(&name)) {
        monitor.warn("whether the scans contradict the fixed values was not tested: that is done for one scan only");
    }
}

/// A fit of several scans.
struct Whole<'a> {
    model: &'a dyn Model,
    scans: &'a [Scan],
    options: &'a FitOptions,
    monitor: &'a Monitor<'a>,
    problems: Vec<&'a Problem<'a>>,
}

/// A shape with a pose, and where it came from.
struct Found {
    x: Vec<f64>,
    motion: Isometry,
}

impl<'a> Whole<'a> {
    /// The loss that the user wants.
    fn given(&self) -> Option<Loss> {
        self.options.sigma.map(|sigma| Loss { kind: self.options.loss, sigma })
    }

    /// The optimum over all scans.
    fn solve(&self) -> Result<Joint<'a>, FitError> {
        let base = self.problems[0].start_level()?;
        self.problems.iter().for_each(|problem| warn_of_unit(problem, base.space.radius));
        let monitor = self.monitor;
        let annealed = match self.earlier(&base)? {
            Some(joint) => monitor.stage("all scans", || joint.anneal(self.given())),
            None => self.registered(&base)?,
        };
        let better = self.better(&base, annealed)?;
        Ok(monitor.stage("all scans", || better.polish(1.0, Some(POLISH))))
    }

    /// The poses of an earlier fit of the same scans, if they explain them still.
    fn earlier(&self, base: &Level<'a>) -> Result<Option<Joint<'a>>, FitError> {
        let poses = self.options.earlier.as_ref().map_or(&[][..], |earlier| &earlier.scans);
        if poses.len() != self.scans.len() {
            return Ok(None);
        }
        let z = base.space.estimate(&self.problems[0].start.x, Isometry::IDENTITY).z;
        let motions = poses.iter().map(|pose| Isometry::from(*pose)).collect();
        let joint = Joint::new(&self.problems, base, JointEstimate { z, motions })?;
        Ok(is_convincing(&joint).then_some(joint))
    }

    /// All scans registered, at the final scales: one is fitted alone, and the others are placed on its shape one after
    /// another. If that does not explain all of them, another one begins.
    fn registered(&self, base: &Level<'a>) -> Result<Joint<'a>, FitError> {
        let mut order: Vec<usize> = (0..self.problems.len()).collect();
        // The largest one shows most of the object.
        order.sort_by(|a, b| self.problems[*b].radius.total_cmp(&self.problems[*a].radius));
        let mut best: Option<Joint<'a>> = None;
        // A part of an object may be that of another shape: another search of it may begin elsewhere.
        let searches = (0..SEARCHES).flat_map(|search| order.iter().take(LEADERS).map(move |leader| (search, leader)));
        for (search, leader) in searches {
            if best.is_some() && self.monitor.cancelled() {
                break;
            }
            let first = self.monitor.stage("first scan", || self.alone(*leader, search))?;
            let others: Vec<usize> = order.iter().copied().filter(|scan| scan != leader).collect();
            let joint = self.monitor.stage("placing", || self.placed(base, *leader, first, &others))?;
            let near = is_convincing(&joint);
            let joint = self.monitor.stage("all scans", || joint.anneal(self.given()));
            // A part that is wrong by less than the scale of a registration is far off at the final one.
            if near && explains_all(&joint) {
                return Ok(joint);
            }
            best = Some(match best {
                Some(best) => better_of(best, joint, 1.0),
                None => joint,
            });
        }
        // There are two scans or more.
        best.ok_or(FitError::EmptyScan { scan: String::new(), points: 0 })
    }

    /// A fit of one of the scans alone, in one search of several.
    fn alone(&self, scan: usize, search: u64) -> Result<Found, FitError> {
        let seed = self.options.seed.wrapping_add(search);
        self.solved(&self.scans[scan], &FitOptions { seed, ..self.options.clone() })
    }

    /// A fit of a scan by itself, of which only the place counts.
    fn solved(&self, scan: &Scan, options: &FitOptions) -> Result<Found, FitError> {
        let piece = self.monitor.piece();
        let monitor = Monitor::of_stages(&piece, plan::to_solution(options));
        let problem = Problem::one_of_several(self.model, scan, options, &monitor)?;
        let Solution { level, estimate, .. } = solve(&problem)?;
        self.monitor.count(monitor.evaluations());
        let x = level.space.x(&estimate.z).unwrap_or_else(|| problem.start.x.clone());
        Ok(Found { x, motion: estimate.motion })
    }

    /// The scans in their order, once all others were placed on the shape of the first.
    fn placed(&self, base: &Level<'a>, leader: usize, first: Found, others: &[usize]) -> Result<Joint<'a>, FitError> {
        let Estimate { z, motion } = base.space.estimate(&first.x, first.motion);
        let mut at = JointEstimate { z, motions: vec![motion] };
        let mut known = vec![leader];
        for (n, scan) in others.iter().enumerate() {
            self.monitor.reach(n as f64 / others.len() as f64, &format!("scan {} of {}", n + 2, self.scans.len()));
            let problems: Vec<&Problem> = known.iter().map(|scan| self.problems[*scan]).collect();
            at = place::place(&problems, base, &at, self.problems[*scan])?;
            known.push(*scan);
        }
        let mut motions = vec![Isometry::IDENTITY; known.len()];
        known.iter().zip(&at.motions).for_each(|(scan, motion)| motions[*scan] = *motion);
        Ok(Joint::new(&self.problems, base, JointEstimate { z: at.z, motions })?)
    }

    /// The same or another shape, with what the search for other shapes finds in all scans at once: parts that only one
    /// scan shows, and which were nowhere when its place was sought, are found by their points in all.
    fn better(&self, base: &Level<'a>, joint: Joint<'a>) -> Result<Joint<'a>, FitError> {
        if self.monitor.cancelled() {
            return Ok(joint);
        }
        let x = base.space.x(&joint.estimate.z).unwrap_or_else(|| self.problems[0].start.x.clone());
        let parameters = self.model.parameters().iter();
        let values = parameters.zip(&x).map(|(p, x)| (p.name.clone(), *x)).collect();
        let pose = Some(joint.estimate.motions[0].into());
        let earlier = Some(EarlierFit { values, pose, ..EarlierFit::default() });
        let mut options = FitOptions { earlier, ..self.options.clone() };
        options.start.retain(|name, _| self.options.fixed.contains(name));
        let scan = merged(self.scans, &joint.estimate.motions);
        let merged_by = joint.estimate.motions.clone();
        let mut best = joint;
        // A solution that does not explain all scans is no place to begin from.
        let afresh = (!explains_all(&best)).then_some(self.options);
        for options in [&options].into_iter().chain(afresh) {
            let Found { x, motion } = self.monitor.stage("all scans", || self.solved(&scan, options))?;
            let other = base.space.estimate(&x, motion);
            let motions = carried(&merged_by, motion);
            let other = Joint::new(&self.problems, base, JointEstimate { z: other.z, motions })?;
            let other = self.monitor.stage("all scans", || other.anneal(self.given()));
            best = better_of(best, other, 1.0);
        }
        Ok(Joint::new(&self.problems, base, best.estimate.clone())?.like(&best))
    }

    /// Standard deviations, whether the scans agree, and the result.
    fn concluded(&self, joint: Joint<'a>) -> Result<SeveralFit, FitError> {
        let monitor = self.monitor;
        let (joint, of, uncertainty) = monitor.stage("uncertainty", || self.assessed(joint, Some(POLISH)))?;
        let agreements = monitor.stage("agreement", || apart::agreements(self, &joint));
        monitor.stage("uncertainty", || report::result(self, &joint, &of, uncertainty, agreements))
    }

    /// The optimum with its uncertainty, which is None where the user does not wait.
    fn assessed(&self, mut joint: Joint<'a>, stage: Option<&'static str>) -> Result<Assessed<'a>, FitError> {
        let absent = || FitError::Evaluation(crate::model::EvaluationError::new("the model does not exist at the end"));
        let mut of = joint.solutions().ok_or_else(absent)?;
        let mut uncertainty: Option<JointUncertainty> = None;
        if !self.monitor.cancelled() {
            uncertainty = assess(&joint, &of);
            // Shorter steps, where what remains is more than a small part of the standard deviations.
            for step in [0.1, 0.01] {
                if uncertainty.as_ref().is_none_or(JointUncertainty::is_settled) || self.monitor.cancelled() {
                    break;
                }
                joint = joint.polish(step, stage);
                of = joint.solutions().ok_or_else(absent)?;
                uncertainty = assess(&joint, &of);
            }
        }
        Ok((joint, of, uncertainty))
    }
}

/// A fit of all scans, its solutions by scan, and its uncertainty.
type Assessed<'a> = (Joint<'a>, Vec<Solution<'a>>, Option<JointUncertainty>);

/// The second of two if it explains all scans better, both by the finer of their scales: if its mean loss is below
/// `factor` times that of the first.
fn better_of<'a>(one: Joint<'a>, other: Joint<'a>, factor: f64) -> Joint<'a> {
    let finest = |(a, b): (&f64, &f64)| a.min(*b);
    let scales: Vec<f64> = one.scales().iter().zip(&other.scales()).map(finest).collect();
    if other.value(&scales) < factor * one.value(&scales) { other } else { one }
}

/// Whether nearly all points of every scan lie near the model.
fn is_convincing(joint: &Joint) -> bool {
    joint.near().iter().all(|near| *near > CONVINCING)
}

/// Whether nearly all points of every scan are inliers, at the final scales.
fn explains_all(joint: &Joint) -> bool {
    joint.inliers().iter().all(|share| *share > CONVINCING)
}

/// Motions in other scans that stand to a new one of the first as they stood to the old one.
fn carried(motions: &[Isometry], first: Isometry) -> Vec<Isometry> {
    let moved = |motion: &Isometry| {
        let rotation = (motion.rotation * motions[0].rotation.inverse()).normalize();
        let translation = motion.translation - rotation * motions[0].translation;
        Isometry {
            rotation: (rotation * first.rotation).normalize(),
            translation: rotation * first.translation + translation,
        }
    };
    std::iter::once(first).chain(motions[1..].iter().map(moved)).collect()
}
