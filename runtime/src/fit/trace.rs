//! What a fit went through, for a plot of its convergence.

use super::objective::{Evaluation, Objective};
use serde::Serialize;
use std::sync::Mutex;
use std::sync::atomic::Ordering;

/// The objective after a step of an optimiser.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TracePoint {
    /// What was going on: `coarse` (L-BFGS), `refine` (Gauss-Newton on some points), `polish` (on all), ...
    pub stage: &'static str,
    /// Evaluations of the objective so far, in all stages.
    pub evaluations: u64,
    /// How many of the scan's points took part.
    pub points: usize,
    /// The scale of psi. Millimetres.
    pub sigma: f64,
    /// Mean psi over these points.
    pub objective: f64,
    /// Fraction of these points with psi below 1/2.
    pub inliers: f64,
}

/// Where the steps of one stage are written down.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Log<'s> {
    pub(crate) stage: &'static str,
    pub(crate) trace: &'s Mutex<Vec<TracePoint>>,
}

impl Objective<'_> {
    /// Writes a step down and shows it, where that is wanted. Whoever runs several minimisations at a time does not want it.
    pub(crate) fn note(&self, evaluation: &Evaluation) {
        let Some(Log { stage, trace }) = self.log else { return };
        let points = self.points.len();
        let point = TracePoint {
            stage,
            evaluations: self.evaluations.load(Ordering::Relaxed),
            points,
            sigma: self.loss.sigma,
            objective: evaluation.value,
            inliers: evaluation.inliers() / points.max(1) as f64,
        };
        let shown = format!(
            "{stage}: objective {:.4}, sigma {:.3} mm, inliers {:.1} %",
            point.objective,
            point.sigma,
            100.0 * point.inliers
        );
        self.progress.report("fitting", f64::NAN, &shown);
        if let Ok(mut trace) = trace.lock() {
            trace.push(point);
        }
    }
}
