//! Distances from every texel of the model's surface to the scan; statistics.

mod deviations;

pub use deviations::Deviations;
