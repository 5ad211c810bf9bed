//! Local refinement: Gauss-Newton and L-BFGS inside bounds, the schedule from coarse to fine (graduated non-convexity),
//! and the coverage term.

pub(crate) mod cover;
pub(crate) mod gauss_newton;
mod lbfgs;
pub(crate) mod schedule;
pub(crate) mod write_back;
