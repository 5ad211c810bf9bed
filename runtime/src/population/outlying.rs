//! Objects that differ from the others.

use super::excess::excess;
use crate::robust::{MAD_TO_SD, median_and_deviation};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Robust standard deviations from the median below which no value is an outlier (Iglewicz and Hoaglin, *How to Detect
/// and Handle Outliers*, 1993).
const FAR: f64 = 3.5;

/// With fewer values nothing can be said of one of them.
const LEAST: usize = 5;

/// Equal objects have an outlier in one of so many populations, all their quantities together.
const FALSE: f64 = 0.05;

/// The largest distance from the median, in robust standard deviations, is distributed about as that of Student's t
/// with this many degrees of freedom a value: of 5, 10, 20 and 50 normal values one in twenty has a larger one than
/// 7.9, 4.6, 4.0 and 3.8 (200,000 simulated populations), by this formula 12, 5.3, 4.2 and 3.8.
const DEGREES: f64 = 0.45;

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

/// The outlying ones among values (row, value, standard deviation of measurement, which may be unknown), of a
/// population with so many quantities.
#[must_use]
pub fn outlying(quantity: &str, values: &[(usize, f64, Option<f64>)], quantities: usize) -> Vec<Outlying> {
    if values.len() < LEAST {
        return Vec::new();
    }
    let far = far(values.len(), quantities);
    let mut of_all: Vec<f64> = values.iter().map(|(_, value, _)| *value).collect();
    let Some((middle, deviation)) = median_and_deviation(&mut of_all) else { return Vec::new() };
    let spread = MAD_TO_SD * deviation;
    // The spread of all has a usual measurement in it.
    let sds: Vec<Option<f64>> = values.iter().map(|(.., sd)| *sd).collect();
    let excess = excess(&sds);
    let found = values.iter().enumerate().filter_map(|(at, (row, value, _))| {
        let score = (value - middle) / (spread * spread + excess(at)).sqrt();
        let is_far = score.abs() > far;
        is_far.then(|| Outlying { row: *row, quantity: quantity.to_owned(), value: *value, median: middle, score })
    });
    found.collect()
}

/// Robust standard deviations beyond which one of `count` values is an outlier.
fn far(count: usize, quantities: usize) -> f64 {
    let tail = FALSE / (2.0 * count as f64 * quantities.max(1) as f64);
    let t = StudentsT::new(0.0, 1.0, DEGREES * (count as f64 - 1.0));
    t.map_or(f64::INFINITY, |t| t.inverse_cdf(1.0 - tail)).max(FAR)
}
