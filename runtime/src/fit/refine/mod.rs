//! Local refinement: the schedule from coarse to fine (graduated non-convexity), the motion written back into the
//! script's parameters, the coverage term, and the one that holds walls apart; `solve` runs registration and all of
//! these in their order.

pub(crate) mod apart;
pub(crate) mod cover;
mod earlier;
pub(crate) mod schedule;
pub(crate) mod solve;
pub(crate) mod write_back;
