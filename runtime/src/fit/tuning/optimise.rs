//! The optimisers.

// -------------------------------------------------------------------------------------------------------- Gauss-Newton

/// Limit of a Gauss-Newton step (sigma): the linear model holds for about as long.
pub(crate) const STEP_LIMIT: f64 = 2.0;
/// A step shorter than this (sigma) gains less than the objective is rounded by: the gradient judges it (0017).
pub(crate) const ROUNDED_STEP: f64 = 2e-3;
/// Levenberg and Marquardt's damping, relative to the diagonal: the first, and factors on it after a step with a good
/// and with a poor ratio of the gain to the predicted one, after a rejected step, and where the matrix is singular.
pub(crate) const DAMPING_START: f64 = 1e-4;
pub(crate) const GOOD_RATIO: f64 = 0.75;
pub(crate) const POOR_RATIO: f64 = 0.25;
pub(crate) const DAMPING_GOOD: f64 = 0.2;
pub(crate) const DAMPING_POOR: f64 = 3.0;
pub(crate) const DAMPING_REJECTED: f64 = 8.0;
pub(crate) const DAMPING_SINGULAR: f64 = 100.0;
/// The damping is at least the first, at least the second once it has been raised, and beyond the third no step is
/// possible.
pub(crate) const DAMPING_LEAST: f64 = 1e-9;
pub(crate) const DAMPING_RAISED: f64 = 1e-6;
pub(crate) const DAMPING_MOST: f64 = 1e8;
/// The part of the damping that is relative to the largest diagonal element: it holds coordinates without influence.
pub(crate) const DAMPING_FLOOR: f64 = 1e-4;
/// The loss's second derivative counts for at least this part of its weight, so that no step runs away.
pub(crate) const LEAST_CURVATURE: f64 = 0.3;

// -------------------------------------------------------------------------------------------------------------- L-BFGS

/// L-BFGS, where Gauss-Newton does not converge: iterations; the gradient, the relative gain of a step and that of a
/// round at which it ends; corrections that are kept; rounds in which the set of coordinates at bounds settles; sigma
/// over the distance by which the first step moves the surface.
pub(crate) const LBFGS_ITERATIONS: u32 = 40;
pub(crate) const LBFGS_GRADIENT: f64 = 1e-7;
pub(crate) const LBFGS_COST: f64 = 1e-10;
pub(crate) const LBFGS_GAIN: f64 = 1e-9;
pub(crate) const LBFGS_MEMORY: usize = 8;
pub(crate) const LBFGS_ROUNDS: u32 = 6;
pub(crate) const LBFGS_FIRST_STEP: f64 = 3.0;
