//! From where the screening ended to the optimum: from coarse to fine, in the scale of psi and in points (graduated
//! non-convexity), to the scale that the scan's noise suggests, and then into the script's own parameters.

use super::gauss_newton::{self, Minimum, Stop};
use super::lbfgs;
use super::loss::{INLIER_DEVIATIONS, Loss, LossKind, robust_deviation};
use super::memory::Memory;
use super::motion::Motion;
use super::objective::{Evaluation, Objective, Order};
use super::options::FitOptions;
use super::points::Points;
use super::pose::{self, RigidParameters};
use super::restart::{Known, Scope, restart};
use super::screening::Candidate;
use super::setting::{MIDDLE, Setting};
use super::space::{Estimate, Space};
use super::uncertainty::{self, Uncertainty};
use crate::model::Model;
use crate::progress::Silent;
use std::sync::Arc;

/// Points with which the scale of psi is followed down.
const FEW: usize = 2000;

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

impl Setting<'_> {
    /// From the screening's scale of psi to the final one.
    pub(crate) fn descend(
        &mut self,
        begin: Candidate,
        known: Known,
        noise: f64,
        options: &FitOptions,
        again: bool,
        iterations: &mut u32,
    ) -> Last {
        let Candidate { estimate: mut at, mut signs, .. } = begin;
        // A model that cannot be evaluated where it has come to keeps its facets.
        let _ = self.remodel(&at, 0.002 * self.radius);
        // Here nearly every point is nearest to its own patch, whichever way that faces: what was learnt wrongly from farther off
        // is mended.
        let wide = self.objective(&self.space, &self.thin, Loss::welsch(0.05 * self.radius));
        if let Some(unsided) = wide.evaluate(&at, Order::Value) {
            signs = self.facing(&unsided, &signs);
        }
        let few = self.thin.sample(FEW);
        let given = options.sigma.map(|sigma| Loss { kind: options.loss, sigma });
        let mut loss = given.unwrap_or(Loss::welsch(0.05 * self.radius));
        for look in 0..2 {
            self.sharpen(
                &few,
                &mut at,
                &mut signs,
                &mut loss,
                |at, loss, signs| given.unwrap_or_else(|| self.scale(at, &few, loss, signs, noise)),
                iterations,
            );
            if look == 1 || self.progress.cancelled() {
                break;
            }
            // With so sharp an eye, what passed for right before may be wrong.
            let found = Candidate { estimate: at.clone(), signs: signs.clone(), value: f64::INFINITY, inliers: 0.0 };
            let found = restart(self, known, &few, loss.sigma / self.radius, Scope::Doubtful, found);
            if found.value.is_infinite() {
                break;
            }
            (at, signs) = (found.estimate, found.signs);
        }
        let loss = given.unwrap_or_else(|| self.scale(&at, &self.thin, loss, &signs, noise));
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

    /// Follows the scale of psi down to the one that the residuals suggest, which `scale` says.
    fn sharpen(
        &self,
        points: &Points,
        at: &mut Estimate,
        signs: &mut Vec<i8>,
        loss: &mut Loss,
        scale: impl Fn(&Estimate, Loss, &[i8]) -> Loss,
        iterations: &mut u32,
    ) {
        for _ in 0..6 {
            if self.progress.cancelled() {
                break;
            }
            let objective = Objective {
                signs: Some(signs),
                memory: Some(Arc::new(Memory::new(points, loss.sigma))),
                log: Some(self.log("refine")),
                ..self.objective(&self.space, points, *loss)
            };
            let stop = Stop { iterations: 12, step: 1e-3 * loss.sigma };
            if let Some(minimum) = minimise(&objective, at.clone(), stop) {
                *iterations += minimum.iterations;
                *at = minimum.estimate;
                *signs = self.facing(&minimum.evaluation, signs);
            }
            let next = scale(at, *loss, signs);
            let settled = next.sigma > 0.9 * loss.sigma;
            *loss = next;
            if settled {
                break;
            }
        }
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
        let memory = Arc::new(Memory::new(points, loss.sigma));
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
                let Minimum { estimate, evaluation, converged, .. } = minimum;
                Last { estimate, evaluation, loss, signs, converged, memory }
            }
            None => {
                // Cancelled, or the model does not exist here. What it is worth is still to be said.
                let objective = Objective { progress: &Silent, signs: Some(&signs), memory: None, ..objective };
                let evaluation = objective.evaluate(&at, Order::Value).unwrap_or_else(|| self.nothing());
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

    /// Puts the motion into the script's pose parameters and finishes in the script's own coordinates.
    pub(crate) fn written_back(
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

/// Gauss-Newton, and where that does not arrive L-BFGS from where it is, with steps that need no model of the distances.
fn minimise(objective: &Objective, start: Estimate, stop: Stop) -> Option<Minimum> {
    let newton = gauss_newton::minimise(objective, start, stop)?;
    if newton.converged {
        return Some(newton);
    }
    let rest = lbfgs::minimise(objective, newton.estimate.clone(), 40, 1e-7);
    Some(rest.filter(|rest| rest.evaluation.value < newton.evaluation.value).unwrap_or(newton))
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
