//! The formats, read by readers that share nothing with the writers.

use super::*;
use crate::export::scale::Scale;
use crate::mesh::{Group, TriangleMesh};
use crate::model::{Tessellation, Texels};
use crate::progress::Silent;
use crate::scan::{self, ReadOptions, ScanParts, ScanSource};
use crate::variance::{Deviations, PointDistance, VarianceReport};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::io::Read;

const NAMES: [&str; 2] = ["<a & \"b\">", "=lid\n\u{1}"];

/// A square of two parts on a texture of 4 x 4 texels of a millimetre. Part one has two columns that deviate by 0.5, of
/// which one texel is buried; part two a column without data, and one that deviates by -0.25. The parts share the
/// vertices in the middle.
fn measurement() -> Measurement {
    let (nan, places) = (f32::NAN, 0..16_usize);
    let column = |i: usize| i % 4;
    let row = |i: usize| i / 4;
    let texels = Texels {
        width: 4,
        height: 4,
        index: (0..16).collect(),
        part: places.clone().map(|i| u32::from(column(i) > 1)).collect(),
        position: places.clone().map(|i| [column(i) as f64 + 0.5, 3.5 - row(i) as f64, 7.0]).collect(),
        normal: vec![[0.0, 0.0, 1.0]; 16],
        area: vec![1.0; 16],
        side: vec![1.0; 16],
        part_names: NAMES.map(str::to_owned).to_vec(),
    };
    let outward: Vec<f32> = places.clone().map(|i| if column(i) < 2 { 0.5 } else { nan }).collect();
    let inward: Vec<f32> = places.map(|i| if column(i) == 3 { 0.25 } else { nan }).collect();
    let mut deviations = Deviations::new(texels, 2.0, outward, inward);
    // The texel of row 3, column 1.
    deviations.buried = (0..16).map(|i| i == 13).collect();
    deviations.outward[13] = nan;
    let corners = [[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [0.0, 4.0], [2.0, 4.0], [4.0, 4.0]];
    let mesh = TriangleMesh {
        positions: corners.map(|[x, y]| [x, y, 7.0]).to_vec(),
        normals: vec![[0.0, 0.0, 1.0]; 6],
        texcoords: corners.map(|[x, y]| [x / 4.0, y / 4.0]).to_vec(),
        triangles: vec![[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]],
        groups: (0..2).map(|k| Group { name: NAMES[k].to_owned(), start: 2 * k, end: 2 * k + 2 }).collect(),
    };
    let source = ScanSource { path: "scan.ply".into(), ..ScanSource::default() };
    let report = VarianceReport::new(&deviations, &source, "cpu", &[]);
    let measured = |distance, part| Some(PointDistance { distance, part });
    let points = MeasuredPoints {
        positions: vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]],
        distances: vec![measured(0.125, 1), None, None],
        facing_away: vec![false, true, false],
        parts: ScanParts::default(),
        colours: Vec::new(),
        intensities: Vec::new(),
    };
    let tessellation = Tessellation { mesh, ..Tessellation::default() };
    let (unmatched, filled, conformance) = (TriangleMesh::default(), None, None);
    let displayed = tessellation.clone();
    let (sensitivity_maps, scan_colours) = (None, None);
    Measurement {
        tessellation,
        displayed,
        deviations,
        report,
        points,
        unmatched,
        filled,
        conformance,
        sensitivity_maps,
        scan_colours,
    }
}

fn names() -> Vec<String> {
    NAMES.map(str::to_owned).to_vec()
}

#[test]
fn vertices_have_what_the_nearest_texel_of_their_part_has() {
    let surface = MeasuredSurface::new(&measurement(), &Scale::continuous(1.0));
    assert_eq!(
        (surface.positions.len(), surface.triangles.len()),
        (8, 4),
        "shared vertices are those of one part each"
    );
    assert_eq!(surface.part, [0, 0, 0, 0, 1, 1, 1, 1]);
    let at = |x: f64, y: f64, part: u32| {
        let is_at = |i: &usize| surface.positions[*i] == [x, y, 7.0] && surface.part[*i] == part;
        let i = (0..8).find(is_at).expect("a vertex");
        (surface.distance[i], surface.class[i])
    };
    assert_eq!(at(0.0, 0.0, 0), (0.5, Class::Measured));
    assert_eq!(at(2.0, 4.0, 0), (0.5, Class::Measured));
    let (distance, class) = at(2.0, 0.0, 0);
    assert!(distance.is_nan() && class == Class::Buried);
    let (distance, class) = at(2.0, 0.0, 1);
    assert!(distance.is_nan() && class == Class::NoData);
    assert_eq!(at(4.0, 4.0, 1), (-0.25, Class::Measured));
}

#[test]
fn scalars_of_ply() {
    let mut out = Vec::new();
    let measurement = measurement();
    write_points_to(&mut out, &measurement.points, &names()).expect("written");
    let end = b"end_header\n";
    let header = out.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    let text = String::from_utf8(out[..header].to_vec()).expect("text");
    assert!(text.contains("comment part 1: =lid__\n") && text.contains("7: surface faces another way\n"), "{text}");
    let record = |i: usize| &out[header + 49 * i..][..49];
    assert_eq!(out.len(), header + 3 * 49);
    assert_eq!(record(0)[24..32], 0.125_f64.to_le_bytes());
    let distance = &0.125_f32.to_le_bytes()[..];
    assert_eq!((record(0)[32], &record(0)[36..40], record(0)[40]), (1, distance, 1));
    assert_eq!((record(0)[44], &record(0)[45..]), (1, distance));
    assert_eq!((i32::from_le_bytes(record(1)[32..36].try_into().expect("4 bytes")), record(1)[44]), (-1, 7));
    assert_eq!(record(2)[44], 6);
    let own = MeasuredPoints {
        colours: vec![[1, 2, 3], [4, 5, 6], [7, 8, 9]],
        intensities: vec![0.5, 1.5, 2.5],
        ..measurement.points.clone()
    };
    let mut out = Vec::new();
    write_points_to(&mut out, &own, &names()).expect("written");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("points.ply");
    std::fs::write(&path, &out).expect("written");
    let read = scan::load(&path, &ReadOptions::default(), &Silent).expect("a cloud").attributes;
    assert_eq!((read.colours, read.intensities), (own.colours, own.intensities), "the scan's own are read back");
    let mut out = Vec::new();
    ply::write_surface(&mut out, &MeasuredSurface::new(&measurement, &Scale::continuous(1.0)), &names())
        .expect("written");
    let header = out.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    assert_eq!(out.len(), header + 8 * (24 + 12 + 3 + 12 + 4 + 1) + 4 * 13);
}

/// What an array of a VTP file holds.
fn array(text: &str, name: &str) -> Vec<u8> {
    let (_, rest) = text.split_once(&format!("Name=\"{name}\"")).expect("the array");
    let data = rest.split_once('>').and_then(|(_, rest)| rest.split_once('<')).expect("its text").0.trim();
    inflated(data)
}

fn inflated(data: &str) -> Vec<u8> {
    let number = |bytes: &[u8], k: usize| u64::from_le_bytes(bytes[8 * k..8 * k + 8].try_into().expect("8 bytes"));
    // The number of blocks says how long the header is.
    let blocks = number(&STANDARD.decode(&data[..12]).expect("base64"), 0) as usize;
    let length = (8 * (3 + blocks)).div_ceil(3) * 4;
    let header = STANDARD.decode(&data[..length]).expect("base64");
    let (mut packed, mut all) = (&STANDARD.decode(&data[length..]).expect("base64")[..], Vec::new());
    for block in 0..blocks {
        let (this, rest) = packed.split_at(number(&header, 3 + block) as usize);
        let mut bytes = Vec::new();
        flate2::read::ZlibDecoder::new(this).read_to_end(&mut bytes).expect("zlib");
        let is_last = block + 1 == blocks && number(&header, 2) > 0;
        assert_eq!(bytes.len() as u64, number(&header, if is_last { 2 } else { 1 }));
        all.extend(bytes);
        packed = rest;
    }
    assert!(packed.is_empty());
    all
}

#[test]
fn arrays_of_vtp_are_in_blocks() {
    for length in [0, 5, 1 << 20, (1 << 20) + 3, 3 << 20] {
        let bytes: Vec<u8> = (0..length).map(|i: usize| ((i * i) >> 7) as u8).collect();
        assert!(inflated(&vtp::deflated(&bytes).expect("deflated")) == bytes, "{length}");
    }
}

#[test]
fn polydata_of_vtk() {
    let measurement = measurement();
    let mut out = Vec::new();
    vtp::write_surface(&mut out, &MeasuredSurface::new(&measurement, &Scale::continuous(1.0)), &names())
        .expect("written");
    let text = String::from_utf8(out).expect("text");
    // Names are numbers, so that no markup of theirs is in the file.
    assert!(!text.contains("<a & ") && text.contains("60 97 32 38 32 34 98 34 62 0\n"), "{text}");
    assert!(text.contains("NumberOfPoints=\"8\" NumberOfVerts=\"0\" NumberOfPolys=\"4\""), "{text}");
    let distances = array(&text, "distance");
    let distances: Vec<f32> = distances.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    // A vertex of part one is buried, two of part two are without data.
    assert_eq!(distances.iter().filter(|d| d.is_nan()).count(), 3);
    assert_eq!(distances.iter().filter(|d| **d == 0.5).count(), 3);
    assert_eq!(array(&text, "offsets"), [3_i64, 6, 9, 12].map(i64::to_le_bytes).as_flattened());
    assert_eq!(array(&text, "class").len(), 8);
    let mut out = Vec::new();
    vtp::write_points(&mut out, &measurement.points, &names()).expect("written");
    let text = String::from_utf8(out).expect("text");
    assert_eq!(array(&text, "class"), [1, 7, 6]);
    assert_eq!(array(&text, "Points").len(), 3 * 24);
    assert!(!text.contains("\"scan"), "{text}");
}

#[test]
fn points_of_several_scans_know_theirs() {
    let parts = ScanParts { paths: vec!["a.ply".into(), "b\n.ply".into()], of_points: vec![0, 1, 1] };
    let points = MeasuredPoints { parts, ..measurement().points };
    let mut out = Vec::new();
    write_points_to(&mut out, &points, &names()).expect("written");
    let end = b"end_header\n";
    let header = out.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    let text = String::from_utf8(out[..header].to_vec()).expect("text");
    assert!(text.contains("comment scan 1: b_.ply\n") && text.contains("property int scalar_scan\n"), "{text}");
    assert_eq!(out.len(), header + 3 * 53);
    assert_eq!(out[header + 2 * 53 + 49..], 1_u32.to_le_bytes());
    let mut out = Vec::new();
    vtp::write_points(&mut out, &points, &names()).expect("written");
    let text = String::from_utf8(out).expect("text");
    assert_eq!(array(&text, "scan"), [0_i32, 1, 1].map(i32::to_le_bytes).as_flattened());
    assert!(text.contains("Name=\"scans\""), "{text}");
}

#[test]
fn parts_of_gltf_are_nodes() {
    let mut out = Vec::new();
    glb::write(&mut out, &MeasuredSurface::new(&measurement(), &Scale::continuous(1.0)), &names()).expect("written");
    let word = |at: usize| u32::from_le_bytes(out[at..at + 4].try_into().expect("4 bytes")) as usize;
    assert_eq!((&out[..4], word(4), word(8), &out[16..20]), (&b"glTF"[..], 2, out.len(), &b"JSON"[..]));
    let (json, binary) = (word(12), word(20 + word(12)));
    assert_eq!((json % 4, binary % 4, 28 + json + binary), (0, 0, out.len()));
    let document: serde_json::Value = serde_json::from_slice(&out[20..20 + json]).expect("JSON");
    let nodes = document["nodes"].as_array().expect("nodes");
    let found: Vec<&str> = nodes.iter().map(|node| node["name"].as_str().expect("a name")).collect();
    assert_eq!(found, ["model", NAMES[0], NAMES[1]]);
    assert_eq!(document["nodes"][0]["translation"], serde_json::json!([0.002, 0.007, -0.002]));
    assert_eq!(document["nodes"][0]["extras"]["unit"], "m");
    // In metres from the middle of the square.
    let accessor = &document["accessors"][0];
    let ends = |name: &str| accessor[name].as_array().expect("three numbers").iter().map(|c| c.as_f64().expect("one"));
    let low: Vec<f32> = ends("min").map(|c| c as f32).collect();
    assert_eq!((low, ends("max").next().map(|c| c as f32)), (vec![-0.002, -0.002, 0.0], Some(0.0)));
    // The colour of what is buried, 84 of 255, in linear light: ((84 / 255 + 0.055) / 1.055)^2.4 = 0.08866.
    let view = &document["bufferViews"][document["accessors"][2]["bufferView"].as_u64().expect("a view") as usize];
    let start = 28 + json + view["byteOffset"].as_u64().expect("a place") as usize;
    let colours = &out[start..start + view["byteLength"].as_u64().expect("a length") as usize];
    let reds: Vec<u16> = colours.chunks_exact(8).map(|c| u16::from_le_bytes([c[0], c[1]])).collect();
    assert!(reds.iter().any(|red| (f64::from(*red) / 65535.0 - 0.08866).abs() < 1e-4), "{reds:?}");
    assert!(colours.chunks_exact(8).all(|c| c[6..] == [255, 255]), "opaque");
}

/// The cells of a table of these tests, in which only the names are in quotation marks.
fn rows(text: &str) -> Vec<Vec<&str>> {
    text.split_terminator("\r\n").map(|row| row.split(',').collect()).collect()
}

#[test]
fn tables_have_a_cell_for_every_head() {
    let measurement = measurement();
    let text = parts::table(&measurement.report);
    let rows = rows(&text);
    assert_eq!(rows.len(), 3);
    assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{text}");
    assert_eq!((rows[1][0], rows[2][0]), ("\"<a & \"\"b\"\">\"", "\"'=lid\n\u{1}\""));
    let cell = |row: usize, head: &str| rows[row][rows[0].iter().position(|h| *h == head).expect("a column")];
    // Seven texels of eight, since one is buried.
    assert_eq!((cell(1, "area_mm2"), cell(1, "signed_mean_mm"), cell(1, "buried_area_mm2")), ("7", "0.5", "1"));
    assert_eq!((cell(2, "coverage"), cell(2, "signed_mean_mm"), cell(2, "verdict")), ("0.5", "-0.25", ""));
}
