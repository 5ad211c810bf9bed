//! The uncertainty that a fit would have without the bounds at which coordinates are held.

use crate::fit::tuning::{BY_BOUNDS, MOVED_BY_BOUNDS};
use nalgebra::{DMatrix, DVector};

/// The uncertainty, and the step to the optimum, without the bounds at which coordinates are held.
#[derive(Clone, Debug)]
pub(crate) struct WithoutBounds {
    pub(crate) covariance: DMatrix<f64>,
    /// The inverse of the bread.
    pub(crate) inverse: DMatrix<f64>,
    pub(crate) determined: Vec<bool>,
    /// By coordinate, whether only the ends of the scan would determine it, which with the bounds are not alone.
    pub(crate) by_ends: Vec<bool>,
    /// The step to the optimum.
    pub(crate) step: DVector<f64>,
    /// The bias by noise, beyond that which there is with the bounds.
    pub(crate) bias: DVector<f64>,
}

impl WithoutBounds {
    /// Whether a coordinate with a variance would be much less certain, or not determined, or clearly another one. It
    /// would be, too, where noise moves it so far together with the coordinates that stand at their bounds: where the
    /// bounds stop them is then chance.
    pub(crate) fn decides(&self, k: usize, variance: f64) -> bool {
        let open = !self.determined[k] || self.covariance[(k, k)] > BY_BOUNDS.powi(2) * variance;
        let moves = self.step[k].abs().max(self.bias[k].abs()) > MOVED_BY_BOUNDS * variance.sqrt();
        variance > 0.0 && (open || moves || self.by_ends[k])
    }

    /// Takes noise into account: the mean gradient that it makes, times sigma^2 / 2 and the weight of the points, and
    /// the bias that it has with the bounds.
    pub(crate) fn biased(mut self, pull: &DVector<f64>, with_bounds: &DVector<f64>) -> Self {
        self.bias = -(&self.inverse * pull) - with_bounds;
        self
    }
}
