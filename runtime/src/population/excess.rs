//! Measurements that are poorer than the usual one of a population.

use crate::robust::median;

/// By place, what a measurement adds to the variance of the usual one, which has the median standard deviation; 0 where
/// nothing is known of it.
pub(super) fn excess(sds: &[Option<f64>]) -> impl Fn(usize) -> f64 {
    let usual = median(&mut sds.iter().copied().flatten().collect::<Vec<f64>>()).unwrap_or(0.0);
    move |at| sds.get(at).copied().flatten().map_or(0.0, |sd| (sd * sd - usual * usual).max(0.0))
}
