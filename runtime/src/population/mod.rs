//! Many objects by one script: what their fits and measurements say together.
//!
//! - [`Row`]: the outcome of one scan as plain data; a table has a row a scan.
//! - [`IndividualsChart`], [`Capability`]: control charts and indices of capability.
//! - [`RandomEffects`]: mean and spread of a parameter over the objects, apart from the uncertainty of measurement.
//! - [`Correlation`], [`Variation`]: how parameters vary together, and which of them moves the surface most.
//! - [`Outlying`]: objects that differ from the others.
//! - [`DeviationMap`]: mean and standard deviation of the deviations at every texel.
//! - [`CommonTexture`]: one texture for all of them.
//! - [`Summary`]: all of it.

mod capability;
mod chart;
mod correlation;
mod deviation_map;
mod excess;
mod layout;
mod normality;
mod outlying;
mod random_effects;
mod row;
mod summary;
mod variation;

#[cfg(test)]
mod tests;

pub use capability::{Capability, Index, Limits};
pub use chart::{IndividualsChart, Signal};
pub use correlation::Correlation;
pub use deviation_map::{BY_CHANCE, DeviationMap, MapError};
pub use layout::CommonTexture;
pub use normality::Normality;
pub use outlying::{Outlying, outlying};
pub use random_effects::{DIFFERENT, RandomEffects};
pub use row::{Inspected, Measured, Outcome, PartRow, Row, SCHEMA};
pub use summary::{Quantities, Series, Summary};
pub use variation::{Contribution, Movements, Variation};
