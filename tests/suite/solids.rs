//! Solids by the built command: their meshes are closed, their virtual scans lie on them, and what does not know
//! trimmed parts says so.

use crate::support::{fails, gmlc, json};
use std::collections::HashMap;
use std::fs;
use tempfile::tempdir;

const PLATE: &str = "model plate {
  param d: length in 1mm..20mm = 8mm
  let bolt = capped_cylinder(radius: d / 2, height: 6mm)
  part plate = box(width: 60mm, depth: 40mm, height: 6mm) - {
    hole: for i in 0..2 { bolt.translate(((i - 0.5) * 30mm, 0mm, 0mm)) },
  }
}
";

/// The corners of the triangles of a binary STL file.
fn triangles(bytes: &[u8]) -> Vec<[[u32; 3]; 3]> {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    (0..word(80) as usize)
        .map(|k| [0, 1, 2].map(|corner| [0, 1, 2].map(|c| word(84 + 50 * k + 12 + 12 * corner + 4 * c))))
        .collect()
}

#[test]
fn the_mesh_of_a_drilled_plate_is_closed() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("plate.gml"), PLATE).expect("written");
    gmlc(folder.path(), &["mesh", "plate.gml", "-o", "plate.stl"]);
    let triangles = triangles(&fs::read(folder.path().join("plate.stl")).expect("it is there"));
    let mut edges: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    for corners in &triangles {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            *edges.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
        }
    }
    assert!(triangles.len() > 100 && edges.values().all(|n| *n == 0), "{} triangles", triangles.len());
    let check = gmlc(folder.path(), &["check", "plate.gml"]);
    assert!(check.contains("plate.hole[1].wall") && check.contains("closed"), "{check}");
}

#[test]
fn a_virtual_scan_of_a_drilled_plate_lies_on_it() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("plate.gml"), PLATE).expect("written");
    let exact = ["--noise", "0mm", "--spacing", "1mm", "--outliers", "0", "--no-pose"];
    gmlc(folder.path(), &[&["scan", "plate.gml", "-o", "scan.ply"][..], &exact].concat());
    gmlc(folder.path(), &["mesh", "plate.gml", "-o", "plate.stl"]);
    gmlc(folder.path(), &["variance", "plate.stl", "scan.ply", "-o", "out"]);
    let points = &json(&folder.path().join("out/variance.json"))["points"];
    // The mesh keeps to 0.02 mm, and rounds to single precision.
    let largest = points["max"].as_f64().unwrap_or(f64::NAN);
    assert!(points["measured"].as_u64() > Some(5000) && largest < 0.021, "{points}");
}

#[test]
fn fits_and_measurements_refuse_trimmed_parts() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("plate.gml"), PLATE).expect("written");
    gmlc(folder.path(), &["scan", "plate.gml", "-o", "scan.ply"]);
    for command in ["fit", "variance", "inspect"] {
        let error = fails(folder.path(), &[command, "plate.gml", "scan.ply", "-o", "out"], 1);
        assert!(error.contains("part plate.top is trimmed"), "{command}: {error}");
    }
    let error = fails(folder.path(), &["compare", "plate.gml", "plate.gml", "-o", "difference"], 1);
    assert!(error.contains("part plate.top is trimmed"), "{error}");
}
