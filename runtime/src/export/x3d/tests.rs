use super::scan::simplified;
use super::{MetadataGroup, X3dError, X3dScene, write};
use crate::export::colormap::diverging;
use crate::export::scale::Scale;
use crate::mesh::{Group, TriangleMesh};
use crate::model::{Motion, Tessellation, Texels};
use crate::variance::Deviations;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::f64::consts::{PI, TAU};
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

/// A texture of 4 x 2 texels; the first has two hits, the second one outside, the third one inside, the rest none.
fn deviations() -> Deviations {
    let texels = Texels {
        width: 4,
        height: 2,
        index: (0..8).collect(),
        part: vec![0, 0, 0, 0, 1, 1, 1, 1],
        position: vec![[0.0; 3]; 8],
        normal: vec![[0.0, 0.0, 1.0]; 8],
        area: vec![1.0; 8],
        side: vec![1.0; 8],
        part_names: vec!["plate".to_owned(), "other".to_owned()],
    };
    let (mut outward, mut inward) = (vec![f32::NAN; 8], vec![f32::NAN; 8]);
    (outward[0], inward[0], outward[1], inward[2]) = (2.0, 3.0, 0.5, 9.0);
    Deviations::new(texels, 10.0, outward, inward)
}

fn scene<'a>(
    tessellation: &'a Tessellation,
    deviations: &'a Deviations,
    metadata: &'a [MetadataGroup],
) -> X3dScene<'a> {
    X3dScene {
        tessellation,
        deviations,
        scan: &tessellation.mesh,
        scale: Scale::continuous(2.5),
        robust_range: 2.5,
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
    let text = write(&scene(&tessellation, &deviations(), &[])).unwrap();
    // The shaders are files of their own, the tile is regular, and the bytes of textures are the encoder's; the
    // snapshot shows the rest.
    let mut rest = String::new();
    for (i, piece) in text.split("<![CDATA[").enumerate() {
        rest.push_str(if i == 0 { piece } else { piece.split_once("]]>").unwrap().1 });
    }
    for (start, end) in [("DEF='Tile'", "</IndexedTriangleStripSet>"), ("base64,", "\"'")] {
        let mut pieces = rest.split(start);
        let first = pieces.next().unwrap().to_owned();
        rest = pieces.fold(first, |all, piece| all + start + "..." + &piece[piece.find(end).unwrap()..]);
    }
    insta::assert_snapshot!(rest);
}

#[test]
fn every_index_has_a_vertex_with_a_normal_and_texture_coordinates() {
    let tessellation = tessellation();
    let text = write(&scene(&tessellation, &deviations(), &[])).unwrap();
    for i in 0..2 {
        let mesh = text.split(&format!("<IndexedTriangleSet DEF='Mesh{i}'")).nth(1).unwrap();
        let mesh = &mesh[..mesh.find("</IndexedTriangleSet>").unwrap()];
        let count = tuples(attributes(mesh, "Coordinate", "point")[0]);
        let [normals, texcoords] = [("Normal", "vector"), ("TextureCoordinate", "point")];
        let of = |(element, attribute)| tuples(attributes(mesh, element, attribute)[0]);
        assert_eq!((count, of(normals), of(texcoords)), (3, 3, 3));
        let indices = mesh.split(" index='").nth(1).unwrap().split('\'').next().unwrap();
        let indices: Vec<usize> =
            indices.split([' ', ',', '\n']).filter(|t| !t.is_empty()).map(|t| t.parse().unwrap()).collect();
        assert_eq!(indices.len(), 3);
        assert!(indices.iter().all(|&k| k < count));
    }
}

/// The strips of a tile cover each triangle of it: of n segments an edge they have n * n triangles, whose areas in
/// steps, a half each, add up to that of the triangle.
#[test]
fn a_tile_covers_its_triangles() {
    let tessellation = tessellation();
    let text = write(&scene(&tessellation, &deviations(), &[])).unwrap();
    let tile = text.split("DEF='Tile'").nth(1).unwrap();
    let of = |name: &str| tile.split(&format!(" {name}='")).nth(1).unwrap().split('\'').next().unwrap();
    let points: Vec<[i64; 3]> = of("point")
        .split([',', '\n'])
        .map(|p| p.split(' ').map(|c| c.parse().unwrap()).collect::<Vec<_>>().try_into().unwrap())
        .collect();
    let segments: i64 =
        text.split("name='segments' value='").nth(1).unwrap().split('\'').next().unwrap().parse().unwrap();
    let mut doubled = std::collections::BTreeMap::<i64, i64>::new();
    let indices: Vec<i64> = of("index").split_whitespace().map(|i| i.parse().unwrap()).collect();
    for strip in indices.split(|i| *i == -1) {
        for corners in strip.windows(3) {
            let [[t, ai, aj], [_, bi, bj], [_, ci, cj]] = [0, 1, 2].map(|k| points[corners[k] as usize]);
            let area = ((bi - ai) * (cj - aj) - (ci - ai) * (bj - aj)).abs();
            assert_eq!(area, 1);
            *doubled.entry(t).or_default() += area;
        }
    }
    assert_eq!(doubled.len(), 128);
    assert!(doubled.values().all(|area| *area == segments * segments), "{segments}: {doubled:?}");
}

#[test]
fn references_have_definitions() {
    let tessellation = tessellation();
    let text = write(&scene(&tessellation, &deviations(), &[])).unwrap();
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
    let text = write(&scene(&tessellation, &deviations(), &metadata)).unwrap();
    assert!(!text.contains("<Script"));
    assert!(text.contains("value='&quot;\\&quot;1\\\\\\&quot; &#39;&lt;2&gt;&#39;&quot;'"));
    assert!(!text.contains("http"), "nothing is loaded from elsewhere");
}

#[test]
fn shaders_are_complete() {
    let tessellation = tessellation();
    let text = write(&scene(&tessellation, &deviations(), &[])).unwrap();
    assert!(!text.contains("//!"), "every insertion is made");
    let sources: Vec<&str> =
        text.split("<![CDATA[data:text/plain,").skip(1).map(|s| s.split("]]>").next().unwrap()).collect();
    assert_eq!(sources.len(), 7);
    for source in sources {
        // What follows a percent sign is no number in hexadecimal: a viewer may decode it.
        assert!(source.split('%').skip(1).all(|rest| rest.starts_with(' ')));
        assert!(
            source.contains("vec2 deviation(vec3 code, float hits)") || source.contains("modelNormal = castle_Normal")
        );
    }
    assert_eq!(text.matches("data:text/plain,#version 300 es\n").count(), 2);
    // X_ITE is not to compile, and to complain of, what is for the desktop.
    assert_eq!(text.matches("load='false'><![CDATA[").count(), 5);
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
    std::fs::write(&file, write(&scene(&tessellation, &deviations(), &metadata)).unwrap()).unwrap();
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
    let text = write(&scene(&tessellation, &deviations(), &[])).unwrap();
    assert!(
        text.contains("<MetadataDouble name='centre' value='1000000.5 -2999999.5 2000000' containerField='value'/>")
    );
    assert_eq!(
        attributes(text.split("DEF='Mesh0'").nth(1).unwrap(), "Coordinate", "point")[0],
        "-0.5 -0.5 0,0.5 -0.5 0,0.5 0.5 0"
    );
}

#[test]
fn what_viewers_cannot_show_is_refused() {
    let good = tessellation();
    let with = |change: fn(&mut TriangleMesh)| {
        let mut changed = good.clone();
        change(&mut changed.mesh);
        write(&scene(&changed, &deviations(), &[])).unwrap_err()
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
    let mut odd = deviations();
    odd.texels.width = 100;
    assert_eq!(write(&scene(&good, &odd, &[])).unwrap_err(), X3dError::TextureSize { width: 100, height: 2 });
    let mut flat = deviations();
    flat.max_distance = f64::NAN;
    assert!(matches!(write(&scene(&good, &flat, &[])).unwrap_err(), X3dError::Distance { .. }));
}

/// The texture of the deviations and, below it, of the model: the words lead back to positions, texture coordinates and
/// normals, as tile.vert reads them.
#[test]
fn the_texture_holds_the_model() {
    let tessellation = tessellation();
    let text = write(&scene(&tessellation, &deviations(), &[])).unwrap();
    let data = text.split("DEF='Distances'").nth(1).unwrap().split("base64,").nth(1).unwrap();
    let png = STANDARD.decode(&data[..data.find('"').unwrap()]).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
    let mut words = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut words).unwrap();
    let word = |i: usize| [0, 1, 2].map(|k| f64::from(words[3 * i + k]));
    // Steps of 7.5 / 223 mm up to 7.5 mm, and of 2.5 / 32 mm from there: 2, 3, 0.5 and 9 mm.
    let codes = [[59, 89, 192], [15, 0, 128], [0, 242, 64], [0, 0, 0]];
    assert_eq!([0, 1, 2, 3].map(|i| word(i).map(|byte| byte as u8)), codes);
    let field = |name: &str| -> usize {
        text.split(&format!("name='{name}' value='")).nth(1).unwrap().split('\'').next().unwrap().parse().unwrap()
    };
    let (rows, vertices, triangles) = (field("distanceRows"), field("vertexPlane"), field("trianglePlane"));
    let plane = |k: usize, i: usize| word(4 * rows + k * vertices + i);
    let size = [1.0, 1.0, 0.02 * 0.5_f64.sqrt()];
    for (i, position) in tessellation.mesh.positions.iter().enumerate() {
        for k in 0..3 {
            let share = (256.0 * plane(0, i)[k] + plane(1, i)[k]) / 65535.0 - 0.5;
            let expected = (position[k] - [0.5, 0.5, 0.0][k]) / size[k];
            assert!((share - expected).abs() < 1e-5, "{i} {k}: {share}, not {expected}");
        }
        let [st, normal] = [plane(2, i), plane(3, i)];
        for k in 0..2 {
            let coordinate = (256.0 * st[k] + normal[k]) / 65535.0;
            assert!((coordinate - tessellation.mesh.texcoords[i][k]).abs() < 1e-5);
        }
        // (0, 0, 1) is the middle of the octahedron.
        assert!((st[2] - 127.5).abs() < 1.0 && (normal[2] - 127.5).abs() < 1.0);
    }
    let corner = |which: usize, i: usize| word(4 * rows + 4 * vertices + which * triangles + i)[0] as u32;
    for (i, triangle) in tessellation.mesh.triangles.iter().enumerate() {
        assert_eq!([0, 1, 2].map(|which| corner(which, i)), *triangle);
    }
}

#[test]
fn a_fine_scan_is_shown_in_few_triangles() {
    // A sphere of 320,000 triangles.
    let (columns, rows) = (800_u32, 200_u32);
    let mut mesh = TriangleMesh::default();
    for j in 0..=rows {
        for i in 0..columns {
            let (a, b) = (f64::from(i) / f64::from(columns) * TAU, f64::from(j) / f64::from(rows) * PI);
            mesh.positions.push([30.0 * b.sin() * a.cos(), 30.0 * b.sin() * a.sin(), 30.0 * b.cos()]);
        }
    }
    let at = |i: u32, j: u32| j * columns + i % columns;
    for (i, j) in (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))) {
        mesh.triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
        mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
    }
    let shown = simplified(&mesh);
    assert!((8_000..24_000).contains(&shown.triangles.len()), "{}", shown.triangles.len());
    // A mean of points of a cell of 1.5 mm lies within the sphere by less than the cell's diagonal squared over 8
    // radii.
    let depth = |p: &[f64; 3]| 30.0 - p.iter().map(|c| c * c).sum::<f64>().sqrt();
    assert!(shown.positions.iter().all(|p| (-1e-9..0.03).contains(&depth(p))));
    let outward = |t: &&[u32; 3]| {
        let corners = shown.corners(**t);
        shown.triangle_normal(**t).is_some_and(|n| n.dot(corners[0]) > 0.0)
    };
    assert_eq!(shown.triangles.iter().filter(outward).count(), shown.triangles.len());
}
