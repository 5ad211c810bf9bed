//! Quick fits: from where the fit of the same model with other inputs ended, over some of the points and without
//! restarts. A race over the values of an input tells by them which values are worth a whole fit.

use super::infer::compare::at_scale;
use super::monitor::Monitor;
use super::options::{EarlierFit, FitOptions};
use super::plan;
use super::problem::Problem;
use super::problem::level::Level;
use super::problem::loss::Loss;
use super::problem::objective::Order;
use super::problem::parameterization::Estimate;
use super::problem::points::Points;
use super::problem::rigid::pose_parameters;
use super::problem::sides::Sides;
use super::refine::schedule::{Guess, anneal};
use super::register::candidate::objective;
use super::register::group::least_turn;
use super::result::{FitResult, FittedParameter};
use super::tuning::{
    ANNEALING_POINTS, ANNEALING_START, QUICK_ANGLES, QUICK_POINTS, QUICK_PROBES, QUICK_SCALE, QUICK_TELLING,
    QUICK_TURNS,
};
use crate::model::Model;
use crate::progress::Progress;
use crate::scan::Scan;
use gml_compiler::program::Parameter;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Fits a model quickly, from the pose of `pilot`, the fit of another one: once from its parameters, once from those of
/// the options. The result has parameters, pose and sigma only. None where the model exists at neither start, or the
/// user cancels.
pub(crate) fn quick(
    model: &dyn Model,
    scan: &Scan,
    options: &FitOptions,
    pilot: &FitResult,
    progress: &dyn Progress,
) -> Option<FitResult> {
    let moving = pose_parameters(model, scan);
    let all = pilot.parameters.iter().map(|p| (p.name.clone(), p.value));
    let of_pose = all.clone().filter(|(name, _)| moving.contains(name));
    let own = options.earlier.iter().flat_map(|earlier| earlier.values.clone());
    let own = own.filter(|(name, _)| !moving.contains(name)).chain(of_pose);
    let fits = [all.collect(), own.collect()].into_iter().filter_map(|values| {
        let earlier = EarlierFit { values, pose: pilot.pose, scans: Vec::new(), converged: None };
        from(model, scan, &FitOptions { earlier: Some(earlier), ..options.clone() }, progress)
    });
    let fits: Vec<FitResult> = fits.collect();
    if progress.cancelled() {
        return None;
    }
    let sigma = fits.iter().map(|fit| fit.sigma).fold(f64::INFINITY, f64::min);
    let valued = fits.into_iter().filter_map(|fit| Some((at_scale(model, &fit, scan, sigma).ok()?, fit)));
    valued.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, fit)| fit)
}

/// A quick fit from where the earlier fit of the options ended.
fn from(model: &dyn Model, scan: &Scan, options: &FitOptions, progress: &dyn Progress) -> Option<FitResult> {
    let monitor = Monitor::of_stages(progress, plan::quick());
    let problem = Problem::new(model, scan, options, &monitor).ok()?;
    monitor.stage("quick", || settle(&problem))
}

/// The end of a quick fit.
fn settle(problem: &Problem) -> Option<FitResult> {
    let Problem { model, options, .. } = problem;
    let level = problem.start_level().ok()?;
    let start = level.space.estimate(&problem.start.x, problem.start_motion());
    let level = level.around(&start).ok()?;
    let Starts { estimates, points: few } = starts(&level, start);
    let given = options.sigma.map(|sigma| Loss { kind: options.loss, sigma });
    let wide = Loss::welsch(ANNEALING_START * problem.radius);
    let end = |estimate: Estimate| {
        let signs = Sides::of(&level, &estimate, wide)?.signs;
        Some(anneal(&level, &few, Guess { estimate, loss: given.unwrap_or(wide), signs, iterations: 0 }, given))
    };
    let ends: Vec<Guess> = estimates.into_par_iter().filter_map(end).collect();
    let sigma = ends.iter().map(|guess| guess.loss.sigma).fold(f64::INFINITY, f64::min);
    let value = |guess: &Guess| {
        let objective = objective(&level, &few, sigma / problem.radius, Some(&guess.signs));
        objective.evaluate(&guess.estimate, Order::Value).map_or(1.0, |e| e.value)
    };
    let ends = ends.into_iter().map(|guess| (value(&guess), guess));
    let (_, best) = ends.min_by(|(a, _), (b, _)| a.total_cmp(b))?;
    // The scale has come down already: only points are new.
    let best = anneal(&level, &problem.thin.sample(ANNEALING_POINTS), best, given);
    let x = level.space.x(&best.estimate.z)?;
    let parameter = |(i, p): (usize, &Parameter)| FittedParameter {
        // What the motion stands for counts with it.
        fixed: problem.start.fixed[i] || problem.pose.stands_for.contains(&i),
        ..FittedParameter::new(p.name.as_str(), x[i], p.quantity)
    };
    Some(FitResult {
        parameters: model.parameters().iter().enumerate().map(parameter).collect(),
        pose: problem.pose.moving.then(|| best.estimate.motion.into()),
        sigma: best.loss.sigma,
        weights: options.weights,
        ..FitResult::default()
    })
}

/// Where a quick fit begins, and by which points.
struct Starts {
    estimates: Vec<Estimate>,
    points: Points,
}

/// The start, and where it fits best when it is turned about the axis about which its surface moves least: with another
/// number of flutes or holes about that axis, nothing says where the first of them is. Most points are as near wherever
/// it is turned to; those that are not decide, and take part in the fit besides a sample of all.
fn starts(level: &Level, start: Estimate) -> Starts {
    let thin = level.problem.thin.sample(ANNEALING_POINTS);
    let few = thin.sample(QUICK_POINTS);
    let all = objective(level, &thin, QUICK_SCALE, None);
    let (Some(axis), Ok(placed)) = (least_turn(&all, &start), all.place(&start)) else {
        return Starts { estimates: vec![start], points: few };
    };
    let turned = |k: u32, of: u32| {
        let angle = TAU * f64::from(k) / f64::from(of);
        axis.rotated(&start.motion, angle, level.space.centre)
    };
    let losses = |k: u32| all.rough_losses(&placed.facets, &turned(k, QUICK_PROBES));
    let losses: Vec<Vec<f64>> = (0..QUICK_PROBES).into_par_iter().map(losses).collect();
    let spread = |i: &usize| {
        let (low, high) = losses.iter().fold((1.0_f64, 0.0_f64), |(low, high), l| (low.min(l[*i]), high.max(l[*i])));
        high - low
    };
    let mut telling: Vec<usize> = (0..thin.len()).collect();
    telling.sort_by(|a, b| spread(b).total_cmp(&spread(a)));
    let telling = thin.pick(telling.into_iter().take(QUICK_TELLING));
    let by_telling = objective(level, &telling, QUICK_SCALE, None);
    let at = |k: u32| by_telling.rough_value(&placed.facets, &turned(k, QUICK_ANGLES));
    let values: Vec<f64> = (0..QUICK_ANGLES).into_par_iter().map(at).collect();
    let count = values.len();
    let is_least = |k: &usize| values[*k] <= values[(k + 1) % count] && values[*k] < values[(k + count - 1) % count];
    let mut minima: Vec<usize> = (0..count).filter(is_least).collect();
    minima.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let chosen = minima.into_iter().take(QUICK_TURNS);
    let mut estimates: Vec<Estimate> =
        chosen.map(|k| Estimate { motion: turned(k as u32, QUICK_ANGLES), ..start.clone() }).collect();
    estimates.push(start);
    Starts { estimates, points: few.and(&telling) }
}
