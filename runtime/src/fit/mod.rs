//! Parameters and pose from a scan: minimises the mean loss of the distances d(M(x), s_i) from the scan's
//! points s_i to the model M(x) (\[VA\] eq. 1 and 2).
//!
//! - [`FitOptions`], [`FitError`], [`FitResult`]: the input and the output of [`fit()`].
//! - `problem`: the model, the scan, the parameterization of estimates, the loss and the objective.
//! - `correspond`: which place of the model's surface belongs to a point of the scan.
//! - `optimise`: minimisation of the objective inside the bounds.
//! - `register`: global registration, which finds where to begin.
//! - `refine`: local refinement from coarse to fine.
//! - `infer`: standard deviations, tests, comparisons.
//! - `several`: one object in several scans.
//! - `scene`: what else the scan shows than the object.

mod attempt;
mod correspond;
mod infer;
mod measures;
mod monitor;
mod optimise;
mod options;
mod plan;
mod problem;
mod quick;
mod refine;
mod register;
mod report;
mod result;
mod room;
mod scene;
mod search;
mod several;
mod start;
mod tuning;
mod verdict;

#[cfg(test)]
mod tests;

pub(crate) use infer::significance::chi_squared_tail;
pub use measures::{AllowedDeviation, FittedMeasure};
pub use monitor::TracePoint;
pub use options::{Converged, EarlierFit, FitError, FitOptions};
pub use problem::loss::LossKind;
pub use problem::rigid::placing_parameters;
pub use problem::weights::Weights;
pub use result::{
    Agreement, Bootstrap, ContradictedPart, Covariance, Covered, FitResult, FittedInput, FittedParameter, FittedScan,
    HypothesisTest, PassedPart, PoseCovariance, Resampled, Search, SearchCandidate, ShapeDifference, Symmetry,
    UnexplainedPiece, WithoutSd,
};
pub use search::{Evidence, InputValues, SearchError, Selected, search};
pub use several::{SeveralFit, copied, fit_several, in_first_frame};

use crate::model::Model;
use crate::progress::Progress;
use crate::scan::Scan;
use attempt::attempt;
use scene::Scene;
use std::time::Instant;

/// Fits a model to a scan. The scan's frame is the script's: a script with pose parameters gets them, one without gets
/// a pose beside its parameters.
///
/// # Errors
/// Options that name what is not there, a scan or a model with nothing in it, or a model that cannot be evaluated where
/// the fit begins. A fit that finds nothing convincing is not an error: `inliers`, `converged` and `warnings` say so.
/// One that `progress` cancels ends soon with the best so far, marked as `interrupted`.
pub fn fit(
    model: &dyn Model,
    scan: &Scan,
    options: &FitOptions,
    progress: &dyn Progress,
) -> Result<FitResult, FitError> {
    let begun = Instant::now();
    let first = attempt(model, scan, options, progress)?;
    let mut fit = Scene { model, scan, options, progress }.explain(first);
    fit.measures = fit.measured(model, &measures::nominal(model, options));
    // What else a scan shows is found by fits of their own, whose stages are not those of this one.
    let staged: f64 = fit.seconds.values().sum();
    fit.seconds.insert("scene".to_owned(), (begun.elapsed().as_secs_f64() - staged).max(0.0));
    Ok(fit)
}
