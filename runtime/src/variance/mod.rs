//! Distances from every texel of the model's surface to the scan; statistics.
//!
//! [`trace`] casts the rays, natively or by a compute shader, and gives [`Deviations`]; [`DistanceTexture`] codes them
//! as the paper does; [`VarianceReport`] has the statistics; [`Unmatched`] is what of the scan no texel can meet.

mod averaging;
mod bins;
mod closest;
mod detection;
mod deviations;
mod explained;
mod form;
mod holes;
mod moments;
mod orientation;
mod quantile;
mod report;
mod split;
mod spread;
mod statistics;
mod texture;
mod tolerance;
mod trace;
mod trace_cpu;
mod trace_gpu;
mod unmatched;
mod values;

pub use averaging::{DEFAULT_WIDTH, MAX_WIDTH, average_normals};
pub use detection::{Detection, ParameterCovariance, detect};
pub use deviations::Deviations;
pub use explained::{Explanation, ParameterEffect, explain};
pub use form::{FormDeviation, Recognised, Roundness, Shape, Zone, form_deviations, recognise};
pub use holes::{FilledHoles, HoleSummary};
pub use moments::{Moments, Percentiles, SignedMoments};
pub use orientation::agree_with_scan;
pub use report::{PartStatistics, SIGN_CONVENTION, SensitivityRange, VarianceReport, VarianceSeconds};
pub use statistics::{Histogram, Statistics};
pub use texture::{DistanceTexture, signed_distances};
pub use tolerance::{Conformance, Tolerance};
pub use trace::{Device, Facing, Towards, Trace, TraceError, hide_behind_filled, trace, trace_closest};
pub use trace_gpu::GpuError;
pub use unmatched::{Piece, Unmatched, UnmatchedSummary};
