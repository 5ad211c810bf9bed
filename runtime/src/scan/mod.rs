//! Scans: reading, cleaning, normals, noise; and the virtual laser scanner.

use crate::mesh::TriangleMesh;
use serde::{Deserialize, Serialize};

/// A scan, cleaned: what the fit and the variance analysis work on.
#[derive(Clone, Debug)]
pub struct Scan {
    /// Millimetres. Unit vertex normals are present; triangles are none for a plain cloud of points. Every position is
    /// finite, every index valid, no triangle degenerate, no vertex unused (but in a cloud).
    pub mesh: TriangleMesh,
    /// Where it came from.
    pub source: ScanSource,
    /// Standard deviation of the noise along the surface's normal, robustly estimated. Millimetres.
    pub noise: f64,
    /// What cleaning found.
    pub cleaning: Cleaning,
}

/// Where a scan came from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
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
}

/// What cleaning found and did; all counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cleaning {
    /// Vertices in the file.
    pub vertices_read: usize,
    /// Triangles in the file, after polygons were split.
    pub triangles_read: usize,
    /// Vertices that repeat an earlier one's position exactly, merged.
    pub duplicate_vertices: usize,
    /// Triangles without area or with a vertex twice, dropped.
    pub degenerate_triangles: usize,
    /// Triangles that repeat an earlier one's vertices, dropped.
    pub duplicate_triangles: usize,
    /// Vertices that no triangle uses, dropped (in a file that has triangles).
    pub unused_vertices: usize,
    /// Normals in the file that were not of unit length (scaled) or zero or not finite (computed anew).
    pub mended_normals: usize,
}
