//! Bounds that depend on other parameters.

use crate::model::Model;

/// Which parameters' bounds change when another parameter moves inside its bounds.
pub(crate) fn varying_bounds(model: &dyn Model, x: &[f64], at: &[(f64, f64)]) -> Vec<bool> {
    let mut varying = vec![false; x.len()];
    for j in 0..x.len() {
        let (low, high) = at[j];
        let mut probe = x.to_vec();
        probe[j] = if low.is_finite() && high.is_finite() {
            low + 0.381_966 * (high - low)
        } else {
            x[j] + 0.618_034 * (1.0 + x[j].abs())
        };
        if probe[j] == x[j] {
            probe[j] += 1e-3 * (1.0 + x[j].abs());
        }
        for (varies, (then, now)) in varying.iter_mut().zip(model.bounds(&probe).iter().zip(at)) {
            *varies |= then != now;
        }
    }
    varying
}
