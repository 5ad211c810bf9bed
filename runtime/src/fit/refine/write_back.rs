//! The motion written back into the script's own pose parameters.

use super::schedule::{Guess, POLISH, Solution, polish};
use crate::fit::optimise::gauss_newton::{Damping, damped_step};
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::level::Level;
use crate::fit::problem::objective::Evaluation;
use crate::fit::problem::parameterization::Parameterization;
use crate::fit::problem::points::mean;
use crate::fit::problem::rigid::VelocityField;
use crate::fit::tuning::{CHORD, POSE_LAST_ROUNDS, POSE_ROUNDS, POSE_STEPS, POSE_TURN, WRITTEN_BACK};
use crate::model::{EvaluationError, Model};
use glam::{DQuat, DVec3};
use gml_compiler::program::Quantity;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Puts the motion into the script's pose parameters, if they take it, and goes on to the optimum in the script's own
/// coordinates.
pub(crate) fn write_back(solution: Solution) -> Solution {
    let problem = solution.level.problem;
    let x = solution.level.space.x(&solution.estimate.z);
    let Some(x) = x.filter(|_| problem.pose.write_back) else { return solution };
    let (level, guess) = solution.into_guess();
    let (level, guess) = in_own_coordinates(level, guess, &x);
    polish(level, &problem.points, guess, Some(POLISH))
}

/// The level on which the script's pose parameters vary instead of the motion, and where on it `guess` lies, whose
/// parameters are `x`.
fn in_own_coordinates<'a>(level: Level<'a>, guess: Guess, x: &[f64]) -> (Level<'a>, Guess) {
    let problem = level.problem;
    let indices = &problem.rigid.indices;
    let (mut x, off) = match parameters_at(problem.model, x, indices, &guess.estimate.motion) {
        Ok(written) => written,
        Err(error) => {
            problem.monitor.warn(format!("the pose could not be written into the script's parameters: {error}"));
            return (level, guess);
        }
    };
    for i in indices {
        x[*i] = principal(x[*i], problem.model, &x, *i);
    }
    if off > WRITTEN_BACK * problem.radius {
        problem.monitor.warn(format!("the script's pose parameters reproduce the pose found only to {off:.3} mm"));
    }
    let start = &problem.start;
    let mut space = Parameterization::new(problem.model, &x, start.free().collect(), false, &start.ties);
    space.centre = level.space.centre;
    let estimate = space.estimate(&x, Isometry::IDENTITY);
    let level = Level::new(problem, space.clone(), &estimate, CHORD).unwrap_or_else(|error| {
        problem.monitor.warn(format!("the model could not be evaluated in its final pose: {error}"));
        Level { space, ..level }
    });
    (level, Guess { estimate, ..guess })
}

/// Angles are reported between -half a turn and half a turn where the bounds allow.
fn principal(value: f64, model: &dyn Model, x: &[f64], i: usize) -> f64 {
    if model.parameters()[i].quantity != Quantity::Angle {
        return value;
    }
    let (low, high) = model.bounds(x)[i];
    let turned = value - TAU * (value / TAU).round();
    if turned >= low && turned <= high { turned } else { value }
}

/// Finds values of the rigid parameters `indices` for which the model at `x` lies where `motion` takes the model at
/// `x`: M(x') = motion(M(x)). The motion is walked in small steps, so that angles follow it. Returns the new x and the
/// largest distance that remains.
///
/// # Errors
/// The model cannot be evaluated.
pub(crate) fn parameters_at(
    model: &dyn Model,
    x: &[f64],
    indices: &[usize],
    motion: &Isometry,
) -> Result<(Vec<f64>, f64), EvaluationError> {
    let instance = model.instantiate(x)?;
    let rest = VelocityField::sample(model, &*instance)?.points;
    let centre = mean(&rest);
    let turn = motion.rotation.to_scaled_axis();
    let shift = motion.apply(centre) - centre;
    let steps = (turn.length() / POSE_TURN).ceil().max(POSE_STEPS) as u32;
    let mut x = x.to_vec();
    let mut off = 0.0;
    for step in 1..=steps {
        let part = f64::from(step) / f64::from(steps);
        let rotation = DQuat::from_scaled_axis(turn * part);
        let target: Vec<DVec3> = rest.iter().map(|p| centre + shift * part + rotation * (*p - centre)).collect();
        let rounds = if step == steps { POSE_LAST_ROUNDS } else { POSE_ROUNDS };
        off = follow(model, &mut x, indices, &target, rounds)?;
    }
    Ok((x, off))
}

/// Levenberg-Marquardt steps of the parameters `indices` towards target positions of the sampled points; returns the
/// largest distance that remains.
fn follow(
    model: &dyn Model,
    x: &mut Vec<f64>,
    indices: &[usize],
    target: &[DVec3],
    rounds: u32,
) -> Result<f64, EvaluationError> {
    let sample = |x: &[f64]| model.instantiate(x).and_then(|instance| VelocityField::sample(model, &*instance));
    let room = vec![(f64::NEG_INFINITY, f64::INFINITY); indices.len()];
    let mut field = sample(x)?;
    let mut at = squared_distances(&field, indices, target);
    let mut damping = Damping::START;
    for _ in 0..rounds {
        let Some(step) = damped_step(&at, &room, damping) else {
            if damping.singular() {
                continue;
            }
            break;
        };
        let mut trial = x.clone();
        indices.iter().zip(step.iter()).for_each(|(i, s)| trial[*i] += s);
        let there = sample(&trial).ok().map(|field| (squared_distances(&field, indices, target), field));
        match there {
            Some((evaluation, moved)) if evaluation.value < at.value => {
                damping.accept((at.value - evaluation.value) / at.predicted_gain(&step).max(f64::MIN_POSITIVE));
                (*x, field, at) = (trial, moved, evaluation);
            }
            _ if at.value == 0.0 || !damping.reject() => break,
            _ => {}
        }
    }
    Ok(field.points.iter().zip(target).map(|(p, t)| p.distance(*t)).fold(0.0, f64::max))
}

/// The sum of squared distances between the sampled points and their targets, with its gradient and Gauss-Newton matrix
/// by the parameters `indices`.
fn squared_distances(field: &VelocityField, indices: &[usize], target: &[DVec3]) -> Evaluation {
    let off: Vec<DVec3> = field.points.iter().zip(target).map(|(p, t)| *p - *t).collect();
    let product = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
    let velocity = |k: usize| &field.velocity[indices[k]];
    let n = indices.len();
    Evaluation {
        value: product(&off, &off),
        gradient: DVector::from_fn(n, |a, _| 2.0 * product(velocity(a), &off)),
        normal: DMatrix::from_fn(n, n, |a, b| 2.0 * product(velocity(a), velocity(b))),
        patches: Vec::new(),
        absent: 0,
    }
}
