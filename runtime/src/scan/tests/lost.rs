//! Files of which a part is missing, or whose header tells something else than the file.

use super::*;

/// An ASCII PLY of three vertices and one face, with other counts and rows.
fn ply(vertices: usize, faces: usize, rows: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n{rows}"
    )
}

const ROWS: &str = "0 0 0\n1 0 0\n0 1 0\n";

#[test]
fn headers_that_count_something_else_are_refused() {
    let faces = format!("{ROWS}3 0 1 2\n3 0 2 1\n");
    let again = ply(3, 1, &format!("{ROWS}3 0 1 2\n"));
    let of = |from: &str, to: &str| again.replacen(from, to, 1);
    let cases = [
        (ply(3, 1, &faces), "line 14: `3 0 2 1` follows the last row of `face`: the header counts fewer rows"),
        (ply(3, 3, &faces), "line 15, property `vertex_indices`, element `face`, row 3 of 3: the file ends here"),
        (ply(2, 1, &faces), "line 12, element `face`, row 1 of 1: more numbers than the properties"),
        (ply(4, 1, &faces), "line 13, element `vertex`, row 4 of 4: more numbers than the properties"),
        (ply(3, 1, "0 0 0\n1 0\n0 1 0\n3 0 1 2\n"), "line 11, element `vertex`, row 2 of 3: fewer numbers"),
        (ply(3, 1, "0 0 0 9\n1 0 0 9\n0 1 0 9\n3 0 1 2\n"), "more numbers than the properties in the header: `9` is"),
        (
            ply(3, 1, &format!("{ROWS}3 0 1 1.5\n")),
            "property `vertex_indices`, element `face`, row 1 of 1: expected a whole",
        ),
        (
            of("property float y", "property uchar y").replace("0 1 0", "0 300 0"),
            "line 12, property `y`, element `vertex`, row 3 of 3: expected a whole number from 0 to 255 by its type",
        ),
        (of("element face", "element vertex"), "line 7: element `vertex` is declared twice, first in line 3"),
        (of("float y", "float x"), "line 5: property `x` is declared twice, first in line 4"),
        (of("ascii 1.0", "ascii 9.0"), "line 2: expected version 1.0 of the format"),
        (
            of("element face", "elment face"),
            "line 7: expected `format`, `element`, `property`, `comment` or `obj_info`",
        ),
        (of("vertex_indices", "corners"), "element `face` has no list `vertex_indices` or `vertex_index`"),
    ];
    for (text, expected) in cases {
        let error = scan_of("a.ply", &text).unwrap_err();
        assert!(error.contains(expected), "{text}\n gave: {error}\n not: {expected}");
    }
}

#[test]
fn binary_files_hold_what_their_header_counts() {
    let (mut stl, mut ply) = (Vec::new(), Vec::new());
    write_to(&mut stl, &patch(), MeshFormat::Stl).unwrap();
    write_to(&mut ply, &patch(), MeshFormat::Ply).unwrap();
    let recounted = |bytes: &[u8], count: u8| [&bytes[..80], &[count, 0, 0, 0], &bytes[84..]].concat();
    for (count, expected) in [
        (0, "announces 0 triangles, and 2 more follow at byte 84"),
        (1, "announces 1 triangles, and 1 more follow at byte 134"),
        (3, "announces 3 triangles, the file ends after 2"),
    ] {
        let error = scan_of("a.stl", recounted(&stl, count)).unwrap_err();
        assert!(error.contains(expected), "{count}: {error}");
    }
    // Padding and texts behind the last triangle are no triangles.
    for rest in [[0; 200].as_slice(), &b"Made by a program that says so. ".repeat(5)] {
        let scan = scan_of("a.stl", [&stl, rest].concat()).unwrap();
        assert_eq!((scan.source.points, scan.source.triangles), (4, 2));
        let expected = format!("{} bytes behind the last triangle", rest.len());
        assert!(scan.warnings.len() == 1 && scan.warnings[0].contains(&expected), "{:?}", scan.warnings);
    }
    let text = String::from_utf8_lossy(&ply).into_owned();
    let count = text.find("element face 2").unwrap() + "element face ".len();
    ply[count] = b'1';
    let error = scan_of("a.ply", &ply).unwrap_err();
    assert!(error.contains("bytes follow the last row of `face`: the header counts fewer rows"), "{error}");
    ply[count] = b'2';
    assert_eq!(counts("a.ply", [&ply, [0; 40].as_slice()].concat()), (4, 2));
}

#[test]
fn objs_that_are_cut_off_are_refused_or_say_so() {
    let mesh = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
    for (text, expected) in [
        (&mesh[..mesh.len() - 3], "line 6: the file ends within `f 1 3`; it is cut off"),
        (&mesh[..mesh.len() - 7], "line 6: the file ends within `f`"),
        (&mesh[..mesh.find("f 1").unwrap() - 3], "line 4: the file ends within `v 0 1`"),
        (&format!("{mesh}vn 0 0 1\nf 1//1 2//1 3/"), "line 8: the file ends within `f 1//1 2//1 3/`"),
    ] {
        let error = scan_of("a.obj", text).unwrap_err();
        assert!(error.contains(expected), "{text}\n gave: {error}");
    }
    let warned = |text: &str| scan_of("a.obj", text).unwrap().warnings;
    assert_eq!(warned(mesh), [""; 0]);
    assert_eq!(warned(mesh.trim_end()), [""; 0]);
    let cloud = &mesh[..mesh.find('f').unwrap()];
    assert_eq!(warned(cloud), [""; 0]);
    for (text, expected) in [
        (&mesh[..mesh.find("f 1 3").unwrap()], "1 of its 4 vertices belong to no face and are left out"),
        (&format!("{mesh}f 1 2\nl 1 2\nf 1\n"), "line 7: a face of fewer than three corners is left out (1 more"),
        (cloud.trim_end(), "it is read as a cloud of points: it has no faces, though its last line has no end"),
        (&format!("vt 0 0\n{cloud}"), "though it has `vt`, which faces use; if the file was cut off"),
        (
            &format!("{mesh}v 1 1 1 2\nv 2 2 2 .5 # 1\nf 1 2 5\nf 1 2 6\n"),
            "line 7: a vertex has the weight 2, by which",
        ),
        (
            &format!("{mesh}face 1 2\nsurface\n"),
            "line 7: `face 1 2` is no statement of the format and is left out (1 more",
        ),
        (&format!("{mesh}\0\0\0"), "line 7: zero bytes, as of a file that was not written to its end, are left out"),
        (
            &format!("{mesh}f 1 1 2\nf 2 3 1\n"),
            "of its 4 triangles, 1 without area and 1 that are there twice are left out",
        ),
        (&format!("# Vertices: 9\n{mesh}"), "its comments announce 9 vertices, and 4 are there"),
        (&format!("{mesh}# 3 faces\n"), "its comments announce 3 faces, and 2 are there"),
    ] {
        let warnings = warned(text);
        assert!(warnings.len() == 1 && warnings[0].contains(expected), "{text}\n gave: {warnings:?}");
    }
}

#[test]
fn faces_of_a_ply_without_triangles_are_counted() {
    let warnings = scan_of("a.ply", ply(3, 4, &format!("{ROWS}3 0 1 2\n2 0 1\n0\n1 2\n"))).unwrap().warnings;
    assert!(warnings.len() == 1, "{warnings:?}");
    assert!(warnings[0].contains("face 2 (counted from 1): fewer than three corners, it is left out (2 more"));
}

#[test]
fn polygons_that_go_round_in_themselves_are_refused() {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let rounds = |count: usize| format!("{square}f {}\n", "1 2 3 4 ".repeat(count));
    let error = scan_of("a.obj", rounds(500)).unwrap_err();
    assert!(error.contains("line 5: a face has 2000 corners on few vertices"), "{error}");
    assert!(scan_of("a.obj", rounds(1)).unwrap().warnings.is_empty());
}

#[test]
fn other_files_under_the_name_of_a_scan_are_named() {
    for (bytes, expected) in [
        (b"<!DOCTYPE html>\n<html>v 1 2 3".as_slice(), "found an HTML page; download the file again"),
        (b"\n <HTML lang=en>", "found an HTML page"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 9\n", "`git lfs pull` fetches that"),
        (b"/annex/objects/SHA256E-s9--1.ply\n", "`git annex get` fetches that"),
        (b"\xff\xfev\0 \x001\0", "found a text in UTF-16; save it as UTF-8"),
        (b"{\"name\": {}}", "found a JSON file; convert it"),
    ] {
        for name in ["a.obj", "a.ply", "a.stl"] {
            let error = scan_of(name, bytes).unwrap_err();
            assert!(error.contains(expected), "{name}: {error}");
        }
    }
}

/// What is read of a long text that is no scan is cut to a line of bearable length.
#[test]
fn messages_quote_little() {
    let long = "x".repeat(100_000);
    for (name, text) in [
        ("a.obj", format!("v 0 0 {long}\n")),
        ("a.obj", format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {}\n", "7".repeat(100_000))),
        ("a.ply", ply(3, 1, &long)),
        ("a.ply", ply(3, 1, ROWS).replace("float y", &long)),
        ("a.ply", ply(3, 1, ROWS).replacen(" y\n", &format!(" {long}\n"), 1)),
        ("a.ply", ply(1, 0, &format!("0 0 0 {long}\n"))),
        ("a.stl", format!("solid a\nfacet normal 0 0 1\n{long}\n")),
        ("a.stl", format!("solid a\nfacet normal 0 0 1\nvertex 1 2 {long}\n")),
        ("a.xyz", long.clone()),
    ] {
        let error = scan_of(name, text).unwrap_err();
        assert!(error.len() < 600, "{name}: {} bytes", error.len());
    }
}

/// Lines that are continued many times cost their length, and not its square.
#[test]
fn continued_lines_are_read_at_once() {
    let obj = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 {}\n", "\\\n1 ".repeat(400_000));
    let begun = std::time::Instant::now();
    let error = parse("a.obj", obj.into_bytes()).err().unwrap().to_string();
    assert!(error.contains("line 4: a face has 400003 corners on few vertices"), "{error}");
    assert!(begun.elapsed().as_secs() < 5, "{:?}", begun.elapsed());
}
