//! STL, binary: bare triangles in single precision.

use super::atomic::{self, WriteError};
use crate::mesh::TriangleMesh;
use std::io::{self, Write};
use std::path::Path;
use stl_io::{Normal, Triangle, Vertex};

/// Writes a mesh as binary STL. The format keeps single precision and neither names nor texture coordinates.
///
/// # Errors
/// See [`atomic::write`]; or more triangles than the format can count (2^32 - 1).
pub fn write(path: &Path, mesh: &TriangleMesh) -> Result<(), WriteError> {
    atomic::write_with(path, |mut out| write_to(&mut out, mesh))
}

/// Writes a mesh as binary STL to `out`.
///
/// # Errors
/// Whatever `out` fails with; or more triangles than the format can count.
pub fn write_to<W: Write>(out: &mut W, mesh: &TriangleMesh) -> io::Result<()> {
    if u32::try_from(mesh.triangles.len()).is_err() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "an STL file holds at most 2^32 - 1 triangles"));
    }
    stl_io::write_stl(out, mesh.triangles.iter().map(|&[a, b, c]| facet(mesh, [a, b, c])))
}

fn facet(mesh: &TriangleMesh, triangle: [u32; 3]) -> Triangle {
    let corners = triangle.map(|i| mesh.positions[i as usize]);
    let normal = mesh.triangle_normal(triangle).unwrap_or([0.0; 3]);
    #[expect(clippy::cast_possible_truncation, reason = "the format has single precision")]
    let single = |p: [f64; 3]| p.map(|c| c as f32);
    Triangle { normal: Normal::new(single(normal)), vertices: corners.map(|p| Vertex::new(single(p))) }
}
