//! The whole model turned: the head of a screw fits after every sixth of a turn, and its thread gives way a little; a
//! tray fits the other way round, but for the lug on one of its walls. Such poses are far apart, and a search that has
//! found one of them has no reason to look for the others.

use super::base::Base;
use super::{Rival, RivalOf};
use crate::eigen;
use crate::fit::optimise::gauss_newton::{self, Stop};
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Objective, Order};
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::points::moments;
use crate::fit::register::group::least_turn;
use crate::fit::tuning::{
    RIVAL_COARSE, RIVAL_ITERATIONS, RIVAL_STEP, TURN_POINTS, TURN_REFINED_POINTS, TURN_SAME_AXIS, TURN_STEPS,
    TURNS_REFINED,
};
use glam::DVec3;
use nalgebra::Matrix3;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// An axis through a point, in the model's frame.
#[derive(Clone, Copy)]
struct Through {
    point: DVec3,
    direction: DVec3,
}

/// The model in another pose, by the mean loss at a coarse scale.
struct Turned {
    loss: f64,
    motion: Isometry,
    degrees: f64,
}

/// The rivals of the solution that are other poses of the whole model. They are found by a base of fewer points.
pub(super) fn rivals(base: &Base) -> Vec<Rival> {
    let level = base.level();
    if !level.space.moving {
        return Vec::new();
    }
    let sample = base.sample.standing_for_all(TURN_REFINED_POINTS);
    let Some(few) = Base::new(base.solution, base.uncertainty, &sample) else { return Vec::new() };
    let coarse = Loss::welsch(base.solution.loss.sigma.max(RIVAL_COARSE * level.problem.radius));
    let points = few.sample.every(TURN_POINTS);
    let objective = Objective { loss: coarse, cancellable: true, ..base.solution.objective(&points) };
    let Some(axes) = axes(&objective, &base.estimate) else { return Vec::new() };
    let mut turned: Vec<Turned> = axes.iter().flat_map(|axis| least_losses(&objective, &base.estimate, axis)).collect();
    turned.sort_by(|a, b| a.loss.total_cmp(&b.loss));
    turned.truncate(TURNS_REFINED);
    let stop = Stop { iterations: RIVAL_ITERATIONS, step: RIVAL_STEP * base.solution.loss.sigma };
    let refined = |Turned { motion, degrees, .. }: Turned| {
        let from = Estimate { motion, ..base.estimate.clone() };
        let objective = Objective { loss: coarse, cancellable: true, ..base.solution.objective(few.sample) };
        let near = gauss_newton::minimise(&objective, from, stop)?.estimate;
        let members: Vec<usize> = (0..level.space.free.len()).collect();
        let near = few.survivor(&members, near)?;
        let of = RivalOf { members, patches: vec![true; level.problem.model.parts().len()], turned: Some(degrees) };
        base.rival(of, near)
    };
    turned.into_par_iter().filter_map(refined).collect()
}

/// The axis about which a turn moves the surface least, and the principal axes of the scan where it lies near the
/// model. None where the model does not exist.
fn axes(objective: &Objective, at: &Estimate) -> Option<Vec<Through>> {
    let placed = objective.place(at).ok()?;
    let feet: Vec<DVec3> = objective.feet(&placed).iter().map(|(_, foot)| foot.point).collect();
    let (point, covariance) = moments(&feet);
    let columns = covariance.to_cols_array();
    let eigen = eigen::symmetric(Matrix3::from_column_slice(&columns));
    let principal = (0..3).map(|k| {
        let e = eigen.eigenvectors.column(k);
        Through { point, direction: DVec3::new(e[0], e[1], e[2]) }
    });
    let least = least_turn(objective, at).map(|axis| {
        let (point, direction) = axis.line(objective.space.centre);
        Through { point, direction }
    });
    let mut axes: Vec<Through> = Vec::new();
    for axis in least.into_iter().chain(principal) {
        let is_new = |other: &Through| other.direction.dot(axis.direction).abs() < TURN_SAME_AXIS;
        if axis.direction.is_finite() && axes.iter().all(is_new) {
            axes.push(axis);
        }
    }
    Some(axes)
}

/// The turns about an axis at which the mean loss is least among its neighbours.
fn least_losses(objective: &Objective, at: &Estimate, axis: &Through) -> Vec<Turned> {
    let turned = |k: u32| {
        let angle = TAU * f64::from(k) / f64::from(TURN_STEPS);
        let motion = at.motion.after_local(DVec3::ZERO, axis.direction * angle, axis.point);
        let estimate = Estimate { motion, ..at.clone() };
        let loss = objective.evaluate(&estimate, Order::Value).map_or(f64::INFINITY, |e| e.value);
        Turned { loss, motion, degrees: angle.to_degrees() }
    };
    let all: Vec<Turned> = (0..TURN_STEPS).into_par_iter().map(turned).collect();
    let losses: Vec<f64> = all.iter().map(|t| t.loss).collect();
    let count = losses.len();
    let is_least = |k: usize| losses[k] <= losses[(k + 1) % count] && losses[k] <= losses[(k + count - 1) % count];
    all.into_iter().enumerate().skip(1).filter(|(k, t)| is_least(*k) && t.loss.is_finite()).map(|(_, t)| t).collect()
}
