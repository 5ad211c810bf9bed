//! Parameters that are held at values: tests of the values.

use crate::support::{gmlc, json};
use serde_json::Value;
use std::path::Path;
use tempfile::{TempDir, tempdir};

/// A drum with a ball beside it. Where the ball is held in a wrong place, the drum takes its few points, and from there
/// nothing leads back.
const BESIDE: &str = "model beside {
  param r: length in 10mm..80mm = 40mm
  param a: length in 0mm..200mm = 90mm
  param b: real in 0..3 = 0.5
  part body = cylinder(r, a)
  part top = disc(r).translate((0mm, 0mm, a))
  part base = disc(r).flip()
  part knob = sphere(10mm).translate((a, b * 20mm, a / 2))
}
";

/// A folder with a script and a scan of it, scan.ply.
fn scanned(name: &str, script: &str, options: &[&str]) -> TempDir {
    let folder = tempdir().expect("a folder");
    std::fs::write(folder.path().join(name), script).expect("written");
    let mut args = vec!["scan", name, "-o", "scan.ply", "--spacing", "4mm", "--seed", "3"];
    args.extend(options);
    gmlc(folder.path(), &args);
    folder
}

/// The test of a held value.
fn tested(folder: &Path, held: &str) -> Value {
    gmlc(folder, &["fit", "beside.gml", "scan.ply", "--fix", held, "-o", "fit.json"]);
    json(&folder.join("fit.json"))["tests"][0].clone()
}

#[test]
fn a_value_is_contradicted_however_far_off_it_is() {
    let folder = scanned("beside.gml", BESIDE, &["-p", "a=100mm", "-p", "b=0.8", "--noise", "0.2mm"]);
    for held in ["0.6", "1", "1.5"] {
        let test = tested(folder.path(), &format!("b={held}"));
        let free = test["free"][0].as_f64().expect("a number");
        assert!(test["statistic"].as_f64() > Some(100.0) && (free - 0.8).abs() < 0.05, "{held}: {test}");
    }
    let test = tested(folder.path(), "b=0.8");
    assert!(test["p"].as_f64() > Some(0.001), "{test}");
}
