//! The objective as a function of the script's own parameters, for those who bring an optimiser of their own, and for
//! measurements.

use crate::fit::correspond::cache::FootCache;
use crate::fit::correspond::foot::Foot;
use crate::fit::correspond::layout::Layout;
use crate::fit::monitor::Monitor;
use crate::fit::options::FitError;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Objective, Order, no_hints};
use crate::fit::problem::parameterization::Parameterization;
use crate::fit::problem::points::Points;
use crate::model::Model;
use crate::scan::Scan;
use std::sync::Arc;
use std::sync::atomic::AtomicU32;

/// f(x) = mean psi(d(M(x), s_i)) ([VA] eq. 1) over all points of a scan, with the scan in the script's frame. Bounds are not
/// looked at.
pub struct ObjectiveFunction<'a> {
    space: Parameterization<'a>,
    points: Points,
    layout: Layout,
    loss: Loss,
    tolerance: f64,
    hints: Arc<Vec<AtomicU32>>,
    cache: Arc<FootCache>,
    monitor: Monitor<'a>,
}

impl<'a> ObjectiveFunction<'a> {
    /// The objective with scale `sigma` (millimetres). `x` is a place near which it will be evaluated: there it is decided how
    /// finely patches are divided for the search of nearest points, which does not change distances but by the side that is
    /// found where two are equally near.
    ///
    /// # Errors
    /// A scan without points, a model without parts or that cannot be evaluated at `x`, or a sigma that is not positive.
    pub fn new(model: &'a dyn Model, scan: &Scan, x: &[f64], sigma: f64) -> Result<Self, FitError> {
        if !(sigma > 0.0 && sigma.is_finite()) {
            return Err(FitError::Sigma(sigma));
        }
        if model.parts().is_empty() {
            return Err(FitError::EmptyModel);
        }
        let points = Points::of(scan);
        let radius = points.gyration();
        if points.len() == 0 || !(radius > 0.0) {
            return Err(FitError::EmptyScan { points: points.len() });
        }
        let instance = model.instantiate(x)?;
        let layout = Layout::new(model, &*instance, 0.002 * radius, 2.0 * radius);
        let space = Parameterization::unbounded(model, x);
        let tolerance = 1e-9 * radius;
        let (hints, monitor) = (no_hints(&points), Monitor::default());
        let cache = Arc::new(FootCache::new(&points, sigma));
        Ok(Self { space, points, layout, loss: Loss::welsch(sigma), tolerance, hints, cache, monitor })
    }

    /// f and its gradient by the parameters; None where the model does not exist.
    pub fn value_and_gradient(&self, x: &[f64]) -> Option<(f64, Vec<f64>)> {
        let at = self.space.estimate(x, Isometry::IDENTITY);
        let evaluation = self.objective().evaluate(&at, Order::Gradient)?;
        Some((evaluation.value, evaluation.gradient.as_slice().to_vec()))
    }

    /// Distances of the scan's points to the exact surface, in millimetres and in the scan's order; infinite beyond the
    /// cut-off of 3.5 sigma. None where the model does not exist.
    pub fn distances(&self, x: &[f64]) -> Option<Vec<f64>> {
        let at = self.space.estimate(x, Isometry::IDENTITY);
        let objective = self.objective();
        let placed = objective.place(&at).ok()?;
        let mut distances = vec![f64::INFINITY; self.points.len()];
        for (i, Foot { d2, .. }) in objective.feet(&placed, &at.motion) {
            distances[self.points.index[i] as usize] = d2.sqrt();
        }
        Some(distances)
    }

    fn objective(&self) -> Objective<'_> {
        Objective {
            tolerance: self.tolerance,
            hints: self.hints.clone(),
            cache: Some(self.cache.clone()),
            ..Objective::new(&self.space, &self.layout, &self.points, self.loss, &self.monitor)
        }
    }
}
