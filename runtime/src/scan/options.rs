//! What of a file is read, and how.

use super::unit::Unit;
use crate::mesh::Bounds;

/// How a scan is read.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ReadOptions {
    /// The unit of the file's coordinates; none for that which the file states, or else the millimetre.
    pub unit: Option<Unit>,
    /// Of the scans in a file only this one, counted from 0.
    pub only: Option<usize>,
    /// Only points in this box are read, and triangles whose corners all are. Millimetres, in the file's frame.
    pub crop: Option<Bounds>,
    /// Of the points of a cloud in a cube of this edge one is kept, by lot. Millimetres; none keeps all, up to a limit.
    pub voxel: Option<f64>,
    /// Only the largest of the pieces that do not hang together is kept.
    pub keep_largest: bool,
    /// Points that lie on no surface are left out of a cloud.
    pub drop_outliers: bool,
    /// Triangles are made of a cloud: a surface through its points.
    pub surface: bool,
    /// The most triangles of a mesh, which is simplified, and the most points of a cloud.
    pub decimate: Option<usize>,
}

impl From<Unit> for ReadOptions {
    fn from(unit: Unit) -> Self {
        Self { unit: Some(unit), ..Self::default() }
    }
}
