//! A file as it is, for other tools.

use super::attributes::Attributes;
use super::error::{ScanError, ScanFault};
use super::file::Opened;
use super::options::ReadOptions;
use super::read::Contents;
use super::source::Cleaning;
use super::unit::Unit;
use super::{pieces, simplify};
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

/// Reads a file without mending anything: nothing is merged, computed or turned.
///
/// # Errors
/// As [`read`](super::read).
pub fn load(path: &Path, options: &ReadOptions, progress: &dyn Progress) -> Result<Loaded, ScanError> {
    let loaded = || {
        let contents = Contents::read(path, Opened::new(path)?, options, progress)?;
        let Contents { format, raw, unit, mut cleaning, warnings, .. } = contents;
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
            let own = std::mem::take(&mut mesh.normals);
            mesh.normals = mesh.vertex_normals();
            cleaning.decimated = simplify::simplify(&mut mesh, &mut attributes, most) as u64;
            // Those by which the sides of walls were told apart are no part of the file.
            if own.is_empty() {
                mesh.normals = own;
            }
            mesh.groups.clear();
        }
        let unit = Unit::ALL.into_iter().find(|known| known.millimetres() == unit).unwrap_or_default();
        Ok(Loaded { mesh, attributes, unit, format: format.name().to_owned(), cleaning, ignored, warnings })
    };
    loaded().map_err(|fault: ScanFault| fault.at(path))
}
