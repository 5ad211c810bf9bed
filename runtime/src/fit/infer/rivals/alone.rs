//! Shapes of one group's patches, by the points that are theirs alone: cheap enough to look all over the bounds.

use super::base::Base;
use super::{Rival, RivalOf};
use crate::fit::correspond::layout::Layout;
use crate::fit::optimise::gauss_newton::{self, Stop};
use crate::fit::problem::level::Level;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::Objective;
use crate::fit::problem::parameterization::Parameterization;
use crate::fit::problem::points::Points;
use crate::fit::refine::schedule::Solution;
use crate::fit::register::group::{Group, GroupLosses};
use crate::fit::tuning::{
    MODEL_SIZE, PART_CHORD, RIVAL_COARSE, RIVAL_DEVIATIONS, RIVAL_DOUBLINGS, RIVAL_EVIDENCE, RIVAL_FEW_OTHERS,
    RIVAL_FEW_OWN, RIVAL_ITERATIONS, RIVAL_LEAST_POINTS, RIVAL_POINTS, RIVAL_POINTS_OF_UNSEEN, RIVAL_STEP,
    RIVAL_VALUES, RIVALS_JOINTLY,
};
use rayon::prelude::*;

/// The patches of one group alone, with the points that are theirs.
pub(super) struct Alone<'s> {
    base: &'s Base<'s>,
    group: &'s Group,
    layout: Layout,
    points: Points,
    /// Fewer points than the base's that stand for them: most of the group's own, and some of the others. None where
    /// they would not be much fewer.
    few: Option<Points>,
    /// n times the share of these points in the weight of all, over the mean loss of all.
    per_loss: f64,
    /// The parameters at the optimum over these points next to the base, and the mean loss there.
    x: Vec<f64>,
    loss: f64,
}

/// A shape with the evidence against it, by the group's own points.
#[derive(Clone)]
struct Shape {
    x: Vec<f64>,
    evidence: f64,
}

impl<'s> Alone<'s> {
    /// None where the group has hardly any points, or the model does not exist.
    pub(super) fn new(base: &'s Base<'s>, group: &'s Group) -> Option<Self> {
        let Base { solution, uncertainty, sample, .. } = base;
        let problem = solution.level.problem;
        let losses = group.losses(&solution.objective(sample), &base.estimate)?;
        if losses.own_points().count() < RIVAL_LEAST_POINTS {
            return None;
        }
        // Of a hole in a wrong place the scan has no points, and those of the wall of its own hole are near no patch.
        let sums = group.patches.iter().zip(&solution.evaluation.patches);
        let is_unseen = sums.filter(|(shaped, _)| **shaped).any(|(_, sum)| sum.is_hidden());
        let (own, most) = if is_unseen {
            (sample.pick(losses.own_or_unexplained_points()), RIVAL_POINTS_OF_UNSEEN)
        } else {
            (sample.pick(losses.own_points()), RIVAL_POINTS)
        };
        let instance = problem.model.instantiate(&base.x).ok()?;
        let (tolerance, size) = (PART_CHORD * problem.radius, MODEL_SIZE * problem.radius);
        let layout = Layout::of_patches(problem.model, &*instance, tolerance, size, |patch| group.patches[patch]);
        let share = own.weight() / sample.weight();
        let per_loss = uncertainty.effective_points * share / base.mean.max(f64::MIN_POSITIVE);
        let points = own.every(most);
        let few = few_for(sample, &losses);
        let alone = Self { base, group, layout, points, few, per_loss, x: base.x.clone(), loss: 0.0 };
        let Shape { x, evidence } = alone.best(&base.x, None, false)?;
        Some(Self { loss: evidence / per_loss, x, ..alone })
    }

    /// The space of the group's parameters about `x`, one of them held at its value there.
    fn space(&self, x: &[f64], held: Option<usize>) -> Parameterization<'s> {
        let Level { problem, space: all, .. } = self.base.level();
        let free = self.group.members.iter().filter(|k| Some(**k) != held).map(|k| all.free[*k]).collect();
        let mut space = Parameterization::new(problem.model, x, free, false, &all.ties);
        space.copy_scale(all);
        space
    }

    fn objective<'o>(&'o self, space: &'o Parameterization<'o>, loss: Loss) -> Objective<'o> {
        let objective = self.base.solution.objective(&self.points);
        Objective {
            space,
            layout: &self.layout,
            loss,
            coverage: None,
            separation: None,
            cancellable: true,
            ..objective
        }
    }

    /// The best shape from `x` on, one parameter held at its value there: at a coarse scale first where that is asked
    /// for.
    fn best(&self, x: &[f64], held: Option<usize>, coarse: bool) -> Option<Shape> {
        let space = self.space(x, held);
        let Base { solution: Solution { loss, level, .. }, estimate, .. } = self.base;
        let stop = Stop { iterations: RIVAL_ITERATIONS, step: RIVAL_STEP * loss.sigma };
        let mut at = space.estimate(x, estimate.motion);
        if coarse {
            let loss = Loss::welsch(loss.sigma.max(RIVAL_COARSE * level.problem.radius));
            at = gauss_newton::minimise(&self.objective(&space, loss), at, stop)?.estimate;
        }
        let minimum = gauss_newton::minimise(&self.objective(&space, *loss), at, stop)?;
        let evidence = self.per_loss * (minimum.evaluation.value - self.loss);
        Some(Shape { x: space.x(&minimum.estimate.z)?, evidence })
    }

    /// All rivals of the solution in this group.
    pub(super) fn rivals(&self) -> Vec<Rival> {
        let ways: Vec<(usize, f64)> = self.group.members.iter().flat_map(|k| [(*k, 1.0), (*k, -1.0)]).collect();
        let walked = ways.into_par_iter().flat_map_iter(|(k, side)| {
            let mut shapes = self.in_other_basins(k, side);
            shapes.extend(self.along_valley(k, side));
            shapes
        });
        let mut shapes: Vec<Shape> = walked.filter(|shape| shape.evidence < RIVALS_JOINTLY).collect();
        shapes.sort_by(|a, b| a.evidence.total_cmp(&b.evidence));
        let mut distinct: Vec<Shape> = Vec::new();
        for shape in shapes {
            let apart = |other: &[f64]| self.base.apart(self.group, other, &shape.x) > RIVAL_DEVIATIONS;
            // Parameters that the scan does not determine at the solution are compared by the evidence alone.
            let is_another = apart(&self.x) || shape.evidence < -RIVAL_EVIDENCE;
            if is_another && distinct.iter().all(|other| apart(&other.x)) {
                distinct.push(shape);
            }
        }
        if distinct.is_empty() {
            return Vec::new();
        }
        let Base { solution, uncertainty, .. } = *self.base;
        let few = self.few.as_ref().and_then(|few| Base::new(solution, uncertainty, few));
        let rival = |shape: Shape| {
            let mut from = self.base.level().space.estimate(&shape.x, self.base.estimate.motion);
            if let Some(few) = &few {
                from = few.survivor(self.base.level(), &self.group.members, from)?;
            }
            let Group { members, patches } = self.group;
            let of = RivalOf { members: members.clone(), patches: patches.clone(), turned: false, open: Vec::new() };
            self.base.rival(self.base.level(), of, from)
        };
        distinct.into_par_iter().filter_map(rival).collect()
    }

    /// The farthest shape on one side of the solution's, at distances in parameter k that double as long as it explains
    /// the scan as well.
    fn along_valley(&self, k: usize, side: f64) -> Option<Shape> {
        let Base { uncertainty, estimate, .. } = self.base;
        let space = &self.base.level().space;
        let deviation = uncertainty.covariance[(k, k)].sqrt();
        if !(deviation > 0.0) {
            return None;
        }
        let present = space.estimate(&self.x, estimate.motion);
        let mut farthest: Option<Shape> = None;
        for n in 0..RIVAL_DOUBLINGS {
            let mut step = vec![0.0; space.dim()];
            step[k] = side * 1.5 * RIVAL_DEVIATIONS * deviation * f64::from(1 << n);
            let there = space.retract(&present, &step);
            let mut x = farthest.as_ref().map_or_else(|| self.x.clone(), |shape| shape.x.clone());
            let Some(moved) = space.x(&there.z).filter(|_| there.z[k] != present.z[k]) else { break };
            self.set(&mut x, k, &moved);
            match self.best(&x, Some(k), false).filter(|shape| shape.evidence < RIVAL_EVIDENCE) {
                Some(shape) => farthest = Some(shape),
                None => break,
            }
        }
        farthest
    }

    /// Shapes that are found from values of parameter k all over its bounds, on one side of the solution's.
    fn in_other_basins(&self, k: usize, side: f64) -> Vec<Shape> {
        let Level { problem, space, .. } = self.base.level();
        let present = space.estimate(&self.x, self.base.estimate.motion);
        let (low, high) = space.search_range(k, present.z[k], problem.radius);
        let values = (0..RIVAL_VALUES).map(|n| low + (high - low) * (f64::from(n) + 0.5) / f64::from(RIVAL_VALUES));
        let mut values: Vec<f64> = values.filter(|z| side * (z - present.z[k]) > 0.0).collect();
        values.sort_by(|a, b| (side * a).total_cmp(&(side * b)));
        let mut x = self.x.clone();
        let mut shapes = Vec::new();
        for value in values {
            let mut there = present.clone();
            there.z[k] = value;
            let Some(moved) = space.x(&there.z) else { break };
            self.set(&mut x, k, &moved);
            let Some(held) = self.best(&x, Some(k), true) else { break };
            shapes.extend(self.best(&held.x, None, false));
            x = held.x;
        }
        shapes
    }

    /// Takes the value of parameter k, and of those that follow it, from another list.
    fn set(&self, x: &mut [f64], k: usize, from: &[f64]) {
        let space = &self.base.level().space;
        space.followers(space.free[k]).for_each(|i| x[i] = from[i]);
    }
}

/// Points of a sample that stand for all of it where only the patches of a group differ. Nearly all of what tells two
/// of its shapes apart are its own points; the others hold the rest of the model.
fn few_for(sample: &Points, losses: &GroupLosses) -> Option<Points> {
    let mut is_own = vec![false; sample.len()];
    losses.own_points().for_each(|i| is_own[i] = true);
    let [own, others] = [true, false].map(|side| sample.pick((0..sample.len()).filter(|i| is_own[*i] == side)));
    let few = own.standing_for_all(RIVAL_FEW_OWN).and(&others.standing_for_all(RIVAL_FEW_OTHERS));
    (2 * few.len() <= sample.len()).then_some(few)
}
