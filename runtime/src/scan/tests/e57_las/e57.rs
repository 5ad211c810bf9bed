//! E57 files as other programs write them, and faults of them.

use super::made::{Made, doubles, e57, seal};
use super::{collect, message};
use crate::export::scan::ScanFormat;
use crate::scan::Station;

const POSE: &str = "<pose><rotation><w>0.5</w><x>0.5</x><y>0.5</y><z>0.5</z></rotation>\
                    <translation><x>10</x><z>-2e1</z></translation></pose>";
const CARTESIAN: &str = "<cartesianX type=\"Float\"/><cartesianY type=\"Float\"/><cartesianZ type=\"Float\"/>";

fn near(a: [f64; 3], b: [f64; 3]) -> bool {
    // Sines and products of small numbers.
    (0..3).all(|k| (a[k] - b[k]).abs() < 1e-14)
}

#[test]
fn spherical_coordinates_and_their_states() {
    let prototype = "<sphericalRange type=\"Float\"/><sphericalAzimuth type=\"Float\"/>\
                     <sphericalElevation type=\"Float\"/><sphericalInvalidState type=\"Integer\" minimum=\"0\" maximum=\"2\"/>";
    let half = std::f64::consts::FRAC_PI_2;
    let fields = vec![
        doubles(&[2.0, 3.0, 4.0, 5.0, 0.0]),
        doubles(&[half, 0.0, 0.0, 0.0, 1.0]),
        doubles(&[0.0, half, 0.0, 0.0, 1.0]),
        // States 0, 0, 1 (a direction), 2 (invalid), 0 in two bits each.
        vec![0b1001_0000, 0],
    ];
    let read = collect(&e57("", prototype, 5, std::slice::from_ref(&fields)), None).unwrap();
    assert_eq!((read.points.len(), read.marked, read.empty), (2, 2, 1));
    assert!(near(read.points[0].position, [0.0, 2.0, 0.0]) && near(read.points[1].position, [0.0, 0.0, 3.0]));
    assert_eq!(read.entries[0].station, Some(Station::at([0.0; 3])));
    // The pose turns x into y, y into z and z into x.
    let read = collect(&e57(POSE, prototype, 5, &[fields]), None).unwrap();
    assert!(near(read.points[0].position, [10.0, 0.0, -18.0]), "{:?}", read.points[0].position);
    assert_eq!(read.entries[0].station.unwrap().place, [10.0, 0.0, -20.0]);
}

#[test]
fn integers_colours_and_fields_without_bits() {
    let prototype = "<cartesianX type=\"ScaledInteger\" minimum=\"-4\" maximum=\"3\" scale=\"0.5\" offset=\"100\"/>\
                     <cartesianY type=\"Integer\" minimum=\"7\" maximum=\"7\"/>\
                     <cartesianZ type=\"Float\" precision=\"single\"/>\
                     <colorRed type=\"Integer\" minimum=\"0\" maximum=\"65535\"/>\
                     <colorGreen type=\"Float\" precision=\"single\"/><colorBlue type=\"Integer\" minimum=\"0\" maximum=\"255\"/>\
                     <isColorInvalid type=\"Integer\" minimum=\"0\" maximum=\"1\"/><nor:normalX type=\"Float\"/>\
                     <nor:other type=\"Integer\" minimum=\"0\" maximum=\"15\"/>\
                     <intensity type=\"Integer\" minimum=\"-10\" maximum=\"245\"/>";
    let limits =
        "<colorLimits><colorBlueMinimum>0</colorBlueMinimum><colorBlueMaximum>127.5</colorBlueMaximum></colorLimits>";
    let single = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let fields = vec![
        // -4 and 3 of three bits.
        vec![0b11_1000],
        vec![],
        single(&[0.25, -1.0]),
        vec![0xff, 0xff, 0, 0x80],
        single(&[0.5, 2.0]),
        vec![51, 200],
        vec![0b10],
        doubles(&[0.0, 0.0]),
        vec![0x12],
        vec![0, 255],
    ];
    let read = collect(&e57(limits, prototype, 2, &[fields]), None).unwrap();
    assert_eq!(read.points[0].position, [98.0, 7.0, 0.25]);
    assert_eq!(read.points[1].position, [101.5, 7.0, -1.0]);
    assert_eq!(read.points[0].colour, Some([255, 128, 102]));
    assert_eq!((read.points[1].colour, read.points[0].normal), (None, None));
    assert_eq!(read.points.iter().map(|p| p.intensity).collect::<Vec<_>>(), [Some(-10.0), Some(245.0)]);
    assert_eq!((read.unit, read.entries[0].station), (Some(1000.0), None));
}

#[test]
fn fields_need_not_be_in_step() {
    let packets = [
        vec![doubles(&[1.0, 2.0, 3.0]), doubles(&[4.0]), vec![]],
        vec![vec![], doubles(&[5.0, 6.0]), doubles(&[7.0])],
        vec![vec![], vec![], doubles(&[8.0, 9.0])],
    ];
    let read = collect(&e57("", CARTESIAN, 3, &packets), None).unwrap();
    let positions: Vec<_> = read.points.iter().map(|p| p.position).collect();
    assert_eq!(positions, [[1.0, 4.0, 7.0], [2.0, 5.0, 8.0], [3.0, 6.0, 9.0]]);
    let read = collect(&e57("", CARTESIAN, 1, &packets), None).unwrap();
    assert_eq!((read.points.len(), read.warnings.len()), (1, 1));
    assert!(read.warnings[0].contains("scan 0 has points behind the 1 that it announces"), "{:?}", read.warnings);
}

#[test]
fn a_pose_that_moves_nothing_is_no_station_unless_points_are_seen_from_it() {
    let none = "<pose><rotation><w>1</w></rotation><translation/></pose>";
    let cells = "<rowIndex type=\"Integer\" minimum=\"0\" maximum=\"0\"/><columnIndex type=\"Integer\" minimum=\"0\" maximum=\"0\"/>";
    let one = || vec![doubles(&[1.0]), doubles(&[2.0]), doubles(&[3.0])];
    let station = |bytes: &[u8]| collect(bytes, None).unwrap().entries[0].station;
    assert_eq!(station(&e57(none, CARTESIAN, 1, &[one()])), None);
    let fields = [one(), vec![vec![], vec![]]].concat();
    assert_eq!(station(&e57(none, &format!("{CARTESIAN}{cells}"), 1, &[fields])), Some(Station::at([0.0; 3])));
    let zero = "<pose><rotation><w>0</w></rotation><translation><x>5</x></translation></pose>";
    let read = collect(&e57(zero, CARTESIAN, 1, &[one()]), None).unwrap();
    assert_eq!(read.points[0].position, [6.0, 2.0, 3.0]);
    assert!(read.warnings[0].contains("quaternion of its pose is 0"));
}

#[test]
fn faults_name_their_places() {
    let one = || vec![doubles(&[1.0]), doubles(&[2.0]), doubles(&[3.0])];
    let cases = [
        (e57("", CARTESIAN, 2, &[one()]), "byte 80: 2 points of 192 bits are announced, but only 36 bytes follow"),
        (
            e57("", "<intensity type=\"Float\"/>", 1, &[vec![doubles(&[1.0])]]),
            "scan 0: its points have neither `cartesianX`",
        ),
        (e57("", CARTESIAN, 1, &[vec![doubles(&[1.0])]]), "byte 80: 1 points of 192 bits"),
        (e57("", CARTESIAN, 1, &[vec![doubles(&[1.0, 2.0, 3.0, 4.0])]]), "with 3 fields was expected, found 1 fields"),
        (
            e57("", "<cartesianX type=\"Integer\" minimum=\"9\" maximum=\"1\"/>", 1, &[]),
            "element `cartesianX`: its minimum 9",
        ),
        (e57("", "<cartesianX type=\"Integer\" minimum=\"a\"/>", 1, &[]), "`a` is not a whole number"),
        (e57("", "<cartesianX type=\"Structure\"/>", 1, &[]), "has the type `Structure`"),
        (
            e57("<pose><rotation><w>NaN</w></rotation></pose>", CARTESIAN, 0, &[]),
            "element `pose`: its numbers are not finite",
        ),
        (e57("<broken", CARTESIAN, 0, &[]), "malformed E57, XML section: "),
        (e57("", &CARTESIAN.replace("Float\"", "Integer\" minimum=\"1\" maximum=\"1\""), 5000, &[]), "have no bits"),
        (b"ASTM-E57".to_vec(), "a page of 1024 bytes was expected, the file ends after 8"),
    ];
    for (bytes, expected) in cases {
        assert!(message(&bytes).contains(expected), "{}, not: {expected}", message(&bytes));
    }
}

#[test]
fn damaged_pages_matter_where_they_are_read() {
    let good = Made::new(600).to_bytes(ScanFormat::E57);
    let mut bytes = good.clone();
    bytes[5000] ^= 1;
    assert!(message(&bytes).contains("byte 4096: the checksum of the 1024 bytes from here on is wrong"));
    // Pages behind the end of the XML section, as pictures may be.
    let mut bytes = [good.clone(), vec![9; 2048]].concat();
    let size = (bytes.len() as u64).to_le_bytes();
    bytes[16..24].copy_from_slice(&size);
    seal(&mut bytes[..1024]);
    assert_eq!(collect(&bytes, None).unwrap().points.len(), 600);
    let cut = message(&good[..good.len() - 3000]);
    assert!(cut.contains("is said to have") && cut.contains("cut off"), "{cut}");
}
