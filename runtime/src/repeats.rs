//! How often tests of statistics repeat what is random.

use std::ops::RangeInclusive;

/// As often as everyday allows, or, with GMLC_THOROUGH set, as often as the figure deserves.
pub(crate) fn repeats(everyday: u64, thorough: u64) -> u64 {
    if std::env::var_os("GMLC_THOROUGH").is_some() { thorough } else { everyday }
}

/// What the ratio of a known standard deviation to the one that was found of so many runs may be. The latter is known
/// to 1 / sqrt(2 (runs - 1)) of itself; three times that on either side is passed by one in four hundred.
pub(crate) fn ratio_of_spreads(runs: u64) -> RangeInclusive<f64> {
    let room = 3.0 / (2.0 * (runs as f64 - 1.0)).sqrt();
    1.0 / (1.0 + room)..=1.0 / (1.0 - room)
}
