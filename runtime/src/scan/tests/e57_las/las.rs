//! LAS files as other programs write them, and faults of them.

use super::made::{Made, las};
use super::{collect, message};
use crate::export::scan::ScanFormat;

/// The bytes of a point behind its coordinates: intensity, class with its state, and a colour (format 2).
fn rest(class: u8, colour: [u16; 3]) -> Vec<u8> {
    let mut bytes = vec![7, 1, 0x11, class, 0, 0, 0, 0];
    colour.iter().for_each(|c| bytes.extend_from_slice(&c.to_le_bytes()));
    bytes
}

/// Points of a number, none at the origin.
fn points(count: i32, colour: [u16; 3]) -> Vec<([i32; 3], Vec<u8>)> {
    (0..count).map(|k| ([k + 1, 2, -3], rest(2, colour))).collect()
}

/// A record of GeoTIFF keys.
fn keys(entries: &[[u16; 4]]) -> (&'static str, u16, Vec<u8>) {
    let head = [[1, 1, 0, entries.len() as u16]];
    ("LASF_Projection", 34735, head.iter().chain(entries).flatten().flat_map(|w| w.to_le_bytes()).collect())
}

#[test]
fn noise_and_withheld_points_are_left_out() {
    let all = [2, 7, 18, 2 | 128, 2 | 64, 31].map(|class| ([100, 200, -300], rest(class, [0; 3])));
    let read = collect(&las(2, 2, &[], &all), None).unwrap();
    assert_eq!((read.points.len(), read.marked, read.points[0].position), (3, 3, [1.0, 2.0, -3.0]));
    assert_eq!(read.points[0].intensity, Some(263.0));
    // The first version has no such bits.
    assert_eq!(collect(&las(0, 2, &[], &all), None).unwrap().marked, 2);
    let mut bytes = Made::new(9).to_bytes(ScanFormat::Las);
    let start = bytes.len() - 9 * 36;
    bytes[start + 15] = 4;
    bytes[start + 36 + 16] = 18;
    bytes[start + 72 + 15] = 0x3b;
    assert_eq!(collect(&bytes, None).unwrap().marked, 2);
}

#[test]
fn colours_have_eight_bits_or_sixteen() {
    let colour = |values: [u16; 3]| collect(&las(2, 2, &[], &points(3, values)), None).unwrap().points[1].colour;
    assert_eq!(colour([255, 3, 0]), Some([255, 3, 0]));
    assert_eq!(colour([65535, 256, 255]), Some([255, 1, 0]));
    // A field without colours.
    assert_eq!(colour([0; 3]), None);
    let mut late = points(140_000, [200, 0, 0]);
    late[139_999].1 = rest(2, [400, 0, 0]);
    let read = collect(&las(2, 2, &[], &late), None).unwrap();
    assert_eq!((read.points[0].colour, read.points[139_999].colour), (Some([200, 0, 0]), Some([255, 0, 0])));
    assert!(read.warnings.iter().any(|w| w.contains("later ones up to 400")), "{:?}", read.warnings);
}

#[test]
fn coordinate_systems_say_units() {
    let unit = |records: &[(&str, u16, Vec<u8>)]| {
        let read = collect(&las(2, 2, records, &points(2, [0; 3])), None).unwrap();
        (read.unit.unwrap(), read.points[0].position[2], read.warnings.len())
    };
    assert_eq!(unit(&[]), (1000.0, -0.03, 1));
    assert_eq!(unit(&[keys(&[[3076, 0, 1, 9001]])]), (1000.0, -0.03, 0));
    assert_eq!(unit(&[keys(&[[3076, 0, 1, 9002]])]), (304.8, -0.03, 0));
    // Heights in metres become feet.
    let (plane, height, warnings) = unit(&[keys(&[[3076, 0, 1, 9002], [4099, 0, 1, 9001]])]);
    assert!((height + 0.03 / 0.3048).abs() < 1e-15 && (plane, warnings) == (304.8, 1));
    let text = b"PROJCS[\"x\",GEOGCS[\"y\",UNIT[\"degree\",0.01]],UNIT[\"US survey foot\",0.3048006096012192]]\0";
    assert_eq!(unit(&[("LASF_Projection", 2112, text.to_vec())]), (304.8006096012192, -0.03, 0));
    let degrees = las(2, 2, &[keys(&[[1024, 0, 1, 2]])], &points(2, [0; 3]));
    // The box of the header is larger than degrees are.
    let read = collect(&degrees, None).unwrap();
    assert!(read.warnings[0].contains("its coordinates are larger"), "{:?}", read.warnings);
    let mut degrees = degrees;
    for at in (179..227).step_by(8) {
        degrees[at..at + 8].copy_from_slice(&48_f64.to_le_bytes());
    }
    assert!(message(&degrees).contains("project them first"));
}

#[test]
fn numbers_of_points_are_held_against_the_bytes() {
    let good = las(2, 2, &[], &points(10, [0; 3]));
    let with_count = |count: u32| [&good[..107], &count.to_le_bytes(), &good[111..]].concat();
    assert!(message(&with_count(11)).contains("byte 487: the header announces 11 points, the file ends after 10"));
    assert!(message(&with_count(8)).contains("byte 435: the header announces 8 points, and 2 more follow"));
    let padded = collect(&[good.clone(), vec![0; 100]].concat(), None).unwrap();
    assert_eq!((padded.points.len(), padded.warnings.len()), (10, 2));
    for length in [3, 100, 226, 300] {
        assert!(message(&good[..length]).contains("cut off"), "{length}: {}", message(&good[..length]));
    }
    // Of a version that is older than its number of points.
    let mut records = good.clone();
    records[100..104].copy_from_slice(&u32::MAX.to_le_bytes());
    let read = collect(&records, None).unwrap();
    assert!(read.warnings[0].contains("of the 4294967295 records behind its header 0 are read"), "{:?}", read.warnings);
}

#[test]
fn faults_of_headers_are_named() {
    let good = las(2, 2, &[], &points(2, [0; 3]));
    let cases: [(usize, &[u8], &str); 6] = [
        (25, &[7], "version 1.0 to 1.4 was expected, found 1.7"),
        (104, &[11], "points of a format 0 to 10 were expected, found 11"),
        (105, &[19], "points of format 2 have 26 bytes or more, not 19"),
        (131, &[0; 8], "a scale of the coordinates is 0"),
        (155, &f64::NAN.to_le_bytes(), "not finite"),
        (104, &[130], "the points are compressed, but there is no such record"),
    ];
    for (at, bytes, expected) in cases {
        let mut changed = good.clone();
        changed[at..at + bytes.len()].copy_from_slice(bytes);
        assert!(message(&changed).contains(expected), "{}, not: {expected}", message(&changed));
    }
}

#[test]
fn compressed_points_are_counted_and_must_be_whole() {
    let good = Made::new(500).to_bytes(ScanFormat::Laz);
    let start = u32::from_le_bytes(*good[96..].first_chunk().unwrap()) as usize;
    for count in [400_u64, 501, 1 << 40] {
        let mut changed = good.clone();
        changed[247..255].copy_from_slice(&count.to_le_bytes());
        assert!(message(&changed).contains("announce"), "{}", message(&changed));
    }
    assert!(message(&good[..good.len() - 50]).contains("cut off"));
    // The first layer is said to be larger than the file.
    let mut changed = good.clone();
    changed[start + 8 + 36 + 4 + 3] = 0x7f;
    assert!(message(&changed).contains("more than the 268435456 that are read"), "{}", message(&changed));
}
