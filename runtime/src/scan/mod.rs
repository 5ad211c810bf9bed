//! Scans: reading, cleaning, normals, noise.
//!
//! [`read`] reads an OBJ, PLY or STL file, whichever its content shows it to be, and cleans it; [`from_mesh`] does the
//! same for a mesh in memory. [`read_mesh`] reads a reference mesh, which keeps its texture coordinates and parts.

mod clean;
mod connected;
mod empty_space;
mod error;
mod format;
mod neighbours;
mod noise;
mod normals;
mod obj;
mod outliers;
mod ply;
mod polygon;
mod raw;
mod stl;
#[cfg(test)]
mod tests;
mod thinned;
mod unit;

pub(crate) use empty_space::EmptySpace;
pub use error::{ScanError, ScanFault};
pub use format::{Foreign, foreign};
pub(crate) use neighbours::Neighbours;
pub(crate) use outliers::outliers;
pub use unit::{Unit, UnknownUnit};

use crate::mesh::{TriangleMesh, retain_marked};
use crate::record::hexadecimal;
use clean::{Cleaned, Dropped};
use format::Format;
use normals::OverNeighbourhoods;
use raw::{Odd, RawMesh};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::io::ErrorKind;
use std::path::Path;

/// The sentence on a scan that was turned as a whole.
pub(crate) const TURNED: &str = "the scan faces the other way than the model everywhere: it was turned as a whole";

/// The largest file that is read, in bytes: vertices and triangles of such a file can be numbered with 32 bits.
const MOST_BYTES: u64 = 4 << 30;

/// A scan, cleaned: what the fit and the variance analysis work on.
#[derive(Clone, Debug)]
pub struct Scan {
    /// The surface in millimetres, with unit vertex normals; a plain cloud of points has no triangles. Every position
    /// is finite, every index valid, no triangle degenerate, no vertex unused (but in a cloud).
    pub mesh: TriangleMesh,
    /// False where the normals' signs are a guess: those of a cloud whose file has no normals.
    pub oriented: bool,
    /// The file that it came from.
    pub source: ScanSource,
    /// Standard deviation of the noise along the surface's normal, robustly estimated. Millimetres; 0 where there are
    /// too few vertices for an estimate.
    pub noise: f64,
    /// Sentences for the user about faults of the file that were put up with.
    pub warnings: Vec<String>,
}

impl Scan {
    /// The vertices that are marked, and the triangles whose corners all are. Not from a file of its own.
    #[must_use]
    pub(crate) fn part(&self, kept: &[bool]) -> Self {
        let mut mesh = TriangleMesh { groups: Vec::new(), ..self.mesh.clone() };
        let mut number = 0;
        let numbers: Vec<Option<u32>> = kept
            .iter()
            .map(|kept| {
                number += u32::from(*kept);
                kept.then(|| number - 1)
            })
            .collect();
        mesh.triangles = mesh
            .triangles
            .iter()
            .filter_map(|t| {
                let [a, b, c] = t.map(|corner| numbers[corner as usize]);
                Some([a?, b?, c?])
            })
            .collect();
        retain_marked(&mut mesh.positions, kept);
        retain_marked(&mut mesh.normals, kept);
        let points = mesh.positions.len();
        let source =
            ScanSource { sha256: String::new(), points, triangles: mesh.triangles.len(), ..self.source.clone() };
        let noise = noise::estimate(&mesh, self.oriented).deviation;
        Self { mesh, source, noise, warnings: Vec::new(), oriented: self.oriented }
    }

    /// Its mirror image: x is turned round.
    #[must_use]
    pub(crate) fn mirrored(&self) -> Self {
        let mut mirrored = self.clone();
        let lists = [&mut mirrored.mesh.positions, &mut mirrored.mesh.normals];
        lists.into_iter().flatten().for_each(|[x, ..]| *x = -*x);
        mirrored.mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        mirrored.source.sha256 = String::new();
        mirrored
    }

    /// The same with its other side out.
    #[must_use]
    pub(crate) fn turned(&self) -> Self {
        let mut turned = self.clone();
        turned.mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        turned.mesh.normals.iter_mut().for_each(|n| *n = n.map(|c| -c));
        turned
    }
}

/// A mesh to compare a scan with, as its file has it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ReferenceMesh {
    /// The mesh. Millimetres.
    pub mesh: TriangleMesh,
    /// Sentences for the user about faults of the file that were put up with.
    pub warnings: Vec<String>,
}

/// The file that a scan came from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
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
}

/// Reads and cleans a scan whose coordinates have the given unit.
///
/// # Errors
/// The file is missing, not a regular file, too large, of another format, malformed, without vertices, or has
/// coordinates that are not finite. The message names the file, the place in it, and the fix.
pub fn read(path: &Path, unit: Unit) -> Result<Scan, ScanError> {
    let bytes = load(path).map_err(|fault| fault.at(path))?;
    let source = ScanSource {
        path: path.display().to_string(),
        sha256: hexadecimal(Sha256::digest(&bytes)),
        unit: unit.to_string(),
        ..ScanSource::default()
    };
    let scan = || {
        let (raw, warnings) = parse(path, bytes)?;
        let scan = finish(raw, unit, source)?;
        Ok(Scan { warnings: [warnings, scan.warnings].concat(), ..scan })
    };
    scan().map_err(|fault: ScanFault| fault.at(path))
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
    let raw = RawMesh { positions, normals, triangles, ..RawMesh::default() };
    let source = ScanSource { path: name.to_owned(), unit: Unit::Mm.to_string(), ..ScanSource::default() };
    finish(raw, Unit::Mm, source)
}

/// Reads a reference mesh: nothing is merged, and only triangles that a part has twice are dropped; texture coordinates
/// and named parts are kept. Vertices are split where a corner's normal or texture coordinate differs; normals are
/// scaled to unit length, or computed where the file has none.
///
/// # Errors
/// As `read`; or there are no triangles with an area.
pub fn read_mesh(path: &Path, unit: Unit) -> Result<ReferenceMesh, ScanError> {
    let mesh = || {
        let (raw, mut warnings) = parse(path, load(path)?)?;
        let raw = raw.into_millimetres(unit.millimetres())?;
        if raw.triangles.is_empty() {
            return Err(ScanFault::NoTriangles { vertices: raw.positions.len() });
        }
        let smooth = normals::compute(&TriangleMesh {
            positions: raw.positions.clone(),
            triangles: raw.triangles.clone(),
            ..TriangleMesh::default()
        });
        let mut mesh = raw.with_usable_normals(&smooth).split_corners();
        let all = mesh.triangles.len();
        let dropped = Dropped { all, repeated: mesh.drop_repeated(), ..Dropped::default() };
        warnings.extend(dropped.warning().map(|dropped| format!("`{}`: {dropped}", path.display())));
        let triangles = mesh.triangles.len();
        match mesh.triangles.iter().filter(|t| mesh.triangle_normal(**t).is_none()).count() {
            0 => {}
            flat if flat == triangles => return Err(ScanFault::OnlyDegenerate { triangles }),
            flat => warnings.push(format!("`{}`: {flat} of its {triangles} triangles have no area", path.display())),
        }
        Ok(ReferenceMesh { mesh, warnings })
    };
    mesh().map_err(|fault: ScanFault| fault.at(path))
}

fn finish(raw: RawMesh, unit: Unit, mut source: ScanSource) -> Result<Scan, ScanFault> {
    let given = !raw.normals.is_empty() || !raw.corner_normals.is_empty();
    let Cleaned { mut mesh, mut oriented, turned, dropped } = clean::clean(&raw.into_millimetres(unit.millimetres())?)?;
    source.points = mesh.positions.len();
    source.triangles = mesh.triangles.len();
    let mut warnings: Vec<String> =
        dropped.warning().map(|dropped| format!("`{}`: {dropped}", source.path)).into_iter().collect();
    if turned {
        warnings.push(
            "the triangles face away from the vertex normals of the same file: they were turned to agree with these"
                .to_owned(),
        );
    }
    let mut agree = normals::agree(&mesh);
    if given && !agree && !mesh.triangles.is_empty() {
        let of_triangles = mesh.vertex_normals();
        let from_file = std::mem::replace(&mut mesh.normals, of_triangles);
        agree = normals::agree(&mesh);
        if agree {
            warnings.push("the file's normals point anywhere: those of its triangles count instead".to_owned());
        } else {
            mesh.normals = from_file;
        }
    }
    let noise = noise::estimate(&mesh, oriented && agree);
    if noise.is_thick || oriented && !agree {
        let OverNeighbourhoods { normals, sided } = normals::over_neighbourhoods(&mesh, noise.one_in);
        mesh.normals = normals;
        if oriented && !sided {
            oriented = false;
            let what = if given { "normals of the file" } else { "triangles" };
            warnings.push(format!(
                "the {what} face any way: they are ignored, and a point belongs to the nearest surface, whichever way it faces"
            ));
        }
    }
    Ok(Scan { mesh, oriented, source, noise: noise.deviation, warnings })
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

/// A file's geometry, and warnings.
fn parse(path: &Path, bytes: Vec<u8>) -> Result<(RawMesh, Vec<String>), ScanFault> {
    let format = format::recognise(path, &bytes)?;
    let mut raw = match format {
        Format::Obj => obj::read(&bytes)?,
        Format::Ply => ply::read(&bytes)?,
        Format::Stl => stl::read(&bytes)?,
    };
    if raw.positions.is_empty() {
        return Err(ScanFault::NoVertices);
    }
    let place = if let Format::Obj = format { "line" } else { "face" };
    if let Some((first, corners)) = raw.tangled_polygon() {
        let message = format!("a face has {corners} corners on few vertices: it goes round in itself; remove it");
        return Err(ScanFault::malformed(format.name(), format!("{place} {first}"), message));
    }
    let warning = |crossing: Odd<u32>| {
        let (first, others) = (crossing.first, crossing.others());
        format!(
            "`{}`, {place} {first}: the face crosses itself or has more than 10,000 corners, so that its triangles may overlap{others}; triangulate it before the export",
            path.display()
        )
    };
    let own = std::mem::take(&mut raw.warnings).into_iter().map(|w| format!("`{}`: {w}", path.display()));
    let crossing = raw.split_concave_polygons().map(warning);
    let warnings = own.chain(crossing).collect();
    Ok((raw, warnings))
}
