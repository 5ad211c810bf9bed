//! Whether a fit can be relied on.

use super::problem::loss::Loss;
use super::result::FitResult;
use super::tuning::EXPLAINED;

impl FitResult {
    /// The distance from the model within which points of the scan are inliers: there the loss is below 1/2.
    /// Millimetres.
    #[must_use]
    pub fn inlier_distance(&self) -> f64 {
        Loss { kind: self.loss, sigma: self.sigma }.half()
    }

    /// A sentence that says why the fit cannot be relied on; none if it converged, at least half of the scan's points
    /// are inliers, and these are enough and not flat.
    #[must_use]
    pub fn shortcoming(&self) -> Option<String> {
        if self.degenerate {
            return Some("the scan has too few points, or too flat ones, to determine the model".to_owned());
        }
        if !(self.inliers >= EXPLAINED) {
            let share = 100.0 * self.inliers;
            let within = self.inlier_distance();
            return Some(format!(
                "only {share:.0} % of the scan's points, fewer than half, lie within {within:.3} mm of the model"
            ));
        }
        (!self.converged).then(|| "the last stage did not converge".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fit_is_relied_on_if_it_converged_to_half_of_the_points() {
        let said = |converged, inliers| FitResult { converged, inliers, ..FitResult::default() }.shortcoming();
        assert_eq!(said(true, 0.5), None);
        assert!(said(false, 0.9).is_some_and(|why| why.contains("converge")));
        assert!(said(true, 0.49).is_some_and(|why| why.contains("49 %")));
        assert!(said(true, f64::NAN).is_some());
        let far = FitResult { converged: true, inliers: 0.2, sigma: 2.0, ..FitResult::default() };
        // 1 - exp(-d^2 / 4) is 1/2.
        let distance = 2.0 * 2f64.ln().sqrt();
        assert!((far.inlier_distance() - distance).abs() < 1e-12);
        assert!(far.shortcoming().is_some_and(|why| why.contains("lie within 1.665 mm of the model")));
        let flat = FitResult { converged: true, inliers: 1.0, degenerate: true, ..FitResult::default() };
        assert!(flat.shortcoming().is_some_and(|why| why.contains("flat")));
    }
}
