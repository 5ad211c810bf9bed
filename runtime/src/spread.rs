//! Mean and standard deviation.

/// The mean of values and their sample standard deviation (over n - 1), which is 0 of a single value. Zeros where there
/// are no values.
pub(crate) fn mean_and_sd(values: &[f64]) -> (f64, f64) {
    if values.is_empty() {
        return (0.0, 0.0);
    }
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    (mean, square.sqrt())
}

#[cfg(test)]
mod tests {
    use super::mean_and_sd;

    #[test]
    fn squares_are_divided_by_one_less_than_there_are_values() {
        // Sum 40; squared differences from the mean of 5 are 9, 1, 1, 1, 0, 0, 4 and 16: 32 over 7.
        let (mean, sd) = mean_and_sd(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]);
        assert_eq!(mean, 5.0);
        assert!((sd - 2.138_089_935_299_395).abs() < 1e-15, "{sd}");
        assert_eq!(mean_and_sd(&[3.0]), (3.0, 0.0));
        assert_eq!(mean_and_sd(&[]), (0.0, 0.0));
    }
}
