//! Objects that differ from the others.

use crate::robust::{MAD_TO_SD, median, median_and_deviation};
use serde::{Deserialize, Serialize};

/// Robust standard deviations from the median beyond which a value is an outlier (Iglewicz and Hoaglin, *How to Detect
/// and Handle Outliers*, 1993).
const FAR: f64 = 3.5;

/// With fewer values nothing can be said of one of them.
const LEAST: usize = 5;

/// A value that differs from those of the other objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outlying {
    /// The object: its place among the rows.
    pub row: usize,
    /// The quantity.
    pub quantity: String,
    /// Its value.
    pub value: f64,
    /// The median of all.
    pub median: f64,
    /// The difference in robust standard deviations, that of the object's own measurement included.
    pub score: f64,
}

/// The outlying ones among values (row, value, standard deviation of measurement, which may be unknown).
#[must_use]
pub fn outlying(quantity: &str, values: &[(usize, f64, Option<f64>)]) -> Vec<Outlying> {
    if values.len() < LEAST {
        return Vec::new();
    }
    let mut of_all: Vec<f64> = values.iter().map(|(_, value, _)| *value).collect();
    let Some((middle, deviation)) = median_and_deviation(&mut of_all) else { return Vec::new() };
    let spread = MAD_TO_SD * deviation;
    let mut known: Vec<f64> = values.iter().filter_map(|(_, _, sd)| *sd).collect();
    // The spread of all has a usual measurement in it.
    let usual = median(&mut known).unwrap_or(0.0);
    let found = values.iter().filter_map(|(row, value, sd)| {
        let excess = sd.map_or(0.0, |sd| (sd * sd - usual * usual).max(0.0));
        let score = (value - middle) / (spread * spread + excess).sqrt();
        let is_far = score.abs() > FAR;
        is_far.then(|| Outlying { row: *row, quantity: quantity.to_owned(), value: *value, median: middle, score })
    });
    found.collect()
}
