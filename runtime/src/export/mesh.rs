//! Meshes as files: Wavefront OBJ, PLY (binary, little endian) and STL (binary).

use super::atomic::{self, WriteError};
use crate::mesh::TriangleMesh;
use crate::scan::{Attributes, Unit};
use glam::DVec3;
use std::io::{self, Write};
use std::path::Path;

/// A format of meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Text in double precision: positions, each once, texture coordinates, normals and groups.
    Obj,
    /// Positions in double precision, each once, and normals in single precision; texture coordinates where there are
    /// no seams.
    Ply,
    /// Bare triangles in single precision.
    Stl,
}

impl MeshFormat {
    /// The format that the ending of a file's name says, in any case of letters; none where it says another.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        Self::named(&path.extension()?.to_string_lossy())
    }

    /// The format of a name such as `obj`, in any case of letters.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name.to_ascii_lowercase().as_str() {
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            "stl" => Some(Self::Stl),
            _ => None,
        }
    }
}

/// Writes a mesh to a file. None of the formats has a field for its unit: it is the millimetre, which they have in a
/// comment.
///
/// # Errors
/// See [`atomic::write`]; or more triangles than STL can count (2^32 - 1).
pub fn write(path: &Path, mesh: &TriangleMesh, format: MeshFormat) -> Result<(), WriteError> {
    atomic::write_with(path, |out| write_to(out, mesh, format))
}

/// Writes a mesh to `out`.
///
/// # Errors
/// Whatever `out` fails with; or more triangles than STL can count.
pub fn write_to(out: &mut dyn Write, mesh: &TriangleMesh, format: MeshFormat) -> io::Result<()> {
    write_scan(out, mesh, &Attributes::default(), Unit::Mm, format)
}

/// Writes a mesh or a cloud to `out`, with coordinates in a unit; of the formats PLY has colours and intensities.
pub(super) fn write_scan(
    out: &mut dyn Write,
    mesh: &TriangleMesh,
    attributes: &Attributes,
    unit: Unit,
    format: MeshFormat,
) -> io::Result<()> {
    match format {
        MeshFormat::Obj => write_obj(out, mesh, unit),
        MeshFormat::Ply => write_ply(out, mesh, attributes, unit),
        MeshFormat::Stl => write_stl(out, mesh, unit),
    }
}

/// The vertices of a mesh with each position once, so that triangles on either side of a corner or of a seam share it.
struct Welded {
    /// For every vertex the number of its position.
    number: Vec<u32>,
    /// A vertex of each position.
    first: Vec<u32>,
}

impl Welded {
    /// Points without triangles stay apart.
    fn of(mesh: &TriangleMesh) -> Self {
        if mesh.triangles.is_empty() {
            let all: Vec<u32> = (0..mesh.positions.len() as u32).collect();
            return Self { number: all.clone(), first: all };
        }
        let number = mesh.position_numbers();
        let mut first = Vec::new();
        for (vertex, number) in number.iter().enumerate() {
            if *number as usize == first.len() {
                first.push(vertex as u32);
            }
        }
        Self { number, first }
    }

    /// Whether a position has several vertices.
    fn has_seams(&self) -> bool {
        self.first.len() < self.number.len()
    }

    /// The normal of each position: the mean of its vertices'.
    fn normals(&self, mesh: &TriangleMesh) -> Vec<[f64; 3]> {
        let mut sums = vec![DVec3::ZERO; self.first.len()];
        for (number, normal) in self.number.iter().zip(&mesh.normals) {
            sums[*number as usize] += DVec3::from_array(*normal);
        }
        let only = |(sum, first): (DVec3, &u32)| {
            let first = mesh.normals[*first as usize];
            if sum == DVec3::from_array(first) { first } else { sum.try_normalize().map_or(first, |n| n.to_array()) }
        };
        sums.into_iter().zip(&self.first).map(only).collect()
    }
}

/// Numbers are written so that reading them gives the same doubles.
fn write_obj(out: &mut dyn Write, mesh: &TriangleMesh, unit: Unit) -> io::Result<()> {
    let welded = Welded::of(mesh);
    writeln!(out, "# {}", unit.comment())?;
    for [x, y, z] in welded.first.iter().map(|i| mesh.positions[*i as usize].map(|c| c / unit.millimetres())) {
        writeln!(out, "v {x} {y} {z}")?;
    }
    for [s, t] in &mesh.texcoords {
        writeln!(out, "vt {s} {t}")?;
    }
    for [x, y, z] in &mesh.normals {
        writeln!(out, "vn {x} {y} {z}")?;
    }
    let (textured, shaded) = (!mesh.texcoords.is_empty(), !mesh.normals.is_empty());
    let corner = |vertex: u32| {
        let (position, i) = (welded.number[vertex as usize] + 1, vertex + 1);
        match (textured, shaded) {
            (true, true) => format!("{position}/{i}/{i}"),
            (true, false) => format!("{position}/{i}"),
            (false, true) => format!("{position}//{i}"),
            (false, false) => format!("{position}"),
        }
    };
    let mut groups = mesh.groups.iter().peekable();
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        while let Some(group) = groups.next_if(|group| group.start <= i) {
            // Control characters would end the line.
            let name: String = group.name.chars().map(|c| if c.is_control() { '_' } else { c }).collect();
            writeln!(out, "g {name}")?;
        }
        let [a, b, c] = triangle.map(corner);
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}

/// Normals are the means at a position. Texture coordinates are left out where positions have several: tools that read
/// those of the corners of faces (VTK, trimesh) cut the mesh open along them.
fn write_ply(out: &mut dyn Write, mesh: &TriangleMesh, attributes: &Attributes, unit: Unit) -> io::Result<()> {
    let welded = Welded::of(mesh);
    let textured = !mesh.texcoords.is_empty() && !welded.has_seams();
    let Attributes { colours, intensities, .. } = attributes;
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment {}", unit.comment())?;
    writeln!(out, "element vertex {}", welded.first.len())?;
    writeln!(out, "property double x\nproperty double y\nproperty double z")?;
    if !mesh.normals.is_empty() {
        writeln!(out, "property float nx\nproperty float ny\nproperty float nz")?;
    }
    if textured {
        writeln!(out, "property float s\nproperty float t")?;
    }
    if !intensities.is_empty() {
        writeln!(out, "property float intensity")?;
    }
    if !colours.is_empty() {
        writeln!(out, "property uchar red\nproperty uchar green\nproperty uchar blue")?;
    }
    if !mesh.triangles.is_empty() {
        writeln!(out, "element face {}", mesh.triangles.len())?;
        writeln!(out, "property list uchar uint vertex_indices")?;
    }
    writeln!(out, "end_header")?;
    let normals = if mesh.normals.is_empty() { Vec::new() } else { welded.normals(mesh) };
    for (number, vertex) in welded.first.iter().map(|vertex| *vertex as usize).enumerate() {
        for c in &mesh.positions[vertex] {
            out.write_all(&(c / unit.millimetres()).to_le_bytes())?;
        }
        let texcoord = mesh.texcoords.get(vertex).filter(|_| textured);
        for c in normals.get(number).into_iter().flatten().chain(texcoord.into_iter().flatten()) {
            out.write_all(&(*c as f32).to_le_bytes())?;
        }
        if let Some(intensity) = intensities.get(vertex) {
            out.write_all(&intensity.to_le_bytes())?;
        }
        if let Some(colour) = colours.get(vertex) {
            out.write_all(colour)?;
        }
    }
    for triangle in &mesh.triangles {
        out.write_all(&[3])?;
        for vertex in triangle {
            out.write_all(&welded.number[*vertex as usize].to_le_bytes())?;
        }
    }
    Ok(())
}

/// The number of points of a mesh in an OBJ or a PLY file.
pub(super) fn count_places(mesh: &TriangleMesh) -> usize {
    Welded::of(mesh).first.len()
}

/// Whether vertices of a mesh are at one place, so that a PLY file has no texture coordinates.
pub(super) fn has_seams(mesh: &TriangleMesh) -> bool {
    Welded::of(mesh).has_seams()
}

/// A header of 80 bytes, which says the unit, and a count; for each triangle its normal, its corners and two bytes of
/// attributes.
fn write_stl(out: &mut dyn Write, mesh: &TriangleMesh, unit: Unit) -> io::Result<()> {
    // The sum makes one zero of two, so that tools that compare bytes find equal places equal.
    let rounded = |v: DVec3| (v + DVec3::ZERO).as_vec3();
    let corners = |triangle: [u32; 3]| mesh.corners(triangle).map(|corner| rounded(corner / unit.millimetres()));
    // In single precision corners next to each other may be one; without these triangles a closed mesh stays closed.
    let has_area = |triangle: &&[u32; 3]| {
        let [a, b, c] = corners(**triangle);
        a != b && b != c && c != a
    };
    let triangles = || mesh.triangles.iter().filter(has_area);
    let Ok(count) = u32::try_from(triangles().count()) else {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "an STL file holds at most 2^32 - 1 triangles"));
    };
    let mut header = [0; 80];
    let comment = unit.comment();
    header[..comment.len()].copy_from_slice(comment.as_bytes());
    out.write_all(&header)?;
    out.write_all(&count.to_le_bytes())?;
    for &triangle in triangles() {
        let [a, b, c] = corners(triangle);
        for vector in [rounded(mesh.triangle_normal(triangle).unwrap_or_default()), a, b, c] {
            out.write_all(bytemuck::bytes_of(&vector.to_array().map(f32::to_le_bytes)))?;
        }
        out.write_all(&[0; 2])?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Group;

    #[test]
    fn a_cloud_as_ply_has_its_attributes_and_its_unit() {
        let mesh = TriangleMesh { positions: vec![[1500.0, 0.0, 1.0]; 2], ..TriangleMesh::default() };
        let colours = vec![[1, 2, 3], [4, 5, 6]];
        let attributes = Attributes { intensities: vec![0.5, 0.25], colours, ..Attributes::default() };
        let mut out = Vec::new();
        write_scan(&mut out, &mesh, &attributes, Unit::M, MeshFormat::Ply).unwrap();
        let header = b"unit: m\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\n\
            property float intensity\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
        assert!(out.windows(header.len()).any(|window| window == header));
        let last = &out[out.len() - 31..];
        assert_eq!(last[..8], 1.5_f64.to_le_bytes());
        assert_eq!((&last[24..28], &last[28..]), (&0.25_f32.to_le_bytes()[..], &[4, 5, 6][..]));
    }

    #[test]
    fn text_of_a_small_mesh() {
        let mesh = TriangleMesh {
            positions: vec![[0.0; 3], [1.5, 0.0, 0.0], [0.0, 1e-3, 0.0], [0.0, 0.0, 1e6]],
            normals: vec![[0.0, 0.0, 1.0]; 4],
            texcoords: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.5]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            groups: vec![
                Group { name: "hole[0]".into(), start: 0, end: 1 },
                Group { name: "a\nb".into(), start: 1, end: 2 },
            ],
        };
        let mut out = Vec::new();
        write_to(&mut out, &mesh, MeshFormat::Obj).unwrap();
        let text = String::from_utf8(out).unwrap();
        let tail: Vec<&str> = text.lines().skip(13).collect();
        assert_eq!(text.lines().nth(3), Some("v 0 0.001 0"));
        assert_eq!(tail, ["g hole[0]", "f 1/1/1 2/2/2 3/3/3", "g a_b", "f 1/1/1 3/3/3 4/4/4"]);
    }
}
