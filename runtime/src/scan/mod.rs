//! Scans: reading, cleaning, normals, noise.
//!
//! [`read`] reads an OBJ, PLY or STL file, whichever its content shows it to be, and cleans it; [`from_mesh`] does the
//! same for a mesh in memory. [`read_mesh`] reads a reference mesh, which keeps its texture coordinates and parts.

mod clean;
#[cfg(test)]
mod data_tests;
mod error;
mod format;
mod neighbours;
mod noise;
mod normals;
mod obj;
mod ply;
mod ply_rows;
mod raw;
mod stl;
mod strays;
#[cfg(test)]
mod tests;
mod unit;

pub use error::{ScanError, ScanFault};
pub(crate) use neighbours::Neighbours;
pub(crate) use strays::strays;
pub use unit::{Unit, UnknownUnit};

use crate::mesh::TriangleMesh;
use clean::Cleaned;
use format::Format;
use raw::RawMesh;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::io::ErrorKind;
use std::path::Path;

/// Most bytes that are read from one file.
const MOST_BYTES: u64 = 4 << 30;

/// A scan, cleaned: what the fit and the variance analysis work on.
#[derive(Clone, Debug)]
pub struct Scan {
    /// Millimetres. Unit vertex normals are present; triangles are none for a plain cloud of points. Every position is
    /// finite, every index valid, no triangle degenerate, no vertex unused (but in a cloud).
    pub mesh: TriangleMesh,
    /// False where the normals' signs are a guess: those of a cloud whose file has no normals.
    pub oriented: bool,
    /// Where it came from.
    pub source: ScanSource,
    /// Standard deviation of the noise along the surface's normal, robustly estimated. Millimetres; 0 where there are
    /// too few vertices to tell.
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
    /// Vertices in the file (in STL, which has none of its own: different positions).
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

/// How a scan is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// Unit of the file's coordinates.
    pub unit: Unit,
    /// Whose normals are used.
    pub normals: Normals,
}

/// Whose normals are used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Normals {
    /// The file's; computed where it has none or they are unusable.
    #[default]
    FromFile,
    /// Always computed.
    Computed,
}

/// Reads and cleans a scan.
///
/// # Errors
/// The file is missing, no file, too large, none of the formats, malformed, without vertices, or has coordinates that
/// are not finite. The message names the file, the place in it, and the mend.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Scan, ScanError> {
    let bytes = load(path).map_err(|fault| fault.at(path))?;
    let source = ScanSource {
        path: path.display().to_string(),
        sha256: hexadecimal(&Sha256::digest(&bytes)),
        unit: options.unit.to_string(),
        ..ScanSource::default()
    };
    let scan = || finish(parse(path, bytes)?, options, source);
    scan().map_err(|fault| fault.at(path))
}

/// Cleans a mesh (or a cloud) in memory as if it had been read from a file in millimetres; `name` stands for the path.
///
/// # Errors
/// No vertices, no triangle with an area, a coordinate that is not finite, an index out of range.
pub fn from_mesh(mesh: TriangleMesh, name: &str) -> Result<Scan, ScanFault> {
    let count = mesh.positions.len();
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        if let Some(&index) = triangle.iter().find(|&&index| index as usize >= count) {
            let place = format!("triangle {} (counted from 1)", i + 1);
            return Err(ScanFault::IndexOutOfRange { place, what: "vertex", index: index.into(), count });
        }
    }
    if count == 0 {
        return Err(ScanFault::NoVertices);
    }
    let normals = if mesh.normals.len() == count { mesh.normals } else { Vec::new() };
    let (positions, triangles) = (mesh.positions, mesh.triangles);
    let raw = RawMesh { vertices_read: count, positions, normals, triangles, ..RawMesh::default() };
    let source = ScanSource { path: name.to_owned(), unit: Unit::Mm.to_string(), ..ScanSource::default() };
    finish(raw, &ReadOptions::default(), source)
}

/// Reads a reference mesh: nothing is merged or dropped, texture coordinates and named parts are kept. Vertices are
/// split where a corner's normal or texture coordinate differs; normals are scaled to unit length, or computed where
/// the file has none.
///
/// # Errors
/// As `read`; or there are no triangles.
pub fn read_mesh(path: &Path, unit: Unit) -> Result<TriangleMesh, ScanError> {
    let mesh = || {
        let raw = parse(path, load(path)?)?.into_millimetres(unit.millimetres())?;
        if raw.triangles.is_empty() {
            return Err(ScanFault::NoTriangles { vertices: raw.vertices_read });
        }
        let smooth = normals::compute(&TriangleMesh {
            positions: raw.positions.clone(),
            triangles: raw.triangles.clone(),
            ..TriangleMesh::default()
        });
        let raw = raw.with_usable_normals(&smooth);
        Ok(raw.split_corners())
    };
    mesh().map_err(|fault: ScanFault| fault.at(path))
}

fn finish(raw: RawMesh, options: &ReadOptions, mut source: ScanSource) -> Result<Scan, ScanFault> {
    let raw = raw.into_millimetres(options.unit.millimetres())?;
    let Cleaned { mesh, cleaning, oriented } = clean::clean(&raw, options.normals)?;
    source.points = mesh.positions.len();
    source.triangles = mesh.triangles.len();
    let noise = noise::estimate(&mesh, oriented);
    Ok(Scan { mesh, oriented, source, noise, cleaning })
}

fn load(path: &Path) -> Result<Vec<u8>, ScanFault> {
    let unreadable = |error: std::io::Error| match error.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => ScanFault::Missing,
        _ => ScanFault::Unreadable(error),
    };
    let about = std::fs::metadata(path).map_err(unreadable)?;
    if about.is_dir() {
        return Err(ScanFault::Folder);
    }
    if !about.is_file() {
        return Err(ScanFault::NotAFile);
    }
    if about.len() > MOST_BYTES {
        return Err(ScanFault::TooLarge { bytes: about.len(), limit: MOST_BYTES });
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    if bytes.is_empty() { Err(ScanFault::Empty) } else { Ok(bytes) }
}

fn parse(path: &Path, bytes: Vec<u8>) -> Result<RawMesh, ScanFault> {
    let raw = match format::recognise(path, &bytes)? {
        Format::Obj => obj::read(&bytes)?,
        Format::Ply => ply::read(&bytes)?,
        Format::Stl => stl::read(bytes)?,
    };
    if raw.positions.is_empty() { Err(ScanFault::NoVertices) } else { Ok(raw) }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
