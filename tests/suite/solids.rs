//! Solids by the built command: their meshes are closed, their virtual scans lie on them, and fits and measurements see
//! what is there of them.

use crate::support::{gmlc, json};
use serde_json::Value;
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

/// A parameter of a fit with its standard deviation.
fn estimate(fit: &Value, name: &str) -> (f64, f64) {
    let all = fit["parameters"].as_array().expect("parameters");
    let of_name = all.iter().find(|p| p["name"] == name).expect("the parameter");
    (of_name["value"].as_f64().expect("a value"), of_name["sd"].as_f64().expect("a standard deviation"))
}

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
fn a_fit_recovers_the_holes_of_a_plate_and_a_measurement_sees_what_is_there() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("plate.gml"), PLATE).expect("written");
    let scan = ["-p", "d=9mm", "--noise", "0.05mm", "--spacing", "0.8mm", "--seed", "3"];
    gmlc(folder.path(), &[&["scan", "plate.gml", "-o", "scan.ply"][..], &scan].concat());
    gmlc(folder.path(), &["inspect", "plate.gml", "scan.ply", "-o", "out"]);
    let fit = json(&folder.path().join("out/fit.json"));
    let (value, sd) = estimate(&fit, "d");
    // Four standard deviations, and a tenth of the noise.
    assert!((value - 9.0).abs() < 4.0 * sd && (value - 9.0).abs() < 0.005 && sd > 0.0, "{value} {sd}");
    let parts = &json(&folder.path().join("out/variance.json"))["parts"];
    // The face less the two holes; texels at their edges count in full or not at all.
    let top = parts.as_array().and_then(|parts| parts.iter().find(|part| part["name"] == "plate.top"));
    let top = top.expect("the face")["area"].as_f64().expect("an area");
    let truth = 60.0 * 40.0 - 2.0 * std::f64::consts::PI * 4.5f64.powi(2);
    assert!((top / truth - 1.0).abs() < 2e-3, "{top}, not {truth}");
}

#[test]
fn a_plate_does_not_differ_from_itself() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("plate.gml"), PLATE).expect("written");
    gmlc(folder.path(), &["compare", "plate.gml", "plate.gml", "-o", "difference.json"]);
    let difference = &json(&folder.path().join("difference.json"));
    let largest = difference["hausdorff"].as_f64().expect("a distance");
    assert!(largest < 1e-4, "{largest} mm from itself");
}

/// A lens of two balls, and a body of two that overlap.
const LENS: &str = "use std.solid (ball)\nmodel lens {
  part lens = {lower: ball(radius: 50mm).translate((0mm, 0mm, -38mm))} & {upper: ball(radius: 35mm).translate((0mm, 0mm, 35mm))}
}
";

#[test]
fn a_comparison_integrates_what_is_there() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("lens.gml"), LENS).expect("written");
    gmlc(folder.path(), &["compare", "lens.gml", "lens.gml", "-o", "difference.json"]);
    let body = &json(&folder.path().join("difference.json"))["a"];
    // Spherical caps: their circle lies where both spheres have one height.
    let (lower, upper, apart) = (50.0_f64, 35.0_f64, 73.0_f64);
    let height = (apart * apart + lower * lower - upper * upper) / (2.0 * apart);
    let (a, b) = (lower - height, upper - (apart - height));
    let cap = |r: f64, h: f64| (std::f64::consts::TAU * r * h, std::f64::consts::PI * h * h * (r - h / 3.0));
    let ((first, under), (second, above)) = (cap(lower, a), cap(upper, b));
    for (found, truth) in [(&body["area"], first + second), (&body["volume"], under + above)] {
        let found = found.as_f64().expect("a number");
        assert!((found / truth - 1.0).abs() < 1e-3, "{found}, not {truth}");
    }
}

/// A shaft with a keyway whose ends are round: the walls of the ends touch those between them along lines.
const KEYWAY: &str = "use std.solid (box, capped_cylinder)\nmodel shaft {
  param r: length in 5mm..40mm = 15mm
  param kw: length in 2mm..12mm = 6mm
  let slot = box(width: 8mm, depth: kw, height: 18mm).translate((r, 0mm, 0mm))
  let end = capped_cylinder(radius: kw / 2, height: 8mm).rotate(90deg, (0, 1, 0)).translate((r - 4mm, 0mm, 0mm))
  part body = capped_cylinder(radius: r, height: 40mm)
    - {key: {a: slot, b: end, c: end.translate((0mm, 0mm, 18mm))}.translate((0mm, 0mm, 11mm))}
}
";

#[test]
fn surfaces_that_touch_along_a_line_do_not_spoil_the_standard_deviations() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("shaft.gml"), KEYWAY).expect("written");
    let scan = ["-p", "r=15.5mm", "-p", "kw=5.5mm", "--noise", "0.05mm", "--spacing", "1.2mm", "--seed", "1"];
    gmlc(folder.path(), &[&["scan", "shaft.gml", "-o", "scan.ply"][..], &scan].concat());
    gmlc(folder.path(), &["fit", "shaft.gml", "scan.ply", "-o", "fit.json"]);
    let fit = json(&folder.path().join("fit.json"));
    for (name, truth, most) in [("r", 15.5, 0.005), ("kw", 5.5, 0.05)] {
        let (value, sd) = estimate(&fit, name);
        assert!(sd < most && (value - truth).abs() < 4.0 * sd, "{name}: {value} +- {sd}");
    }
}

#[test]
fn a_model_of_which_nothing_is_left_is_not_closed() {
    let folder = tempdir().expect("a folder");
    let script = "use std.solid (box)\nmodel m { part b = box() - {q: box()} }\n";
    fs::write(folder.path().join("nothing.gml"), script).expect("written");
    let check = gmlc(folder.path(), &["check", "nothing.gml"]);
    assert!(check.contains("nothing is left of the model") && !check.contains("closed:"), "{check}");
}
