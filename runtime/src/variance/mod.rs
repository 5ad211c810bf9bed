//! Variance analysis: distances from every texel of the model's surface to the scan, and their statistics.
//!
//! [`measure()`] is the whole analysis. Its stages: [`cast()`] casts the rays, natively or by a compute shader, and
//! gives [`Deviations`]; [`DistanceTexture`] codes them as the paper does; [`VarianceReport`] has the statistics.

mod agreement;
mod averaging;
mod cast;
mod class;
mod cloud;
mod contradicted;
mod detection;
mod deviations;
mod distribution;
mod explained;
mod form;
mod hits;
mod holes;
mod matching;
mod measure;
mod moments;
mod noise;
mod nothing;
mod orientation;
mod peaks;
mod points;
mod reach;
mod report;
mod sag;
mod scan_colours;
mod scanned;
mod statistics;
mod surface;
mod texel_widths;
mod texture;
mod tolerance;
mod unmatched;
mod verdict;

pub use agreement::{Agreement, Limits, LimitsBasis, NOISE_FACTOR, PointAgreement, Portion};
pub use cast::{Cast, CastError, Device, DistanceKind, Facing, cast};
pub use class::Class;
pub use cloud::CylinderSummary;
pub use detection::{Detection, ParameterCovariance};
pub use deviations::Deviations;
pub(crate) use distribution::{Distribution, Sample};
pub use explained::{Explanation, ParameterEffect};
pub use form::{
    Characteristic, DatumRelations, FormDeviation, PointMeasure, Relation, Roundness, Shape, Straightness,
    WithoutNoise, Zone,
};
pub use holes::HoleSummary;
pub use matching::Matching;
pub use measure::{MeasureError, MeasureOptions, Measurement, measure, require_datum, require_what_scan_has};
pub(crate) use moments::null_as_nan;
pub use moments::{Moments, Percentiles, SignedMoments};
pub(crate) use orientation::{Facings, enclosed_volume, turn};
pub use peaks::Peak;
pub use points::{LargestDistance, MeasuredPoints, PartPoints, PointDistance, PointDistances, PointStatistics};
pub(crate) use reach::Reach;
pub use report::{PartStatistics, SIGN_CONVENTION, SensitivityRange, VarianceReport, VarianceSeconds, without_indices};
pub use sag::{Sag, without_sag};
pub use scan_colours::{ColourSource, ColourSummary, ScanColours, Stretch};
pub use statistics::{Histogram, Statistics};
pub(crate) use surface::{Parametrised, Surface, target};
pub use surface::{Reference, Resolution};
pub use texel_widths::TexelWidths;
pub(crate) use texture::dilate;
pub use texture::{DistanceTexture, FINE_CODE, fine_end, signed_distances};
pub use tolerance::{Conformance, Tolerance};
pub use unmatched::{Piece, UnmatchedSummary};
pub use verdict::{DecisionRule, Dimension, DimensionVerdict, Outcome, OverallVerdict, Verdict, VerdictOptions};
