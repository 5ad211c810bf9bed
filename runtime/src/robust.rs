//! Robust statistics.

/// A standard deviation over the median absolute deviation, for the normal distribution.
pub(crate) const MAD_TO_SD: f64 = 1.4826;

/// The upper median, in linear time; reorders the values. None where there are none.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The median, and the median of what values differ from it; the values are replaced by those differences.
pub(crate) fn median_and_deviation(values: &mut [f64]) -> Option<(f64, f64)> {
    let middle = median(values)?;
    values.iter_mut().for_each(|x| *x = (*x - middle).abs());
    Some((middle, median(values)?))
}
