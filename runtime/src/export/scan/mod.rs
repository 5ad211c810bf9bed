//! Scans as files: points, triangles, colours, intensities and the places of the scanner, as far as a format has them.

mod e57;
mod glb;
mod las;
mod off;
mod pcd;
mod pts;
mod ptx;
mod threemf;
mod xyz;

use super::atomic::{self, WriteError};
use super::mesh::{self, MeshFormat};
use crate::mesh::TriangleMesh;
use crate::scan::{Attributes, Unit};
use glam::DVec3;
use std::io::{self, Seek, Write};
use std::path::Path;

/// A format of scans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScanFormat {
    /// Wavefront OBJ, PLY or STL.
    Mesh(MeshFormat),
    /// Object File Format, text.
    Off,
    /// Binary glTF.
    Glb,
    /// 3D Manufacturing Format.
    ThreeMf,
    /// ASTM E2807: scans with poses.
    E57,
    /// ASPRS LAS 1.4.
    Las,
    /// The same, compressed.
    Laz,
    /// Point Cloud Data, binary.
    Pcd,
    /// Points with intensities and colours as text, with their count.
    Pts,
    /// Scans with poses as grids of points, as text.
    Ptx,
    /// Points as text, with a line of names.
    Xyz,
}

/// What a format has room for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Holds {
    /// Normals.
    pub normals: bool,
    /// Colours.
    pub colours: bool,
    /// Intensities.
    pub intensities: bool,
    /// Places of the scanner.
    pub stations: bool,
    /// Texture coordinates.
    pub texcoords: bool,
}

/// What is written. Millimetres.
#[derive(Clone, Copy, Debug)]
pub struct Recorded<'a> {
    /// Points, their normals and triangles, where there are any.
    pub mesh: &'a TriangleMesh,
    /// What they have besides. Points of one station follow each other.
    pub attributes: &'a Attributes,
    /// By station, the points in the order in which it saw them; empty where that is not known.
    pub grids: &'a [Grid],
    /// The unit of the file's coordinates, of formats that have no unit of their own
    /// ([`has_metres`](ScanFormat::has_metres)).
    pub unit: Unit,
}

impl Recorded<'_> {
    /// A point in the file's unit.
    fn position(&self, point: usize) -> [f64; 3] {
        self.mesh.positions[point].map(|c| c / self.unit.millimetres())
    }
}

/// The points of a station as the cells of a grid.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Grid {
    /// Number of columns.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
    /// Column by column, the indices of the points, or [`EMPTY`](Self::EMPTY): as many as cells.
    pub cells: Vec<u32>,
}

impl Grid {
    /// The index in a cell without a point.
    pub const EMPTY: u32 = u32::MAX;
}

/// What a writer writes to.
trait Out: Write + Seek + Send + Sync {}

impl<T: Write + Seek + Send + Sync> Out for T {}

impl ScanFormat {
    /// All of them, with the endings of the names of their files.
    pub const ALL: [(&'static str, Self); 13] = [
        ("obj", Self::Mesh(MeshFormat::Obj)),
        ("ply", Self::Mesh(MeshFormat::Ply)),
        ("stl", Self::Mesh(MeshFormat::Stl)),
        ("off", Self::Off),
        ("glb", Self::Glb),
        ("3mf", Self::ThreeMf),
        ("e57", Self::E57),
        ("las", Self::Las),
        ("laz", Self::Laz),
        ("pcd", Self::Pcd),
        ("pts", Self::Pts),
        ("ptx", Self::Ptx),
        ("xyz", Self::Xyz),
    ];

    /// The format of a name such as `e57`, in any case of letters.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, format)| format)
    }

    /// The format that the ending of a file's name says.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        Self::named(&path.extension()?.to_string_lossy())
    }

    /// Whether the format has points only: triangles are left out.
    #[must_use]
    pub fn is_of_points(self) -> bool {
        matches!(self, Self::E57 | Self::Las | Self::Laz | Self::Pcd | Self::Pts | Self::Ptx | Self::Xyz)
    }

    /// Whether coordinates of the format are metres, whatever unit is asked for.
    #[must_use]
    pub fn has_metres(self) -> bool {
        matches!(self, Self::E57 | Self::Las | Self::Laz | Self::Ptx | Self::Glb)
    }

    /// Whether a file says its unit to gmlc: as the format has it, or in a comment.
    #[must_use]
    pub fn says_unit(self) -> bool {
        self != Self::Pts
    }

    /// The number of points of a mesh in a file of the format, in which those at one place may be one.
    #[must_use]
    pub fn count_points(self, mesh: &TriangleMesh) -> usize {
        match self {
            Self::Mesh(MeshFormat::Ply | MeshFormat::Obj) => mesh::count_places(mesh),
            _ => mesh.positions.len(),
        }
    }

    /// Whether intensities are other numbers in a file of the format.
    #[must_use]
    pub fn spreads(self, intensities: &[f32]) -> bool {
        matches!(self, Self::Las | Self::Laz) && las::spreads(intensities)
    }

    /// The data of a scan that a file of the format has room for, beside positions and triangles.
    #[must_use]
    pub fn holds(self, mesh: &TriangleMesh, attributes: &Attributes) -> Holds {
        let all = Holds { normals: true, colours: true, intensities: true, stations: true, texcoords: false };
        match self {
            Self::Mesh(MeshFormat::Ply) => {
                // A vertex of a PLY file has one.
                Holds { stations: false, texcoords: mesh.texcoords.is_empty() || !mesh::has_seams(mesh), ..all }
            }
            Self::Mesh(MeshFormat::Obj) => Holds { normals: true, texcoords: true, ..Holds::default() },
            Self::Mesh(MeshFormat::Stl) | Self::ThreeMf => Holds::default(),
            Self::Off => Holds { normals: true, colours: true, ..Holds::default() },
            Self::Glb => Holds { normals: true, colours: true, ..Holds::default() },
            Self::Ptx => Holds { normals: false, ..all },
            Self::Las | Self::Laz | Self::Pts => Holds { normals: false, stations: false, ..all },
            Self::E57 => all,
            // A file has one viewpoint.
            Self::Pcd => Holds { stations: attributes.stations.places.len() <= 1, ..all },
            Self::Xyz => Holds { stations: false, ..all },
        }
    }

    /// How far a file of the format moves a point along an axis, at most, where it rounds coordinates more coarsely
    /// than double precision does. Millimetres.
    #[must_use]
    pub fn rounding(self, scan: &Recorded<'_>) -> f64 {
        match self {
            Self::Mesh(MeshFormat::Stl) => single_rounding(scan, DVec3::ZERO),
            Self::Glb => {
                let metres = Recorded { unit: Unit::M, ..*scan };
                single_rounding(&metres, scan.mesh.bounds().centre() / Unit::M.millimetres())
            }
            Self::Pcd if pcd::is_single(scan) => single_rounding(scan, DVec3::ZERO),
            Self::Las | Self::Laz => las::step(scan) / 2.0,
            _ => 0.0,
        }
    }

    /// Whether the format has triangles only.
    #[must_use]
    pub fn is_of_triangles(self) -> bool {
        matches!(self, Self::Mesh(MeshFormat::Stl) | Self::ThreeMf)
    }
}

/// How far single precision moves a point along an axis, at most, if coordinates are those from a place in the file's
/// unit. Millimetres.
fn single_rounding(scan: &Recorded<'_>, from: DVec3) -> f64 {
    let lost = |i: usize| {
        let place = DVec3::from(scan.position(i)) - from;
        (place.as_vec3().as_dvec3() - place).abs().max_element()
    };
    (0..scan.mesh.positions.len()).map(lost).fold(0.0, f64::max) * scan.unit.millimetres()
}

/// Writes a scan to a file.
///
/// # Errors
/// See [`atomic::write`]; or the format cannot hold it.
pub fn write(path: &Path, scan: &Recorded<'_>, format: ScanFormat) -> Result<(), WriteError> {
    atomic::write_with(path, |out| match format {
        ScanFormat::Mesh(format) => mesh::write_scan(out, scan.mesh, scan.attributes, scan.unit, format),
        // Headers of some are written last.
        _ => out.write_all(&to_bytes(scan, format)?),
    })
}

/// The bytes of a file.
///
/// # Errors
/// The format cannot hold the scan.
pub fn to_bytes(scan: &Recorded<'_>, format: ScanFormat) -> io::Result<Vec<u8>> {
    let mut bytes = io::Cursor::new(Vec::new());
    write_to(&mut bytes, scan, format)?;
    Ok(bytes.into_inner())
}

fn write_to(out: &mut dyn Out, scan: &Recorded<'_>, format: ScanFormat) -> io::Result<()> {
    match format {
        ScanFormat::Mesh(format) => mesh::write_scan(out, scan.mesh, scan.attributes, scan.unit, format),
        ScanFormat::Off => off::write(out, scan),
        ScanFormat::Glb => glb::write(out, scan),
        ScanFormat::ThreeMf => threemf::write(out, scan),
        ScanFormat::E57 => e57::write(out, scan),
        ScanFormat::Las => las::write(out, scan, false),
        ScanFormat::Laz => las::write(out, scan, true),
        ScanFormat::Pcd => pcd::write(out, scan),
        ScanFormat::Pts => pts::write(out, scan),
        ScanFormat::Ptx => ptx::write(out, scan),
        ScanFormat::Xyz => xyz::write(out, scan),
    }
}
