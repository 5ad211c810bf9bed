//! The whole model turned: the head of a screw fits after every sixth of a turn, and its thread gives way a little; a
//! tray fits the other way round, but for the lug on one of its walls, and an angle bracket with its legs exchanged
//! takes other lengths for them. Such poses are far apart, and a search that has found one of them has no reason to
//! look for the others.

use super::base::Base;
use super::names::Named;
use super::{Rival, RivalOf, frames};
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
use glam::{DMat3, DQuat, DVec3};
use nalgebra::Matrix3;
use rayon::prelude::*;
use std::cmp::Ordering;
use std::f64::consts::TAU;

/// An axis through a point, in the model's frame.
#[derive(Clone, Copy)]
struct Through {
    point: DVec3,
    direction: DVec3,
}

/// The model in another pose, by the mean loss.
#[derive(Clone)]
pub(super) struct Turned {
    pub(super) loss: f64,
    pub(super) estimate: Estimate,
    /// Positions of the parameters that have another name's value, which the scan leaves open.
    pub(super) open: Vec<usize>,
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
    let Some(turns) = Turns::of(base, &objective) else { return Vec::new() };
    let mut turned: Vec<Turned> = turns.axes().iter().flat_map(|axis| turns.least_losses(axis)).collect();
    let rotations = frames::rotations(&turns.normals);
    turned.extend(turns.between_planes(&rotations));
    turned.sort_by(by_loss);
    let mut turned = distinct(turned);
    turned.truncate(TURNS_REFINED);
    let own_loss = Objective { cancellable: true, ..base.solution.objective(few.sample) };
    turned.extend(turns.renamed(&rotations, &own_loss));
    let stop = Stop { iterations: RIVAL_ITERATIONS, step: RIVAL_STEP * base.solution.loss.sigma };
    let refined = |Turned { estimate: from, open, .. }: Turned| {
        let objective = Objective { loss: coarse, cancellable: true, ..base.solution.objective(few.sample) };
        let near = gauss_newton::minimise(&objective, from, stop)?.estimate;
        let members: Vec<usize> = (0..level.space.free.len()).collect();
        // What is divided for the solution's shape is not for one with its lengths exchanged.
        let own = level.around(&near).ok()?;
        let near = few.survivor(&own, &members, near)?;
        let of = RivalOf { members, patches: vec![true; level.problem.model.parts().len()], turned: true, open };
        base.rival(&own, of, near)
    };
    turned.into_par_iter().filter_map(refined).collect()
}

fn by_loss(a: &Turned, b: &Turned) -> Ordering {
    a.loss.total_cmp(&b.loss)
}

/// The first of those that are nearly the same pose of the same shape: turns about an axis are among those that take
/// planes to planes, too.
fn distinct(all: Vec<Turned>) -> Vec<Turned> {
    let apart = 0.5 * TAU / f64::from(TURN_STEPS);
    let is_same = |a: &Estimate, b: &Estimate| a.z == b.z && a.motion.rotation.angle_between(b.motion.rotation) < apart;
    let mut found: Vec<Turned> = Vec::new();
    for turned in all {
        if !found.iter().any(|other| is_same(&other.estimate, &turned.estimate)) {
            found.push(turned);
        }
    }
    found
}

/// The turns of the model about the middle of what is scanned.
pub(super) struct Turns<'a> {
    pub(super) base: &'a Base<'a>,
    pub(super) objective: &'a Objective<'a>,
    /// The mean of the model's points next to the scan's, their covariance, and the unit normals there.
    about: DVec3,
    covariance: DMat3,
    normals: Vec<DVec3>,
    /// The model's points themselves.
    pub(super) feet: Vec<DVec3>,
    /// The centre of the model's surface.
    pub(super) middle: DVec3,
}

impl<'a> Turns<'a> {
    /// None where the model does not exist.
    fn of(base: &'a Base<'a>, objective: &'a Objective<'a>) -> Option<Self> {
        let placed = objective.place(&base.estimate).ok()?;
        let feet = objective.feet(&placed);
        let normals = feet.iter().map(|(_, foot)| foot.normal.normalize_or_zero()).collect();
        let points: Vec<DVec3> = feet.iter().map(|(_, foot)| foot.point).collect();
        let (about, covariance) = moments(&points);
        let middle = placed.facets.moments().0;
        Some(Self { base, objective, about, covariance, normals, feet: points, middle })
    }

    /// The axis about which a turn moves the surface least, and the principal axes of the scan where it lies near the
    /// model.
    fn axes(&self) -> Vec<Through> {
        let columns = self.covariance.to_cols_array();
        let eigen = eigen::symmetric(Matrix3::from_column_slice(&columns));
        let principal = (0..3).map(|k| {
            let e = eigen.eigenvectors.column(k);
            Through { point: self.about, direction: DVec3::new(e[0], e[1], e[2]) }
        });
        let least = least_turn(self.objective, &self.base.estimate).map(|axis| {
            let (point, direction) = axis.line(self.objective.space.centre);
            Through { point, direction }
        });
        let mut axes: Vec<Through> = Vec::new();
        for axis in least.into_iter().chain(principal) {
            let is_new = |other: &Through| other.direction.dot(axis.direction).abs() < TURN_SAME_AXIS;
            if axis.direction.is_finite() && axes.iter().all(is_new) {
                axes.push(axis);
            }
        }
        axes
    }

    /// The turns about an axis at which the mean loss is least among its neighbours.
    fn least_losses(&self, axis: &Through) -> Vec<Turned> {
        let turned = |k: u32| {
            let angle = TAU * f64::from(k) / f64::from(TURN_STEPS);
            self.turned(DQuat::from_scaled_axis(axis.direction * angle), axis.point)
        };
        let all: Vec<Turned> = (0..TURN_STEPS).into_par_iter().map(turned).collect();
        let losses: Vec<f64> = all.iter().map(|t| t.loss).collect();
        let count = losses.len();
        let is_least = |k: usize| losses[k] <= losses[(k + 1) % count] && losses[k] <= losses[(k + count - 1) % count];
        all.into_iter()
            .enumerate()
            .skip(1)
            .filter(|(k, t)| is_least(*k) && t.loss.is_finite())
            .map(|(_, t)| t)
            .collect()
    }

    /// The rotations that take planes of the model to planes of it, each with the parameters as they are, and with
    /// those two exchanged that are best.
    fn between_planes(&self, rotations: &[DQuat]) -> Vec<Turned> {
        let exchanged = if rotations.is_empty() { Vec::new() } else { self.exchanged(&self.named()) };
        let ways = |(k, rotation): (usize, &DQuat)| {
            // The mean of few points is beside the middle of a thread, and the model's middle beside that of a half.
            // The first rotation is none.
            let abouts = if k > 0 { &[self.about, self.middle][..] } else { &[] };
            let turned = abouts.iter().map(|about| self.turned(*rotation, *about)).min_by(by_loss);
            let exchanged = exchanged.iter().map(|shape| self.placed(shape, *rotation)).min_by(by_loss);
            [turned, exchanged].into_iter().flatten().collect::<Vec<Turned>>()
        };
        let all = rotations.par_iter().enumerate().flat_map_iter(ways);
        all.filter(|t| t.loss.is_finite()).collect()
    }

    /// Another shape in the solution's place, turned.
    pub(super) fn placed(&self, shape: &Named, rotation: DQuat) -> Turned {
        // The middle of the surface stays where it is; that of what is scanned of another shape is not known.
        let from = self.about + shape.middle - self.middle;
        let to = self.base.estimate.motion.apply(self.about);
        let motion = Isometry::taking(self.base.estimate.motion.rotation * rotation, from, to);
        self.at(Estimate { motion, ..shape.estimate.clone() })
    }

    fn turned(&self, rotation: DQuat, about: DVec3) -> Turned {
        let motion = self.base.estimate.motion.after_local(DVec3::ZERO, rotation.to_scaled_axis(), about);
        self.at(Estimate { motion, ..self.base.estimate.clone() })
    }

    pub(super) fn at(&self, estimate: Estimate) -> Turned {
        Turned::by(self.objective, estimate)
    }
}

impl Turned {
    /// A pose by an objective.
    pub(super) fn by(objective: &Objective, estimate: Estimate) -> Self {
        let loss = objective.evaluate(&estimate, Order::Value).map_or(f64::INFINITY, |e| e.value);
        Self { loss, estimate, open: Vec::new() }
    }
}
