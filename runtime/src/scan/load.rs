//! A file as it is, for other tools.

use super::attributes::Attributes;
use super::error::{ScanError, ScanFault};
use super::file::Opened;
use super::options::ReadOptions;
use super::read::Contents;
use super::source::{Cleaning, ScanSource};
use super::unit::Unit;
use super::{pieces, prepare, simplify};
use crate::mesh::TriangleMesh;
use crate::progress::Progress;
use std::path::Path;

/// A file's points and triangles with everything that belongs to them, as they stand there.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Loaded {
    /// The geometry in millimetres; normals only if the file has them, of its own lengths.
    pub mesh: TriangleMesh,
    /// Colours, intensities and stations.
    pub attributes: Attributes,
    /// The unit of the file; the millimetre where its length has no name.
    pub unit: Unit,
    /// The file's format: `PLY`, `E57`, ...
    pub format: String,
    /// What is left out.
    pub cleaning: Cleaning,
    /// Names of the fields of its points that are not read.
    pub ignored: Vec<String>,
    /// Sentences for the user about faults of the file that were put up with.
    pub warnings: Vec<String>,
}

/// Reads a file without mending anything: nothing is merged, computed or turned. Triangles that are asked for of a
/// cloud are the exception: of equal points the first is kept, and points that are in no triangle are left out.
///
/// # Errors
/// As [`read`](super::read), and if no triangles can be made of a cloud.
pub fn load(path: &Path, options: &ReadOptions, progress: &dyn Progress) -> Result<Loaded, ScanError> {
    let loaded = || {
        let contents = Contents::read(path, Opened::new(path)?, options, progress)?;
        let Contents { format, raw, unit, mut cleaning, mut warnings, .. } = contents;
        let mut raw = raw.into_millimetres(unit)?;
        let ignored = std::mem::take(&mut raw.ignored);
        let (mut mesh, mut attributes) = raw.split_corners();
        if options.drop_outliers {
            cleaning.outliers = pieces::drop_outliers(&mut mesh, &mut attributes) as u64;
        }
        if options.keep_largest {
            cleaning.pieces = pieces::keep_largest(&mut mesh, &mut attributes) as u64;
        }
        if let Some(most) = options.decimate {
            cleaning.decimated = decimate(&mut mesh, &mut attributes, most) as u64;
        }
        if options.surface && mesh.triangles.is_empty() {
            let mut source = ScanSource { path: path.display().to_string(), cleaning, ..ScanSource::default() };
            warnings.extend(prepare::mesh_cloud(&mut mesh, &mut attributes, &mut source)?);
            cleaning = source.cleaning;
        }
        let unit = Unit::ALL.into_iter().find(|known| known.millimetres() == unit).unwrap_or_default();
        Ok(Loaded { mesh, attributes, unit, format: format.name().to_owned(), cleaning, ignored, warnings })
    };
    loaded().map_err(|fault: ScanFault| fault.at(path))
}

/// Simplifies a mesh, or draws points of a cloud; returns the number of triangles, or points, that are gone.
fn decimate(mesh: &mut TriangleMesh, attributes: &mut Attributes, most: usize) -> usize {
    if mesh.triangles.is_empty() {
        return simplify::simplify(mesh, attributes, most);
    }
    let own = std::mem::take(&mut mesh.normals);
    mesh.normals = mesh.vertex_normals();
    let gone = simplify::simplify(mesh, attributes, most);
    // Those by which the sides of walls were told apart are no part of the file.
    if own.is_empty() {
        mesh.normals = own;
    }
    mesh.groups.clear();
    gone
}
