//! What is written is read again.

use super::made::Made;
use super::{Collected, collect};
use crate::export::scan::ScanFormat;
use crate::scan::cloud::RawPoint;

/// The largest distance in millimetres of coordinates from those that were written.
fn largest_error(read: &Collected, made: &Made) -> f64 {
    let unit = read.unit.unwrap();
    let error = |(read, written): (&RawPoint, &[f64; 3])| {
        (0..3).map(|k| (read.position[k] * unit - written[k]).abs()).fold(0.0, f64::max)
    };
    assert_eq!(read.points.len(), made.mesh.positions.len());
    read.points.iter().zip(&made.mesh.positions).map(error).fold(0.0, f64::max)
}

#[test]
fn e57_keeps_all_of_a_scan() {
    let made = Made::new(10_000);
    let read = collect(&made.to_bytes(ScanFormat::E57), None).unwrap();
    // Some units in the last place of 5e9 mm, each of 1e-6 mm.
    assert!(largest_error(&read, &made) < 1e-5, "{}", largest_error(&read, &made));
    assert_eq!((read.entries.len(), read.warnings.len(), read.share), (2, 0, 1.0));
    for (index, (entry, written)) in read.entries.iter().zip(&made.attributes.stations.places).enumerate() {
        let station = entry.station.unwrap();
        assert_eq!(entry.name, format!("station {index}"));
        for k in 0..3 {
            assert!((station.place[k] * 1000.0 - written.place[k]).abs() < 1e-5);
            // Quaternions and back: some roundings.
            assert!((0..3).all(|c| (station.rotation[k][c] - written.rotation[k][c]).abs() < 1e-14));
        }
    }
    for (k, point) in read.points.iter().enumerate() {
        assert_eq!(point.colour, Some(made.attributes.colours[k]));
        assert_eq!(point.intensity, Some(made.attributes.intensities[k]));
        assert_eq!(read.of[k], usize::from(made.attributes.stations.of_points[k]));
        let (normal, written) = (point.normal.unwrap(), made.mesh.normals[k]);
        // Normals are in single precision.
        assert!((0..3).all(|c| (f64::from(normal[c]) - written[c]).abs() < 1e-6), "{normal:?}, not {written:?}");
    }
}

#[test]
fn one_scan_of_an_e57_file_is_read_alone() {
    let bytes = Made::new(300).to_bytes(ScanFormat::E57);
    let (all, second) = (collect(&bytes, None).unwrap(), collect(&bytes, Some(1)).unwrap());
    assert_eq!(second.points, all.points[100..]);
    assert_eq!(second.entries, all.entries[1..]);
    assert!(collect(&bytes, Some(2)).unwrap_err().to_string().contains("it has 2 scans"));
}

#[test]
fn e57_without_stations_or_attributes() {
    let mut made = Made::new(50);
    made.attributes = crate::scan::Attributes::default();
    (made.mesh.normals, made.grids) = (Vec::new(), Vec::new());
    let read = collect(&made.to_bytes(ScanFormat::E57), None).unwrap();
    assert!(largest_error(&read, &made) < 1e-5);
    assert_eq!((read.entries.len(), read.entries[0].station), (1, None));
    assert!(read.points.iter().all(|p| (p.normal, p.colour, p.intensity) == (None, None, None)));
}

#[test]
fn las_and_laz_keep_points_colours_and_intensities() {
    let made = Made::new(5_000);
    for format in [ScanFormat::Las, ScanFormat::Laz] {
        let read = collect(&made.to_bytes(format), None).unwrap();
        // Half of the scale, and as above.
        assert!(largest_error(&read, &made) < 0.5e-3 + 1e-5, "{}", largest_error(&read, &made));
        assert_eq!((read.unit, read.warnings.as_slice(), read.share), (Some(1000.0), [].as_slice(), 1.0));
        for (k, point) in read.points.iter().enumerate() {
            assert_eq!(point.colour, Some(made.attributes.colours[k]));
            assert_eq!(point.intensity, Some(made.attributes.intensities[k]));
        }
        assert!(collect(&made.to_bytes(format), Some(1)).unwrap_err().to_string().contains("it has 1 scan;"));
    }
}

#[test]
fn laz_of_several_parts() {
    // A part has 50,000 points.
    let made = Made::new(110_000);
    let (plain, packed) = (made.to_bytes(ScanFormat::Las), made.to_bytes(ScanFormat::Laz));
    assert_eq!(collect(&plain, None).unwrap().points, collect(&packed, None).unwrap().points);
    assert!(packed.len() < plain.len() / 2);
}
