//! Why nothing could be measured.

use crate::bvh::BvhError;
use crate::model::{AtlasError, EvaluationError, ReferenceError};
use crate::variance::CastError;
use thiserror::Error;

/// Why nothing could be measured.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum MeasureError {
    /// The model cannot be evaluated.
    #[error(transparent)]
    Evaluation(#[from] EvaluationError),
    /// The model has no texture.
    #[error(transparent)]
    Atlas(#[from] AtlasError),
    /// The reference mesh has no texture.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// No rays can be cast.
    #[error(transparent)]
    Cast(#[from] CastError),
    /// The scan has points only.
    #[error(
        "{path}: is a point cloud without triangles, which has no edges of holes to close: leave out --fill-holes, or make triangles of it with --surface"
    )]
    HolesOfCloud {
        /// Path of the scan.
        path: String,
    },
    /// No hierarchy can be built over the scan.
    #[error("{path}: {error}")]
    Scan {
        /// Path of the scan.
        path: String,
        /// The reason.
        error: BvhError,
    },
    /// No hierarchy can be built over the surface.
    #[error("the model's surface: {0}")]
    Surface(BvhError),
    /// The model is so large that no distances are searched from it.
    #[error(
        "the model's surface is {size:.3e} mm across, more than the 2e9 mm that can be searched: check the parameters' values and their units"
    )]
    Huge {
        /// The longest side of its bounding box. Millimetres.
        size: f64,
    },
    /// The band beside edges is too wide.
    #[error("{width} mm is more than a tenth of the model's size; at most {most:.3}mm here")]
    AveragingWidth {
        /// As requested. Millimetres.
        width: f64,
        /// The widest band. Millimetres.
        most: f64,
    },
    /// The part that was named cannot be a datum.
    #[error("{reason}")]
    Datum {
        /// A sentence about the part.
        reason: String,
    },
    /// The maximum distance is not well above a tolerance.
    #[error(
        "{max_distance} mm is too close to the tolerance of {limit} mm: what is farther away is not measured, and no reason to reject a part; at least {least:.3}mm here"
    )]
    MaxDistance {
        /// As requested. Millimetres.
        max_distance: f64,
        /// The farthest limit of a tolerance. Millimetres.
        limit: f64,
        /// The least maximum distance. Millimetres.
        least: f64,
    },
    /// No maximum distance follows from the surface, and none was requested.
    #[error("the surface has no extent, so that no maximum distance follows from it; choose one with --max-distance")]
    NoExtent,
    /// The scan lies nowhere near the surface.
    #[error("{path}: nothing was measured: {likely}")]
    Nothing {
        /// Path of the scan.
        path: String,
        /// What is likely to be wrong.
        likely: String,
    },
    /// The user ended the work.
    #[error("interrupted")]
    Interrupted,
}
