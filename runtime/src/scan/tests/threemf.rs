//! 3MF.

use super::*;
use rand::SeedableRng;
use std::io::{Cursor, Write};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

const RELATIONS: (&str, &str) = (
    "_rels/.rels",
    r#"<Relationships><Relationship Target="/3D/3dmodel.model" Id="a" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"#,
);
const MODEL: &str = "3D/3dmodel.model";
const TRIANGLE: &str = r#"<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/></vertices>
<triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh>"#;

fn package(parts: &[(&str, &str)]) -> Vec<u8> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in parts {
        archive.start_file(*name, SimpleFileOptions::default()).unwrap();
        archive.write_all(text.as_bytes()).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

fn model(unit: &str, resources: &str, build: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model {unit} xmlns:p=\"x\"><resources>{resources}</resources><build>{build}</build></model>"
    )
}

fn read_3mf(parts: &[(&str, &str)]) -> Result<(Contents, Scan), String> {
    let (_folder, path) = file("a.3mf", package(parts));
    let scan = read(&path, &ReadOptions::default(), &Silent).map_err(|error| error.to_string())?;
    let opened = Opened::new(&path).unwrap();
    Ok((Contents::read(&path, opened, &ReadOptions::default(), &Silent).unwrap(), scan))
}

#[test]
fn components_are_placed_where_the_build_has_them() {
    let resources = format!(
        r#"<object id="1" name="a &amp; b">{TRIANGLE}</object><object id="2"><components>
        <component objectid="1" transform="0 1 0 -1 0 0 0 0 1 10 0 0"/><component p:path="/3D/other.model" objectid="1"/></components></object>"#
    );
    let items = r#"<item objectid="2" transform="1 0 0 0 1 0 0 0 -1 0 0 5"/><item objectid="1"/>"#;
    let other = model("", &format!(r#"<object id="1">{}</object>"#, TRIANGLE.replace("x=\"1\"", "x=\"3\"")), "");
    let parts = [RELATIONS, (MODEL, &model("unit=\"inch\"", &resources, items)), ("3D/other.model", &other)];
    let (contents, scan) = read_3mf(&parts).unwrap();
    assert_eq!(scan.source.unit, "in");
    let names: Vec<&str> = contents.raw.groups.iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["object 2", "a & b"]);
    let inches = &contents.raw.positions;
    // A quarter of a turn to the left, and the mirror of the item.
    assert_eq!(inches[..3], [[10.0, 0.0, 5.0], [10.0, 1.0, 5.0], [9.0, 0.0, 5.0]]);
    assert_eq!((inches[4], contents.raw.triangles[1]), ([3.0, 0.0, 5.0], [3, 5, 4]));
    assert_eq!((inches[7], contents.raw.triangles[2]), ([1.0, 0.0, 0.0], [6, 7, 8]));
}

#[test]
fn wrong_3mfs_get_a_clear_error() {
    let object = format!(r#"<object id="1">{TRIANGLE}</object>"#);
    let item = r#"<item objectid="1"/>"#;
    let good = model("", &object, item);
    assert!(read_3mf(&[RELATIONS, (MODEL, &good)]).is_ok() && read_3mf(&[(MODEL, &good)]).is_ok());
    let ring = r#"<object id="1"><components><component objectid="2"/></components></object><object id="2"><components><component objectid="1"/></components></object>"#;
    let doubling: String = (2..60)
        .map(|i| {
            format!(
                r#"<object id="{i}"><components>{}</components></object>"#,
                format!(r#"<component objectid="{}"/>"#, i - 1).repeat(2)
            )
        })
        .collect();
    let cases = [
        (model("", ring, item), "components are nested more than 64 times, or it is a part of itself"),
        (model("", &(object.clone() + &doubling), r#"<item objectid="59"/>"#), "repeat objects so often"),
        (model("", &object, ""), "its build has no items"),
        (model("", &object, r#"<item objectid="7"/>"#), "object 7: it is placed, and there is no such object"),
        (
            model("", &object, r#"<item objectid="1" p:path="/3D/no.model"/>"#),
            "`3D/no.model`: the package refers to it",
        ),
        (model("", &object, r#"<item objectid="1" transform="1 2 3"/>"#), "the transform of `item` is not 12 numbers"),
        (model("unit=\"mile\"", &object, item), "its unit is `mile`; expected micron"),
        (good.replace("v3=\"2\"", "v3=\"3\""), "object 1: triangle 1 (counted from 1) names vertex 3, but there are 3"),
        (good.replace("v3=\"2\"", "v3=\"a\""), "object 1: triangle 1 (counted from 1) has no v1, v2 and v3"),
        (good.replace("y=\"1\"", ""), "object 1: vertex 3 (counted from 1) has no x, y and z"),
        (good.replace("<model", "<!DOCTYPE a [<!ENTITY b \"c\">]><model"), "document type"),
        (good.replace("id=\"1\"", "id=\"1\" name=\"&b;\""), "an attribute of `object` is damaged"),
        (good.replace("</model>", ""), "the end of its element `model` is missing"),
        (good.replace("</mesh>", "</mess>"), "byte"),
        (model("", &(object.clone() + &object), item), "there are two objects 1"),
    ];
    for (text, expected) in cases {
        let error = read_3mf(&[RELATIONS, (MODEL, &text)]).err().unwrap_or_else(|| panic!("{expected}"));
        assert!(error.contains(expected), "gave: {error}\n not: {expected}");
    }
    let error = read_3mf(&[("holiday.jpg", "x"), ("scan/b.ply", "ply")]).err().unwrap();
    assert!(error.contains("a ZIP archive without a 3D model, it has `holiday.jpg`, `scan/b.ply`"), "{error}");
    let whole = package(&[RELATIONS, (MODEL, &good)]);
    let error = scan_of("a.3mf", &whole[..whole.len() - 30]).unwrap_err();
    assert!(error.contains("it is damaged or cut off"), "{error}");
}

#[test]
fn mutated_3mfs_and_offs_do_no_harm() {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    let resources = format!(
        r#"<object id="1">{TRIANGLE}</object><object id="2"><components><component objectid="1"/></components></object>"#
    );
    let text = model(
        "unit=\"inch\"",
        &resources,
        r#"<item objectid="2"/><item objectid="1" transform="1 0 0 0 1 0 0 0 -1 0 0 5"/>"#,
    );
    let off = b"COFF\n3 1 0 # c\n0 0 0 10 20 30\n1 0 0 10 20 30\n0 1 0 10 20 30\n3 0 1 2\n";
    let check = |name: &str, bytes: Vec<u8>| {
        if let Ok(contents) = parse(name, bytes) {
            drop(finish(contents.raw, contents.unit, ScanSource::default(), &ReadOptions::default()));
        }
    };
    let whole = package(&[RELATIONS, (MODEL, &text)]);
    for _ in 0..2000 {
        // The archive, and the XML in a good one.
        check("a.3mf", super::mutated(&whole, &mut random));
        let xml = String::from_utf8_lossy(&super::mutated(text.as_bytes(), &mut random)).into_owned();
        check("a.3mf", package(&[RELATIONS, (MODEL, &xml)]));
        check("a.off", super::mutated(off, &mut random));
    }
}
