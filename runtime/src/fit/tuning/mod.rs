//! The constants that decide how a fit goes about its work: how much is tried, when something is good enough, and what
//! is accepted. Lengths are in radii of gyration of the scan ("radii") or in sigma, the scale of the loss. Numbers of
//! points are those of samples, even in space where nothing else is said. docs/decisions/0029-tuning-constants.md says
//! what became of fits with half and with twice of each. Bounds on rounding errors stand beside the code that they
//! guard.
//!
//! A constant stands in the file of the stage that it is about, and is used by its name alone wherever it is needed.

mod correspond;
mod infer;
mod optimise;
mod problem;
mod refine;
mod register;
mod report;
mod restart;
mod rivals;
mod scene;
mod search;

pub(crate) use correspond::*;
pub(crate) use infer::*;
pub(crate) use optimise::*;
pub(crate) use problem::*;
pub(crate) use refine::*;
pub(crate) use register::*;
pub(crate) use report::*;
pub(crate) use restart::*;
pub(crate) use rivals::*;
pub(crate) use scene::*;
pub(crate) use search::*;
