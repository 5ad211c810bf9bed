//! Reading files, good and bad.

mod data;
mod e57_las;
mod gltf;
mod loaded;
mod lost;
mod meshes;
mod threemf;
mod written;

use super::file::Opened;
use super::prepare::finish;
use super::read::Contents;
use super::*;
use crate::export::mesh::{MeshFormat, write, write_to};
use crate::mesh::Group;
use crate::progress::Silent;
use crate::record::hexadecimal;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Writes `bytes` to a file of that name in a folder of its own.
fn file(name: &str, bytes: impl AsRef<[u8]>) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

fn scan_of(name: &str, bytes: impl AsRef<[u8]>) -> Result<Scan, String> {
    let (_folder, path) = file(name, bytes);
    read(&path, &Unit::Mm.into(), &Silent).map_err(|error| error.to_string())
}

/// What is read of bytes in memory.
fn parse(name: &str, bytes: Vec<u8>) -> Result<Contents, ScanFault> {
    Contents::read(Path::new(name), Opened::in_memory(name, bytes)?, &ReadOptions::default(), &Silent)
}

fn mesh_of(name: &str, bytes: impl AsRef<[u8]>) -> Result<TriangleMesh, String> {
    let (_folder, path) = file(name, bytes);
    read_mesh(&path, Some(Unit::Mm)).map(|reference| reference.mesh).map_err(|error| error.to_string())
}

/// Points and triangles, or the error.
fn counts(name: &str, bytes: impl AsRef<[u8]>) -> (usize, usize) {
    let scan = scan_of(name, bytes).unwrap();
    (scan.source.points, scan.source.triangles)
}

/// Two triangles with everything that a mesh can have; coordinates that single precision does not hold.
fn patch() -> TriangleMesh {
    TriangleMesh {
        positions: vec![[1e6 + 0.1, 0.0, 0.0], [1e6 + 1.1, 0.0, 0.0], [1e6 + 1.1, 1.0, 0.0], [1e6 + 0.1, 1.0, 0.0]],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        texcoords: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        groups: vec![Group { name: "a".into(), start: 0, end: 1 }, Group { name: "b[0]".into(), start: 1, end: 2 }],
    }
}

#[test]
fn written_meshes_are_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = patch();
    let path = folder.path().join("a.obj");
    write(&path, &mesh, MeshFormat::Obj).unwrap();
    assert_eq!(read_mesh(&path, Some(Unit::Mm)).unwrap().mesh, mesh);
    let path = folder.path().join("a.ply");
    write(&path, &mesh, MeshFormat::Ply).unwrap();
    let without_groups = TriangleMesh { groups: Vec::new(), ..mesh.clone() };
    assert_eq!(read_mesh(&path, Some(Unit::Mm)).unwrap().mesh, without_groups);
    let path = folder.path().join("a.stl");
    write(&path, &mesh, MeshFormat::Stl).unwrap();
    let back = read_mesh(&path, Some(Unit::Mm)).unwrap().mesh;
    assert_eq!(back.triangles, mesh.triangles);
    // Single precision has steps of 1/16 there.
    assert!((back.positions[2][0] - mesh.positions[2][0]).abs() < 1.0 / 16.0);
}

#[test]
fn units_scale() {
    let (_folder, path) = file("a.obj", "v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n");
    let scan = read(&path, &Unit::In.into(), &Silent).unwrap();
    assert_eq!(scan.mesh.positions, [[0.0; 3], [25.4, 0.0, 0.0], [0.0, 50.8, 0.0]]);
    assert_eq!((scan.source.unit.as_str(), scan.source.sha256.len()), ("in", 64));
}

#[test]
fn the_digest_is_the_files() {
    // `printf abc | sha256sum`
    let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
    assert_eq!(hexadecimal(Sha256::digest(b"abc")), abc);
}

/// Six vertices, of which two are at one place and two are used by no good triangle; four triangles, of which one has
/// no area, one has a vertex twice and one repeats another.
#[test]
fn cleaning_merges_and_drops() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -0 0\nv 9 9 9\nv 2 0 0\nvn 0 0 3\nvn 0 0 0\n\
        f 1//1 2//1 3//2\nf 2//1 3//2 4//1\nf 1//1 2//1 6//1\nf 1//1 1//1 3//1\n";
    let scan = scan_of("a.obj", obj).unwrap();
    assert_eq!(scan.mesh.positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(scan.mesh.triangles, [[0, 1, 2]]);
    assert_eq!(scan.mesh.normals, [[0.0, 0.0, 1.0]; 3]);
    assert!(scan.oriented);
}

#[test]
fn objs_of_all_kinds() {
    // A byte that is not UTF-8, a continued line, colours, a comment behind a face, an empty material, a line element.
    let latin = b"# caf\xe9\no d\xe9j\xe0\nv 0 0 0 1 0 0\nv 1 0 \\\n 0\r\nv 1 1 0 0.5 0.5 0.5 1\nv 0 1 0\nusemtl\nf -4 -3 -2 -1 # quad\nl 1 2\n";
    assert_eq!(counts("a.obj", latin), (4, 2));
    assert_eq!(counts("a.obj", "\u{feff}v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/ 2/ 3/\n"), (3, 1));
    assert_eq!(counts("cloud.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0 2\np 1\n"), (3, 0));
    let cloud = scan_of("cloud.obj", "v 0 0 0\nvn 0 0 2\nv 1 0 0\nvn 0 0 1\nv 0 3 0 2\nvn 0 0 1\n").unwrap();
    assert_eq!((cloud.mesh.positions[2], cloud.oriented), ([0.0, 1.5, 0.0], true));
    assert_eq!(cloud.mesh.normals, [[0.0, 0.0, 1.0]; 3]);
    let parts = mesh_of("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\ng\ng x y\nf 3 2 1\n").unwrap();
    let names: Vec<&str> = parts.groups.iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["unnamed", "x y"]);
}

/// A U whose fan covers its notch; with texture coordinates that are the corners' places, so that each must go with its
/// own corner. The vertices of the PLY file come after its faces.
#[test]
fn concave_faces_keep_to_their_outline() {
    let outline = [[0, 20], [0, 0], [20, 0], [20, 20], [15, 20], [15, 5], [5, 5], [5, 20]];
    let mut obj = String::from("o u\n");
    let mut ply = String::from(
        "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n\
         element vertex 9\nproperty float x\nproperty float y\nproperty float z\nend_header\n3 1 0 8 6 0 0 0 20 -9 -9\n8",
    );
    for [x, y] in outline {
        obj += &format!("v {x} {y} 0\nvt {x} {y}\nvn 0 0 {}\n", 1 + x + y);
    }
    obj += "v -9 -9 0\nvt -9 -9\nvn 0 0 1\nf 2/2/2 1/1/1 9/9/9\nf";
    for k in 0..8 {
        obj += &format!(" {0}/{0}/{0}", k + 1);
        ply += &format!(" {k}");
    }
    ply += " 16";
    outline.iter().for_each(|[x, y]| ply += &format!(" {x} {y}"));
    ply += "\n";
    outline.iter().chain(&[[-9, -9]]).for_each(|[x, y]| ply += &format!("{x} {y} 0\n"));
    for (name, text) in [("u.obj", &obj), ("u.ply", &ply)] {
        let (_folder, path) = file(name, text);
        let ReferenceMesh { mesh, warnings, .. } = read_mesh(&path, Some(Unit::Mm)).unwrap();
        assert_eq!((mesh.triangles.len(), warnings.len()), (7, 0));
        let area: f64 = mesh.triangles[1..].iter().map(|t| mesh.triangle_area(*t)).sum();
        assert!((area - 250.0).abs() < 1e-9, "{name}: {area}");
        assert!(mesh.triangles[1..].iter().all(|t| mesh.triangle_normal(*t).is_some_and(|n| n.z == 1.0)), "{name}");
        let own = |(p, t): (&[f64; 3], &[f64; 2])| p[..2] == t[..] || name == "u.ply" && p[0] == -9.0;
        assert!(mesh.positions.iter().zip(&mesh.texcoords).all(own), "{name}");
        let scan = read(&path, &Unit::Mm.into(), &Silent).unwrap();
        assert_eq!((scan.source.triangles, scan.warnings.len()), (7, 0));
    }
}

#[test]
fn faces_that_cross_themselves_are_named() {
    let rows = "0 0 0\n2 3 0\n2 0 0\n0 2 0\n";
    let obj: String =
        rows.lines().map(|row| format!("v {row}\n")).collect::<String>() + "f 1 2 3\nf 1 2 3 4\nf 4 3 2 1\n";
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n\
         property list uchar int vertex_indices\nend_header\n{rows}3 0 1 2\n4 0 1 2 3\n"
    );
    for (name, text, place) in [("bow.obj", &obj, "line 6: "), ("bow.ply", &ply, "face 2: ")] {
        let (_folder, path) = file(name, text);
        let scan = read(&path, &Unit::Mm.into(), &Silent).unwrap();
        for warnings in [scan.warnings, read_mesh(&path, Some(Unit::Mm)).unwrap().warnings] {
            // A scan of the first file also lacks the triangles that are there twice.
            let [warning, ..] = &warnings[..] else { panic!("{warnings:?}") };
            assert!(warning.contains(place) && warning.contains("crosses itself"), "{warning}");
            assert_eq!(warning.contains("(1 more like it)"), name == "bow.obj", "{warning}");
        }
    }
}

#[test]
fn corners_that_differ_split_a_vertex_of_a_reference_mesh_only() {
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0\nf 1/1 2/2 3/3\nf 1/4 3/3 4/1\n";
    let mesh = mesh_of("a.obj", obj).unwrap();
    assert_eq!((mesh.positions.len(), mesh.texcoords.len(), mesh.normals.len()), (5, 5, 5));
    assert_eq!(mesh.texcoords[mesh.triangles[1][0] as usize], [0.5, 0.0]);
    assert_eq!(counts("a.obj", obj), (4, 2));
}

#[test]
fn plys_of_all_kinds() {
    let ascii = "ply\r\nformat ascii 1.0\r\ncomment end_header is below\r\nelement vertex 4\r\nproperty short y\r\n\
        property double x\r\nproperty uchar red\r\nproperty float z\r\nelement thing 1\r\nproperty list uchar int a\r\n\
        property float b\r\nelement face 1\r\nproperty list ushort short vertex_index\r\nend_header\r\n\
        0 0.1 9 0\r\n0 1 9 0\r\n1 1 9 0\r\n1 0 9 0\r\n2 5 6 1.5\r\n4 0 1 2 3\r\n";
    let scan = scan_of("a.ply", ascii).unwrap();
    assert_eq!((scan.mesh.positions[0], scan.source.triangles), ([0.1, 0.0, 0.0], 2));
    for big in [false, true] {
        let order = if big { "big" } else { "little" };
        let mut bytes = format!(
            "ply\nformat binary_{order}_endian 1.0\ncomment caf? \nelement vertex 3\nproperty float x\nproperty float y\n\
             property double z\nelement face 1\nproperty list int uint vertex_indices\nproperty uchar flags\nend_header\n"
        )
        .into_bytes();
        *bytes.iter_mut().find(|b| **b == b'?').unwrap() = 0xe9;
        for [x, y, z] in [[0.0_f32, 0.0, 0.5], [1.0, 0.0, 0.5], [0.0, 1.0, 0.5]] {
            bytes.extend(if big { x.to_be_bytes() } else { x.to_le_bytes() });
            bytes.extend(if big { y.to_be_bytes() } else { y.to_le_bytes() });
            bytes.extend(if big { f64::from(z).to_be_bytes() } else { f64::from(z).to_le_bytes() });
        }
        for n in [3_u32, 0, 1, 2] {
            bytes.extend(if big { n.to_be_bytes() } else { n.to_le_bytes() });
        }
        bytes.push(7);
        let scan = scan_of("a.ply", &bytes).unwrap();
        assert_eq!((scan.mesh.positions[1], scan.mesh.triangles[0]), ([1.0, 0.0, 0.5], [0, 1, 2]));
        let error = scan_of("a.ply", &bytes[..bytes.len() - 3]).unwrap_err();
        assert!(error.contains("property `vertex_indices`, element `face`, row 1 of 1: the file ends here"), "{error}");
    }
    let head = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n";
    let rows = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n";
    let strips = format!(
        "{head}element tristrips 1\nproperty list int int vertex_indices\nend_header\n{rows}9 0 1 2 3 -1 2 3 4 -1\n"
    );
    let scan = scan_of("a.ply", strips).unwrap();
    assert_eq!(scan.mesh.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
    assert!(scan.mesh.normals.iter().all(|n| n[2] > 0.99));
    let textured = format!(
        "{head}element face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n{rows}4 0 1 3 2 8 0 0 1 0 1 1 0 1\n"
    );
    assert_eq!(mesh_of("a.ply", textured).unwrap().texcoords, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
}

#[test]
fn stls_of_all_kinds() {
    let facet = |z: f64| {
        format!(
            "facet normal nan 0 0\n OUTER LOOP\nvertex 0 0 {z}\nVertex 1 0 {z}\nvertex 0 1e0 {z}\nendloop\nendfacet\n"
        )
    };
    let two = format!("solid caf\u{e9}\n{}endsolid\n\nSOLID\n{}endsolid\n", facet(1e6 + 0.1), facet(2.0));
    let mesh = mesh_of("a.stl", &two).unwrap();
    assert_eq!((mesh.positions[0][2], mesh.triangles.len()), (1e6 + 0.1, 2));
    assert_eq!(mesh.groups[1].name, "solid 2");
    // As old programs end lines.
    let old = mesh_of("a.stl", two.replace('\n', "\r")).unwrap();
    assert_eq!((old.positions, old.groups), (mesh.positions, mesh.groups));
    let mut binary = Vec::new();
    write_to(&mut binary, &patch(), MeshFormat::Stl).unwrap();
    // Many programs begin the comment of a binary file with `solid`, and some pad the file.
    binary[..11].copy_from_slice(b"solid facet");
    assert_eq!(counts("a.stl", &binary), (4, 2));
    binary[..11].fill(b' ');
    binary.extend([0; 7]);
    assert_eq!(counts("a.stl", &binary), (4, 2));
}

#[test]
fn compressed_files_are_unpacked_once() {
    use std::io::Write;
    let packed = |bytes: &[u8]| {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    };
    let once = packed(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    assert_eq!(counts("a.obj.gz", &once), (3, 1));
    assert_eq!(counts("a.obj", &once), (3, 1));
    let error = scan_of("a.obj.gz", packed(&once)).unwrap_err();
    assert!(error.contains("it holds another compressed file; unpack it once"), "{error}");
}

#[test]
fn bad_files_get_a_clear_error() {
    let ply = |body: &str| format!("ply\nformat ascii 1.0\n{body}");
    let xyz = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
    let cases: Vec<(&str, String, &str)> = vec![
        ("a.ply", String::new(), "the file is empty (0 bytes)"),
        ("a.ply", "hello".into(), "line 1: expected `ply`"),
        ("a.xyz", "1 2 3\n4 5\n".into(), "line 2: expected 3 columns as in line 1, found 2 in `4 5`"),
        ("a.obj", "OFF\n3 1 0\n".into(), "the header counts 3 vertices, the file ends after 0; it is cut off"),
        ("a.bin", "\u{1}\u{2}".into(), "bytes 01 02"),
        ("a.obj", "# nothing\n".into(), "has no vertices"),
        ("a.obj", "v 0 0 0\nv 1 0\n".into(), "line 2: expected `v` and three numbers, found `v 1 0`"),
        (
            "a.obj",
            "v 0 0 0\n\nv 1 x 0\nv 0 1 0\nf 1 2 3\n".into(),
            "line 3: expected `v` and three numbers, found `v 1 x 0`",
        ),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 a\n".into(), "line 5: expected `f` and corners"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n".into(), "line 5 names vertex 4, but there are 3"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2 -3\nv 0 1 0\n".into(), "line 3 names vertex -3, but there are 2"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//2 3//1\n".into(), "line 5 names normal 2"),
        (
            "a.obj",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -9223372036854775808\n".into(),
            "line 4: an index has more than 18 digits",
        ),
        (
            "a.obj",
            "v 0 0 0\nv 7 7 7\nv nan 0 0\nv 0 1 0\nf 1 3 4\n".into(),
            "vertex 3 (counted from 1) is at (NaN, 0, 0)",
        ),
        ("a.obj", "v 0 0 0\nv 1e300 0 0\nv 0 1 0\n".into(), "vertex 2 (counted from 1)"),
        ("a.obj", "v 1 1 1\nv 1e300 0 0\nv 0 1 0\nf 2 1 3\n".into(), "vertex 2 (counted from 1)"),
        ("a.obj", "v 1 1 1\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 2 1 3\n".into(), "vertex 4 (counted from 1)"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n".into(), "none of its 1 triangles has an area"),
        ("a.ply", ply("end_header\n"), "has no vertices"),
        ("a.ply", ply("element vertex 3\n"), "the file ends before `end_header`"),
        (
            "a.ply",
            ply(&format!("{xyz}end_header\n0 0 0\n1 0 0\n0 1\n")),
            "line 11, property `z`, element `vertex`, row 3 of 3: the file ends here",
        ),
        (
            "a.ply",
            ply(&format!("{xyz}end_header\n0 0 0\n1 a 0\n0 1 0\n")),
            "line 9, property `y`, element `vertex`, row 2 of 3: expected a number, found `a`",
        ),
        ("a.ply", ply("element vertex 3\nproperty float x\nproperty float y\nend_header\n1 1\n"), "no property `z`"),
        (
            "a.ply",
            ply(&xyz.replace('3', "99999999999999").replace("float z", "float z\nend_header\n0 0 0")),
            "is cut off",
        ),
        ("a.ply", ply(&format!("element x 99999999999999\n{xyz}end_header\n0 0 0\n")), "no properties"),
        (
            "a.ply",
            ply(&format!("{xyz}{face}3 0 1 3\n")),
            "line 13: face 1 (counted from 1) names vertex 3, but there are 3",
        ),
        ("a.ply", ply(&format!("{xyz}{face}3 0 1 -1\n")), "names vertex -1"),
        (
            "a.ply",
            ply(&format!("{xyz}end_header\n0 0 0\n1 inf 0\n0 1 0\n")),
            "vertex 2 (counted from 1) is at (1, inf, 0)",
        ),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty int64 x\nend_header\n".into(),
            "line 4: expected `property TYPE NAME` or `property list TYPE TYPE NAME` below `element`",
        ),
        ("a.stl", "solid a\nendsolid a\n".into(), "has no vertices"),
        (
            "a.stl",
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\n".into(),
            "line 7: a facet of 3 vertices was expected, this has 2",
        ),
        (
            "a.stl",
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 x\n".into(),
            "line 4: expected `vertex` and three numbers",
        ),
        ("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n".into(), "cut off"),
        ("a.stl", "short".into(), "header of 84 bytes was expected, the file ends after 5"),
        ("a.stl", format!("{}\u{9}\0\0\0..........", " ".repeat(80)), "announces 9 triangles, the file ends after 0"),
    ];
    for (name, text, expected) in cases {
        let error = scan_of(name, &text).unwrap_err();
        assert!(error.contains(expected) && error.contains(name), "{text:?}\n gave: {error}\n not: {expected}");
    }
    let error = mesh_of("a.obj", "v 0 0 0\nv 1 0 0\n").unwrap_err();
    assert!(error.contains("2 vertices but no triangles"), "{error}");
    let folder = tempfile::tempdir().unwrap();
    for (path, expected) in [
        (folder.path().to_owned(), "is a folder, not a file"),
        (folder.path().join("absent.ply"), "no such file"),
        (PathBuf::from("/dev/null"), "is a pipe or a device"),
    ] {
        let error = read(&path, &Unit::Mm.into(), &Silent).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn meshes_in_memory_are_checked_too() {
    let scan = from_mesh(patch(), "patch").unwrap();
    assert_eq!((scan.source.path.as_str(), scan.source.points, scan.noise), ("patch", 4, 0.0));
    let broken = TriangleMesh { triangles: vec![[0, 1, 4]], ..patch() };
    assert!(matches!(from_mesh(broken, "x"), Err(ScanFault::IndexOutOfRange { index: 4, .. })));
    assert!(matches!(from_mesh(TriangleMesh::default(), "x"), Err(ScanFault::NoVertices)));
}

/// A file with some of its bytes changed, removed or inserted.
fn mutated(seed: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    const WORDS: [&[u8]; 8] =
        [b"nan", b"-1", b"99999999999999999999", b"\xff", b"\n", b"f 1 2 3\n", b"\0\0\0\x80", b"1e999"];
    let mut bytes = seed.to_vec();
    for _ in 0..random.random_range(1..4) {
        let at = random.random_range(0..bytes.len());
        match random.random_range(0..5) {
            0 => bytes[at] = random.random(),
            1 => bytes[at] ^= 1 << random.random_range(0..8),
            2 => drop(bytes.drain(at..(at + random.random_range(1..20)).min(bytes.len()))),
            3 => drop(bytes.splice(at..at, WORDS[random.random_range(0..WORDS.len())].iter().copied())),
            _ => bytes.truncate(at),
        }
        if bytes.is_empty() {
            bytes.push(b' ');
        }
    }
    bytes
}

/// Changes, removes, repeats and inserts bytes of small good files: there is a scan or an error, and never a panic, a
/// hang or a huge allocation.
#[test]
fn mutated_files_do_no_harm() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (mut ply, mut stl, mut obj) = (Vec::new(), Vec::new(), Vec::new());
    for (file, format) in [(&mut ply, MeshFormat::Ply), (&mut stl, MeshFormat::Stl), (&mut obj, MeshFormat::Obj)] {
        write_to(file, &patch(), format).unwrap();
    }
    let ascii = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let solid = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
    let seeds = [("a.ply", ply), ("a.stl", stl), ("a.obj", obj), ("a.ply", ascii.to_vec()), ("a.stl", solid.to_vec())];
    let (mut good, mut bad) = (0, 0);
    for round in 0..20_000 {
        let (name, seed) = &seeds[round % seeds.len()];
        let bytes = mutated(seed, &mut random);
        match parse(name, bytes).and_then(|read| finish(read.raw, 1.0, ScanSource::default(), &ReadOptions::default()))
        {
            Ok(scan) => {
                good += 1;
                assert_eq!(scan.mesh.normals.len(), scan.mesh.positions.len());
                assert!(scan.mesh.triangles.iter().flatten().all(|&i| (i as usize) < scan.mesh.positions.len()));
                assert!(scan.mesh.normals.iter().all(|&n| (glam::DVec3::from(n).length() - 1.0).abs() < 1e-9));
            }
            Err(_) => bad += 1,
        }
    }
    assert!(good > 1000 && bad > 1000, "{good} good, {bad} bad");
}

/// The normals of a file are meant; the order of a triangle's vertices may be an accident.
#[test]
fn triangles_that_contradict_the_normals_of_their_file_are_turned() {
    let square = |order: [&str; 2], up: &str| {
        let normals = format!("vn 0 0 {up}\n").repeat(4);
        let corner = |v: &str| format!("{v}//{v}");
        let face = |order: &str| order.split(' ').map(corner).collect::<Vec<_>>().join(" ");
        let faces: String = order.iter().map(|order| format!("f {}\n", face(order))).collect();
        scan_of("a.obj", format!("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n{normals}{faces}")).unwrap()
    };
    for (order, up, turned) in [
        (["1 2 3", "1 3 4"], "1", false),
        (["1 3 2", "1 4 3"], "1", true),
        (["1 2 3", "1 3 4"], "-1", true),
        // They contradict each other: no turn of the whole helps.
        (["1 2 3", "1 4 3"], "1", false),
    ] {
        let scan = square(order, up);
        let said = scan.warnings.iter().filter(|w| w.contains("turned to agree")).count();
        assert_eq!(said, usize::from(turned), "{order:?}, {up}: {:?}", scan.warnings);
        if turned {
            let agrees = |t: &[u32; 3]| scan.mesh.triangle_normal(*t).unwrap().z * scan.mesh.normals[0][2] > 0.0;
            assert!(scan.mesh.triangles.iter().all(agrees));
        }
    }
}
