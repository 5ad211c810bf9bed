//! Measures of a script: in a fit's result, on the terminal, in the report, and as verdicts with exit statuses.

use crate::support::{fails, gmlc, gmlc_in, json, text};
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::{TempDir, tempdir};

const CAN: &str = "/// A can.
model can {
  param r: length in 10mm..60mm = 20mm
  param h: length in 20mm..120mm = 50mm
  /// Across the outside.
  measure diameter of shell.wall tolerance +0.2/-0.1mm = 2 * r
  measure height of shell.bottom, shell.top = h
  measure slope = atan2(h, r)
  part shell = {
    wall: cylinder(r, h),
    bottom: disc(r).flip(),
    top: disc(r).translate((0mm, 0mm, h)),
  }
}
";

/// A folder with the can, and a scan of one with a radius of 20.05 mm.
fn scanned() -> TempDir {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("can.gml"), CAN).expect("written");
    let scan = ["scan", "can.gml", "-p", "r=20.05mm", "-p", "h=51mm", "--noise", "0.1mm", "--spacing", "1.2mm"];
    gmlc(folder.path(), &[&scan[..], &["-o", "can.ply"]].concat());
    folder
}

fn measure<'v>(document: &'v Value, name: &str) -> &'v Value {
    let all = document["measures"].as_array().expect("measures");
    all.iter().find(|m| m["name"] == name).unwrap_or_else(|| panic!("{name} in {document}"))
}

/// Writes the can with another tolerance of its diameter.
fn with_tolerance(folder: &Path, name: &str, tolerance: &str) {
    fs::write(folder.join(name), CAN.replace("tolerance +0.2/-0.1mm", tolerance)).expect("written");
}

#[test]
fn fits_have_measures_and_verdicts_with_statuses() {
    let folder = scanned();
    let folder = folder.path();
    let fit: Value =
        serde_json::from_str(&gmlc(folder, &["fit", "can.gml", "can.ply", "-o", "fit.json", "--format", "json"]))
            .expect("a document");
    let diameter = measure(&fit, "diameter");
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("a number, not {value}"));
    let (value, sd) = (number(&diameter["value"]), number(&diameter["sd"]));
    assert!((value - 40.1).abs() < 4.0 * sd && sd < 0.01, "{diameter}");
    assert!((value - 2.0 * number(&fit["parameters"][0]["value"])).abs() < 1e-12, "{diameter}");
    assert!((sd - 2.0 * number(&fit["parameters"][0]["sd"])).abs() < 1e-12, "{diameter}");
    assert_eq!((&diameter["nominal"], &diameter["unit"]), (&40.0.into(), &"mm".into()));
    assert_eq!(diameter["tolerance"], serde_json::json!({ "lower": -0.1, "upper": 0.2 }));
    assert_eq!(diameter["derivatives"], serde_json::json!({ "r": 2.0 }));
    assert!((number(&measure(&fit, "slope")["value"]) - (51.0f64 / 20.05).atan()).abs() < 1e-3);

    let variance = |script: &str, options: &[&str]| -> Vec<String> {
        let args = ["variance", script, "can.ply", "--device", "cpu", "--resolution", "256", "-o", "out"];
        [&args[..], options].concat().into_iter().map(str::to_owned).collect()
    };
    let run = |args: Vec<String>| gmlc_in(folder, &args.iter().map(String::as_str).collect::<Vec<_>>());
    let status = |args: Vec<String>| run(args).status.code();
    let fitted = ["--params", "fit.json"];
    let output = run(variance("can.gml", &fitted));
    let said = text(&output.stdout);
    assert!(output.status.success() && said.contains("conforms") && said.contains("decision rule guarded"), "{said}");
    let report = json(&folder.join("out/variance.json"));
    let verdict = measure(&report, "diameter");
    assert_eq!((&verdict["outcome"], &report["verdict"]["outcome"]), (&"conforms".into(), &"conforms".into()));
    assert!(number(&verdict["probability"]) > 0.99 && number(&verdict["lower"]) == -0.1, "{verdict}");
    assert!((number(&verdict["deviation"]) - 0.1).abs() < 0.02, "{verdict}");

    // The text has changed, which is said, and the new tolerance counts; no new fit is needed.
    with_tolerance(folder, "narrow.gml", "tolerance 0.05mm");
    let output = run(variance("narrow.gml", &fitted));
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{error}");
    assert!(error.contains("has changed") && error.contains("does not conform: diameter: 40.1"), "{error}");
    with_tolerance(folder, "even.gml", &format!("tolerance {:.4}mm", value - 40.0));
    assert_eq!(status(variance("even.gml", &fitted)), Some(4));
    assert_eq!(status(variance("can.gml", &[&fitted[..], &["--device-uncertainty", "0.1mm"]].concat())), Some(4));
    let simple = [&fitted[..], &["--decision", "simple", "--device-uncertainty", "0.1mm"]].concat();
    assert_eq!(status(variance("can.gml", &simple)), Some(0));

    // Without a fit nothing was measured of a parameter.
    let output = run(variance("can.gml", &["-p", "h=51mm", "--max-distance", "40mm"]));
    let said = text(&output.stdout);
    assert!(said.contains("the tolerance of `diameter` is not judged"), "{said}");
    assert!(json(&folder.join("out/variance.json"))["measures"].is_null());

    let shown = gmlc(folder, &["check", "can.gml", "--params", "fit.json"]);
    assert!(shown.contains("deviation") && shown.contains("40.1"), "{shown}");
}

#[test]
fn inspections_judge_measures() {
    let folder = scanned();
    let folder = folder.path();
    let inspect = |options: &[&str]| -> Vec<String> {
        let args = ["inspect", "can.gml", "can.ply", "--device", "cpu", "--resolution", "256", "-o", "out"];
        [&args[..], options].concat().into_iter().map(str::to_owned).collect()
    };
    let passes = |options: &[&str]| gmlc(folder, &inspect(options).iter().map(String::as_str).collect::<Vec<_>>());
    let refuses = |status: i32, options: &[&str]| {
        fails(folder, &inspect(options).iter().map(String::as_str).collect::<Vec<_>>(), status)
    };
    let said = passes(&[]);
    assert!(said.contains("slope") && said.contains("diameter") && said.contains("probability"), "{said}");
    let report = fs::read_to_string(folder.join("out/report.html")).expect("a report");
    assert!(
        report.contains("<h3>Measures</h3>") && report.contains("<th scope=\"row\">diameter</th><td>40."),
        "no table"
    );
    assert!(fs::read_to_string(folder.join("out/model.x3d")).expect("a scene").contains("diameter"));
    // The start values that are given are the nominal ones.
    let error = refuses(3, &["-p", "r=21mm"]);
    assert!(error.contains("does not conform: diameter") && error.contains("from the nominal 42."), "{error}");
    // A parameter that is held was not measured.
    let error = refuses(4, &["--fix", "r"]);
    assert!(error.contains("undecided: diameter") && error.contains("nothing that was fitted"), "{error}");
}

/// What the points of named parts show does not depend on the model's parameters, nor on a fit of them.
#[test]
fn measured_points_show_measures() {
    let folder = scanned();
    let folder = folder.path();
    let fit = ["fit", "can.gml", "can.ply", "-o", "fit.json"];
    gmlc(folder, &fit);
    let run = |script: &str, resolution: &str, options: &[&str]| {
        let args = ["variance", script, "can.ply", "--params", "fit.json", "--device", "cpu", "-o", "out"];
        let output = gmlc_in(folder, &[&args[..], &["--resolution", resolution], options].concat());
        (output, json(&folder.join("out/variance.json"))["point_measures"].clone())
    };
    let (output, fitted) = run("can.gml", "256", &["--decision", "simple"]);
    let said = text(&output.stdout);
    assert!(
        output.status.success() && said.contains("by points") && said.contains("shell.bottom, shell.top"),
        "{said}"
    );
    let (_, other) = run("can.gml", "512", &["-p", "r=20.3mm"]);
    for (k, name, figure, truth) in [(0, "diameter", "diameter", 40.1), (1, "height", "distance", 51.0)] {
        let entry = &fitted[k];
        assert_eq!((&entry["name"], &entry["figure"]), (&name.into(), &figure.into()));
        let number = |field: &str| entry[field].as_f64().unwrap_or_else(|| panic!("{field} of {entry}"));
        let (value, uncertainty) = (number("value"), number("uncertainty"));
        assert!((value - truth).abs() < 4.0 * uncertainty && uncertainty < 0.02, "{entry}");
        let there = other[k]["value"].as_f64().expect("a value");
        assert!((there - value).abs() < 2.0 * uncertainty, "{there}, not {value}");
    }
    fs::write(folder.join("wrong.gml"), CAN.replace("= 2 * r", "= 3 * r")).expect("written");
    let (output, points) = run("wrong.gml", "256", &[]);
    let reason = points[0]["reason"].as_str().expect("a reason");
    assert!(reason.starts_with("the diameter in the model is another: 40."), "{reason}\n{}", text(&output.stderr));
}

#[test]
fn the_table_of_a_script_has_measures_with_derivatives() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("can.gml"), CAN).expect("written");
    let said = gmlc(folder.path(), &["check", "can.gml"]);
    let row = "diameter   40.000  mm    -0.1000  0.2000  r 2.0000             Across the outside.";
    assert!(said.contains(row) && said.contains("slope      68.199  deg"), "{said}");
    let document: Value =
        serde_json::from_str(&gmlc(folder.path(), &["check", "can.gml", "--format", "json"])).expect("a document");
    let slope = measure(&document, "slope");
    assert!(slope["derivatives"]["h"].as_f64().is_some_and(|d| (d - 20.0 / 2900.0).abs() < 1e-12), "{slope}");
    let page = gmlc(folder.path(), &["doc", "can.gml"]);
    assert!(
        page.contains("### Measures\n\n- `diameter = 2 * r`, of `shell.wall`, tolerance `+0.2/-0.1mm`: Across"),
        "{page}"
    );
}

const BOLT: &str = "model bolt {
  param off: length = 0mm
  part shaft = cylinder(8mm, 30mm)
  part foot = flip(disc(8mm))
  part head = cylinder(15mm, 15mm).translate((off, 0mm, 30mm))
  part collar = revolve(|t| (mix(8mm, 15mm, t), 0mm)).translate((off, 0mm, 30mm))
  part shoulder = revolve(|t| (mix(15mm, 10mm, t), 45mm)).translate((off, 0mm, 0mm))
  part dome = revolve(|t| (10mm * cos(t * 90deg), 45mm + 10mm * sin(t * 90deg))).translate((off, 0mm, 0mm))
  part fin = |u, v| (8mm + u * 4mm, sin(u * 200deg) * 1mm, 4mm + v * 4mm)
}
";

/// A head that is 0.5 mm off its shaft, measured from a model in which it is not.
#[test]
fn parts_lie_to_a_datum() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    fs::write(folder.join("bolt.gml"), BOLT).expect("written");
    let scan = ["scan", "bolt.gml", "-p", "off=0.5mm", "--noise", "0.1mm", "--spacing", "1mm", "--no-pose"];
    gmlc(folder, &[&scan[..], &["-o", "bolt.ply"]].concat());
    let variance = |options: &[&str]| -> Vec<String> {
        let args = ["variance", "bolt.gml", "bolt.ply", "--device", "cpu", "--resolution", "256", "-o", "out"];
        [&args[..], options].concat().into_iter().map(str::to_owned).collect()
    };
    let run = |args: Vec<String>| gmlc_in(folder, &args.iter().map(String::as_str).collect::<Vec<_>>());
    let output = run(variance(&["--datum", "shaft"]));
    let said = text(&output.stdout);
    assert!(output.status.success() && said.contains("to shaft") && said.contains("coaxiality"), "{said}");
    let datum = json(&folder.join("out/variance.json"))["datum"].clone();
    assert_eq!((&datum["part"], &datum["shape"]), (&"shaft".into(), &"cylinder".into()));
    let relations = datum["relations"].as_array().expect("relations");
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("a number, not {value}"));
    for (part, characteristic, truth) in [
        ("foot", "perpendicularity", 0.0),
        ("head", "coaxiality", 1.0),
        ("head", "parallelism", 0.0),
        ("collar", "perpendicularity", 0.0),
        ("shoulder", "perpendicularity", 0.0),
        ("dome", "concentricity", 1.0),
    ] {
        let found = relations.iter().find(|r| r["part"] == part && r["characteristic"] == characteristic);
        let found = found.unwrap_or_else(|| panic!("{characteristic} of {part} in {datum}"));
        let [corrected, uncertainty] = ["corrected", "uncertainty"].map(|field| number(&found[field]));
        assert!((corrected - truth).abs() < 4.0 * uncertainty && uncertainty < 0.08, "{found}");
        assert!(number(&found["model"]) < 1e-6 && number(&found["noise_alone"]) > 0.0, "{found}");
    }
    // Of the fin, which has no form, nothing is said.
    assert_eq!(relations.len(), 6, "{datum}");
    let head = relations.iter().find(|r| r["characteristic"] == "coaxiality").expect("one");
    let [x, y, z] = [0, 1, 2].map(|k| number(&head["place"][k]));
    assert!((x - 0.5).abs() < 0.1 && y.abs() < 0.1 && (29.9..=45.1).contains(&z), "{head}");

    for (name, reason) in [
        ("shafd", "--datum: there is no part `shafd`; `shaft` is similar"),
        ("fin", "--datum: `fin` is no plane, sphere, cylinder, cone or other surface of revolution"),
    ] {
        let output = run(variance(&["--datum", name]));
        let error = text(&output.stderr);
        assert!(output.status.code() == Some(2) && error.contains(reason), "{error}");
    }
    // Before the fit, which would take longer.
    let error = fails(folder, &["inspect", "bolt.gml", "bolt.ply", "--datum", "shafd", "-o", "out"], 2);
    assert!(error.contains("`shaft` is similar"), "{error}");
    let inspect = ["inspect", "bolt.gml", "bolt.ply", "--device", "cpu", "--resolution", "256", "--datum", "shaft"];
    gmlc(folder, &[&inspect[..], &["-o", "out"]].concat());
    let report = fs::read_to_string(folder.join("out/report.html")).expect("a report");
    assert!(report.contains("<h3>Datum shaft</h3>") && report.contains("concentricity"), "no table");
}
