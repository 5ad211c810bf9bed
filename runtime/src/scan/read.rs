//! Reading a file, whatever its format.

use super::clean::Dropped;
use super::cloud::{BATCH, Input, Points, RawPoint};
use super::creases::split_at_creases;
use super::error::{ScanError, ScanFault};
use super::file::{Opened, digest};
use super::format::{self, Format};
use super::formats::{e57, gltf, las, obj, off, pcd, ply, pts, ptx, stl, table, threemf};
use super::options::ReadOptions;
use super::raw::{Odd, RawMesh};
use super::reservoir::{Counted, MOST_POINTS, Reservoir};
use super::source::{Cleaning, ScanSource};
use super::unit::{self, Unit};
use super::{Scan, crop, normals, prepare};
use crate::mesh::TriangleMesh;
use crate::progress::{Progress, Silent};
use std::path::Path;
use std::thread;

/// A mesh to compare a scan with, as its file has it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ReferenceMesh {
    /// The mesh. Millimetres.
    pub mesh: TriangleMesh,
    /// The unit of the file: `mm`, `m`, ...
    pub unit: String,
    /// Sentences for the user about faults of the file that were put up with.
    pub warnings: Vec<String>,
}

/// Reads and cleans a scan.
///
/// # Errors
/// The file is missing, not a regular file, too large, of another format, malformed, without vertices, or has
/// coordinates that are not finite. The message names the file, the place in it, and the fix.
pub fn read(path: &Path, options: &ReadOptions, progress: &dyn Progress) -> Result<Scan, ScanError> {
    let scan = || {
        let opened = Opened::new(path)?;
        // The sum takes as long as reading does.
        let (contents, sum) = thread::scope(|scope| {
            let sum = scope.spawn(|| digest(path));
            (Contents::read(path, opened, options, progress), sum.join())
        });
        prepared(contents?, path, sum.map_err(|_| ScanFault::Cancelled)??, options)
    };
    scan().map_err(|fault: ScanFault| fault.at(path))
}

/// A scan of what was read of a file.
pub(super) fn prepared(
    contents: Contents,
    path: &Path,
    sha256: String,
    options: &ReadOptions,
) -> Result<Scan, ScanFault> {
    let source = ScanSource {
        path: path.display().to_string(),
        sha256,
        unit: unit::text(contents.unit),
        format: contents.format.name().to_owned(),
        cleaning: contents.cleaning,
        ..ScanSource::default()
    };
    let scan = prepare::finish(contents.raw, contents.unit, source, options)?;
    Ok(Scan { warnings: [contents.warnings, scan.warnings].concat(), ..scan })
}

/// What a file has, as it stands there but for the points and triangles that are not wanted.
pub(super) struct Contents {
    pub(super) format: Format,
    pub(super) raw: RawMesh,
    /// The unit of its coordinates, in millimetres.
    pub(super) unit: f64,
    pub(super) cleaning: Cleaning,
    /// The scans in it.
    pub(super) scans: Vec<Counted>,
    /// Sentences about its faults, with its name.
    pub(super) warnings: Vec<String>,
}

impl Contents {
    pub(super) fn read(
        path: &Path,
        opened: Opened,
        options: &ReadOptions,
        progress: &dyn Progress,
    ) -> Result<Self, ScanFault> {
        progress.report("reading the scan", 0.0, "");
        let format = format::recognise(&opened.name, &opened.head, opened.size)?;
        let given = options.unit.map(Unit::millimetres);
        let reservoir = |stated| Reservoir::new(given.or(stated), options.crop, options.voxel, MOST_POINTS, progress);
        let commented = Unit::in_comment(&opened.head).map(Unit::millimetres);
        let mut triangles = 0;
        let (mut raw, mut cleaning, scans) = match cloud_reader(format) {
            Some(read) => {
                let mut points = reservoir(None);
                if let Some(unit) = commented {
                    points.unit(unit);
                }
                let (size, only) = (opened.size, options.only);
                read(Input { bytes: Box::new(opened.stream()), size, only }, &mut points)?;
                points.finish()
            }
            None => {
                let mut raw = read_whole(format, opened)?;
                raw.unit = raw.unit.or(commented);
                require_only_scan(options)?;
                triangles = raw.triangles.len() as u64;
                if raw.triangles.is_empty() {
                    let mut points = reservoir(raw.unit);
                    hand_on(&raw, &mut points)?;
                    let (kept, cleaning, scans) = points.finish();
                    let mut kept = RawMesh { unit: raw.unit, warnings: raw.warnings, ignored: raw.ignored, ..kept };
                    // Readers of clouds know of stations only. Of some of the points nothing tells which they were.
                    if kept.positions.len() == raw.positions.len() {
                        kept.attributes.rounded = raw.attributes.rounded;
                    }
                    (kept, cleaning, scans)
                } else {
                    let points = raw.positions.len() as u64;
                    (raw, Cleaning { points, ..Cleaning::default() }, Vec::new())
                }
            }
        };
        cleaning.triangles = triangles;
        if cleaning.points == 0 {
            return Err(nothing_of(&cleaning));
        }
        let unit = given.or(raw.unit).unwrap_or(Unit::default().millimetres());
        let mut warnings = mend_polygons(format, &mut raw)?;
        if !raw.is_usual_unit {
            warnings.extend(other_unit(given, raw.unit));
        }
        warnings.extend(
            useless(options, &raw).into_iter().map(|(option, why)| format!(": --{option} has no effect: {why}")),
        );
        if let Some(bounds) = options.crop {
            cleaning.cropped += crop::crop(&mut raw, bounds, unit);
        }
        if raw.positions.is_empty() {
            return Err(ScanFault::NothingInBox { points: cleaning.points });
        }
        let warnings = warnings.into_iter().map(|w| format!("`{}`{w}", path.display())).collect();
        Ok(Self { format, raw, unit, cleaning, scans, warnings })
    }

    /// The reference mesh that a file is.
    fn into_reference(self, path: &Path) -> Result<ReferenceMesh, ScanFault> {
        let Self { raw, unit, mut warnings, .. } = self;
        let (raw, unit) = (raw.into_millimetres(unit)?, unit::text(unit));
        if raw.triangles.is_empty() {
            return Err(ScanFault::NoTriangles { vertices: raw.positions.len() });
        }
        let smooth = normals::compute(&TriangleMesh {
            positions: raw.positions.clone(),
            triangles: raw.triangles.clone(),
            ..TriangleMesh::default()
        });
        let given = !raw.normals.is_empty() || !raw.corner_normals.is_empty();
        let mut mesh = split_at_creases(raw.with_usable_normals(&smooth), given).split_corners().0;
        let all = mesh.triangles.len();
        let dropped = Dropped { all, repeated: mesh.drop_repeated(), ..Dropped::default() };
        warnings.extend(dropped.warning().map(|dropped| format!("`{}`: {dropped}", path.display())));
        let triangles = mesh.triangles.len();
        match mesh.triangles.iter().filter(|t| mesh.triangle_normal(**t).is_none()).count() {
            0 => {}
            flat if flat == triangles => return Err(ScanFault::OnlyDegenerate { triangles }),
            flat => warnings.push(format!("`{}`: {flat} of its {triangles} triangles have no area", path.display())),
        }
        Ok(ReferenceMesh { mesh, unit, warnings })
    }
}

/// A reader of clouds.
type ReadCloud = fn(Input, &mut dyn Points) -> Result<(), ScanFault>;

/// The reader of a format whose files are read in batches; none for those that are read as a whole.
fn cloud_reader(format: Format) -> Option<ReadCloud> {
    match format {
        Format::E57 => Some(e57::read),
        Format::Las => Some(las::read),
        Format::Pcd => Some(pcd::read),
        Format::Pts => Some(pts::read),
        Format::Ptx => Some(ptx::read),
        Format::Table => Some(table::read),
        Format::Obj | Format::Ply | Format::Stl | Format::Off | Format::Gltf | Format::ThreeMf => None,
    }
}

/// Reads a file of a format that has meshes.
fn read_whole(format: Format, opened: Opened) -> Result<RawMesh, ScanFault> {
    let folder = opened.name.parent().map(Path::to_owned).unwrap_or_default();
    let bytes = opened.bytes()?;
    match format {
        Format::Obj => obj::read(&bytes),
        Format::Ply => ply::read(&bytes),
        Format::Stl => stl::read(&bytes),
        Format::Off => off::read(&bytes),
        Format::Gltf => gltf::read(&bytes, &folder),
        _ => threemf::read(&bytes),
    }
}

/// A file that has one scan has no other.
fn require_only_scan(options: &ReadOptions) -> Result<(), ScanFault> {
    match options.only {
        None | Some(0) => Ok(()),
        Some(_) => Err(ScanFault::NoSuchScan { count: 1 }),
    }
}

/// Hands on the points of a file that was read as a whole.
fn hand_on(raw: &RawMesh, points: &mut dyn Points) -> Result<(), ScanFault> {
    let point = |i: usize| RawPoint {
        position: raw.positions[i],
        normal: raw.normals.get(i).map(|n| n.map(|c| c as f32)),
        colour: raw.attributes.colours.get(i).copied(),
        intensity: raw.attributes.intensities.get(i).copied(),
    };
    let count = raw.positions.len();
    for from in (0..count).step_by(BATCH) {
        let batch: Vec<RawPoint> = (from..count.min(from + BATCH)).map(point).collect();
        points.take(&batch)?;
    }
    Ok(())
}

/// Why a file without points has none.
fn nothing_of(cleaning: &Cleaning) -> ScanFault {
    match cleaning.marked + cleaning.empty {
        0 => ScanFault::NoVertices,
        count => ScanFault::OnlyInvalid { count },
    }
}

/// The options that do nothing to what the file has, and why.
fn useless(options: &ReadOptions, raw: &RawMesh) -> Vec<(&'static str, &'static str)> {
    if raw.triangles.is_empty() {
        return Vec::new();
    }
    let of_clouds = [
        (options.voxel.is_some(), "voxel", "the scan has triangles, which --decimate reduces"),
        (options.drop_outliers, "drop-outliers", "the scan has triangles; --keep-largest leaves out loose ones"),
        (options.surface, "surface", "the scan has triangles already"),
    ];
    of_clouds.into_iter().filter(|(given, ..)| *given).map(|(_, option, why)| (option, why)).collect()
}

/// A sentence on a unit that the user gives and the file contradicts.
fn other_unit(given: Option<f64>, stated: Option<f64>) -> Option<String> {
    let (given, stated) = (given?, stated?);
    // Feet of the American survey are longer than others by two millionths.
    ((given / stated - 1.0).abs() > 1e-5).then(|| {
        format!(": the file says that its unit is {}; --unit {} was taken", unit::text(stated), unit::text(given))
    })
}

/// Splits polygons into triangles; the warnings go on behind the name of the file.
fn mend_polygons(format: Format, raw: &mut RawMesh) -> Result<Vec<String>, ScanFault> {
    let place = if let Format::Obj = format { "line" } else { "face" };
    if let Some((first, corners)) = raw.tangled_polygon() {
        let message = format!("a face has {corners} corners on few vertices: it goes round in itself; remove it");
        return Err(ScanFault::malformed(format.name(), format!("{place} {first}"), message));
    }
    let warning = |crossing: Odd<u32>| {
        let (first, others) = (crossing.first, crossing.others());
        format!(
            ", {place} {first}: the face crosses itself or has more than 10,000 corners, so that its triangles may overlap{others}; triangulate it before the export"
        )
    };
    let own = std::mem::take(&mut raw.warnings).into_iter().map(|w| format!(": {w}"));
    let crossing = raw.split_concave_polygons().map(warning);
    Ok(own.chain(crossing).collect())
}

/// Reads a reference mesh, or makes one of a cloud of points.
///
/// # Errors
/// As [`read_mesh`]; or no triangles can be made of the points.
pub fn read_surface(path: &Path, unit: Option<Unit>) -> Result<ReferenceMesh, ScanError> {
    let options = ReadOptions { unit, ..ReadOptions::default() };
    let mesh = || {
        let contents = Contents::read(path, Opened::new(path)?, &options, &Silent)?;
        if !contents.raw.triangles.is_empty() {
            return contents.into_reference(path);
        }
        let meshed = ReadOptions { surface: true, ..options };
        let Scan { mesh, source, warnings, .. } = prepared(contents, path, String::new(), &meshed)?;
        Ok(ReferenceMesh { mesh, unit: source.unit, warnings })
    };
    mesh().map_err(|fault: ScanFault| fault.at(path))
}

/// Reads a reference mesh: nothing is merged, and only triangles that a part has twice are dropped; texture coordinates
/// and named parts are kept. Vertices are split where a corner's normal or texture coordinate differs; normals are
/// scaled to unit length, or computed where the file has none.
///
/// # Errors
/// As `read`; or there are no triangles with an area.
pub fn read_mesh(path: &Path, unit: Option<Unit>) -> Result<ReferenceMesh, ScanError> {
    let options = ReadOptions { unit, ..ReadOptions::default() };
    let contents = Opened::new(path).and_then(|opened| Contents::read(path, opened, &options, &Silent));
    contents.and_then(|contents| contents.into_reference(path)).map_err(|fault| fault.at(path))
}
