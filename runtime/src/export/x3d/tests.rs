use super::{MetadataGroup, X3dError, X3dScene, write};
use crate::export::colormap::diverging;
use crate::mesh::{Group, TriangleMesh};
use crate::model::{Motion, Tessellation};
use std::process::Command;

/// A unit square of two triangles in two parts, the second with a name that means to do harm.
fn tessellation() -> Tessellation {
    Tessellation {
        mesh: TriangleMesh {
            positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            normals: vec![[0.0, 0.0, 1.0]; 4],
            texcoords: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            groups: vec![
                Group { name: "plate".into(), start: 0, end: 1 },
                Group { name: "'/><Script url=\"x\\\"/>&\0]]>".into(), start: 1, end: 2 },
            ],
        },
        ..Tessellation::default()
    }
}

fn scene<'a>(tessellation: &'a Tessellation, metadata: &'a [MetadataGroup]) -> X3dScene<'a> {
    X3dScene {
        tessellation,
        texture_png: b"not looked at",
        texture_size: [4, 2],
        max_distance: 10.0,
        colour_range: 2.5,
        turned: Motion::IDENTITY.rotation,
        title: "A <plate> & 'more'",
        metadata,
    }
}

/// Values of all attributes of that name in elements of that name.
fn attributes<'a>(text: &'a str, element: &str, attribute: &str) -> Vec<&'a str> {
    let opening = format!("<{element} ");
    text.match_indices(&opening)
        .filter_map(|(at, _)| {
            let tag = &text[at..at + text[at..].find('>')?];
            let (_, rest) = tag.split_once(&format!(" {attribute}='"))?;
            rest.split('\'').next()
        })
        .collect()
}

fn tuples(list: &str) -> usize {
    list.split([',', '\n']).filter(|t| !t.trim().is_empty()).count()
}

#[test]
fn a_tiny_scene() {
    let tessellation = tessellation();
    let text = write(&scene(&tessellation, &[])).unwrap();
    // The shaders are files of their own; the snapshot shows the rest.
    let mut rest = String::new();
    for (i, piece) in text.split("<![CDATA[").enumerate() {
        rest.push_str(if i == 0 { piece } else { piece.split_once("]]>").unwrap().1 });
    }
    insta::assert_snapshot!(rest);
}

#[test]
fn every_index_has_a_vertex_with_a_normal_and_texture_coordinates() {
    let tessellation = tessellation();
    let text = write(&scene(&tessellation, &[])).unwrap();
    let points = attributes(&text, "Coordinate", "point");
    let normals = attributes(&text, "Normal", "vector");
    let texcoords = attributes(&text, "TextureCoordinate", "point");
    let indices: Vec<&str> =
        text.match_indices(" index='").map(|(at, m)| text[at + m.len()..].split('\'').next().unwrap()).collect();
    assert_eq!((points.len(), normals.len(), texcoords.len(), indices.len()), (2, 2, 2, 2));
    for i in 0..2 {
        let count = tuples(points[i]);
        assert_eq!((count, tuples(normals[i]), tuples(texcoords[i])), (3, 3, 3));
        let indices: Vec<usize> =
            indices[i].split([' ', ',', '\n']).filter(|t| !t.is_empty()).map(|t| t.parse().unwrap()).collect();
        assert_eq!(indices.len(), 3);
        assert!(indices.iter().all(|&k| k < count));
    }
}

#[test]
fn references_have_definitions() {
    let tessellation = tessellation();
    let text = write(&scene(&tessellation, &[])).unwrap();
    let of = |attribute: &str| -> Vec<&str> {
        text.match_indices(&format!(" {attribute}='"))
            .map(|(at, m)| text[at + m.len()..].split('\'').next().unwrap())
            .collect()
    };
    let mut defined = of("DEF");
    for used in of("USE").into_iter().chain(of("fromNode")).chain(of("toNode")) {
        assert!(defined.contains(&used), "{used}");
    }
    let count = defined.len();
    defined.sort_unstable();
    defined.dedup();
    assert_eq!(defined.len(), count, "no name twice");
}

#[test]
fn names_do_no_harm() {
    let tessellation = tessellation();
    let metadata = [MetadataGroup { name: "\"<a>".into(), entries: vec![("b&c".into(), "\"1\\\" '<2>'".into())] }];
    let text = write(&scene(&tessellation, &metadata)).unwrap();
    assert!(!text.contains("<Script"));
    assert!(text.contains("value='&quot;\\&quot;1\\\\\\&quot; &#39;&lt;2&gt;&#39;&quot;'"));
    assert!(!text.contains("http"), "nothing is loaded from elsewhere");
}

#[test]
fn shaders_are_complete() {
    let tessellation = tessellation();
    let text = write(&scene(&tessellation, &[])).unwrap();
    assert!(!text.contains("//!"), "every insertion is made");
    let sources: Vec<&str> =
        text.split("<![CDATA[data:text/plain,").skip(1).map(|s| s.split("]]>").next().unwrap()).collect();
    assert_eq!(sources.len(), 7);
    for source in sources {
        assert!(!source.contains('%'), "a viewer may decode percent signs in data URIs");
        assert!(source.contains("vec2 deviation(vec3 code)") || source.contains("modelNormal = castle_Normal"));
    }
    assert_eq!(text.matches("data:text/plain,#version 300 es\n").count(), 2);
    let end = |x: f64| diverging(x).map(|c| format!("{:.4}", f64::from(c) / 255.0)).join(", ");
    assert!(text.contains(&format!("vec3 c = vec3({});", end(-1.0))));
    assert!(text.contains(&format!("c = mix(c, vec3({}), clamp(t - 15.0, 0.0, 1.0));", end(1.0))));
}

#[test]
fn the_output_is_valid_x3d() {
    let Ok(data) = std::env::var("GMLC_TEST_DATA") else {
        println!("skipped: GMLC_TEST_DATA is not set");
        return;
    };
    if Command::new("xmllint").arg("--version").output().is_err() {
        println!("skipped: xmllint is not installed (Debian package libxml2-utils)");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.x3d");
    let tessellation = tessellation();
    let metadata = [MetadataGroup { name: "\"<a>".into(), entries: vec![("b&c".into(), "\"1\"".into())] }];
    std::fs::write(&file, write(&scene(&tessellation, &metadata)).unwrap()).unwrap();
    let schema = std::path::Path::new(&data).join("schema/x3d-4.0.xsd");
    let output =
        Command::new("xmllint").args(["--nonet", "--noout", "--schema"]).arg(schema).arg(&file).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn large_coordinates_keep_their_digits() {
    let mut tessellation = tessellation();
    for p in &mut tessellation.mesh.positions {
        *p = [p[0] + 1e6, p[1] - 3e6, p[2] + 2e6];
    }
    let text = write(&scene(&tessellation, &[])).unwrap();
    assert!(text.contains("translation='1000000.5 2000000 2999999.5'>"));
    assert_eq!(attributes(&text, "Coordinate", "point")[0], "-0.5 -0.5 0,0.5 -0.5 0,0.5 0.5 0");
}

#[test]
fn what_viewers_cannot_show_is_refused() {
    let good = tessellation();
    let with = |change: fn(&mut TriangleMesh)| {
        let mut changed = good.clone();
        change(&mut changed.mesh);
        write(&scene(&changed, &[])).unwrap_err()
    };
    let mesh = |change: fn(&mut TriangleMesh), fault: &str| {
        let error = with(change).to_string();
        assert!(error.contains(fault), "{error}, not: {fault}");
    };
    mesh(|m| m.triangles.clear(), "no triangles");
    mesh(|m| m.triangles[1][2] = 4, "triangle 1 refers to a vertex");
    mesh(|m| m.positions[3][1] = f64::NAN, "vertex 3 has a coordinate");
    mesh(|m| m.groups[1].end = 3, "Script url=\"x\\\"/>&\0]]> refers to triangles");
    mesh(|m| m.normals.clear(), "4 positions, 0 normals and 4 texture coordinates");
    let odd = X3dScene { texture_size: [100, 128], ..scene(&good, &[]) };
    assert_eq!(write(&odd).unwrap_err(), X3dError::TextureSize { width: 100, height: 128 });
    let flat = X3dScene { max_distance: f64::NAN, ..scene(&good, &[]) };
    assert!(matches!(write(&flat).unwrap_err(), X3dError::Distance { .. }));
}
