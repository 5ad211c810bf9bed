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

/// The upper median of values with weights (value, weight): the least value that, with those below it, has more than
/// half of the weight; reorders the values. None where there are none. With equal weights it is `median`.
pub(crate) fn weighted_median(values: &mut [(f64, f64)]) -> Option<f64> {
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * values.iter().map(|(_, weight)| weight).sum::<f64>();
    let mut sum = 0.0;
    let passes = |(_, weight): &&(f64, f64)| {
        sum += weight;
        sum > half
    };
    values.iter().find(passes).or(values.last()).map(|(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_weight_counts_as_often_as_its_value_would() {
        let values = [3.0, 1.0, 4.0, 1.5, 5.0, 9.0, 2.0, 6.0];
        for count in 0..=values.len() {
            let mut alike: Vec<(f64, f64)> = values[..count].iter().map(|v| (*v, 1.0)).collect();
            assert_eq!(weighted_median(&mut alike), median(&mut values[..count].to_vec()), "{count}");
        }
        let weights = [2_u32, 5, 1, 0, 3, 1, 4, 2];
        let mut weighted: Vec<(f64, f64)> = values.into_iter().zip(weights.map(f64::from)).collect();
        let mut repeated: Vec<f64> =
            values.iter().zip(weights).flat_map(|(v, n)| std::iter::repeat_n(*v, n as usize)).collect();
        assert_eq!(weighted_median(&mut weighted), median(&mut repeated));
    }
}
