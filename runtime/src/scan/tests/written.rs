//! Clouds that are written and read back.

use super::super::attributes::{Attributes, Station, Stations};
use super::super::cloud::{Input, Points};
use super::super::error::ScanFault;
use super::super::formats::collected::{Collected, collect};
use super::super::formats::{pcd, pts, ptx, table};
use super::super::unit::Unit;
use super::super::{ReadOptions, load};
use crate::export::scan::{Grid, Recorded, ScanFormat, write};
use crate::mesh::TriangleMesh;
use crate::progress::Silent;

type Read = fn(Input, &mut dyn Points) -> Result<(), ScanFault>;

/// Five points with all that there is, from two stations.
fn scan() -> (TriangleMesh, Attributes) {
    let positions =
        vec![[0.1, -2.0 / 3.0, 1e-7], [1e6 + 0.1, 3.0, 1.0 / 7.0], [7.0, 8.0, 9.0], [-1.5, 0.0, 4.0], [2.0, 1.0, 0.5]];
    let normals = vec![[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.8, 0.0, -0.6]];
    let (sin, cos) = 0.3_f64.sin_cos();
    let turned = Station { place: [100.0, 20.0, -3.0], rotation: [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]] };
    let stations = Stations { places: vec![Station::at([5.0, 6.0, 7.0]), turned], of_points: vec![0, 0, 0, 1, 1] };
    let attributes = Attributes {
        colours: vec![[1, 2, 3], [255, 0, 17], [9, 8, 7], [0, 0, 0], [4, 4, 4]],
        intensities: vec![0.25, 1.0, 0.1, 0.0, -7.5],
        stations,
        ..Attributes::default()
    };
    (TriangleMesh { positions, normals, ..TriangleMesh::default() }, attributes)
}

fn round(scan: &Recorded<'_>, format: ScanFormat, read: Read) -> (Collected, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan");
    write(&path, scan, format).unwrap();
    let bytes = std::fs::read(path).unwrap();
    (collect(read, &bytes, None).unwrap(), bytes)
}

fn recorded<'a>(scan: &'a (TriangleMesh, Attributes), unit: Unit) -> Recorded<'a> {
    Recorded { mesh: &scan.0, attributes: &scan.1, grids: &[], unit }
}

/// What was read is the scan, in a unit of so many millimetres, with coordinates at most `apart` off.
fn assert_same(found: &Collected, scan: &(TriangleMesh, Attributes), unit: f64, apart: f64, name: &str) {
    assert!(found.warnings.is_empty(), "{name}: {:?}", found.warnings);
    assert_eq!(found.points.len(), scan.0.positions.len(), "{name}");
    for (i, point) in found.points.iter().enumerate() {
        for k in 0..3 {
            let (found, expected) = (point.position[k] * unit, scan.0.positions[i][k]);
            assert!((found - expected).abs() <= apart, "{name}: {found}, not {expected}");
        }
        assert_eq!(point.colour, scan.1.colours.get(i).copied(), "{name}");
        assert_eq!(point.intensity, scan.1.intensities.get(i).copied(), "{name}");
    }
}

#[test]
fn points_come_back() {
    let scan = scan();
    let formats: [(ScanFormat, Read, bool); 3] =
        [(ScanFormat::Xyz, table::read, true), (ScanFormat::Pts, pts::read, false), (ScanFormat::Pcd, pcd::read, true)];
    for (format, read, has_normals) in formats {
        let name = format!("{format:?}");
        let (found, _) = round(&recorded(&scan, Unit::Mm), format, read);
        assert_same(&found, &scan, 1.0, 0.0, &name);
        // One rounding each way.
        let (metres, _) = round(&recorded(&scan, Unit::M), format, read);
        assert_same(&metres, &scan, 1000.0, 1e-9, &name);
        let normals: Vec<_> = found.points.iter().filter_map(|point| point.normal).collect();
        assert_eq!(normals.is_empty(), !has_normals, "{name}");
        for (found, expected) in normals.iter().zip(&scan.0.normals) {
            assert_eq!(*found, expected.map(|c| c as f32), "{name}");
        }
    }
}

#[test]
fn plain_points_come_back() {
    let (mesh, _) = scan();
    let scan = (TriangleMesh { normals: Vec::new(), ..mesh }, Attributes::default());
    let formats: [(ScanFormat, Read); 3] =
        [(ScanFormat::Xyz, table::read), (ScanFormat::Pts, pts::read), (ScanFormat::Pcd, pcd::read)];
    for (format, read) in formats {
        let (found, bytes) = round(&recorded(&scan, Unit::Mm), format, read);
        assert_same(&found, &scan, 1.0, 0.0, &String::from_utf8_lossy(&bytes));
    }
}

#[test]
fn stations_come_back() {
    let scan = scan();
    let (found, bytes) = round(&recorded(&scan, Unit::Mm), ScanFormat::Ptx, ptx::read);
    // Points in the stations' frames are up to 1e6 mm away, which doubles hold to 1e-10.
    assert_eq!(found.unit, Some(1000.0));
    let plain = Attributes { stations: Stations::default(), ..scan.1.clone() };
    assert_same(&found, &(scan.0.clone(), plain), 1000.0, 1e-8, &String::from_utf8_lossy(&bytes));
    let starts: Vec<usize> = found.entries.iter().map(|(_, start)| *start).collect();
    assert_eq!(starts, [0, 3]);
    for ((entry, _), expected) in found.entries.iter().zip(&scan.1.stations.places) {
        let station = entry.station.unwrap();
        for k in 0..3 {
            assert!((station.place[k] * 1000.0 - expected.place[k]).abs() < 1e-9);
        }
        assert_eq!(station.rotation, expected.rotation);
    }
    // A grid has its empty cells.
    let cells = vec![1, Grid::EMPTY, 0, Grid::EMPTY, Grid::EMPTY, 2];
    let grids = [Grid { columns: 2, rows: 3, cells }, Grid::default()];
    let (gridded, bytes) = round(&Recorded { grids: &grids, ..recorded(&scan, Unit::Mm) }, ScanFormat::Ptx, ptx::read);
    assert!(bytes.starts_with(b"2\n3\n0.005 0.006 0.007\n1 0 0\n"), "{}", String::from_utf8_lossy(&bytes));
    assert_eq!((gridded.points.len(), gridded.empty), (5, 3));
    assert_eq!((gridded.points[0].position, gridded.points[2]), (found.points[1].position, found.points[2]));
}

#[test]
fn a_single_station_is_the_viewpoint_of_pcd() {
    let (mesh, attributes) = scan();
    let places = vec![attributes.stations.places[1]];
    let stations = Stations { places, of_points: vec![0; 5] };
    let scan = (mesh, Attributes { stations, ..attributes });
    let (found, _) = round(&recorded(&scan, Unit::Mm), ScanFormat::Pcd, pcd::read);
    let (found, expected) = (found.entries[0].0.station.unwrap(), scan.1.stations.places[0]);
    assert_eq!(found.place, expected.place);
    for (found, expected) in found.rotation.iter().flatten().zip(expected.rotation.iter().flatten()) {
        assert!((found - expected).abs() < 1e-15, "{found}, not {expected}");
    }
}

#[test]
fn coordinates_of_pcd_are_single_where_that_is_fine() {
    let small = TriangleMesh { positions: vec![[0.1, 1000.3, -8000.7]], ..TriangleMesh::default() };
    let scan = (small, Attributes::default());
    let (found, bytes) = round(&recorded(&scan, Unit::Mm), ScanFormat::Pcd, pcd::read);
    assert!(String::from_utf8_lossy(&bytes).contains("SIZE 4 4 4\n"));
    assert_same(&found, &scan, 1.0, 5e-4, "PCD");
    let far =
        (TriangleMesh { positions: vec![[500_000.1, 0.0, 0.0]], ..TriangleMesh::default() }, Attributes::default());
    let (found, _) = round(&recorded(&far, Unit::Mm), ScanFormat::Pcd, pcd::read);
    assert_same(&found, &far, 1.0, 0.0, "PCD");
}

/// A survey has coordinates of 450 and 5400 km; 30 m are a hall.
#[test]
fn coordinates_far_from_the_origin_are_kept_or_their_rounding_is_known() {
    let folder = tempfile::tempdir().unwrap();
    for far in [[450_000_000.0, 5_400_000_000.0, 300_000.0], [0.0; 3]] {
        let corner = |x: f64, y: f64| [far[0] + x, far[1] + y, far[2] + 0.3 * x];
        let positions = vec![corner(0.1234, 0.2), corner(30_000.321, 1.7), corner(5.5, 20_000.123)];
        let mesh = TriangleMesh { positions, triangles: vec![[0, 1, 2]], ..TriangleMesh::default() };
        let mut said = Vec::new();
        for (name, format) in ScanFormat::ALL {
            let unit = if format.has_metres() { Unit::M } else { Unit::Mm };
            let attributes = Attributes::default();
            let scan = Recorded { mesh: &mesh, attributes: &attributes, grids: &[], unit };
            let path = folder.path().join(format!("a.{name}"));
            write(&path, &scan, format).unwrap();
            let found = load(&path, &ReadOptions::default(), &Silent).unwrap().mesh.positions;
            let off = found.iter().zip(&mesh.positions).flat_map(|(a, b)| (0..3).map(move |k| (a[k] - b[k]).abs()));
            let (off, rounding) = (off.fold(0.0, f64::max), format.rounding(&scan));
            // A coordinate of 5400 km has doubles of 1e-6 mm, and is rounded as metres and as millimetres.
            assert!(found.len() == 3 && off <= rounding + 3e-6, "{name}: {off}, not {rounding}");
            assert!(off >= 0.3 * rounding, "{name}: {off}, not {rounding}");
            if rounding > 6e-4 {
                said.push(name);
            }
        }
        if far[0] > 0.0 {
            assert_eq!(said, ["stl"]);
        }
    }
}
