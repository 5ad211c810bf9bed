//! The standard library against formulas, algorithms written a second time, and finite differences.

#[path = "../common/mod.rs"]
mod common;
mod curves;
mod derivatives;
mod geometry;
mod solids;
mod splines;
