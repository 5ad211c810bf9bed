//! What the compiler makes of scripts: one binary for all that may run in one process, since each costs its linking.

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
