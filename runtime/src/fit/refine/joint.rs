//! The refinement of one shape and of its poses in several scans, all at once: from a coarse scale of the loss to the
//! final one, as `schedule` does it for one scan.

use super::schedule::{Guess, Solution, final_loss, foot_tolerance, suggested_loss};
use crate::fit::correspond::cache::FootCache;
use crate::fit::optimise::gauss_newton::{self, Stop, Target};
use crate::fit::optimise::joint::{JointEstimate, JointObjective};
use crate::fit::problem::Problem;
use crate::fit::problem::level::Level;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Evaluation, Objective, Order, foot_cache};
use crate::fit::problem::points::Points;
use crate::fit::problem::sides::Sides;
use crate::fit::tuning::{
    ANNEALING_ITERATIONS, ANNEALING_LEVELS, ANNEALING_POINTS, ANNEALING_START, ANNEALING_STEP, CHORD, COMPARED, FINE,
    JOINT_SCALES, POLISH_ITERATIONS, POLISH_STEP, RUNG_ITERATIONS, RUNG_STEP, SCALE_SETTLED,
};
use crate::model::EvaluationError;
use std::sync::Arc;

/// A shape in several scans.
#[derive(Clone)]
pub(crate) struct Joint<'a> {
    /// By scan. Their spaces have the same scales.
    pub(crate) members: Vec<Member<'a>>,
    pub(crate) estimate: JointEstimate,
    pub(crate) iterations: u32,
    pub(crate) converged: bool,
}

/// One of the scans.
#[derive(Clone)]
pub(crate) struct Member<'a> {
    pub(crate) level: Level<'a>,
    pub(crate) loss: Loss,
    /// Per patch, which way is out (see `Facing`).
    pub(crate) signs: Vec<i8>,
}

impl<'a> Joint<'a> {
    /// A shape and its poses by some problems' scans, at the scale at which a registration ends. The space of the
    /// shape is that of `level`.
    ///
    /// # Errors
    /// The model cannot be evaluated there.
    pub(crate) fn new(
        problems: &[&'a Problem<'a>],
        level: &Level<'a>,
        estimate: JointEstimate,
    ) -> Result<Self, EvaluationError> {
        let mut members: Vec<Member<'a>> = Vec::new();
        for (scan, problem) in problems.iter().enumerate() {
            let own = Level::new(problem, level.space.clone(), &estimate.of(scan), CHORD)?;
            // The scales of coordinates are the first scan's for all.
            let space = members.first().map_or_else(|| own.space.clone(), |first| first.level.space.clone());
            let level = Level { space, ..own };
            let loss = Loss::welsch(FINE * problem.radius);
            let signs = sides(&level, &estimate, scan, loss);
            members.push(Member { level, loss, signs });
        }
        Ok(Self { members, estimate, iterations: 0, converged: false })
    }

    /// The same with the losses and the steps of another one.
    pub(crate) fn like(mut self, other: &Self) -> Self {
        self.members.iter_mut().zip(&other.members).for_each(|(member, other)| member.loss = other.loss);
        Self { iterations: other.iterations, ..self.sided() }
    }

    /// The same shape in some of the scans only, where it may become another one.
    pub(crate) fn of_scans(&self, scans: &[usize]) -> Self {
        let members = scans.iter().map(|scan| self.members[*scan].clone()).collect();
        let motions = scans.iter().map(|scan| self.estimate.motions[*scan]).collect();
        let estimate = JointEstimate { z: self.estimate.z.clone(), motions };
        Self { members, estimate, iterations: 0, converged: false }
    }

    /// Coordinates of the shape.
    pub(crate) fn free(&self) -> usize {
        self.members[0].level.space.free.len()
    }

    /// The objective over some points of every scan.
    fn objective<'s>(&'s self, points: &'s [Points], losses: &[Loss]) -> JointObjective<'s> {
        let of = self.members.iter().zip(points).zip(losses);
        let of = of.map(|((member, points), loss)| Objective {
            signs: Some(&member.signs),
            ..member.level.objective(points, *loss)
        });
        JointObjective { of: of.collect(), shares: self.shares() }
    }

    /// By scan, the share of its points among all, by their prior weights.
    pub(crate) fn shares(&self) -> Vec<f64> {
        let weights: Vec<f64> = self.members.iter().map(|member| member.level.problem.points.weight()).collect();
        let all: f64 = weights.iter().sum();
        weights.into_iter().map(|weight| weight / all).collect()
    }

    fn samples(&self, count: usize) -> Vec<Points> {
        self.members.iter().map(|member| member.level.problem.thin.sample(count)).collect()
    }

    fn losses(&self) -> Vec<Loss> {
        self.members.iter().map(|member| member.loss).collect()
    }

    /// By scan, the scale of its loss. Millimetres.
    pub(crate) fn scales(&self) -> Vec<f64> {
        self.members.iter().map(|member| member.loss.sigma).collect()
    }

    /// The mean loss of some of the points by Welsch's loss of given scales. Infinite where the model does not exist.
    pub(crate) fn value(&self, scales: &[f64]) -> f64 {
        let losses: Vec<Loss> = scales.iter().map(|sigma| Loss::welsch(*sigma)).collect();
        let points = self.samples(ANNEALING_POINTS);
        let evaluation = self.objective(&points, &losses).evaluated(&self.estimate, Order::Value);
        evaluation.map_or(f64::INFINITY, |evaluation| evaluation.value)
    }

    /// By scan, the share of points near the model at the scale at which a registration ends, or at that of its loss,
    /// if the noise makes that larger.
    pub(crate) fn near(&self) -> Vec<f64> {
        self.within(|member| Loss::welsch(near_scale(member.level.problem, member.loss)))
    }

    /// By scan, the share of points near the model at the scale of its loss.
    pub(crate) fn inliers(&self) -> Vec<f64> {
        self.within(|member| member.loss)
    }

    fn within(&self, loss: impl Fn(&Member) -> Loss) -> Vec<f64> {
        let points = self.samples(COMPARED);
        let near = |(scan, points): (usize, &Points)| {
            let level = &self.members[scan].level;
            let objective = level.objective(points, loss(&self.members[scan]));
            let evaluation = objective.evaluate(&self.estimate.of(scan), Order::Value);
            evaluation.map_or(0.0, |evaluation| evaluation.inliers() / points.weight())
        };
        points.iter().enumerate().map(near).collect()
    }

    /// Brings a coarse place nearer, by few points and scales that come down to that at which a registration ends. The
    /// shape may still be wrong where no scan has shown it until now.
    pub(crate) fn settle(mut self) -> Self {
        let points = self.samples(COMPARED);
        for scale in JOINT_SCALES {
            let losses: Vec<Loss> =
                self.members.iter().map(|member| Loss::welsch(scale * member.level.problem.radius)).collect();
            let step = self.objective(&points, &losses).scale() * RUNG_STEP;
            self = self.minimised(&points, &losses, Stop { iterations: RUNG_ITERATIONS, step });
        }
        self.sided()
    }

    /// Follows the scales of the losses down to those that the residuals suggest, unless one is `given`.
    pub(crate) fn anneal(mut self, given: Option<Loss>) -> Self {
        let points = self.samples(ANNEALING_POINTS);
        for member in &mut self.members {
            member.loss = given.unwrap_or(Loss::welsch(ANNEALING_START * member.level.problem.radius));
        }
        self.sided().follow(&points, given)
    }

    /// Follows the scales of the losses from the present ones down to those that the residuals suggest, unless one is
    /// `given`.
    pub(crate) fn refine(self, given: Option<Loss>) -> Self {
        let points = self.samples(ANNEALING_POINTS);
        self.follow(&points, given)
    }

    fn follow(mut self, points: &[Points], given: Option<Loss>) -> Self {
        for _ in 0..ANNEALING_LEVELS {
            let losses = self.losses();
            let step = self.objective(points, &losses).scale() * ANNEALING_STEP;
            self = self.minimised(points, &losses, Stop { iterations: ANNEALING_ITERATIONS, step });
            let next: Vec<Loss> = (0..self.members.len())
                .map(|scan| {
                    given.unwrap_or_else(|| suggested_loss(&self.members[scan].level, &points[scan], &self.guess(scan)))
                })
                .collect();
            let settled = next.iter().zip(&losses).all(|(next, loss)| next.sigma > SCALE_SETTLED * loss.sigma);
            self.members.iter_mut().zip(next).for_each(|(member, loss)| member.loss = loss);
            if settled {
                break;
            }
        }
        let last = |scan: usize| given.unwrap_or_else(|| final_loss(&self.members[scan].level, &self.guess(scan)));
        let last: Vec<Loss> = (0..self.members.len()).map(last).collect();
        self.members.iter_mut().zip(last).for_each(|(member, loss)| member.loss = loss);
        self.sided()
    }

    /// Gauss-Newton over all points at the final scales, down to steps of `step` scales, traced as those of `stage`, if
    /// there is one.
    pub(crate) fn polish(self, step: f64, stage: Option<&'static str>) -> Self {
        let points: Vec<&Points> = self.members.iter().map(|member| &member.level.problem.points).collect();
        let caches: Vec<Arc<FootCache>> =
            self.members.iter().zip(&points).map(|(member, points)| foot_cache(points, member.loss.sigma)).collect();
        let of = self.members.iter().zip(points).zip(caches).map(|((member, points), cache)| Objective {
            signs: Some(&member.signs),
            tolerance: foot_tolerance(member.loss, member.level.problem.radius),
            cache: Some(cache),
            curved: true,
            stage,
            ..member.level.objective(points, member.loss)
        });
        let objective = JointObjective { of: of.collect(), shares: self.shares() };
        let stop = Stop { iterations: POLISH_ITERATIONS, step: step * POLISH_STEP * objective.scale() };
        let Some(minimum) = gauss_newton::minimise(&objective, self.estimate.clone(), stop) else { return self };
        let iterations = self.iterations + minimum.iterations;
        Self { estimate: minimum.estimate, converged: minimum.converged, iterations, ..self }
    }

    /// The solutions of the scans one by one. None where the model does not exist.
    pub(crate) fn solutions(&self) -> Option<Vec<Solution<'a>>> {
        let solution = |(scan, member): (usize, &Member<'a>)| {
            let Member { level, loss, signs } = member.clone();
            let estimate = self.estimate.of(scan);
            let points = &level.problem.points;
            let cache = foot_cache(points, loss.sigma);
            let objective = Objective {
                signs: Some(&signs),
                tolerance: foot_tolerance(loss, level.problem.radius),
                cache: Some(cache.clone()),
                curved: true,
                cancellable: false,
                ..level.objective(points, loss)
            };
            let evaluation: Evaluation = objective.evaluate(&estimate, Order::Normal)?;
            let (converged, iterations) = (self.converged, self.iterations);
            let apart_at = None;
            Some(Solution { level, estimate, evaluation, loss, signs, converged, cache, iterations, apart_at })
        };
        self.members.iter().enumerate().map(solution).collect()
    }

    fn guess(&self, scan: usize) -> Guess {
        let Member { loss, signs, .. } = &self.members[scan];
        Guess { estimate: self.estimate.of(scan), loss: *loss, signs: signs.clone(), iterations: 0 }
    }

    fn minimised(self, points: &[Points], losses: &[Loss], stop: Stop) -> Self {
        let objective = self.objective(points, losses);
        let Some(minimum) = gauss_newton::minimise(&objective, self.estimate.clone(), stop) else { return self };
        let iterations = self.iterations + minimum.iterations;
        Self { estimate: minimum.estimate, iterations, ..self }
    }

    /// The same with the sides of patches learnt anew.
    fn sided(mut self) -> Self {
        for scan in 0..self.members.len() {
            let Member { level, loss, .. } = &self.members[scan];
            self.members[scan].signs = sides(level, &self.estimate, scan, *loss);
        }
        self
    }
}

/// The scale at which points of a scan are near a model. Millimetres.
pub(crate) fn near_scale(problem: &Problem, loss: Loss) -> f64 {
    loss.sigma.max(FINE * problem.radius)
}

/// Per patch, which way is out in one of the scans.
fn sides(level: &Level, estimate: &JointEstimate, scan: usize, loss: Loss) -> Vec<i8> {
    let sides = Sides::of(level, &estimate.of(scan), loss);
    sides.map_or_else(|| vec![0; level.problem.model.parts().len()], |sides| sides.signs)
}
