//! Tests of compiled scripts. There is one test binary for all that may run in one process, because linking each takes
//! long.

mod common;
mod conformance;
mod cup;
mod failures;
mod gradients;
mod grids;
mod language;
mod library;
mod pages;
mod special;
mod taylor;
mod threads;
