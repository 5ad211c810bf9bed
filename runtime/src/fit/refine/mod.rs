//! Local refinement: the schedule from coarse to fine (graduated non-convexity), a second search where the scan
//! contradicts what it led to, the motion written back into the script's parameters, the coverage term, and the one
//! that holds walls apart; `solve` runs registration and all of these in their order.

pub(crate) mod apart;
pub(crate) mod cover;
mod earlier;
pub(crate) mod joint;
pub(crate) mod mixed;
pub(crate) mod schedule;
mod second_search;
pub(crate) mod solve;
pub(crate) mod unexplained;
pub(crate) mod witness;
pub(crate) mod write_back;
