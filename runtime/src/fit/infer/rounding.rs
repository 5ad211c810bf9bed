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
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{PI, TAU};

/// Terms of the sawtooth: the first four have 87 % of its variance; those after count as the fourth.
const TERMS: usize = 4;
/// What the mean square of the fourth term is multiplied by, to stand for all after it: the sum of 1 / m^2 from 4 on.
const LAST: f64 = 16.0 * (PI * PI / 6.0 - 1.0 - 1.0 / 4.0 - 1.0 / 9.0);

/// The uncertainty with that of rounding.
pub(crate) fn include(solution: &Solution, uncertainty: Uncertainty) -> Uncertainty {
    let steps = solution.level.problem.scan.steps;
    if steps == [0.0; 3] {
        return uncertainty;
    }
    let Some(pulls) = pulls(solution, steps) else { return uncertainty };
    let mut covariance = uncertainty.covariance.clone();
    for pull in &pulls {
        let moved = &uncertainty.inverse * pull;
        covariance += &moved * moved.transpose();
    }
    Uncertainty { covariance, ..uncertainty }
}

/// Sums of w J n e over the points of every face, term, and phase, times the root of their mean square.
fn pulls(solution: &Solution, steps: [f64; 3]) -> Option<Vec<DVector<f64>>> {
    let Solution { level, estimate, cache, .. } = solution;
    let objective = Objective { cache: Some(cache.clone()), ..solution.objective(&level.problem.points) };
    let all = AllRows::new(&objective, estimate)?;
    let chain = level.space.chain(estimate);
    let turn = estimate.motion.rotation;
    let faces = 6 * level.space.model.parts().len();
    let none = || DMatrix::zeros(chain.nrows(), faces * TERMS * 2);
    let add = |sums: &mut DMatrix<f64>, rows: &Rows| {
        for (point, row) in rows.iter() {
            let normal = turn * point.away;
            let at = objective.points.position[point.index as usize] - normal * point.distance;
            for (k, step) in steps.iter().enumerate().filter(|(_, step)| **step > 0.0) {
                let face = 6 * rows.patch as usize + 2 * k + usize::from(normal[k] < 0.0);
                for term in 0..TERMS {
                    let m = (term + 1) as f64;
                    let last = if term + 1 == TERMS { LAST.sqrt() } else { 1.0 };
                    let size = point.weight * normal[k] * last * step / (2f64.sqrt() * PI * m);
                    let (sin, cos) = (TAU * m * at[k] / step).sin_cos();
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
