//! Whether a fit can be relied on.

use super::problem::loss::{Loss, LossKind};
use super::result::{FitResult, FittedScan};
use super::tuning::EXPLAINED;

impl FitResult {
    /// The distance from the model within which points of the scan are inliers: there the loss is below 1/2.
    /// Millimetres.
    #[must_use]
    pub fn inlier_distance(&self) -> f64 {
        Loss { kind: self.loss, sigma: self.sigma }.half()
    }

    /// A sentence that says why the fit cannot be relied on; none if it converged, at least half of the scan's points
    /// are inliers, these are enough and not flat, and they determine a parameter if there are several. Of several
    /// scans this holds for each, and they agree on the shape: otherwise it is that of none of them.
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
        if !self.converged {
            return Some("the last stage did not converge".to_owned());
        }
        if let Some(free) = self.nothing_determined() {
            return Some(format!("none of its {free} parameters is determined, and most of them ended at a bound"));
        }
        let of_scan = |(n, scan): (usize, &FittedScan)| {
            let path = &scan.source.path;
            let name = if path.is_empty() { format!("scan {}", n + 1) } else { path.clone() };
            scan.shortcoming(self.loss, &name)
        };
        // Two scans of which one is of another object do not agree either.
        let foreign = self.scans.iter().enumerate().filter(|(_, scan)| scan.foreign).find_map(of_scan);
        foreign.or_else(|| self.scans.iter().enumerate().find_map(of_scan))
    }
}

impl FitResult {
    /// The number of free parameters, if they are several, none of them has a standard deviation, and most ended at a
    /// bound: then points lie near the model because it is large, and not because it has their shape.
    fn nothing_determined(&self) -> Option<usize> {
        let free = || self.parameters.iter().filter(|p| !p.fixed);
        let (count, at_bound) = (free().count(), free().filter(|p| p.at_bound).count());
        (count > 1 && free().all(|p| p.sd.is_none()) && 2 * at_bound > count).then_some(count)
    }
}

impl FittedScan {
    /// Why one shape of all scans cannot be relied on, by this one, which the sentence calls by its `name`.
    fn shortcoming(&self, loss: LossKind, name: &str) -> Option<String> {
        if !(self.inliers >= EXPLAINED) {
            let (share, within) = (100.0 * self.inliers, Loss { kind: loss, sigma: self.sigma }.half());
            return Some(format!("only {share:.0} % of the points of {name} lie within {within:.3} mm of the model"));
        }
        if self.foreign {
            return Some(format!("{name} may be of another object, or in the wrong place"));
        }
        let agrees = self.agreement.as_ref().is_none_or(|agreement| agreement.agrees);
        (!agrees).then(|| format!("{name} does not agree with the other scans on the shape"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::result::Agreement;
    use crate::model::Motion;
    use crate::scan::ScanSource;

    #[test]
    fn several_scans_have_to_agree() {
        let scan = |path: &str, inliers, agrees| FittedScan {
            source: ScanSource { path: path.into(), ..ScanSource::default() },
            inliers,
            sigma: 1.0,
            agreement: Some(Agreement { statistic: 9.0, degrees: 3, p: 0.03, agrees, differences: Vec::new() }),
            pose: Motion::IDENTITY,
            pose_covariance: None,
            rms: 0.1,
            noise: 0.1,
            foreign: false,
        };
        let said = |scans| FitResult { converged: true, inliers: 0.9, scans, ..FitResult::default() }.shortcoming();
        assert_eq!(said(vec![scan("a", 0.9, true), scan("b", 0.9, true)]), None);
        assert!(said(vec![scan("a", 0.9, true), scan("b", 0.4, true)]).is_some_and(|why| why.contains("points of b")));
        let foreign = FittedScan { foreign: true, ..scan("b", 0.9, true) };
        assert!(
            said(vec![scan("a", 0.9, true), foreign]).is_some_and(|why| why.contains("b may be of another object"))
        );
        assert!(
            said(vec![scan("a", 0.9, true), scan("", 0.9, false)]).is_some_and(|why| why.contains("scan 2 does not"))
        );
    }

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
