//! Variance analysis: distances from every texel of the model's surface to the scan, and their statistics.
//!
//! [`measure`] is the whole analysis. Its stages: [`cast`](cast()) casts the rays, natively or by a compute shader, and
//! gives [`Deviations`]; [`DistanceTexture`] codes them as the paper does; [`VarianceReport`] has the statistics;
//! [`Unmatched`] is the part of the scan that no texel can meet.

mod averaging;
mod cast;
mod detection;
mod deviations;
mod distribution;
mod explained;
mod form;
mod holes;
mod measure;
mod moments;
mod orientation;
mod report;
mod statistics;
mod surface;
mod texture;
mod tolerance;
mod unmatched;

pub use averaging::{DEFAULT_WIDTH, MAX_WIDTH, average_normals};
pub use cast::{Cast, CastError, Device, DistanceKind, Facing, GpuError, cast, closest, hide_behind_filled};
pub use detection::{Detection, ParameterCovariance, detect};
pub use deviations::Deviations;
pub use explained::{Explanation, ParameterEffect, explain};
pub use form::{FormDeviation, Recognised, Roundness, Shape, Zone, form_deviations, recognise};
pub use holes::{FilledHoles, HoleSummary};
pub use measure::{MeasureError, MeasureOptions, Measurement, measure};
pub use moments::{Moments, Percentiles, SignedMoments};
pub use orientation::agree_with_scan;
pub use report::{PartStatistics, SIGN_CONVENTION, SensitivityRange, VarianceReport, VarianceSeconds};
pub use statistics::{Histogram, Statistics};
pub use surface::{Reference, Resolution};
pub use texture::{DistanceTexture, signed_distances};
pub use tolerance::{Conformance, Tolerance};
pub use unmatched::{Piece, Unmatched, UnmatchedSummary};
