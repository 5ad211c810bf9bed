//! Local refinement: the schedule from coarse to fine (graduated non-convexity), the motion written back into the
//! script's parameters, and the coverage term; `solve` runs registration and all of these in their order.

pub(crate) mod cover;
mod earlier;
pub(crate) mod schedule;
pub(crate) mod solve;
pub(crate) mod write_back;
