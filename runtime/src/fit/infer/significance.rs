//! Tail probabilities.

/// The probability that a chi-squared variable with `degrees` degrees of freedom exceeds `x` (Abramowitz and Stegun
/// 26.4.4 and 26.4.5: finite sums, from the complementary error function where `degrees` is odd).
pub(crate) fn chi_squared_tail(x: f64, degrees: usize) -> f64 {
    if !(x > 0.0) || degrees == 0 {
        return 1.0;
    }
    let half = 0.5 * x;
    let (mut sum, mut term, mut order) = if degrees.is_multiple_of(2) {
        (0.0, (-half).exp(), 1.0)
    } else {
        (libm::erfc(half.sqrt()), 2.0 * (half / std::f64::consts::PI).sqrt() * (-half).exp(), 1.5)
    };
    for _ in 0..degrees / 2 {
        sum += term;
        term *= half / order;
        order += 1.0;
    }
    sum.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::chi_squared_tail;

    #[test]
    fn tails_are_those_of_the_tables() {
        // Abramowitz and Stegun, table 26.8.
        for (degrees, x, q) in [
            (1, 3.841_459, 0.05),
            (2, 5.991_465, 0.05),
            (3, 7.814_728, 0.05),
            (4, 13.276_704, 0.01),
            (7, 14.067_141, 0.05),
            (10, 18.307_038, 0.05),
        ] {
            assert!((chi_squared_tail(x, degrees) - q).abs() < 1e-6, "{degrees} {x}");
        }
        assert_eq!(chi_squared_tail(0.0, 3), 1.0);
        assert!(chi_squared_tail(2000.0, 3) < 1e-300);
    }
}
