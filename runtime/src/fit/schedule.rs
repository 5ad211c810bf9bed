//! The fit as a whole: the pose is recognised, orientations are screened, and the best candidate is taken from coarse to
//! fine, in the scale of psi and in points (graduated non-convexity), to the scale that the scan's noise suggests.

use super::facets::Layout;
use super::gauss_newton::{self, Stop};
use super::lbfgs;
use super::loss::{INLIER_DEVIATIONS, Welsch, robust_deviation};
use super::motion::Motion;
use super::objective::{Evaluation, Objective, PatchSum};
use super::options::{FitError, FitOptions};
use super::points::Points;
use super::pose::{self, Field, RigidParameters};
use super::report::{self, Outcome};
use super::result::FitResult;
use super::screening::{self, Candidate};
use super::space::{Estimate, Space};
use crate::model::Model;
use crate::progress::{Progress, Silent};
use crate::scan::Scan;
use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;
use std::time::Instant;

/// Everything that stays the same while one fit goes on.
pub(crate) struct Setting<'a> {
    pub(crate) model: &'a dyn Model,
    /// All points of the scan.
    pub(crate) points: &'a Points,
    pub(crate) space: Space<'a>,
    pub(crate) layout: Layout,
    /// Radius of gyration of the scan: the scale of lengths. Millimetres.
    pub(crate) radius: f64,
    pub(crate) evaluations: &'a AtomicU64,
    /// Asked whether to go on.
    pub(crate) progress: &'a dyn Progress,
    /// Whether the scan's normals tell the sides of a wall from each other.
    pub(crate) oriented: bool,
    start_x: Vec<f64>,
}

/// Points of the levels between the screening and the last one, which has all.
const MIDDLE: usize = 6000;

/// Fits a model to a scan. The scan's frame is the script's: a script with pose parameters gets them, one without gets a
/// pose beside its parameters.
///
/// # Errors
/// Options that name what is not there, a scan or a model with nothing in it, or a model that cannot be evaluated where the
/// fit begins; or that `progress` was cancelled. A fit that finds nothing convincing is not an error: `inliers`, `converged` and `warnings` say so.
pub fn fit(
    model: &dyn Model,
    scan: &Scan,
    options: &FitOptions,
    progress: &dyn Progress,
) -> Result<FitResult, FitError> {
    let mut clock = Clock::default();
    let (x, fixed) = options.resolve(model)?;
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
    let frame = Frame::choose(model, options, &rigid, &fixed);
    let evaluations = AtomicU64::new(0);
    let mut setting = Setting::new(model, &points, &x, frame.free(&fixed), frame.moving, radius, &evaluations)?;
    setting.progress = progress;
    setting.oriented &= scan.oriented && !options.ignore_normals;
    clock.lap("prepare");

    let start = setting.space.estimate(&x, Motion::IDENTITY);
    let near =
        options.no_pose || rigid.indices.iter().any(|i| options.start.contains_key(&model.parameters()[*i].name));
    let mut iterations = 0;
    let begin = if near || !frame.moving {
        Candidate::new(&setting, start)
    } else {
        progress.report("screening orientations", f64::NAN, "");
        screening::screen(&setting, &start).unwrap_or_else(|| Candidate::new(&setting, start))
    };
    clock.lap("screen");
    if progress.cancelled() {
        return Err(FitError::Cancelled);
    }
    progress.report("fitting", f64::NAN, "");
    let mut last = setting.descend(begin, scan.noise, options, near, &mut iterations);
    clock.lap("fit");

    let mut warnings = frame.warnings;
    if frame.write_back {
        last = setting.written_back(last, &rigid, &fixed, options, &mut iterations, &mut warnings);
    }
    clock.lap("finish");
    if progress.cancelled() {
        return Err(FitError::Cancelled);
    }
    Ok(report::result(
        &setting,
        scan,
        Outcome { last, fixed, rigid, iterations, warnings, seconds: clock.laps, report_pose: frame.report_pose },
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
                "some of the pose parameters {} are fixed, so orientations are not searched: the fit begins at their start values",
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
    pub(crate) loss: Welsch,
    pub(crate) signs: Vec<i8>,
    pub(crate) converged: bool,
}

impl<'a> Setting<'a> {
    /// The setting of a fit that begins at `x`.
    pub(crate) fn new(
        model: &'a dyn Model,
        points: &'a Points,
        x: &[f64],
        free: Vec<usize>,
        moving: bool,
        radius: f64,
        evaluations: &'a AtomicU64,
    ) -> Result<Self, FitError> {
        let space = Space::new(model, x, free, moving);
        let at = space.estimate(x, Motion::IDENTITY);
        let layout = Layout::default();
        let oriented = !points.normal.is_empty();
        let mut setting = Self {
            model,
            points,
            space,
            layout,
            radius,
            evaluations,
            progress: &Silent,
            oriented,
            start_x: x.to_vec(),
        };
        setting.remodel(&at, 0.01 * radius)?;
        Ok(setting)
    }

    /// Divides the model's patches, and scales the coordinates, as is right at an estimate.
    fn remodel(&mut self, at: &Estimate, tolerance: f64) -> Result<(), FitError> {
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
    pub(crate) fn objective<'s>(&'s self, space: &'s Space<'s>, points: &'s Points, loss: Welsch) -> Objective<'s> {
        Objective {
            space,
            points,
            layout: &self.layout,
            loss,
            signs: None,
            tolerance: 1e-3 * loss.sigma,
            evaluations: self.evaluations,
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

    /// From a coarse scale of psi to the final one.
    fn descend(
        &mut self,
        begin: Candidate,
        noise: f64,
        options: &FitOptions,
        near: bool,
        iterations: &mut u32,
    ) -> Last {
        let middle = self.points.sample(MIDDLE);
        let Candidate { estimate: mut at, mut signs, .. } = begin;
        let scales: &[f64] = if near { &[0.3, 0.2, 0.14, 0.1, 0.07] } else { &[0.07] };
        for scale in scales {
            // A model that cannot be evaluated where it has come to keeps its facets.
            let _ = self.remodel(&at, 0.05 * scale * self.radius);
            // From a near start the signs are still to be learnt; the screening has learnt them.
            let objective = Objective {
                signs: Some(&signs).filter(|_| !near).map(Vec::as_slice),
                ..self.objective(&self.space, &middle, Welsch { sigma: scale * self.radius })
            };
            if let Some(minimum) = lbfgs::minimise(&objective, at.clone(), 40, 1e-7) {
                *iterations += minimum.iterations;
                at = minimum.estimate;
                signs = self.facing(&minimum.evaluation);
            }
        }
        let _ = self.remodel(&at, 0.002 * self.radius);
        let coarse = Welsch { sigma: 0.05 * self.radius };
        let mut loss = options.sigma.map_or(coarse, |sigma| Welsch { sigma });
        for _ in 0..6 {
            let objective = Objective { signs: Some(&signs), ..self.objective(&self.space, &middle, loss) };
            let stop = Stop { iterations: 12, step: 1e-4 * loss.sigma };
            if let Some(minimum) = gauss_newton::minimise(&objective, at.clone(), stop) {
                *iterations += minimum.iterations;
                at = minimum.estimate;
                signs = self.facing(&minimum.evaluation);
            }
            let next =
                options.sigma.map_or_else(|| self.scale(&at, &middle, loss, &signs, noise), |sigma| Welsch { sigma });
            let settled = next.sigma > 0.9 * loss.sigma;
            loss = next;
            if settled {
                break;
            }
        }
        self.polish(at, loss, signs, iterations)
    }

    /// The scale that the residuals suggest: psi(d + eps) = 1/2 ([VA] sect. 3) where d + eps is three robust standard
    /// deviations of the distances, which hold both the noise and what the model's family cannot follow. Never above the
    /// present scale, and never below the noise's.
    fn scale(&self, at: &Estimate, points: &Points, loss: Welsch, signs: &[i8], noise: f64) -> Welsch {
        let objective = Objective { signs: Some(signs), ..self.objective(&self.space, points, loss) };
        let Ok(placed) = objective.place(at) else { return loss };
        let mut distances: Vec<f64> = objective.feet(&placed, &at.motion).iter().map(|(_, f)| f.d2.sqrt()).collect();
        let spread = robust_deviation(&mut distances, loss.cutoff()).max(noise).max(1e-6 * self.radius);
        let next = Welsch::with_half_at(INLIER_DEVIATIONS * spread);
        Welsch { sigma: next.sigma.min(loss.sigma).max(0.35 * loss.sigma) }
    }

    /// Gauss-Newton over all points at the final scale.
    fn polish(&self, at: Estimate, loss: Welsch, signs: Vec<i8>, iterations: &mut u32) -> Last {
        let objective = Objective {
            signs: Some(&signs),
            tolerance: 1e-5 * loss.sigma,
            ..self.objective(&self.space, self.points, loss)
        };
        let stop = Stop { iterations: 30, step: 2e-5 * loss.sigma };
        match gauss_newton::minimise(&objective, at.clone(), stop) {
            Some(minimum) => {
                *iterations += minimum.iterations;
                let gauss_newton::Minimum { estimate, evaluation, converged, .. } = minimum;
                Last { estimate, evaluation, loss, signs, converged }
            }
            None => Last { evaluation: self.nothing(), estimate: at, loss, signs, converged: false },
        }
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
        options: &FitOptions,
        iterations: &mut u32,
        warnings: &mut Vec<String>,
    ) -> Last {
        let Some(x) = self.space.x(&last.estimate.z) else { return last };
        let written = pose::write_back(self.model, &x, &rigid.indices, &last.estimate.motion);
        let (mut x, off) = match written {
            Ok(written) => written,
            Err(error) => {
                warnings.push(format!("the pose could not be written into the script's parameters: {error}"));
                return last;
            }
        };
        for i in &rigid.indices {
            x[*i] = principal(x[*i], self.model, &x, *i);
        }
        if off > 1e-6 * self.radius {
            warnings.push(format!("the script's pose parameters reproduce the pose found only to {off:.3} mm"));
        }
        let free = (0..fixed.len()).filter(|i| !fixed[*i]).collect();
        let centre = self.space.centre;
        self.space = Space::new(self.model, &x, free, false);
        self.space.centre = centre;
        let at = self.space.estimate(&x, Motion::IDENTITY);
        if let Err(error) = self.remodel(&at, 0.002 * self.radius) {
            warnings.push(format!("the model could not be evaluated in its final pose: {error}"));
        }
        let _ = options;
        self.polish(at, last.loss, last.signs, iterations)
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
