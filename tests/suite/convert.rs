//! `gmlc convert`: what it makes of a cloud on request.

use crate::support::{example, fails, gmlc, gmlc_in, text};
use serde_json::Value;
use std::fmt::Write;

/// Points of the cloud, on a square of this side in mm.
const POINTS: usize = 4000;
const SIDE: f64 = 40.0;

/// A gentle wave over a square as a cloud with colours, in ASCII PLY. Its points are spread evenly and on no grid (the
/// additive sequence of Roberts, 'The unreasonable effectiveness of quasirandom sequences', 2018).
fn wave() -> String {
    let mut out = format!("ply\nformat ascii 1.0\nelement vertex {POINTS}\n");
    out += "property double x\nproperty double y\nproperty double z\n";
    out += "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    for i in 0..POINTS {
        let [x, y] = [0.754_877_666_246_693, 0.569_840_290_998_053].map(|step| SIDE * (i as f64 * step).fract());
        let _ = writeln!(out, "{x} {y} {} {} 0 9", 0.2 * (x / 8.0).sin(), x.floor());
    }
    out
}

#[test]
fn a_cloud_becomes_a_mesh_with_the_colours_of_its_points() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("cloud.ply"), wave()).expect("written");
    let refused = fails(at, &["convert", "cloud.ply", "-o", "mesh.stl"], 2);
    assert!(refused.contains("has points only") && refused.contains("--surface"), "{refused}");
    let output = gmlc_in(at, &["convert", "cloud.ply", "--surface", "-o", "mesh.ply", "--json"]);
    let said = text(&output.stderr);
    assert!(output.status.success() && said.contains("triangles were made of its 4000 points (--surface)"), "{said}");
    let result: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let count = |name: &str| result[name].as_u64().expect(name);
    let unused = result["cleaning"]["unused"].as_u64().unwrap_or(0);
    // A triangulation of n points has two triangles a point, less those that the border lacks.
    assert_eq!(count("points") + unused, 4000);
    assert!(unused < 40 && (7200..8000).contains(&count("triangles")), "{result}");
    let survey: Value = serde_json::from_str(&gmlc(at, &["info", "mesh.ply", "--json"])).expect("JSON");
    assert_eq!((survey["triangles"].as_u64(), &survey["colours"]), (result["triangles"].as_u64(), &Value::Bool(true)));
    // The wave adds less than a thousandth to the square; some of its border is missing.
    let area = survey["surface"]["area"].as_f64().expect("an area");
    assert!((0.93..1.001).contains(&(area / (SIDE * SIDE))), "{area}");
    gmlc(at, &["convert", "cloud.ply", "--surface", "-o", "mesh.stl"]);
    let again = text(&gmlc_in(at, &["convert", "mesh.ply", "--surface", "-o", "again.ply"]).stderr);
    assert!(again.contains("--surface has no effect: the scan has triangles already"), "{again}");
}

#[test]
fn rounding_far_from_the_origin_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let obj = "v 450000000.1 5 0\nv 450000100.3 5 0\nv 450000000.1 90 7\nf 1 2 3\n";
    std::fs::write(at.join("far.obj"), obj).expect("written");
    // Single precision has steps of 32 mm there: 450000000 and 450000096 are the nearest.
    let said = text(&gmlc_in(at, &["convert", "far.obj", "-o", "far.stl"]).stderr);
    assert!(said.contains("far.stl: the format rounds coordinates, here by up to 4.3 mm: .ply, .obj"), "{said}");
    for kept in ["far.pcd", "far.ply", "far.glb", "far.las"] {
        let said = text(&gmlc_in(at, &["convert", "far.obj", "-o", kept]).stderr);
        assert!(!said.contains("rounds coordinates"), "{said}");
    }
}

/// PCD has room for one place of the scanner, PLY for none, E57 for all.
#[test]
fn places_of_the_scanner_are_not_lost_silently() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let can = example("can/can.gml");
    let lost = "places of the scanner";
    let scanned = |name: &str, stations: &str| {
        let kind = ["--scanner", "panorama", "--stations", stations, "--spacing", "8mm", "-o", name];
        text(&gmlc_in(at, &[&["scan", &can][..], &kind].concat()).stderr)
    };
    assert!(!scanned("two.e57", "2").contains(lost) && !scanned("one.pcd", "1").contains(lost));
    assert!(scanned("two.pcd", "2").contains(lost) && scanned("one.ply", "1").contains(lost));
    for (name, is_lost) in [("two.ptx", false), ("again.e57", false), ("again.pcd", true), ("again.ply", true)] {
        let output = gmlc_in(at, &["convert", "two.e57", "-o", name]);
        let said = text(&output.stderr);
        assert!(output.status.success() && said.contains(lost) == is_lost, "{name}: {said}");
    }
    let info = |name: &str| gmlc(at, &["info", name]);
    assert!(info("one.pcd").contains("the scanner's places"), "{}", info("one.pcd"));
    assert!(info("two.ptx").contains("scanner at"), "{}", info("two.ptx"));
}
