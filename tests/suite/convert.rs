//! `gmlc convert`: what it makes of a cloud on request.

use crate::scan_colours::write_plate;
use crate::support::{fails, gmlc, gmlc_in, text};
use serde_json::Value;

/// The cloud has 101 x 101 points 0.4 mm apart, which scatter by 0.01 mm.
#[test]
fn a_cloud_becomes_a_mesh_with_the_colours_of_its_points() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    write_plate(&at.join("cloud.ply"), false, true);
    let refused = fails(at, &["convert", "cloud.ply", "-o", "plate.stl"], 2);
    assert!(refused.contains("has points only") && refused.contains("--surface"), "{refused}");
    let output = gmlc_in(at, &["convert", "cloud.ply", "--surface", "-o", "plate.ply", "--json"]);
    let said = text(&output.stderr);
    assert!(output.status.success() && said.contains("triangles were made of its 10201 points (--surface)"), "{said}");
    let result: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let count = |name: &str| result[name].as_u64().expect(name);
    let unused = result["cleaning"]["unused"].as_u64().unwrap_or(0);
    assert_eq!(count("points") + unused, 10_201);
    assert!(unused < 20 && (19_800..=20_000).contains(&count("triangles")), "{result}");
    let survey: Value = serde_json::from_str(&gmlc(at, &["info", "plate.ply", "--json"])).expect("JSON");
    assert_eq!((survey["triangles"].as_u64(), &survey["colours"]), (result["triangles"].as_u64(), &Value::Bool(true)));
    // A square of 40 mm; bumps add some 3 mm^2, and the scatter less.
    let area = survey["surface"]["area"].as_f64().expect("an area");
    assert!((1580.0..1610.0).contains(&area), "{area}");
    gmlc(at, &["convert", "cloud.ply", "--surface", "-o", "plate.stl"]);
    let again = text(&gmlc_in(at, &["convert", "plate.ply", "--surface", "-o", "again.ply"]).stderr);
    assert!(again.contains("--surface has no effect: the scan has triangles already"), "{again}");
}
