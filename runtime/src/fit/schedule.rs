//! The fit as a whole: the pose is recognised, orientations are screened, and the best candidate is taken from coarse to
//! fine, in the scale of psi and in points (graduated non-convexity), to the scale that the scan's noise suggests.

use super::bootstrap;
use super::gauss_newton::{self, Stop};
use super::hypothesis;
use super::layout::Layout;
use super::lbfgs;
use super::loss::{INLIER_DEVIATIONS, Loss, LossKind, robust_deviation};
use super::memory::{Memory, REACH};
use super::motion::Motion;
use super::objective::{Evaluation, Objective, Order, no_hints};
use super::options::{FitError, FitOptions, Start};
use super::points::Points;
use super::pose::{self, Field, RigidParameters};
use super::report::{self, Outcome};
use super::result::FitResult;
use super::screening::{self, Candidate};
use super::space::{Estimate, Space};
use super::sums::PatchSum;
use super::trace::{Log, TracePoint};
use super::uncertainty::{self, Uncertainty};
use crate::model::Model;
use crate::progress::{Progress, Silent};
use crate::scan::Scan;
use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// Everything that stays the same while one fit goes on.
pub(crate) struct Setting<'a> {
    pub(crate) model: &'a dyn Model,
    /// All points of the scan.
    pub(crate) points: &'a Points,
    /// Some of them, even in space.
    pub(crate) thin: Points,
    pub(crate) space: Space<'a>,
    pub(crate) layout: Layout,
    /// Radius of gyration of the scan: the scale of lengths. Millimetres.
    pub(crate) radius: f64,
    pub(crate) evaluations: &'a AtomicU64,
    /// Asked whether to go on.
    pub(crate) progress: &'a dyn Progress,
    /// Whether the scan's normals tell the sides of a wall from each other.
    pub(crate) oriented: bool,
    /// Every step after the screening.
    pub(crate) trace: Mutex<Vec<TracePoint>>,
    /// See `FitOptions`.
    pub(crate) seed: u64,
    start_x: Vec<f64>,
}

/// Points of the levels between the screening and the last one, which has all.
const MIDDLE: usize = 6000;
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
    let radius = points.gyration();
    if points.len() < 4 || !(radius > 0.0) {
        return Err(FitError::EmptyScan { points: points.len() });
    }
    let rigid = pose::recognise(model, &x, radius)?;
    let bound: Vec<bool> = (0..x.len()).map(|i| fixed[i] || ties.iter().any(|(a, b)| *a == i || *b == i)).collect();
    let following = |i: &usize| ties.iter().any(|(_, b)| b == i);
    let frame = Frame::choose(model, options, &rigid, &bound);
    let evaluations = AtomicU64::new(0);
    let free = frame.free(&fixed).into_iter().filter(|i| !following(i)).collect();
    let mut setting = Setting::new(model, &points, &x, (free, &ties), frame.moving, radius, &evaluations)?;
    setting.progress = progress;
    setting.oriented &= scan.oriented && !options.ignore_normals;
    setting.seed = options.seed;
    clock.lap("prepare");

    let start = setting.space.estimate(&x, Motion::IDENTITY);
    let near =
        options.no_pose || rigid.indices.iter().any(|i| options.start.contains_key(&model.parameters()[*i].name));
    let mut iterations = 0;
    let begin = setting.begin(start, near, frame.moving && !options.no_pose);
    clock.lap("screen");
    progress.report("fitting", f64::NAN, "");
    let mut last = setting.descend(begin, scan.noise, options, frame.write_back, &mut iterations);
    clock.lap("fit");

    let mut warnings = frame.warnings;
    if frame.write_back {
        last = setting.written_back(last, &rigid, &fixed, &mut iterations, &mut warnings);
    }
    clock.lap("finish");
    let tests = hypothesis::test(&setting, &last, options, &fixed, &mut warnings);
    let uncertainty = setting.uncertainty(&last);
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

/// How the pose is treated.
struct Frame {
    /// The motion is a variable.
    moving: bool,
    /// Parameters that the motion stands for.
    stands_for: Vec<usize>,
    /// The motion ends in the script's parameters.
    write_back: bool,
    /// The motion is part of the result.
    report_pose: bool,
    warnings: Vec<String>,
}

impl Frame {
    fn choose(model: &dyn Model, options: &FitOptions, rigid: &RigidParameters, fixed: &[bool]) -> Self {
        let names = || {
            rigid.indices.iter().map(|i| format!("`{}`", model.parameters()[*i].name)).collect::<Vec<_>>().join(", ")
        };
        let none =
            Self { moving: false, stands_for: Vec::new(), write_back: false, report_pose: false, warnings: Vec::new() };
        if options.no_pose {
            return none;
        }
        if rigid.indices.is_empty() {
            return Self { moving: true, report_pose: true, ..none };
        }
        if rigid.indices.iter().any(|i| fixed[*i]) {
            let warning = format!(
                "some of the pose parameters {} are fixed or tied, so orientations are not searched: the fit begins at their start values",
                names()
            );
            return Self { warnings: vec![warning], ..none };
        }
        if rigid.rank == 6 {
            return Self { moving: true, stands_for: rigid.indices.clone(), write_back: true, ..none };
        }
        let warning = format!(
            "{} move the whole model, but only in {} of the six ways of a rigid body: they are held, and the pose is reported beside the parameters",
            names(),
            rigid.rank
        );
        Self { moving: true, stands_for: rigid.indices.clone(), report_pose: true, warnings: vec![warning], ..none }
    }

    fn free(&self, fixed: &[bool]) -> Vec<usize> {
        (0..fixed.len()).filter(|i| !fixed[*i] && !self.stands_for.contains(i)).collect()
    }
}

/// The last estimate with what it was judged by.
pub(crate) struct Last {
    pub(crate) estimate: Estimate,
    pub(crate) evaluation: Evaluation,
    pub(crate) loss: Loss,
    pub(crate) signs: Vec<i8>,
    pub(crate) converged: bool,
    /// What is known of the feet of the points that were fitted.
    pub(crate) memory: Arc<Memory>,
}

impl<'a> Setting<'a> {
    /// The setting of a fit that begins at `x`.
    pub(crate) fn new(
        model: &'a dyn Model,
        points: &'a Points,
        x: &[f64],
        (free, ties): (Vec<usize>, &[(usize, usize)]),
        moving: bool,
        radius: f64,
        evaluations: &'a AtomicU64,
    ) -> Result<Self, FitError> {
        let space = Space::new(model, x, free, moving, ties);
        let at = space.estimate(x, Motion::IDENTITY);
        let layout = Layout::default();
        let oriented = !points.normal.is_empty();
        let mut setting = Self {
            model,
            points,
            thin: points.sample(MIDDLE),
            space,
            layout,
            radius,
            evaluations,
            progress: &Silent,
            oriented,
            trace: Mutex::default(),
            seed: 0,
            start_x: x.to_vec(),
        };
        setting.remodel(&at, 0.01 * radius)?;
        Ok(setting)
    }

    /// Divides the model's patches, and scales the coordinates, as is right at an estimate.
    pub(crate) fn remodel(&mut self, at: &Estimate, tolerance: f64) -> Result<(), FitError> {
        let x = self.space.x(&at.z).unwrap_or_else(|| self.start_x.clone());
        let instance = self.model.instantiate(&x)?;
        self.layout = Layout::new(self.model, &*instance, tolerance, 2.0 * self.radius);
        let (centre, _, gyration) = self.layout.facets(&*instance).moments();
        let field = Field::sample(self.model, &*instance)?;
        let sizes: Vec<f64> = (0..x.len()).map(|i| field.size(i)).collect();
        self.space.set_scale(at, &sizes, centre, gyration.max(1e-6 * self.radius));
        Ok(())
    }

    /// An objective without normals.
    pub(crate) fn objective<'s>(&'s self, space: &'s Space<'s>, points: &'s Points, loss: Loss) -> Objective<'s> {
        Objective {
            space,
            points,
            layout: &self.layout,
            loss,
            signs: None,
            tolerance: 1e-3 * loss.sigma,
            evaluations: self.evaluations,
            hints: no_hints(points),
            memory: None,
            curved: false,
            log: None,
            progress: self.progress,
        }
    }

    /// Per patch, which way its parametrisation faces: outwards, as the language's convention has it, unless the scan's
    /// normals say clearly otherwise. Where points lie on both sides (a thin wall whose sides are not told apart yet) the
    /// convention decides: without a decision, both sides of the scanned wall would pull at both of the model.
    pub(crate) fn facing(&self, evaluation: &Evaluation) -> Vec<i8> {
        let sign = |p: &PatchSum| {
            let inwards = p.weight >= 10.0 && p.facing <= -0.85 * p.weight;
            match (self.oriented, inwards) {
                (false, _) => 0,
                (true, true) => -1,
                (true, false) => 1,
            }
        };
        evaluation.patches.iter().map(sign).collect()
    }

    /// Where the descent begins: what lies near the start, or the best of all orientations. Near starts that lead to nothing
    /// convincing are given up where the pose may be searched.
    fn begin(&self, start: Estimate, near: bool, searched: bool) -> Candidate {
        let nearby = (near || !searched).then(|| screening::approach(self, &start));
        if let Some(found) = &nearby
            && (!searched || found.inliers > CONVINCING)
        {
            return found.clone();
        }
        self.progress.report("screening orientations", f64::NAN, "");
        let elsewhere = screening::screen(self, &start);
        match (nearby, elsewhere) {
            (Some(near), Some(far)) if far.value < CLEARLY * near.value => far,
            (Some(near), _) => near,
            (None, Some(far)) => far,
            (None, None) => Candidate::new(self, start),
        }
    }

    /// From the screening's scale of psi to the final one.
    fn descend(
        &mut self,
        begin: Candidate,
        noise: f64,
        options: &FitOptions,
        again: bool,
        iterations: &mut u32,
    ) -> Last {
        let middle = self.thin.clone();
        let Candidate { estimate: mut at, mut signs, .. } = begin;
        // A model that cannot be evaluated where it has come to keeps its facets.
        let _ = self.remodel(&at, 0.05 * screening::FINE * self.radius);
        let objective = Objective {
            signs: Some(&signs),
            log: Some(self.log("coarse")),
            ..self.objective(&self.space, &middle, Loss::welsch(screening::FINE * self.radius))
        };
        if let Some(minimum) = lbfgs::minimise(&objective, at.clone(), 40, 1e-7) {
            *iterations += minimum.iterations;
            at = minimum.estimate;
            signs = self.facing(&minimum.evaluation);
        }
        let _ = self.remodel(&at, 0.002 * self.radius);
        let given = options.sigma.map(|sigma| Loss { kind: options.loss, sigma });
        let mut loss = given.unwrap_or(Loss::welsch(0.05 * self.radius));
        for _ in 0..6 {
            let objective = Objective {
                signs: Some(&signs),
                memory: Some(Arc::new(Memory::new(middle.len(), REACH * loss.sigma))),
                log: Some(self.log("refine")),
                ..self.objective(&self.space, &middle, loss)
            };
            let stop = Stop { iterations: 12, step: 1e-4 * loss.sigma };
            if let Some(minimum) = gauss_newton::minimise(&objective, at.clone(), stop) {
                *iterations += minimum.iterations;
                at = minimum.estimate;
                signs = self.facing(&minimum.evaluation);
            }
            let next = given.unwrap_or_else(|| self.scale(&at, &middle, loss, &signs, noise));
            let settled = next.sigma > 0.9 * loss.sigma;
            loss = next;
            if settled {
                break;
            }
        }
        let half = loss.half();
        let last = if options.sigma.is_none() { Loss::with_half_at(options.loss, half) } else { loss };
        // Some points, as dense as the scan itself, first: all of them then have hardly anything left to do. Where the motion is
        // still to be put into the script's parameters, they wait for that.
        let some = self.points.every(MIDDLE);
        let near = self.polish(&some, at, last, signs, iterations);
        if again || some.len() == self.points.len() {
            return near;
        }
        self.polish(self.points, near.estimate, last, near.signs, iterations)
    }

    fn log(&self, stage: &'static str) -> Log<'_> {
        Log { stage, trace: &self.trace }
    }

    /// The scale that the residuals suggest: psi(d + eps) = 1/2 ([VA] sect. 3) where d + eps is three robust standard
    /// deviations of the distances, which hold both the noise and what the model's family cannot follow. Never above the
    /// present scale, and never below the noise's.
    fn scale(&self, at: &Estimate, points: &Points, loss: Loss, signs: &[i8], noise: f64) -> Loss {
        let objective = Objective { signs: Some(signs), ..self.objective(&self.space, points, loss) };
        let Ok(placed) = objective.place(at) else { return loss };
        let mut distances: Vec<f64> = objective.feet(&placed, &at.motion).iter().map(|(_, f)| f.d2.sqrt()).collect();
        let spread = robust_deviation(&mut distances, loss.cutoff()).max(noise).max(1e-6 * self.radius);
        let next = Loss::with_half_at(loss.kind, INLIER_DEVIATIONS * spread);
        Loss::welsch(next.sigma.min(loss.sigma).max(0.35 * loss.sigma))
    }

    /// Gauss-Newton at the final scale.
    pub(crate) fn polish(
        &self,
        points: &Points,
        at: Estimate,
        loss: Loss,
        signs: Vec<i8>,
        iterations: &mut u32,
    ) -> Last {
        // Least squares is for those who want every digit.
        let (tolerance, step) = match loss.kind {
            LossKind::Squared => (1e-12 * self.radius, 1e-11 * self.radius),
            // Shorter steps are about as large as those by which single points that change patches move the optimum.
            _ => (1e-5 * loss.sigma, 2e-4 * loss.sigma),
        };
        let memory = Arc::new(Memory::new(points.len(), REACH * loss.sigma));
        let objective = Objective {
            signs: Some(&signs),
            tolerance,
            memory: Some(memory.clone()),
            curved: true,
            log: Some(self.log("polish")),
            ..self.objective(&self.space, points, loss)
        };
        let stop = Stop { iterations: 30, step };
        match gauss_newton::minimise(&objective, at.clone(), stop) {
            Some(minimum) => {
                *iterations += minimum.iterations;
                let gauss_newton::Minimum { estimate, evaluation, converged, .. } = minimum;
                Last { estimate, evaluation, loss, signs, converged, memory }
            }
            None => {
                // Cancelled, or the model does not exist here. What it is worth is still to be said.
                let objective = Objective { progress: &Silent, signs: Some(&signs), ..objective };
                let evaluation = objective.evaluate(&at, Order::Normal).unwrap_or_else(|| self.nothing());
                Last { evaluation, estimate: at, loss, signs, converged: false, memory }
            }
        }
    }

    /// How well the last estimate is determined.
    pub(crate) fn uncertainty(&self, last: &Last) -> Option<Uncertainty> {
        let objective = Objective {
            signs: Some(&last.signs),
            tolerance: 1e-5 * last.loss.sigma,
            memory: Some(last.memory.clone()),
            progress: &Silent,
            ..self.objective(&self.space, self.points, last.loss)
        };
        uncertainty::assess(&objective, &last.estimate, &self.space.at_bound(&last.estimate))
    }

    /// What stands for the evaluation of a model that does not exist.
    fn nothing(&self) -> Evaluation {
        let dim = self.space.dim();
        Evaluation {
            value: 1.0,
            gradient: nalgebra::DVector::zeros(dim),
            normal: nalgebra::DMatrix::zeros(dim, dim),
            patches: vec![Default::default(); self.model.parts().len()],
            absent: self.model.parts().len(),
        }
    }

    /// Puts the motion into the script's pose parameters and finishes in the script's own coordinates.
    fn written_back(
        &mut self,
        last: Last,
        rigid: &RigidParameters,
        fixed: &[bool],
        iterations: &mut u32,
        warnings: &mut Vec<String>,
    ) -> Last {
        let Some(x) = self.space.x(&last.estimate.z) else { return last };
        let written = pose::write_back(self.model, &x, &rigid.indices, &last.estimate.motion);
        let (mut x, off) = match written {
            Ok(written) => written,
            Err(error) => {
                warnings.push(format!("the pose could not be written into the script's parameters: {error}"));
                return self.polish(self.points, last.estimate, last.loss, last.signs, iterations);
            }
        };
        for i in &rigid.indices {
            x[*i] = principal(x[*i], self.model, &x, *i);
        }
        if off > 1e-6 * self.radius {
            warnings.push(format!("the script's pose parameters reproduce the pose found only to {off:.3} mm"));
        }
        let ties = std::mem::take(&mut self.space.ties);
        let follows = |i: &usize| ties.iter().any(|(_, b)| b == i);
        let free = (0..fixed.len()).filter(|i| !fixed[*i] && !follows(i)).collect();
        let centre = self.space.centre;
        self.space = Space::new(self.model, &x, free, false, &ties);
        self.space.centre = centre;
        let at = self.space.estimate(&x, Motion::IDENTITY);
        if let Err(error) = self.remodel(&at, 0.002 * self.radius) {
            warnings.push(format!("the model could not be evaluated in its final pose: {error}"));
        }
        self.polish(self.points, at, last.loss, last.signs, iterations)
    }
}

/// Angles are reported between -half a turn and half a turn where the bounds allow.
fn principal(value: f64, model: &dyn Model, x: &[f64], i: usize) -> f64 {
    if model.parameters()[i].quantity != gml_compiler::program::Quantity::Angle {
        return value;
    }
    let (low, high) = model.bounds(x)[i];
    let turned = value - std::f64::consts::TAU * (value / std::f64::consts::TAU).round();
    if turned >= low && turned <= high { turned } else { value }
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
