//! The standard library against formulas, algorithms written a second time, and finite differences.

mod curves;
mod derivatives;
mod geometry;
mod solids;
mod splines;
