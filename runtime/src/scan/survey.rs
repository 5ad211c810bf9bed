//! What a file has, and what is suspicious about it: before anybody fits anything to it.

use super::error::ScanError;
use super::file::Opened;
use super::neighbours::Neighbours;
use super::options::ReadOptions;
use super::outliers::outliers;
use super::read::{self, Contents};
use super::reservoir::Counted;
use super::source::Cleaning;
use super::{Scan, pieces, unit};
use crate::mesh::{TriangleMesh, tetrahedron};
use crate::progress::Progress;
use crate::rims;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;
use std::path::Path;

mod suspicions;

/// Points at which distances of neighbours, and outliers, are looked at.
const SAMPLES: usize = 20_000;

/// What a file has.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Survey {
    /// Path as the user gave it.
    pub path: String,
    /// `PLY`, `E57`, ...
    pub format: String,
    /// The unit of the file's coordinates.
    pub unit: String,
    /// Who says so: `file`, `option`, `format` (files of it usually have it), or `default`.
    pub unit_from: &'static str,
    /// Points after cleaning.
    pub points: usize,
    /// Triangles after cleaning.
    pub triangles: usize,
    /// What of the file is left out.
    pub cleaning: Cleaning,
    /// The scans in the file, where it can have several.
    pub scans: Vec<ScanEntry>,
    /// Names of the fields of its points that are not read.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ignored: Vec<String>,
    /// Least coordinates. Millimetres, as all lengths.
    pub low: [f64; 3],
    /// Greatest coordinates.
    pub high: [f64; 3],
    /// The largest step to which coordinates are rounded in the file, if it is larger than the noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub precision: Option<f64>,
    /// Distances of points from their nearest neighbours: 5 %, the median, 95 %.
    pub spacing: [f64; 3],
    /// Standard deviation of the noise along the normal; 0 where it is not known.
    pub noise: f64,
    /// Where the normals come from: `file`, `triangles`, `neighbours and the scanner's places` or `neighbours`.
    pub normals: &'static str,
    /// Whether the normals tell the outer side.
    pub oriented: bool,
    /// Whether points have colours.
    pub colours: bool,
    /// The least and the greatest intensity, if points have one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intensity: Option<[f32; 2]>,
    /// Pieces that do not hang together.
    pub pieces: usize,
    /// The share of the largest in the area, or of a cloud in the points.
    pub largest_piece: f64,
    /// Properties of the surface; none of a cloud.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceFigures>,
    /// The share of the points of a cloud that lie on no surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outliers: Option<f64>,
    /// Sentences about faults of the file that were put up with.
    pub warnings: Vec<String>,
    /// Sentences on what looks wrong, each with the mend.
    pub suspicions: Vec<String>,
}

/// One of the scans in a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ScanEntry {
    /// Its name; may be empty.
    pub name: String,
    /// Its points.
    pub points: u64,
    /// Where the scanner stood, if the file tells it. Millimetres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub station: Option<[f64; 3]>,
}

/// Properties of a surface of triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SurfaceFigures {
    /// Square millimetres.
    pub area: f64,
    /// Rims: of holes, and of open borders.
    pub rims: usize,
    /// The size of the largest rim: the diagonal of its box. Millimetres.
    pub largest_rim: f64,
    /// Edges of more than two triangles.
    pub edges_of_many: usize,
    /// Edges whose two triangles face to different sides.
    pub torn_edges: usize,
    /// The enclosed volume where there is no rim and no edge of many or torn. Cubic millimetres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume: Option<f64>,
}

/// Reads a file and says what is in it.
///
/// # Errors
/// As [`read`](super::read).
pub fn survey(path: &Path, options: &ReadOptions, progress: &dyn Progress) -> Result<Survey, ScanError> {
    let survey = || {
        let contents = Contents::read(path, Opened::new(path)?, options, progress)?;
        let unit_from = match (options.unit, contents.raw.unit) {
            (Some(_), _) => "option",
            (None, Some(_)) if contents.raw.is_usual_unit => "format",
            (None, Some(_)) => "file",
            (None, None) => "default",
        };
        let ignored = contents.raw.ignored.clone();
        let has_normals = !contents.raw.normals.is_empty() || !contents.raw.corner_normals.is_empty();
        let (unit, scans) = (contents.unit, contents.scans.iter().map(|s| ScanEntry::new(s, contents.unit)).collect());
        progress.report("looking at the scan", f64::NAN, "");
        let scan = read::prepared(contents, path, String::new(), options)?;
        let mut survey = Survey {
            path: path.display().to_string(),
            format: scan.source.format.clone(),
            unit: unit::text(unit),
            unit_from,
            scans,
            ignored,
            normals: normals_from(&scan, has_normals),
            warnings: scan.warnings.clone(),
            ..Survey::of_scan(&scan)
        };
        survey.suspicions = suspicions::of(&survey);
        Ok(survey)
    };
    survey().map_err(|fault: super::ScanFault| fault.at(path))
}

impl ScanEntry {
    fn new(counted: &Counted, unit: f64) -> Self {
        let station = counted.entry.station.map(|station| station.place.map(|c| c * unit));
        Self { name: counted.entry.name.clone(), points: counted.points, station }
    }
}

impl Survey {
    /// What a scan shows of itself.
    fn of_scan(scan: &Scan) -> Self {
        let mesh = &scan.mesh;
        let bounds = mesh.bounds();
        let (count, largest_piece) = pieces_of(mesh);
        let tree = Neighbours::new(&mesh.positions);
        let intensities = &scan.attributes.intensities;
        let range = intensities.iter().fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], i| [a.min(*i), b.max(*i)]);
        Self {
            points: mesh.positions.len(),
            triangles: mesh.triangles.len(),
            cleaning: scan.source.cleaning.clone(),
            low: bounds.low.into(),
            high: bounds.high.into(),
            spacing: spacing(&tree, &mesh.positions),
            noise: scan.noise,
            precision: Some(scan.attributes.rounded.largest()).filter(|step| *step > 0.0),
            oriented: scan.oriented,
            colours: !scan.attributes.colours.is_empty(),
            intensity: (!intensities.is_empty()).then_some(range),
            pieces: count,
            largest_piece,
            surface: (!mesh.triangles.is_empty()).then(|| SurfaceFigures::new(mesh)),
            outliers: mesh.triangles.is_empty().then(|| share_of_outliers(&tree, &mesh.positions)),
            ..Self::default()
        }
    }
}

fn normals_from(scan: &Scan, given: bool) -> &'static str {
    match (given, scan.mesh.triangles.is_empty(), scan.oriented) {
        (true, ..) => "file",
        (_, false, _) => "triangles",
        (_, _, true) => "neighbours and the scanner's places",
        _ => "neighbours",
    }
}

/// Indices of evenly chosen points.
fn sample(count: usize) -> Vec<u32> {
    (0..count as u32).step_by(count.div_ceil(SAMPLES).max(1)).collect()
}

/// Distances of points from their nearest neighbours: 5 %, the median and 95 %; zeros of a single point.
fn spacing(tree: &Neighbours, positions: &[[f64; 3]]) -> [f64; 3] {
    let distance = |i: &u32| {
        let at = positions[*i as usize];
        let nearest = *tree.nearest(at, 2).get(1)?;
        Some(DVec3::from(at).distance(DVec3::from(positions[nearest as usize])))
    };
    let mut distances: Vec<f64> = sample(positions.len()).par_iter().filter_map(distance).collect();
    distances.sort_by(f64::total_cmp);
    let at = |share: f64| distances.get((share * distances.len() as f64) as usize).copied().unwrap_or(0.0);
    [at(0.05), at(0.5), at(0.95)]
}

fn share_of_outliers(tree: &Neighbours, positions: &[[f64; 3]]) -> f64 {
    let found = outliers(tree, positions, &sample(positions.len()));
    found.iter().filter(|outlier| **outlier).count() as f64 / found.len().max(1) as f64
}

/// The number of pieces, and the share of the largest.
fn pieces_of(mesh: &TriangleMesh) -> (usize, f64) {
    let sizes = pieces::sizes(mesh, &pieces::pieces(mesh));
    let (total, largest) = sizes.iter().fold((0.0, 0.0_f64), |(total, most), s| (total + s, most.max(*s)));
    (sizes.iter().filter(|size| **size > 0.0).count(), if total > 0.0 { largest / total } else { 0.0 })
}

impl SurfaceFigures {
    fn new(mesh: &TriangleMesh) -> Self {
        let rims = rims::find(mesh);
        let size = |rim: &rims::Rim| {
            let points = rim.vertices.iter().map(|v| DVec3::from(mesh.positions[*v as usize]));
            points.collect::<crate::mesh::Bounds>().diagonal()
        };
        let [edges_of_many, torn_edges] = odd_edges(mesh);
        let closed = rims.is_empty() && edges_of_many == 0 && torn_edges == 0;
        Self {
            area: mesh.area(),
            rims: rims.len(),
            largest_rim: rims.iter().map(size).fold(0.0, f64::max),
            edges_of_many,
            torn_edges,
            volume: closed.then(|| volume(mesh)),
        }
    }
}

/// The numbers of edges of more than two triangles, and of edges along which two triangles run the same way.
fn odd_edges(mesh: &TriangleMesh) -> [usize; 2] {
    let of_triangle = |t: &[u32; 3]| {
        let t = *t;
        (0..3).map(move |k| (t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3]), t[k] < t[(k + 1) % 3]))
    };
    let mut edges: Vec<(u32, u32, bool)> = mesh.triangles.par_iter().flat_map_iter(of_triangle).collect();
    edges.par_sort_unstable();
    let mut odd = [0; 2];
    for run in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        odd[0] += usize::from(run.len() > 2);
        odd[1] += usize::from(run.len() == 2 && run[0].2 == run[1].2);
    }
    odd
}

/// The volume that a closed mesh encloses (the divergence theorem), about its middle. Cubic millimetres.
fn volume(mesh: &TriangleMesh) -> f64 {
    let middle = mesh.bounds().centre();
    mesh.triangles.iter().map(|t| tetrahedron(mesh.corners(*t).map(|p| p - middle))).sum()
}

#[cfg(test)]
mod tests;
