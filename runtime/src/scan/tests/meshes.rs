//! OFF, colours and grids of PLY, colours of OBJ, and what the writers of meshes write.

use super::*;
use crate::export::scan::{Recorded, ScanFormat, write as write_scan};
use rand::{RngExt, SeedableRng};

/// Writes a mesh with colours in a format and a unit; returns what is read of it.
fn written(mesh: &TriangleMesh, colours: &[[u8; 3]], format: ScanFormat, unit: Unit) -> (Contents, Scan) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    let attributes = Attributes { colours: colours.to_vec(), ..Attributes::default() };
    write_scan(&path, &Recorded { mesh, attributes: &attributes, grids: &[], unit }, format).unwrap();
    let options = ReadOptions { unit: (format == ScanFormat::Off).then_some(unit), ..ReadOptions::default() };
    let contents = Contents::read(&path, Opened::new(&path).unwrap(), &options, &Silent).unwrap();
    (contents, read(&path, &options, &Silent).unwrap())
}

#[test]
fn written_scans_are_read_back() {
    let (mesh, colours) = (patch(), [[0, 1, 2], [3, 100, 200], [253, 254, 255], [10, 20, 30]]);
    let (_, off) = written(&mesh, &colours, ScanFormat::Off, Unit::Mm);
    assert_eq!((&off.mesh.positions, &off.mesh.triangles), (&mesh.positions, &mesh.triangles));
    assert_eq!((&off.mesh.normals, &off.attributes.colours[..]), (&mesh.normals, &colours[..]));
    for (format, unit) in [(ScanFormat::Glb, "m"), (ScanFormat::ThreeMf, "in")] {
        let (contents, scan) = written(&mesh, &colours, format, Unit::In);
        assert_eq!((scan.source.unit.as_str(), &scan.mesh.triangles), (unit, &mesh.triangles));
        let names: Vec<&str> = contents.raw.groups.iter().map(|group| group.name.as_str()).collect();
        assert_eq!(names, ["a", "b[0]"]);
        // Units are divided and multiplied by; single precision is of the distance from the middle, below 1 mm.
        let off = |(a, b): (&[f64; 3], &[f64; 3])| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-6);
        assert!(!scan.mesh.positions.iter().zip(&mesh.positions).any(off), "{:?}", scan.mesh.positions);
        assert!(format == ScanFormat::ThreeMf || scan.attributes.colours == colours);
    }
    let points = TriangleMesh { triangles: Vec::new(), groups: Vec::new(), ..mesh };
    let (attributes, folder) = (Attributes::default(), tempfile::tempdir().unwrap());
    let recorded = Recorded { mesh: &points, attributes: &attributes, grids: &[], unit: Unit::Mm };
    let error = write_scan(&folder.path().join("a.3mf"), &recorded, ScanFormat::ThreeMf).unwrap_err();
    assert!(error.to_string().contains("triangles only"), "{error}");
}

#[test]
fn every_colour_survives_the_linear_ones_of_gltf() {
    let positions: Vec<[f64; 3]> = (0..256).map(|i| [f64::from(i), f64::from(i * i % 7), 5.0]).collect();
    let colours: Vec<[u8; 3]> = (0..=255).map(|i| [i, 255 - i, i / 2]).collect();
    let mesh = TriangleMesh { positions, ..TriangleMesh::default() };
    assert_eq!(written(&mesh, &colours, ScanFormat::Glb, Unit::Mm).1.attributes.colours, colours);
}

#[test]
fn offs_of_all_kinds() {
    let rows = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"];
    let file = |head: &str, before: &str, behind: &str, faces: &str| {
        let rows: Vec<String> = rows.iter().map(|row| format!("{row}{before}{behind}\n")).collect();
        format!("{head}{}{faces}", rows.concat())
    };
    let quad = "4 0 1 2 3\n";
    assert_eq!(counts("a.off", file("OFF\n4 1 4\n", "", "", quad)), (4, 2));
    assert_eq!(counts("a", file("# a comment\r\n\r\noff 4 1\r\n", "", " # here", "4 0 1 2 3 0.5 0.5 0.5\n")), (4, 2));
    assert_eq!(counts("a.off", file("4OFF\n4 1 4\n", " 2", "", quad)), (4, 2));
    assert_eq!(scan_of("a.off", file("4OFF\n4 1 4\n", " 2", "", quad)).unwrap().mesh.positions[2], [0.5, 0.5, 0.0]);
    let scan = scan_of("a.off", file("NOFF\n4 1 4\n", " 0 0 -2", "", quad)).unwrap();
    assert_eq!((scan.mesh.normals[0], scan.warnings.len()), ([0.0, 0.0, -1.0], 1));
    for (head, before, behind, colour) in [
        ("COFF\n4 1 4\n", "", " 10 20 30 255", [10, 20, 30]),
        ("COFF\n4 1 4\n", "", " 1 0 0 255", [1, 0, 0]),
        ("COFF\n4 1 4\n", "", " 0.2 1 0", [51, 255, 0]),
        ("CNOFF\n4 1 4\n", " 0 0 1", " 10 20 30", [10, 20, 30]),
        ("NCOFF\n4 1 4\n", " 0 0 1", " 10 20 30 255", [10, 20, 30]),
        ("STCN4OFF\n4 1 4\n", " 1 0 0 1", " 10 20 30 255 0.5 0.25", [10, 20, 30]),
    ] {
        let scan = scan_of("a.off", file(head, before, behind, quad)).unwrap();
        assert_eq!(scan.attributes.colours, [colour; 4], "{head}");
    }
    let textured = mesh_of("a.off", file("STOFF\n4 1 4\n", "", " 0.5 0.25", quad)).unwrap();
    assert_eq!(textured.texcoords, [[0.5, 0.25]; 4]);
    let mut binary = b"COFF BINARY\n".to_vec();
    let whole = |numbers: &[i32]| numbers.iter().flat_map(|n| n.to_be_bytes()).collect::<Vec<u8>>();
    binary.extend(whole(&[3, 1, 0]));
    for [x, y, z] in [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
        binary.extend([x, y, z, 1.0, 0.0, 0.2, 1.0].iter().flat_map(|n| n.to_be_bytes()));
    }
    binary.extend(whole(&[3, 0, 1, 2, 1, 0]));
    let scan = scan_of("a.off", &binary).unwrap();
    assert_eq!((scan.mesh.triangles.as_slice(), scan.attributes.colours[0]), (&[[0, 1, 2]][..], [255, 0, 51]));
    let error = scan_of("a.off", &binary[..binary.len() - 6]).unwrap_err();
    assert!(error.contains("ends within the faces; it is cut off"), "{error}");
    for (text, expected) in [
        ("OFF\n", "line 1: expected the numbers of vertices, faces and edges, the file ends"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n", "counts 3 vertices, the file ends after 2; it is cut off"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n", "counts 1 faces, the file ends after 0; it is cut off"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 2 1 0\n", "line 7: `3 2 1 0` follows the last"),
        ("OFF\n3 1 0\n0 0 0 255 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "line 3: a vertex of `OFF` has 3 numbers on a line"),
        ("OFF\n3 1 0\n0 0 x\n1 0 0\n0 1 0\n3 0 1 2\n", "line 3: expected a number, found `x`"),
        (
            "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n",
            "line 6: face 1 (counted from 1) names vertex 3, but there are 3",
        ),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n", "line 6: a face is its number of corners"),
        ("nOFF\n3\n3 1 0\n", "points of any dimension"),
        ("OFF\n0 0 0\n", "has no vertices"),
    ] {
        let error = scan_of("a.off", text).unwrap_err();
        assert!(error.contains(expected), "{text:?}\n gave: {error}\n not: {expected}");
    }
}

#[test]
fn colours_and_intensities_of_plys() {
    let ply = |properties: &str, row: &str| {
        let properties: String = properties.lines().map(|p| format!("property {p}\n")).collect();
        let rows: String = (0..3).map(|i| format!("{} {} 0 {row}\n", i % 2, i / 2)).collect();
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{properties}end_header\n{rows}"
        );
        scan_of("a.ply", text).unwrap().attributes
    };
    for (properties, row, colour, intensity) in [
        ("uchar red\nuchar green\nuchar blue", "1 2 255", Some([1, 2, 255]), None),
        ("uchar diffuse_red\nuchar diffuse_green\nuchar diffuse_blue", "1 2 255", Some([1, 2, 255]), None),
        ("ushort r\nushort g\nushort b\nfloat scalar_Intensity", "65535 257 0 0.25", Some([255, 1, 0]), Some(0.25)),
        ("float red\nfloat green\nfloat blue\nushort intensity", "1 0.2 nan 900", Some([255, 51, 0]), Some(900.0)),
        ("float blue\nfloat green\nfloat red", "1 2 255", Some([255, 2, 1]), None),
        ("uchar red\nuchar green", "1 2", None, None),
        ("double reflectance", "-7.5", None, Some(-7.5)),
    ] {
        let found = ply(properties, row);
        assert_eq!(found.colours, colour.map_or(Vec::new(), |colour| vec![colour; 3]), "{properties}");
        assert_eq!(found.intensities, intensity.map_or(Vec::new(), |value| vec![value; 3]), "{properties}");
    }
}

/// Rows of one size are read in another way than others and text: all give the same.
#[test]
fn plys_of_all_encodings_agree() {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(6);
    let vertices: Vec<[f32; 7]> = (0..60).map(|_| std::array::from_fn(|_| random.random_range(0.0..1.0))).collect();
    let faces: Vec<Vec<u32>> =
        (0..90).map(|i| (0..[3, 3, 3, 4, 5, 2][i % 6]).map(|_| random.random_range(0..60)).collect()).collect();
    let file = |format: &str, extra: bool| {
        let lists = if extra { "property list uchar float other\n" } else { "" };
        let mut file = format!("ply\nformat {format} 1.0\nelement vertex 60\n").into_bytes();
        for name in ["x", "y", "z", "nx", "ny", "nz", "intensity"] {
            file.extend(format!("property float {name}\n").bytes());
        }
        file.extend(format!("{lists}element face 90\nproperty ushort flags\n{}", "").bytes());
        file.extend(
            format!("property list uchar int vertex_indices\nproperty uchar more\n{lists}end_header\n").bytes(),
        );
        let ordered = |bytes: &mut [u8]| {
            if format.contains("big") {
                bytes.reverse()
            }
        };
        let text = format == "ascii";
        for row in &vertices {
            for number in row {
                let mut bytes = number.to_le_bytes();
                ordered(&mut bytes);
                if text { file.extend(format!("{number} ").bytes()) } else { file.extend(bytes) }
            }
            file.extend(if extra { &b"\0"[..] } else { b"" });
            file.extend(if text { &b"\n"[..] } else { b"" });
        }
        for face in &faces {
            if text {
                let corners: String = face.iter().map(|c| format!("{c} ")).collect();
                file.extend(format!("9 {} {corners} 7\n", face.len()).bytes());
                continue;
            }
            let mut flags = 9_u16.to_le_bytes();
            ordered(&mut flags);
            file.extend(flags);
            file.push(face.len() as u8);
            for corner in face {
                let mut bytes = corner.to_le_bytes();
                ordered(&mut bytes);
                file.extend(bytes);
            }
            file.extend(if extra { &[7, 0][..] } else { &[7] });
        }
        file
    };
    let expected = parse("a.ply", file("ascii", false)).unwrap();
    for (format, extra) in [
        ("binary_little_endian", false),
        ("binary_big_endian", false),
        ("binary_little_endian", true),
        ("binary_big_endian", true),
    ] {
        let found = parse("a.ply", file(format, extra)).unwrap();
        assert_eq!(found.raw.positions, expected.raw.positions);
        assert_eq!(found.raw.normals, expected.raw.normals);
        assert_eq!(found.raw.attributes, expected.raw.attributes);
        assert_eq!(found.raw.triangles, expected.raw.triangles);
        assert_eq!(found.warnings, expected.warnings);
        let whole = file(format, extra);
        let error = |bytes: Vec<u8>| parse("a.ply", bytes).err().unwrap().to_string();
        let cut = error(whole[..whole.len() - 5].to_vec());
        assert!(cut.contains("element `face`, row 90 of 90: the file ends here"), "{cut}");
        let cut = error(whole[..whole.len() / 2].to_vec());
        assert!(cut.contains("the file ends here; it is cut off"), "{cut}");
        // The least and the most significant bytes of the last corner but one of the last face.
        let mut wrong = whole.clone();
        let last = whole.len() - if extra { 2 } else { 1 };
        wrong[last - 8..last - 4].fill(0x80);
        assert!(error(wrong).contains("face 90 (counted from 1) names vertex -"));
    }
}

#[test]
fn range_grids_of_plys_are_triangulated_without_steps() {
    // Three rows of four cells, one empty; the last row's right half is far behind, and one vertex is in no cell.
    let text = "ply\nformat ascii 1.0\nobj_info num_cols 4\nobj_info num_rows 3\nelement vertex 12\nproperty float x\n\
        property float y\nproperty float z\nelement range_grid 12\nproperty list uchar int vertex_indices\nend_header\n\
        0 2 0\n1 2 0\n2 2 0\n3 2 0\n0 1 0\n1 1 0\n2 1 0\n0 0 0\n1 0 0\n2 0 -90\n3 0 -90\n9 9 9\n\
        1 0\n1 1\n1 2\n1 3\n1 4\n1 5\n1 6\n0\n1 7\n1 8\n1 9\n1 10\n";
    let scan = scan_of("a.ply", text).unwrap();
    // Two full squares above, and half of one; one below, and half of the next.
    assert_eq!((scan.source.triangles, scan.source.cleaning.unused), (2 + 2 + 1 + 2 + 1, 3));
    assert!(scan.mesh.triangles.iter().all(|t| scan.mesh.triangle_normal(*t).unwrap().z > 0.99));
    let points = scan_of("a.ply", text.replace("num_rows 3", "num_rows 4")).unwrap();
    assert_eq!((points.source.triangles, points.source.points), (0, 12));
    assert!(points.warnings[0].contains("read as points"), "{:?}", points.warnings);
    let error = scan_of("a.ply", text.replace("1 10\n", "2 10 9\n")).unwrap_err();
    assert!(error.contains("a cell has one vertex or none, this has 2"), "{error}");
}

#[test]
fn colours_of_objs() {
    let mesh = "v 9 9 9 0 0 0\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 0.2\nf 4 -3 -2\n";
    let scan = scan_of("a.obj", mesh).unwrap();
    assert_eq!(scan.attributes.colours, [[0, 0, 51], [255, 0, 0], [0, 255, 0]]);
    let cloud = scan_of("a.obj", "v 0 0 0 255 0 7\nv 1 0 0 0 1 0\n").unwrap();
    assert_eq!(cloud.attributes.colours, [[255, 0, 7], [0, 1, 0]]);
    let some = scan_of("a.obj", "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n").unwrap();
    assert!(some.attributes.colours.is_empty() && some.warnings[0].contains("others none"), "{:?}", some.warnings);
}

#[test]
fn names_of_ply_properties_may_be_in_capitals() {
    let rows = "end_header\n1 2 3 0 0 1\n4 5 6 0 1 0\n";
    let head = "ply\nformat ascii 1.0\nelement vertex 2\n";
    let names = ["X", "Y", "Z", "NX", "NY", "NZ"].map(|name| format!("property float {name}\n")).concat();
    let scan = scan_of("a.ply", format!("{head}{names}{rows}")).unwrap();
    assert_eq!((scan.mesh.positions[1], scan.mesh.normals[1]), ([4.0, 5.0, 6.0], [0.0, 1.0, 0.0]));
    // The usual name is taken of two.
    let both = ["X", "Y", "Z", "x", "y", "z"].map(|name| format!("property float {name}\n")).concat();
    assert_eq!(scan_of("a.ply", format!("{head}{both}{rows}")).unwrap().mesh.positions[1], [0.0, 1.0, 0.0]);
}

/// Two triangles that share an edge, red and blue.
#[test]
fn colours_of_ply_faces_are_carried_to_the_vertices() {
    let vertices = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.5]];
    let expected = [[200, 0, 0], [100, 0, 50], [100, 0, 50], [0, 0, 100]];
    let head = |format: &str, before: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
             element face 2\n{before}property list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\n\
             property uchar blue\nend_header\n"
        )
    };
    let faces = [([0_i32, 1, 2], [200_u8, 0, 0]), ([2, 1, 3], [0, 0, 100])];
    let mut ascii = head("ascii", "");
    vertices.iter().for_each(|[x, y, z]| ascii += &format!("{x} {y} {z}\n"));
    faces.iter().for_each(|([a, b, c], [r, g, l])| ascii += &format!("3 {a} {b} {c} {r} {g} {l}\n"));
    let mut binary = head("binary_little_endian", "property ushort flags\n").into_bytes();
    binary.extend(vertices.as_flattened().iter().flat_map(|c| c.to_le_bytes()));
    for (corners, colour) in faces {
        binary.extend([7, 7, 3]);
        binary.extend(corners.iter().flat_map(|c| c.to_le_bytes()));
        binary.extend(colour);
    }
    for bytes in [ascii.clone().into_bytes(), binary] {
        let scan = scan_of("a.ply", bytes).unwrap();
        assert_eq!((scan.mesh.positions.len(), &scan.attributes.colours[..]), (4, &expected[..]));
        assert!(scan.warnings[0].contains("colours are those of its faces"), "{:?}", scan.warnings);
    }
    // Vertices that have colours keep them.
    let own = "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n";
    let own = ascii.replacen("property float z\n", own, 1);
    let own = ["0 0 0\n", "1 0 0\n", "0 1 0\n", "1 1 0.5\n"]
        .iter()
        .fold(own, |text, row| text.replacen(&format!("\n{row}"), &format!("\n{} 1 2 3\n", row.trim()), 1));
    let scan = scan_of("a.ply", own).unwrap();
    assert!(scan.attributes.colours == [[1, 2, 3]; 4] && scan.warnings.is_empty(), "{:?}", scan.warnings);
}
