//! Scans: reading, cleaning, normals, noise.
//!
//! [`read`] reads a file of any of the formats, whichever its content shows it to be, and cleans it; [`from_mesh`] does
//! the same for a mesh in memory. [`read_mesh`] reads a reference mesh, which keeps its texture coordinates and parts.

mod attributes;
mod clean;
pub(crate) mod cloud;
mod colour;
mod connected;
mod creases;
mod crop;
mod empty_space;
mod equal;
mod error;
mod far;
mod file;
mod format;
mod formats;
mod load;
mod merged;
mod neighbours;
mod noise;
mod normals;
mod options;
mod outliers;
mod pieces;
mod polygon;
mod prepare;
mod raw;
mod read;
mod reservoir;
mod rounded;
mod simplify;
mod source;
mod spacing;
mod spikes;
mod stations;
mod steps;
mod surface;
mod survey;
#[cfg(test)]
mod tests;
mod thinned;
mod unit;

pub use attributes::{Attributes, ScanParts, Station, Stations};
pub(crate) use empty_space::EmptySpace;
pub use error::{ScanError, ScanFault};
pub use format::{Foreign, Named, foreign, named};
pub(crate) use formats::e57::pages as e57_pages;
pub use load::{Loaded, load};
pub(crate) use neighbours::Neighbours;
pub use options::ReadOptions;
pub(crate) use outliers::outliers;
pub use prepare::from_mesh;
pub use read::{ReferenceMesh, read, read_mesh, read_surface};
pub use rounded::{Frame, Rounded};
pub use source::{Cleaning, ScanSource};
pub(crate) use spacing::spacings;
pub(crate) use spikes::spikes;
pub(crate) use steps::steps as coordinate_steps;
pub use survey::{ScanEntry, SurfaceFigures, Survey, survey};
pub use unit::{Unit, UnknownUnit};

use crate::mesh::{TriangleMesh, retain_marked};

/// The sentence on a scan that was turned as a whole.
pub(crate) const TURNED: &str = "the scan faces the other way than the model everywhere: it was turned as a whole";

/// A scan, cleaned: what the fit and the variance analysis work on.
#[derive(Clone, Debug)]
pub struct Scan {
    /// The surface in millimetres, with unit vertex normals; a plain cloud of points has no triangles. Every position
    /// is finite, every index valid, no triangle degenerate, no vertex unused (but in a cloud).
    pub mesh: TriangleMesh,
    /// What its file has beside the geometry.
    pub attributes: Attributes,
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
        let mut attributes = self.attributes.clone();
        attributes.retain_marked(kept);
        let points = mesh.positions.len();
        let source =
            ScanSource { sha256: String::new(), points, triangles: mesh.triangles.len(), ..self.source.clone() };
        let noise = noise::estimate(&mesh, self.oriented).deviation.max(attributes.rounded.deviation(&mesh.normals));
        Self { mesh, attributes, source, noise, warnings: Vec::new(), oriented: self.oriented }
    }

    /// The standard deviation along the normals of the rounding of the coordinates, where it is coarse beside the
    /// noise: it may be the same all over a face. Millimetres; else 0.
    pub(crate) fn rounding(&self) -> f64 {
        self.attributes.rounded.deviation(&self.mesh.normals)
    }

    /// Its mirror image: x is turned round.
    #[must_use]
    pub(crate) fn mirrored(&self) -> Self {
        let mut mirrored = self.clone();
        let places = &mut mirrored.attributes.stations.places;
        places.iter_mut().for_each(|station| station.place[0] = -station.place[0]);
        mirrored.attributes.rounded.mirror();
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
