//! `gmlc compare`: scripts, fits and meshes whose differences are known, and what is refused.

use crate::support::{fails, gmlc, gmlc_in, json, text};
use serde_json::Value;
use tempfile::{TempDir, tempdir};

const CAN: &str = "use std.solid (capped_cylinder)
model tin {
  input lid: bool = true
  param r: length in 15mm..25mm = 20mm
  param h: length in 30mm..70mm = 50mm
  part can = capped_cylinder(radius: r, height: h)
  if lid { part button = capped_cylinder(radius: 3mm, height: 4mm).translate((0mm, 0mm, h + 1mm)) }
}
";

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn named<'a>(list: &'a Value, name: &str) -> &'a Value {
    let found = list.as_array().and_then(|list| list.iter().find(|entry| entry["name"] == name));
    found.unwrap_or_else(|| panic!("no {name} in {list}"))
}

fn near(value: &Value, expected: f64, tolerance: f64) {
    assert!((number(value) - expected).abs() <= tolerance, "{value}, not {expected}");
}

/// A folder with the can, and fits of it to two scans in other poses.
fn fitted() -> TempDir {
    let folder = tempdir().expect("a folder");
    let path = folder.path();
    std::fs::write(path.join("can.gml"), CAN).expect("written");
    for (r, seed, name) in [("20.1mm", "3", "a"), ("20.16mm", "4", "b")] {
        let (scan, fit, r) = (format!("{name}.ply"), format!("{name}.json"), format!("r={r}"));
        let sampled = ["--noise", "0.1mm", "--spacing", "1.5mm", "--input", "lid=false"];
        gmlc(path, &[&["scan", "can.gml", "-p", &r, "--seed", seed, "-o", &scan][..], &sampled].concat());
        gmlc(path, &["fit", "can.gml", &scan, "--input", "lid=false", "-o", &fit]);
    }
    folder
}

#[test]
fn two_fits_differ_by_a_parameter_that_explains_it() {
    let folder = fitted();
    let path = folder.path();
    let said = gmlc(path, &["compare", "a.json", "b.json", "-o", "out/drift.json"]);
    assert!(said.contains("fitted to a.ply") && said.contains("differs") && said.contains("explained"), "{said}");
    let found = json(&path.join("out/drift.json"));
    let [a, b] = ["a.json", "b.json"].map(|file| json(&path.join(file)));
    let r = named(&found["parameters"], "r");
    let of = |fit: &Value, name: &str, what: &str| number(&named(&fit["parameters"], name)[what]);
    near(&r["difference"], of(&b, "r", "value") - of(&a, "r", "value"), 1e-12);
    near(&r["sd"], of(&a, "r", "sd").hypot(of(&b, "r", "sd")), 1e-12);
    near(&r["z"], number(&r["difference"]) / number(&r["sd"]), 1e-9);
    // The true radii differ by 0.06 mm.
    assert!((number(&r["difference"]) - 0.06).abs() < 5.0 * number(&r["sd"]), "{r}");
    assert_eq!((r["significant"].as_bool(), found["together"]["degrees"].as_u64()), (Some(true), Some(2)));
    // Poses are those of the scans, and play no role: the wall is as far apart as the radii.
    let wall = named(&found["a_to_b"]["parts"], "can.wall");
    near(&wall["signed"]["mean"], number(&r["difference"]), 1e-6);
    near(&wall["signed"]["sd"], 0.0, 1e-6);
    let explained = &found["explained"];
    assert!(number(&explained["share"]) > 0.999, "{explained}");
    near(&named(&explained["parameters"], "r")["share"], 1.0, 0.02);
    let [first, second] = ["a", "b"].map(|side| number(&found[side]["volume"]));
    let volume = |fit: &Value| std::f64::consts::PI * of(fit, "r", "value").powi(2) * of(fit, "h", "value");
    assert!((first / volume(&a) - 1.0).abs() < 1e-8 && (second / volume(&b) - 1.0).abs() < 1e-8);

    // The other way round everything changes its sign or its side.
    let back: Value =
        serde_json::from_str(&gmlc(path, &["compare", "b.json", "a.json", "--format", "json"])).expect("JSON");
    assert_eq!((&back["a_to_b"], &back["b_to_a"]), (&found["b_to_a"], &found["a_to_b"]));
    near(&named(&back["parameters"], "r")["difference"], -number(&r["difference"]), 0.0);

    // The nominal model is exact, so that the standard deviation is that of the fit.
    let nominal = ["compare", "can.gml", "b.json", "--input-a", "lid=false", "--format", "json"];
    let nominal: Value = serde_json::from_str(&gmlc(path, &nominal)).expect("JSON");
    near(&named(&nominal["parameters"], "r")["sd"], of(&b, "r", "sd"), 1e-15);
    assert_eq!(nominal["operands"][0]["kind"], "script");
    // A value that is given is no fitted one, and an input that differs is said.
    let given = gmlc(path, &["compare", "a.json", "can.gml", "--param-a", "r=20mm"]);
    assert!(given.contains("A has lid=false, B has lid=true") && given.contains("h "), "{given}");

    // A fit is where its scan is if the other one is a mesh.
    let scanned: Value =
        serde_json::from_str(&gmlc(path, &["compare", "a.json", "a.ply", "--format", "json"])).expect("JSON");
    near(&named(&scanned["a_to_b"]["parts"], "can.wall")["signed"]["median"], 0.0, 0.03);
    assert_eq!(scanned["parameters"], Value::Null);
    let twice = gmlc(path, &["compare", "a.json", "a.json"]);
    assert!(twice.contains("both were fitted to the same scan"), "{twice}");

    // From another folder the script is found beside the fit, or is named.
    std::fs::create_dir(path.join("elsewhere")).expect("a folder");
    gmlc(&path.join("elsewhere"), &["compare", "../a.json", "../b.json"]);
    std::fs::copy(path.join("a.json"), path.join("elsewhere/a.json")).expect("copied");
    let lost = fails(&path.join("elsewhere"), &["compare", "a.json", "../b.json"], 1);
    assert!(lost.contains("--script names it"), "{lost}");
    gmlc(&path.join("elsewhere"), &["compare", "a.json", "../b.json", "--script", "../can.gml"]);
}

#[test]
fn a_script_and_a_mesh_are_compared_where_they_are() {
    let folder = tempdir().expect("a folder");
    let path = folder.path();
    std::fs::write(path.join("can.gml"), CAN).expect("written");
    gmlc(path, &["mesh", "can.gml", "-p", "h=51mm", "--chord", "0.005mm", "-o", "high.obj"]);
    gmlc(path, &["compare", "can.gml", "high.obj", "-o", "high.json"]);
    let found = json(&path.join("high.json"));
    // The lid and the button on it are 1 mm higher.
    let top = named(&found["a_to_b"]["parts"], "can.top");
    near(&top["signed"]["median"], 1.0, 1e-6);
    near(&named(&found["a_to_b"]["parts"], "can.wall")["signed"]["median"], 0.0, 0.006);
    near(&named(&found["b_to_a"]["parts"], "button.top")["signed"]["median"], -1.0, 1e-6);
    near(&found["hausdorff"], 1.0, 0.006);
    let volume = |high: f64| std::f64::consts::PI * (400.0 * high + 9.0 * 4.0);
    assert!((number(&found["a"]["volume"]) / volume(50.0) - 1.0).abs() < 1e-8, "{}", found["a"]);
    assert!((number(&found["b"]["volume"]) / volume(51.0) - 1.0).abs() < 1e-3, "{}", found["b"]);
    // Without the button that has no counterpart but far away.
    let limited =
        ["compare", "high.obj", "can.gml", "--input-b", "lid=false", "--max-distance", "1.5mm", "-o", "less.json"];
    gmlc(path, &limited);
    let less = json(&path.join("less.json"));
    let button = named(&less["a_to_b"]["parts"], "button.top");
    near(&button["matched_area"], 0.0, 0.0);
    near(&button["unmatched_area"], std::f64::consts::PI * 9.0, 0.1);
    assert_eq!(less["operands"][1]["model"], "tin");

    let unit = gmlc_in(path, &["compare", "can.gml", "high.obj", "--unit-b", "m"]);
    let said = format!("{}{}", text(&unit.stdout), text(&unit.stderr));
    assert!(said.contains("is the unit right?"), "{said}");
}

#[test]
fn what_cannot_be_compared_is_refused_with_the_mend() {
    let folder = tempdir().expect("a folder");
    let path = folder.path();
    let write = |name: &str, content: &str| std::fs::write(path.join(name), content).expect("written");
    write("can.gml", CAN);
    write("broken.gml", "model m { part p = }");
    write("empty.stl", "");
    write("no.json", "{\"model\": 3}");
    write("notes.txt", "nothing");
    let vertices = "property float x\nproperty float y\nproperty float z\n";
    let triangle = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    write("cloud.ply", &format!("ply\nformat ascii 1.0\nelement vertex 1\n{vertices}end_header\n0 0 0\n"));
    let three = format!("ply\nformat ascii 1.0\nelement vertex 3\n{vertices}{triangle}");
    write("nan.ply", &format!("{three}0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n"));
    write("flat.ply", &format!("{three}0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n"));
    write("huge.ply", &format!("{three}0 0 0\n1e30 0 0\n0 1e30 0\n3 0 1 2\n"));
    write("far.ply", &format!("{three}5000 0 0\n5050 0 0\n5000 50 0\n3 0 1 2\n"));
    let cases: [(&[&str], i32, &str); 18] = [
        (&["can.gml", "nothing.stl"], 1, "no such file"),
        (&["nothing.gml", "can.gml"], 1, "no such file"),
        (&["nothing.json", "can.gml"], 1, "no such file"),
        (&["can.gml", "broken.gml"], 1, "expected"),
        (&["can.gml", "empty.stl"], 1, "empty"),
        (&["can.gml", "no.json"], 1, "is not a result of `gmlc fit`"),
        (&["can.gml", "notes.txt"], 2, "by the ending of its name"),
        (&["can.gml", "cloud.ply"], 1, "mesh the points first"),
        (&["can.gml", "nan.ply"], 1, "nan.ply"),
        (&["can.gml", "flat.ply"], 1, "none of its 1 triangles has an area"),
        (&["can.gml", "huge.ply"], 1, "check the unit"),
        (&["far.ply", "can.gml"], 1, "gmlc fit"),
        (&["can.gml", "far.ply", "--param-b", "r=20mm"], 2, "a mesh has no parameters"),
        (&["can.gml", "can.gml", "--unit-a", "m"], 2, "requires a mesh"),
        (&["can.gml", "can.gml", "--param-b", "r=40mm"], 1, "bounds"),
        (&["can.gml", "can.gml", "--param-b", "q=4mm"], 2, "--param-b q: the model has no parameter of that name"),
        (&["can.gml", "can.gml", "--script", "can.gml"], 2, "requires a result of `gmlc fit`"),
        (&["can.gml", "far.ply", "--align"], 2, "two states of one model"),
    ];
    for (arguments, status, word) in cases {
        let error = fails(path, &[&["compare"], arguments].concat(), status);
        assert!(error.contains(word) && !error.contains("panicked"), "{arguments:?}: {error}");
    }
}

/// Beside edges at which two surfaces touch, the nearest place is that of the surface itself, and what is narrower than
/// the samples does not make bodies overlap.
#[test]
fn a_body_with_tangent_edges_is_as_itself() {
    let folder = tempdir().expect("a folder");
    let script = "model m { part b = box(width: 20mm, depth: 10mm, height: 10mm) - {c: cove(3mm, 10mm)} }\n";
    std::fs::write(folder.path().join("m.gml"), script).expect("written");
    gmlc(folder.path(), &["compare", "m.gml", "m.gml", "--resolution", "256", "-o", "c.json"]);
    let found = json(&folder.path().join("c.json"));
    // The area between two tangents of a quarter circle and this.
    let volume = 2000.0 - 10.0 * 9.0 * (1.0 - std::f64::consts::FRAC_PI_4);
    let of_body = found["a"]["volume"].as_f64().unwrap_or_else(|| panic!("no volume: {}", found["a"]));
    assert!((of_body / volume - 1.0).abs() < 1e-4, "{of_body} for {volume}");
    let largest = found["a_to_b"]["max"].as_f64().expect("a distance");
    // The chord of the samples; they were 1.7 mm off.
    assert!(largest < 0.02, "{largest}");
}
