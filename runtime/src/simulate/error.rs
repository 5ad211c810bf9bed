//! Why nothing could be scanned.

use super::scanner::Kind;
use crate::bvh::BvhError;
use crate::model::EvaluationError;
use thiserror::Error;

/// The reason why nothing could be scanned.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SimulationError {
    /// An option is out of its range.
    #[error("the scanner's {option} is {value}, but must be {range}")]
    Option {
        /// Its name.
        option: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        range: &'static str,
    },
    /// Memory and time would not suffice.
    #[error(
        "a spacing of {spacing} mm on an object {size:.0} mm large takes {rays:.1e} rays, more than {limit:.1e}; choose a wider spacing"
    )]
    TooFine {
        /// The spacing.
        spacing: f64,
        /// Diameter of the object. Millimetres.
        size: f64,
        /// Rays that it would take.
        rays: f64,
        /// Most rays.
        limit: f64,
    },
    /// Memory would not suffice.
    #[error("the scan has more than {limit} points; choose a wider spacing, or fewer stations")]
    TooManyPoints {
        /// Most points.
        limit: usize,
    },
    /// The kind of scanner has no such property.
    #[error("a scanner of the kind {} has no {property}; {instead}", kind.name())]
    NoSuchProperty {
        /// The kind.
        kind: Kind,
        /// What it has not.
        property: &'static str,
        /// The way out.
        instead: &'static str,
    },
    /// The model has no surface.
    #[error("the model has no surface to scan: no triangle with an area")]
    NoSurface,
    /// The stations see nothing of it.
    #[error(
        "no ray of the {stations} places of the scanner meets the surface at less than the largest angle of incidence; take a smaller spacing, or other places (--station)"
    )]
    NothingInSight {
        /// The number of places.
        stations: usize,
    },
    /// The views see nothing of it.
    #[error(
        "no ray of the {views} views meets the surface; take a smaller spacing than the surface is wide, or more views (--spacing, --views)"
    )]
    NothingSeen {
        /// The number of views.
        views: usize,
    },
    /// The holes took all of it.
    #[error("the holes, of radius {radius} mm, leave nothing; punch fewer (--holes), or none")]
    NothingLeft {
        /// Their radius.
        radius: f64,
    },
    /// The mesh cannot be ray-cast.
    #[error("the model cannot be scanned: {0}")]
    Mesh(#[from] BvhError),
    /// The model's surface cannot be evaluated at a point of the scan.
    #[error("the model cannot be scanned: {0}")]
    Surface(#[from] EvaluationError),
    /// The user ended the work.
    #[error("cancelled")]
    Cancelled,
}
