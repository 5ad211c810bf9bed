//! The file that a scan came from, and what became of its contents.

use serde::{Deserialize, Serialize};

/// The file that a scan came from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScanSource {
    /// Path as the user gave it.
    pub path: String,
    /// SHA-256 of the file, in hexadecimal.
    pub sha256: String,
    /// Points (vertices) after cleaning.
    pub points: usize,
    /// Triangles after cleaning.
    pub triangles: usize,
    /// The file's unit: `mm`, `m`, ...
    pub unit: String,
    /// The file's format: `PLY`, `E57`, ...
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub format: String,
    /// What of the file is not in the scan.
    #[serde(default, skip_serializing_if = "Cleaning::is_empty")]
    pub cleaning: Cleaning,
}

/// Numbers of points and triangles of a file that are not in the scan, by reason.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cleaning {
    /// Points (vertices) of the file that have coordinates.
    pub points: u64,
    /// Triangles of the file.
    pub triangles: u64,
    /// Points that the file marks as invalid, as noise or as withheld.
    #[serde(skip_serializing_if = "is_zero")]
    pub marked: u64,
    /// Cells of a grid without an echo, and points whose coordinates are not numbers.
    #[serde(skip_serializing_if = "is_zero")]
    pub empty: u64,
    /// Points outside of the box of `--crop`.
    #[serde(skip_serializing_if = "is_zero")]
    pub cropped: u64,
    /// Points of a cloud that are far from all others.
    #[serde(skip_serializing_if = "is_zero")]
    pub far: u64,
    /// Points of which another one in the same cube is kept.
    #[serde(skip_serializing_if = "is_zero")]
    pub thinned: u64,
    /// The edge of these cubes. Millimetres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub voxel: Option<f64>,
    /// Points of a cloud at exactly the place of another one; vertices of a mesh that became one with another.
    #[serde(skip_serializing_if = "is_zero")]
    pub equal_points: u64,
    /// Triangles without area.
    #[serde(skip_serializing_if = "is_zero")]
    pub without_area: u64,
    /// Triangles that are there twice.
    #[serde(skip_serializing_if = "is_zero")]
    pub repeated: u64,
    /// Vertices that no triangle uses.
    #[serde(skip_serializing_if = "is_zero")]
    pub unused: u64,
    /// Points that lie on no surface.
    #[serde(skip_serializing_if = "is_zero")]
    pub outliers: u64,
    /// Points of pieces that do not hang together with the largest.
    #[serde(skip_serializing_if = "is_zero")]
    pub pieces: u64,
    /// Triangles that the simplification of a mesh took away; points of a cloud.
    #[serde(skip_serializing_if = "is_zero")]
    pub decimated: u64,
}

impl Cleaning {
    /// Whether nothing was counted.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}
