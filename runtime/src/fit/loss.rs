//! The loss psi that makes the fit robust ([VA] eq. 2), and how its scale follows from residuals.

/// psi(d) = 1 - exp(-d^2 / sigma^2) ([VA] eq. 2), known elsewhere as Welsch's loss: quadratic for small distances,
/// constant for large ones, so that what the model does not explain does not pull it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Welsch {
    /// The scale. Millimetres.
    pub(crate) sigma: f64,
}

/// Distances beyond this many sigma are not computed and count as psi = 1 ([VA] eq. 4); psi there is 1 - 4.8e-6.
const CUTOFF: f64 = 3.5;

impl Welsch {
    /// psi at a squared distance.
    pub(crate) fn psi(self, d2: f64) -> f64 {
        -(-d2 / (self.sigma * self.sigma)).exp_m1()
    }

    /// The weight exp(-d^2 / sigma^2) that makes weighted least squares agree with psi: psi'(d) = weight * 2 d / sigma^2.
    pub(crate) fn weight(self, d2: f64) -> f64 {
        (-d2 / (self.sigma * self.sigma)).exp()
    }

    /// The distance beyond which nothing is computed. Millimetres.
    pub(crate) fn cutoff(self) -> f64 {
        CUTOFF * self.sigma
    }

    /// The distance at which psi is 1/2: what is nearer counts as an inlier.
    pub(crate) fn half(self) -> f64 {
        self.sigma * std::f64::consts::LN_2.sqrt()
    }

    /// The scale for which psi(d + eps) = 1/2 ([VA] sect. 3), d + eps being what an inlier's distance may reach.
    pub(crate) fn with_half_at(distance: f64) -> Self {
        Self { sigma: distance / std::f64::consts::LN_2.sqrt() }
    }
}

/// How many robust standard deviations of the residuals d + eps stands for in [VA] sect. 3. At 3 the estimator is 97 %
/// as efficient as least squares on Gaussian residuals.
pub(crate) const INLIER_DEVIATIONS: f64 = 3.0;

/// Robust standard deviation of unsigned distances: 1.4826 times their median, over those within `limit`.
/// Zero where there are none.
pub(crate) fn robust_deviation(distances: &mut Vec<f64>, limit: f64) -> f64 {
    distances.retain(|d| *d <= limit);
    if distances.is_empty() {
        return 0.0;
    }
    let middle = distances.len() / 2;
    let (_, median, _) = distances.select_nth_unstable_by(middle, f64::total_cmp);
    1.4826 * *median
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weight_is_the_derivative_of_psi_and_half_is_half() {
        let loss = Welsch { sigma: 1.7 };
        for d in [0.01_f64, 0.4, 1.3, 3.0] {
            let h = 1e-5;
            let slope = (loss.psi((d + h).powi(2)) - loss.psi((d - h).powi(2))) / (2.0 * h);
            let expected = loss.weight(d * d) * 2.0 * d / (1.7 * 1.7);
            assert!((slope - expected).abs() < 1e-9, "{slope} against {expected} at {d}");
        }
        assert!((loss.psi(loss.half().powi(2)) - 0.5).abs() < 1e-15);
        assert!((Welsch::with_half_at(loss.half()).sigma - 1.7).abs() < 1e-14);
    }

    #[test]
    fn the_robust_deviation_ignores_what_lies_beyond_the_limit() {
        let mut distances: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-3).collect();
        distances.extend([50.0; 200]);
        assert!((robust_deviation(&mut distances, 10.0) - 1.4826 * 0.5).abs() < 1e-3);
        assert_eq!(robust_deviation(&mut vec![5.0], 1.0), 0.0);
    }
}
