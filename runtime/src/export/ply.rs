//! PLY, binary little endian: positions, normals, texture coordinates and named values at the vertices.

use super::atomic::{self, WriteError};
use crate::mesh::TriangleMesh;
use std::io::{self, Write};
use std::path::Path;

/// A value at every vertex, such as the signed deviation in millimetres; NaN where there is none.
#[derive(Clone, Copy, Debug)]
pub struct ScalarField<'a> {
    /// Its name, written as `scalar_NAME` (where CloudCompare looks).
    pub name: &'a str,
    /// As many as vertices.
    pub values: &'a [f32],
}

/// Writes a mesh as PLY: positions in double precision, all else in single. The first of `fields` is the main one and
/// is also written as `quality` (where MeshLab looks).
///
/// # Errors
/// See [`atomic::write`]; or a field whose length is not the number of vertices.
pub fn write(path: &Path, mesh: &TriangleMesh, fields: &[ScalarField]) -> Result<(), WriteError> {
    atomic::write_with(path, |out| write_to(out, mesh, fields))
}

/// Writes a mesh as PLY to `out`.
///
/// # Errors
/// Whatever `out` fails with; or a field whose length is not the number of vertices.
pub fn write_to(out: &mut dyn Write, mesh: &TriangleMesh, fields: &[ScalarField]) -> io::Result<()> {
    if let Some(field) = fields.iter().find(|field| field.values.len() != mesh.positions.len()) {
        let message =
            format!("field `{}` has {} values for {} vertices", field.name, field.values.len(), mesh.positions.len());
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    write_header(out, mesh, fields)?;
    for (i, position) in mesh.positions.iter().enumerate() {
        for c in position {
            out.write_all(&c.to_le_bytes())?;
        }
        let normal = mesh.normals.get(i).into_iter().flatten();
        let texcoord = mesh.texcoords.get(i).into_iter().flatten();
        #[expect(clippy::cast_possible_truncation, reason = "single precision is enough for all but positions")]
        for c in normal.chain(texcoord) {
            out.write_all(&(*c as f32).to_le_bytes())?;
        }
        for field in fields.first().into_iter().chain(fields) {
            out.write_all(&field.values[i].to_le_bytes())?;
        }
    }
    for triangle in &mesh.triangles {
        out.write_all(&[3])?;
        for index in triangle {
            out.write_all(&index.to_le_bytes())?;
        }
    }
    Ok(())
}

fn write_header(out: &mut dyn Write, mesh: &TriangleMesh, fields: &[ScalarField]) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment gmlc, unit: mm")?;
    writeln!(out, "element vertex {}", mesh.positions.len())?;
    writeln!(out, "property double x\nproperty double y\nproperty double z")?;
    if !mesh.normals.is_empty() {
        writeln!(out, "property float nx\nproperty float ny\nproperty float nz")?;
    }
    if !mesh.texcoords.is_empty() {
        writeln!(out, "property float s\nproperty float t")?;
    }
    if !fields.is_empty() {
        writeln!(out, "property float quality")?;
    }
    for field in fields {
        // A property's name ends at white space.
        let name: String = field.name.chars().map(|c| if c.is_ascii_graphic() { c } else { '_' }).collect();
        writeln!(out, "property float scalar_{name}")?;
    }
    if !mesh.triangles.is_empty() {
        writeln!(out, "element face {}", mesh.triangles.len())?;
        writeln!(out, "property list uchar uint vertex_indices")?;
    }
    writeln!(out, "end_header")
}
