//! Parameters and pose from a scan: minimises f(x) = mean psi(d(M(x), s_i)) ([VA] eq. 1 and 2).
//!
//! - [`FitOptions`], [`FitError`], [`FitResult`]: what goes in and what comes out of [`fit()`].
//! - `points` thins the scan evenly; `layout` divides the model into facets, `facets`, `tree` and `block` find the nearest one within the
//!   cut-off, `distance` the exact foot point; `memory` knows which points need no search; `objective` sums psi and its derivatives
//!   (`sums`, `rows`).
//! - `space` says what varies: parameters inside their bounds, and the motion in local coordinates (`motion`), and `figure` where its parts are, whatever their symmetry. `pose` finds the
//!   script's own pose parameters and writes the motion back into them.
//! - `lbfgs` and `gauss_newton` minimise; `schedule` is the whole: `frame` says how the pose is treated, `screening` finds where to
//!   begin, `descent` goes from coarse to fine. `setting` is what stays the same meanwhile.
//! - `uncertainty` says how well the result is known, with `blocks` of dependent residuals and `kinks` between patches; `unshown`
//!   parts were not scanned.

mod block;
mod blocks;
mod bootstrap;
mod bounds;
mod compare;
mod coverage;
mod descent;
mod distance;
mod facets;
mod field;
mod figure;
mod filling;
mod frame;
mod function;
mod gauss_newton;
mod group;
mod hypothesis;
mod kinks;
mod layout;
mod lbfgs;
mod loss;
mod memory;
mod motion;
mod objective;
mod options;
mod points;
mod pose;
mod proposals;
mod regression;
mod relabel;
mod report;
mod restart;
mod result;
mod rows;
mod schedule;
mod screening;
mod setting;
mod significance;
mod slack;
mod space;
mod sums;
mod trace;
mod tree;
mod uncertainty;
mod unshown;

#[cfg(test)]
mod tests;

pub use compare::{Comparison, Rival, compare};
pub use function::ObjectiveFunction;
pub use loss::LossKind;
pub use options::{FitError, FitOptions};
pub use pose::pose_parameters;
pub use regression::{Observation, Regression, regress};
pub use result::{
    Bootstrap, Covariance, Covered, FitResult, FittedParameter, HypothesisTest, Resampled, Search, SearchCandidate,
};
pub use schedule::fit;
pub use trace::TracePoint;
