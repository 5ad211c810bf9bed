//! Parameters that are held at values or equal: tests of the values, and options that cannot be met.

use crate::support::{fails, gmlc, json};
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

/// Bounds that depend on each other.
const DEPENDENT: &str = "model dependent {
  param r: length in 5mm..50mm = 20mm
  param t: length in 1mm..(r / 2) = 4mm
  param e: length in (-t * sin(30deg))..(t * sin(30deg)) = 0mm
  param h: length in t..(3 * r) = 40mm
  param a: angle in 0deg..90deg = 30deg
  part body = cylinder(r, h)
  part base = disc(r).flip()
  part pin = sphere(t).translate((r + e, 0mm, h / 2 * cos(a)))
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

#[test]
fn holds_that_cannot_be_met_are_refused() {
    let folder = scanned("dependent.gml", DEPENDENT, &[]);
    let refused = |more: &[&str]| {
        let mut args = vec!["fit", "dependent.gml", "scan.ply"];
        args.extend(more);
        fails(folder.path(), &args, 2)
    };
    let message = refused(&["--equal", "t,e"]);
    assert!(message.contains("`t` and `e` cannot be held equal: their bounds leave no common value"), "{message}");
    assert!(message.contains(": `t` 1 mm to 10 mm, `e` -0.5 mm to 0.5 mm, where `r` = 20 mm, `t` = 1 mm"), "{message}");
    let message = refused(&["--equal", "r,h", "--equal", "h,t"]);
    assert!(message.contains("`r`, `h` and `t` cannot be held equal"), "{message}");

    let message = refused(&["--fix", "t=14mm"]);
    let expected = "the start value 14 mm of `t` is not within its bounds 1 mm to 10 mm; the upper bound depends on `r`, \
                    whose start value is 20 mm";
    assert!(message.contains(expected), "{message}");
    let message = refused(&["-p", "a=120deg"]);
    assert!(message.contains("the start value 120 deg of `a` is not within its bounds 0 deg to 90 deg\n"), "{message}");

    for contradiction in [["--fix", "r=30mm", "--fix", "r=31mm"], ["--fix", "r=31mm", "-p", "r=30mm"]] {
        let message = refused(&contradiction);
        assert!(message.contains("--fix r=31mm: another value of r is given as well"), "{message}");
    }
}

#[test]
fn a_value_that_leaves_another_parameter_none_is_refused() {
    let folder = scanned("narrow.gml", &DEPENDENT.replace("in 1mm..(r / 2)", "in 3mm..(r / 2)"), &[]);
    for option in ["--fix", "-p"] {
        let message = fails(folder.path(), &["fit", "narrow.gml", "scan.ply", option, "r=5mm"], 2);
        assert!(message.contains("the bounds of `t` leave no value: 3 mm to 2.5 mm, where `r` = 5 mm"), "{message}");
    }
    // What was not given makes room.
    gmlc(folder.path(), &["fit", "narrow.gml", "scan.ply", "-p", "r=7mm", "-o", "fit.json"]);
}
