//! The loss of a distance (\[VA\] eq. 2, which writes psi, and others), and its scale from residuals.

use crate::fit::tuning::CUTOFF_SIGMAS;
use crate::robust::{MAD_TO_SD, weighted_median};
use serde::{Deserialize, Serialize};
use std::f64::consts::LN_2;

/// A robust loss of a distance d with the scale sigma. All agree with d^2 / sigma^2 for distances much smaller than
/// sigma.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LossKind {
    /// 1 - exp(-d^2 / sigma^2) (\[VA\] eq. 2): quadratic for small distances, constant for large ones, so that points
    /// that the model does not explain do not pull it.
    #[default]
    Welsch,
    /// d^2 / sigma^2: least squares, for scans without anything foreign. Sigma only scales it.
    Squared,
    /// Huber's: quadratic up to sigma, 2 d / sigma - 1 beyond.
    Huber,
    /// Tukey's biweight with c^2 = 3 sigma^2: 1 - (1 - d^2 / c^2)^3 up to c, constant beyond.
    Tukey,
}

/// A loss with its scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Loss {
    pub(crate) kind: LossKind,
    /// The scale. Millimetres.
    pub(crate) sigma: f64,
}

/// The loss of a point, with its weight and its curvature (see `Loss`), times its prior weight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointLoss {
    pub(crate) prior: f64,
    pub(crate) value: f64,
    pub(crate) weight: f64,
    pub(crate) curvature: f64,
}

impl PointLoss {
    /// That of a point that counts `prior` times as much.
    pub(crate) fn times(self, prior: f64) -> Self {
        let Self { prior: before, value, weight, curvature } = self;
        Self { prior: prior * before, value: prior * value, weight: prior * weight, curvature: prior * curvature }
    }
}

impl Loss {
    /// The default loss.
    pub(crate) fn welsch(sigma: f64) -> Self {
        Self { kind: LossKind::Welsch, sigma }
    }

    /// The loss of a squared distance.
    pub(crate) fn value(self, d2: f64) -> f64 {
        let t = d2 / (self.sigma * self.sigma);
        match self.kind {
            LossKind::Welsch => -(-t).exp_m1(),
            LossKind::Squared => t,
            LossKind::Huber if t <= 1.0 => t,
            LossKind::Huber => 2.0 * t.sqrt() - 1.0,
            LossKind::Tukey if t < 3.0 => t * (1.0 - t / 3.0 + t * t / 27.0),
            LossKind::Tukey => 1.0,
        }
    }

    /// The weight with which weighted least squares has the loss's derivative, loss'(d) = weight * 2 d / sigma^2.
    pub(crate) fn weight(self, d2: f64) -> f64 {
        let t = d2 / (self.sigma * self.sigma);
        match self.kind {
            LossKind::Welsch => (-t).exp(),
            LossKind::Squared => 1.0,
            LossKind::Huber => t.max(1.0).sqrt().recip(),
            LossKind::Tukey => (1.0 - t / 3.0).max(0.0).powi(2),
        }
    }

    /// The loss, the weight and the curvature at a squared distance, for the price of one of the three. The prior
    /// weight is 1.
    pub(crate) fn at(self, d2: f64) -> PointLoss {
        match self.kind {
            LossKind::Welsch => {
                let value = self.value(d2);
                let weight = 1.0 - value;
                let curvature = weight * (1.0 - 2.0 * d2 / (self.sigma * self.sigma));
                PointLoss { prior: 1.0, value, weight, curvature }
            }
            _ => {
                let (value, weight, curvature) = (self.value(d2), self.weight(d2), self.curvature(d2));
                PointLoss { prior: 1.0, value, weight, curvature }
            }
        }
    }

    /// loss''(d) sigma^2 / 2: the derivative of the score weight * d by d.
    pub(crate) fn curvature(self, d2: f64) -> f64 {
        let t = d2 / (self.sigma * self.sigma);
        match self.kind {
            LossKind::Welsch => (-t).exp() * (1.0 - 2.0 * t),
            LossKind::Squared => 1.0,
            LossKind::Huber => f64::from(u8::from(t <= 1.0)),
            LossKind::Tukey => (1.0 - t / 3.0).max(0.0) * (1.0 - 5.0 * t / 3.0),
        }
    }

    /// The distance beyond which nothing is computed. Millimetres; infinite where every point counts.
    pub(crate) fn cutoff(self) -> f64 {
        match self.kind {
            LossKind::Welsch => CUTOFF_SIGMAS * self.sigma,
            LossKind::Tukey => 3f64.sqrt() * self.sigma,
            LossKind::Squared | LossKind::Huber => f64::INFINITY,
        }
    }

    /// The distance at which the loss is 1/2: points that are nearer are inliers.
    pub(crate) fn half(self) -> f64 {
        self.sigma * Self::half_by_sigma(self.kind)
    }

    fn half_by_sigma(kind: LossKind) -> f64 {
        match kind {
            LossKind::Welsch => LN_2.sqrt(),
            LossKind::Squared | LossKind::Huber => 0.5f64.sqrt(),
            LossKind::Tukey => (3.0 * (1.0 - 0.5f64.cbrt())).sqrt(),
        }
    }

    /// The loss whose scale makes it 1/2 at `distance`, which an inlier's may reach (d + eps in \[VA\] sect. 3).
    pub(crate) fn with_half_at(kind: LossKind, distance: f64) -> Self {
        Self { kind, sigma: distance / Self::half_by_sigma(kind) }
    }
}

/// Robust standard deviation of unsigned distances with their prior weights: 1.4826 times their median, over those
/// within `limit`. Zero where there are none.
pub(crate) fn robust_deviation(distances: &mut Vec<(f64, f64)>, limit: f64) -> f64 {
    distances.retain(|(d, _)| *d <= limit);
    MAD_TO_SD * weighted_median(distances).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINDS: [LossKind; 4] = [LossKind::Welsch, LossKind::Squared, LossKind::Huber, LossKind::Tukey];

    #[test]
    fn weight_and_curvature_are_derivatives_of_the_loss_and_half_is_half() {
        for kind in KINDS {
            let loss = Loss { kind, sigma: 1.7 };
            for d in [0.01_f64, 0.4, 1.3, 2.2, 3.0] {
                let h = 1e-4;
                let at = |d: f64| loss.value(d * d);
                let slope = (at(d + h) - at(d - h)) / (2.0 * h);
                let expected = loss.weight(d * d) * 2.0 * d / (1.7 * 1.7);
                // The third derivative times h^2 / 6.
                assert!((slope - expected).abs() < 1e-7, "{kind:?}: {slope} against {expected} at {d}");
                let bend = (at(d + h) - 2.0 * at(d) + at(d - h)) / (h * h);
                let expected = loss.curvature(d * d) * 2.0 / (1.7 * 1.7);
                assert!((bend - expected).abs() < 1e-6, "{kind:?}: {bend} against {expected} at {d}");
            }
            for d2 in [0.0, 0.2, 1.5, 9.0] {
                let PointLoss { value, weight, curvature, .. } = loss.at(d2);
                let expected = [loss.value(d2), loss.weight(d2), loss.curvature(d2)];
                for (a, b) in [value, weight, curvature].into_iter().zip(expected) {
                    assert!((a - b).abs() < 1e-14, "{kind:?}: {a} {b} at {d2}");
                }
            }
            assert!((loss.value(loss.half().powi(2)) - 0.5).abs() < 1e-15);
            assert!((Loss::with_half_at(kind, loss.half()).sigma - 1.7).abs() < 1e-14);
            // Continuous where it bends, and as d^2 / sigma^2 for small distances.
            assert!((loss.value(1.7_f64.powi(2) * 1.000_001) - loss.value(1.7_f64.powi(2))).abs() < 1e-5);
            assert!((loss.value(1e-10) * 1.7 * 1.7 / 1e-10 - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn bounded_losses_end_at_the_cutoff() {
        for kind in [LossKind::Welsch, LossKind::Tukey] {
            let loss = Loss { kind, sigma: 2.0 };
            assert!((loss.value(loss.cutoff().powi(2)) - 1.0).abs() < 5e-6, "{kind:?}");
        }
    }

    #[test]
    fn the_robust_deviation_ignores_what_lies_beyond_the_limit() {
        let mut distances: Vec<(f64, f64)> = (0..1000).map(|i| (f64::from(i) * 1e-3, 1.0)).collect();
        distances.extend([(50.0, 1.0); 200]);
        assert!((robust_deviation(&mut distances, 10.0) - 1.4826 * 0.5).abs() < 1e-3);
        assert_eq!(robust_deviation(&mut vec![(5.0, 1.0)], 1.0), 0.0);
    }
}
