//! The block bootstrap (Kuensch 1989): scans are drawn from the scan itself with repetitions, in blocks so that
//! residuals that depend on each other stay together, and fitted again from where the fit ended.

use super::blocks::Blocks;
use super::sandwich::Uncertainty;
use super::sums::Groups;
use crate::fit::optimise::gauss_newton::{self, Stop};
use crate::fit::problem::objective::{Objective, foot_cache};
use crate::fit::problem::points::Points;
use crate::fit::refine::schedule::Solution;
use crate::fit::result::{Bootstrap, Resampled};
use crate::fit::tuning::{BOOTSTRAP_ITERATIONS, BOOTSTRAP_TOLERANCE, POLISH_STEP};
use crate::spread::mean_and_sd;
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Draws and fits as many scans as the options say; None where fewer than two could be fitted.
pub(crate) fn run(solution: &Solution, uncertainty: Option<&Uncertainty>) -> Option<Bootstrap> {
    let edge = uncertainty?.blocks.map(|b| b.edge);
    let problem = solution.level.problem;
    let samples = problem.options.bootstrap;
    if problem.monitor.cancelled() {
        return None;
    }
    let drawn = AtomicUsize::new(0);
    let blocks = blocks(&problem.points, edge);
    let fits: Vec<Vec<f64>> = (0..samples)
        .into_par_iter()
        .filter_map(|sample| {
            // Drawing takes time as well.
            if problem.monitor.cancelled() {
                return None;
            }
            let mut random = ChaCha8Rng::seed_from_u64(problem.options.seed);
            random.set_stream(1 + sample as u64);
            let refitted = refitted(solution, &draw(&problem.points, &blocks, &mut random));
            let drawn = 1 + drawn.fetch_add(1, Ordering::Relaxed);
            problem.monitor.reach(drawn as f64 / samples as f64, &format!("sample {drawn} of {samples}"));
            refitted
        })
        .collect();
    if fits.len() < 2 {
        return None;
    }
    let space = &solution.level.space;
    let at_bound = space.at_bound(&solution.estimate);
    let varies = |i: usize| space.free.iter().zip(&at_bound).any(|(k, at)| !at && space.followers(*k).any(|f| f == i));
    let parameters = problem.model.parameters().iter().enumerate();
    let parameters = parameters
        .filter(|(i, _)| varies(*i))
        .map(|(i, p)| spread(p.name.clone(), fits.iter().map(|x| x[i]).collect()))
        .collect();
    Some(Bootstrap { samples: fits.len(), block: edge, parameters })
}

/// The points' indices by block; every point is one where there is no edge.
fn blocks(points: &Points, edge: Option<f64>) -> Vec<Vec<u32>> {
    let count = points.len() as u32;
    let Some(edge) = edge else { return (0..count).map(|i| vec![i]).collect() };
    let mut groups = Groups::default();
    let mut blocks: Vec<Vec<u32>> = Vec::new();
    for (i, position) in (0..count).zip(&points.position) {
        let number = groups.number(Blocks::key(edge, DVec3::ZERO, 0, *position));
        if number == blocks.len() {
            blocks.push(Vec::new());
        }
        blocks[number].push(i);
    }
    blocks
}

/// As many blocks as there are, drawn with repetitions, in their old order.
fn draw(points: &Points, blocks: &[Vec<u32>], random: &mut ChaCha8Rng) -> Points {
    let mut times = vec![0_u32; blocks.len()];
    for _ in 0..blocks.len() {
        times[random.random_range(0..blocks.len())] += 1;
    }
    let mut chosen: Vec<usize> = Vec::with_capacity(points.len());
    for (block, times) in blocks.iter().zip(times) {
        for _ in 0..times {
            chosen.extend(block.iter().map(|i| *i as usize));
        }
    }
    points.pick(chosen.into_iter())
}

/// The parameters that fit a drawn scan.
fn refitted(solution: &Solution, points: &Points) -> Option<Vec<f64>> {
    let sigma = solution.loss.sigma;
    let objective = Objective {
        signs: Some(&solution.signs),
        tolerance: BOOTSTRAP_TOLERANCE * sigma,
        cache: Some(foot_cache(points, sigma)),
        curved: true,
        ..solution.level.objective(points, solution.loss)
    };
    let stop = Stop { iterations: BOOTSTRAP_ITERATIONS, step: POLISH_STEP * sigma };
    let minimum = gauss_newton::minimise(&objective, solution.estimate.clone(), stop)?;
    solution.level.space.x(&minimum.estimate.z)
}

/// Standard deviation and the middle 95 % of values.
fn spread(name: String, mut values: Vec<f64>) -> Resampled {
    values.sort_by(f64::total_cmp);
    let (_, sd) = mean_and_sd(&values);
    let quantile = |q: f64| {
        let at = q * (values.len() as f64 - 1.0);
        let (below, part) = (at.floor() as usize, at.fract());
        values[below] + part * (values[(below + 1).min(values.len() - 1)] - values[below])
    };
    Resampled { name, sd, low: quantile(0.025), high: quantile(0.975) }
}
