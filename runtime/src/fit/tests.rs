//! Fits of models written by hand: an oracle that shares nothing with the compiler.

mod both_ways;
mod convergence;
mod corners;
pub(crate) mod cup;
mod derivatives;
mod distances;
mod fits;
mod measures;
mod number;
mod planes;
mod pose;
mod races;
mod several;
pub(crate) mod shapes;
mod sides;
mod statistics;
mod success;
mod trouble;
mod vessel;
mod walls;
mod weights;
