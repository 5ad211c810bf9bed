//! Minimisation of an objective inside the bounds.

pub(crate) mod gauss_newton;
pub(crate) mod in_box;
pub(crate) mod joint;
pub(crate) mod lbfgs;

use super::problem::objective::Objective;
use super::problem::parameterization::Estimate;
use gauss_newton::{Minimum, Stop};

/// Gauss-Newton, and where that does not converge L-BFGS from where it ended, whose steps need no model of the
/// distances. None where the model does not exist at the start.
pub(crate) fn minimise(objective: &Objective, start: Estimate, stop: Stop) -> Option<Minimum> {
    let newton = gauss_newton::minimise(objective, start, stop)?;
    if newton.converged {
        return Some(newton);
    }
    let rest = lbfgs::minimise(objective, newton.estimate.clone());
    Some(rest.filter(|rest| rest.evaluation.value < newton.evaluation.value).unwrap_or(newton))
}
