//! Tests of PCD.

use super::super::collected::{Collected, collect, mutate};
use super::*;
use crate::scan::attributes::Station;

const HEADER: &str = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb _ normal_x normal_y \
    normal_z intensity\nSIZE 4 8 2 4 1 4 4 4 1\nTYPE F F I U U F F F U\nCOUNT 1 1 1 1 3 1 1 1 2\nWIDTH 2\nHEIGHT 1\n\
    VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\n";

/// Two points of all kinds of fields: the fields of each.
fn values() -> [Vec<Vec<u8>>; 2] {
    let point = |x: f32, y: f64, z: i16| {
        vec![
            x.to_le_bytes().to_vec(),
            y.to_le_bytes().to_vec(),
            z.to_le_bytes().to_vec(),
            0xff01_0203_u32.to_le_bytes().to_vec(),
            vec![9; 3],
            0.0_f32.to_le_bytes().to_vec(),
            0.0_f32.to_le_bytes().to_vec(),
            1.0_f32.to_le_bytes().to_vec(),
            vec![200, 1],
        ]
    };
    [point(1.5, 1e-9, -7), point(f32::NAN, 0.0, 0)]
}

fn binary() -> Vec<u8> {
    let points = values().map(|fields| fields.concat());
    [format!("{HEADER}DATA binary\n").into_bytes(), points.concat()].concat()
}

/// As literals.
fn compressed() -> Vec<u8> {
    let [a, b] = values();
    let all: Vec<u8> = a.into_iter().zip(b).flat_map(|(a, b)| [a, b].concat()).collect();
    let packed: Vec<u8> = all.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect();
    let sizes = [packed.len() as u32, all.len() as u32].map(u32::to_le_bytes);
    [format!("{HEADER}DATA binary_compressed\n").into_bytes(), sizes.concat(), packed].concat()
}

fn text() -> Vec<u8> {
    format!("{HEADER}DATA ascii\n1.5 1e-9 -7 4278256131 9 9 9 0 0 1 200 1\nnan 0 0 4278256131 9 9 9 0 0 1 200 1\n")
        .into()
}

fn found(bytes: &[u8]) -> Collected {
    collect(read, bytes, None).unwrap()
}

#[test]
fn all_kinds_of_data() {
    for bytes in [text(), binary(), compressed()] {
        assert!(recognise(&bytes));
        let found = found(&bytes);
        assert_eq!((found.points.len(), found.empty, found.entries.len(), found.unit), (1, 1, 0, None));
        let point = found.points[0];
        assert_eq!((point.position, point.colour), ([1.5, 1e-9, -7.0], Some([1, 2, 3])));
        assert_eq!((point.normal, point.intensity), (Some([0.0, 0.0, 1.0]), Some(200.0)));
        assert!(found.warnings.is_empty() && found.progress == 1.0, "{:?}", found.warnings);
    }
}

#[test]
fn viewpoints_are_stations() {
    let turned = String::from_utf8(text()).unwrap().replace("0 0 0 1 0 0 0", "1 2 3 1 0 0 1");
    let found = found(turned.as_bytes());
    let expected = Station { place: [1.0, 2.0, 3.0], rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]] };
    assert_eq!(found.entries[0].0.station, Some(expected));
    assert_eq!(found.points[0].position, [1.5, 1e-9, -7.0]);
}

#[test]
fn colours_in_text() {
    let rgb = |kind: &str, value: &str| {
        let text = format!(
            "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F {kind}\nPOINTS 1\nDATA ascii\n1 2 3 {value}\n"
        );
        found(text.as_bytes()).points[0].colour
    };
    assert_eq!(rgb("U", "66051"), Some([1, 2, 3]));
    assert_eq!(rgb("F", "66051"), Some([1, 2, 3]));
    assert_eq!(rgb("F", &format!("{:e}", f32::from_bits(0x0001_0203))), Some([1, 2, 3]));
    assert_eq!(rgb("F", &format!("{:e}", f32::from_bits(0xfe01_0203))), Some([1, 2, 3]));
    assert_eq!(rgb("I", "-16711165"), Some([1, 2, 3]));
    assert_eq!(rgb("F", "nan"), None);
}

#[test]
fn faults_are_named() {
    let text = String::from_utf8(text()).unwrap();
    let change = |from: &str, to: &str| text.replacen(from, to, 1).into_bytes();
    let (binary, compressed) = (binary(), compressed());
    let cases: Vec<(Vec<u8>, &str)> = vec![
        (change("WIDTH 2", "WIDTH 3"), "POINTS is 2, but WIDTH 3 times HEIGHT 1 are 3"),
        (change("WIDTH 2\nHEIGHT 1\n", "").to_vec(), ""),
        (change("nan 0 0", "nan 0"), "line 13: expected 12 numbers (x y z rgb _ normal_x"),
        (change("POINTS 2", "POINTS x"), "line 10: expected the keyword and a whole number, found `POINTS x`"),
        (
            change("WIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2", "POINTS 3"),
            "announces 3 points, the file ends after 2",
        ),
        (
            change("WIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2", "POINTS 1"),
            "line 10: more points follow than the 1",
        ),
        (change("FIELDS x", "FIELDS w"), "fields x, y and z were expected, there are `w y z"),
        (change("SIZE 4 8", "SIZE 4 3"), "line 4: expected sizes of 1, 2, 4 or 8 bytes"),
        (change("SIZE 4 8", "SIZE 2 8"), "the field `x` has type F and size 2"),
        (change("SIZE 4 ", "SIZE "), "FIELDS names 9 fields, SIZE has 8 values"),
        (change("1 0 0 0", "0 0 0 0"), "line 9: expected `VIEWPOINT` and 7 numbers"),
        (change("DATA ascii", "DATA zip"), "line 11: expected `DATA`"),
        (change("COUNT 1 1", "COUNT 1 99999999"), "line 6: expected counts"),
        (b"VERSION .7\n".to_vec(), "there is no line `DATA ascii`"),
        (b"VERSION .7\nDATA ascii\n".to_vec(), "no line FIELDS"),
        (binary[..binary.len() - 1].to_vec(), "announces 2 points, the file ends after 1"),
        ([&binary[..], &[0; 40]].concat(), "behind the 2 points that the header announces 40 more bytes"),
        (compressed[..compressed.len() - 1].to_vec(), "bytes are announced"),
    ];
    for (bytes, expected) in cases {
        match collect(read, &bytes, None) {
            Ok(found) => assert!(expected.is_empty(), "{expected}: {found:?}"),
            Err(error) => assert!(error.to_string().contains(expected), "{error}, not {expected}"),
        }
    }
    let spare = found(&[&binary[..], b"\n"].concat());
    assert!(spare.warnings[0].contains("1 bytes behind the last point"), "{:?}", spare.warnings);
}

#[test]
fn sizes_that_the_file_has_no_room_for_take_no_memory() {
    let mut bytes = compressed();
    let at = bytes.windows(7).position(|w| w == b"ressed\n").unwrap() + 7;
    bytes[at + 4..at + 8].copy_from_slice(&u32::MAX.to_le_bytes());
    let error = collect(read, &bytes, None).unwrap_err().to_string();
    assert!(error.contains("4294967295 bytes are announced"), "{error}");
    let many = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 300000000\nDATA binary_compressed\n";
    let sizes = [4_u32, 3_600_000_000].map(u32::to_le_bytes).concat();
    let error = collect(read, &[many.as_bytes(), &sizes, &[0; 4]].concat(), None).unwrap_err().to_string();
    assert!(error.contains("it unpacks to 352; the file is damaged"), "{error}");
}

#[test]
fn faulty_files_do_no_harm() {
    let (text, binary, compressed) = (text(), binary(), compressed());
    mutate(read, &[&text, &binary, &compressed], 5_000);
}
