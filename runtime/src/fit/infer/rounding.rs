//! The error by the rounding of coordinates in the file, where that is coarse beside the noise: a face across an axis
//! lies off by the same amount all over, up to half a step, and no residual tells.
//!
//! Rounding of a coordinate c to steps of s adds the sawtooth sum_m (-1)^m s / (pi m) sin(2 pi m c / s), which moves
//! the estimate by A sum_i w J n e(c) over the points, to first order. How c lies to the steps is not known, as it is
//! what was rounded, so every face that looks along an axis, to one side, has any phase: the mean square of the error
//! is the sum over faces and m of s^2 / (2 pi^2 m^2) |A sum_i w J n exp(2 pi i m c / s)|^2. The sum over the points of
//! a curved or inclined face goes to zero by itself, where c passes through many steps.

use super::sandwich::Uncertainty;
use crate::fit::problem::objective::Objective;
use crate::fit::problem::rows::{AllRows, Rows};
use crate::fit::refine::schedule::Solution;
use crate::scan::Rounded;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{PI, TAU};

/// Terms of the sawtooth: the first four have 87 % of its variance; those after count as the fourth.
const TERMS: usize = 4;
/// What the mean square of the fourth term is multiplied by, to stand for all after it: the sum of 1 / m^2 from 4 on.
const LAST: f64 = 16.0 * (PI * PI / 6.0 - 1.0 - 1.0 / 4.0 - 1.0 / 9.0);

/// Frames that are told apart. Of more of them, some have the same sums: their phases are independent, so that the mean
/// square of what they add is the same.
const FRAMES: usize = 8;

/// The uncertainty with that of rounding.
pub(crate) fn include(solution: &Solution, uncertainty: Uncertainty) -> Uncertainty {
    let rounded = &solution.level.problem.scan.attributes.rounded;
    if rounded.frames.is_empty() {
        return uncertainty;
    }
    let Some(pulls) = pulls(solution, rounded) else { return uncertainty };
    let mut covariance = uncertainty.covariance.clone();
    for pull in &pulls {
        let moved = &uncertainty.inverse * pull;
        covariance += &moved * moved.transpose();
    }
    Uncertainty { covariance, ..uncertainty }
}

/// Sums of w J n e over the points of every face, frame, term, and phase, times the root of their mean square.
fn pulls(solution: &Solution, rounded: &Rounded) -> Option<Vec<DVector<f64>>> {
    let Solution { level, estimate, cache, .. } = solution;
    let points = &level.problem.points;
    let objective = Objective { cache: Some(cache.clone()), ..solution.objective(points) };
    let all = AllRows::new(&objective, estimate)?;
    let chain = level.space.chain(estimate);
    let turn = estimate.motion.rotation;
    let frames = rounded.frames.len().min(FRAMES);
    let faces = 6 * frames * level.space.model.parts().len();
    let none = || DMatrix::zeros(chain.nrows(), faces * TERMS * 2);
    let add = |sums: &mut DMatrix<f64>, rows: &Rows| {
        for (point, row) in rows.iter() {
            let index = points.index[point.index as usize] as usize;
            let Some(frame) = rounded.of(index) else { continue };
            let normal = turn * point.away;
            let at = points.position[point.index as usize] - normal * point.distance;
            let of_patch = rows.patch as usize * frames + rounded.index(index) % frames;
            for (k, local) in frame.local(at.to_array()).into_iter().enumerate().filter(|(k, _)| frame.steps[*k] > 0.0)
            {
                let (axis, step) = frame.step(k);
                let along = normal.dot(axis);
                let face = 6 * of_patch + 2 * k + usize::from(along < 0.0);
                for term in 0..TERMS {
                    let m = (term + 1) as f64;
                    let last = if term + 1 == TERMS { LAST.sqrt() } else { 1.0 };
                    let size = point.weight * along * last * step / (2f64.sqrt() * PI * m);
                    let (sin, cos) = (TAU * m * local / frame.steps[k]).sin_cos();
                    let column = 2 * (face * TERMS + term);
                    for (variable, slope) in rows.columns.iter().zip(row) {
                        sums[(*variable, column)] += size * cos * slope;
                        sums[(*variable, column + 1)] += size * sin * slope;
                    }
                }
            }
        }
    };
    let mut sums = none();
    all.fold(none, add, |chunk| sums += chunk);
    let local = chain.tr_mul(&sums);
    Some(local.column_iter().filter(|column| column.amax() > 0.0).map(DVector::from).collect())
}
