//! One objective over several scans of one object: the model's shape is common to them, and each has a pose of its own.
//! Coordinates are those of the free parameters, then six of every scan's motion, in the order of the scans. No term
//! knows two motions, so that the matrix of second derivatives is an arrow: the shape's rows are full, and of the
//! motions only the blocks on the diagonal.

use super::gauss_newton::Target;
use crate::fit::monitor::TracePoint;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::objective::{Evaluation, Objective, Order};
use crate::fit::problem::parameterization::Estimate;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Coordinates of a motion.
const MOTION: usize = 6;

/// A shape, and where it stands in every scan.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct JointEstimate {
    /// Coordinates of the free parameters (see `Estimate`).
    pub(crate) z: Vec<f64>,
    /// By scan, from the model's frame to the scan's.
    pub(crate) motions: Vec<Isometry>,
}

impl JointEstimate {
    /// The estimate of one scan.
    pub(crate) fn of(&self, scan: usize) -> Estimate {
        Estimate { z: self.z.clone(), motion: self.motions[scan] }
    }

    /// The same shape with other scans' motions.
    pub(crate) fn with(&self, motion: Isometry) -> Self {
        let motions = self.motions.iter().copied().chain([motion]).collect();
        Self { z: self.z.clone(), motions }
    }
}

/// The joint coordinates of one scan among those of all: of the shape, which has `free` of them, and of its motion.
pub(crate) fn coordinates(free: usize, scan: usize) -> impl Iterator<Item = usize> + Clone {
    (0..free).chain(motion_of(free, scan))
}

/// The joint coordinates of a scan's motion.
pub(crate) fn motion_of(free: usize, scan: usize) -> Range<usize> {
    free + MOTION * scan..free + MOTION * (scan + 1)
}

/// Adds `factor` times a matrix by the coordinates of one scan to one by those of all.
pub(crate) fn add_square(sum: &mut DMatrix<f64>, free: usize, scan: usize, factor: f64, of_scan: &DMatrix<f64>) {
    for (a, i) in coordinates(free, scan).enumerate() {
        for (b, j) in coordinates(free, scan).enumerate() {
            sum[(i, j)] += factor * of_scan[(a, b)];
        }
    }
}

/// Adds `factor` times a vector by the coordinates of one scan to one by those of all.
pub(crate) fn add_vector(sum: &mut DVector<f64>, free: usize, scan: usize, factor: f64, of_scan: &DVector<f64>) {
    for (a, i) in coordinates(free, scan).enumerate() {
        sum[i] += factor * of_scan[a];
    }
}

/// The mean over all points of all scans of their losses, by scales of their own.
pub(crate) struct JointObjective<'s> {
    /// By scan; their spaces have the same scales.
    pub(crate) of: Vec<Objective<'s>>,
    /// By scan, what its mean loss counts: the share of its points, by their prior weights. The sum is 1.
    pub(crate) shares: Vec<f64>,
}

impl JointObjective<'_> {
    fn free(&self) -> usize {
        self.of[0].space.free.len()
    }

    /// Coordinates in all.
    fn dim(&self) -> usize {
        self.free() + MOTION * self.of.len()
    }
}

impl Target for JointObjective<'_> {
    type At = JointEstimate;

    fn evaluated(&self, at: &JointEstimate, order: Order) -> Option<Evaluation> {
        let (free, dim) = (self.free(), self.dim());
        let vector = if order == Order::Value { 0 } else { dim };
        let square = if order == Order::Normal { dim } else { 0 };
        let mut all = Evaluation {
            value: 0.0,
            gradient: DVector::zeros(vector),
            normal: DMatrix::zeros(square, square),
            patches: Vec::new(),
            absent: 0,
        };
        for (scan, (objective, share)) in self.of.iter().zip(&self.shares).enumerate() {
            let one = objective.evaluate(&at.of(scan), order)?;
            all.value += share * one.value;
            if order != Order::Value {
                add_vector(&mut all.gradient, free, scan, *share, &one.gradient);
            }
            if order == Order::Normal {
                add_square(&mut all.normal, free, scan, *share, &one.normal);
            }
            all.patches.extend(one.patches);
            all.absent = all.absent.max(one.absent);
        }
        Some(all)
    }

    fn room(&self, from: &JointEstimate) -> Vec<(f64, f64)> {
        let mut room = self.of[0].space.room(&from.of(0));
        room.resize(self.dim(), (f64::NEG_INFINITY, f64::INFINITY));
        room
    }

    fn retract(&self, from: &JointEstimate, step: &[f64]) -> JointEstimate {
        let free = self.free();
        let moved = |scan: usize| {
            let own: Vec<f64> = coordinates(free, scan).map(|k| step[k]).collect();
            self.of[scan].space.retract(&from.of(scan), &own)
        };
        let moved: Vec<Estimate> = (0..self.of.len()).map(moved).collect();
        JointEstimate { z: moved[0].z.clone(), motions: moved.iter().map(|one| one.motion).collect() }
    }

    fn scale(&self) -> f64 {
        self.of.iter().map(|one| one.loss.sigma).fold(f64::INFINITY, f64::min)
    }

    fn trace(&self, evaluation: &Evaluation) {
        let first = &self.of[0];
        let Some(stage) = first.stage else { return };
        first.monitor.note(TracePoint {
            stage,
            evaluations: first.monitor.evaluations(),
            points: self.of.iter().map(|one| one.points.len()).sum(),
            sigma: self.scale(),
            objective: evaluation.value,
            inliers: evaluation.inliers() / self.of.iter().map(|one| one.points.weight()).sum::<f64>(),
        });
    }
}
