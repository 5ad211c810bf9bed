//! Fits that later commands begin from: their inputs, and the script that they belong to.

use crate::support::{fails, gmlc, gmlc_in, gmlc_with_input, json, parameter, text};
use std::path::Path;
use tempfile::{TempDir, tempdir};

/// A drum with knobs on its top: as many as the input says.
const DRUM: &str = "use \"knob.gml\" (knob)
model drum {
  input knobs: int in 1..9 = 3
  input tall: bool = false
  input gap: length = 2mm
  param r: length in 20mm..60mm = 40mm
  let h = if tall { 50mm } else { 30mm }
  part body = cylinder(r, h)
  part top = disc(r).translate((0mm, 0mm, h))
  part base = disc(r).flip()
  for i in 0..knobs {
    part k = knob(5mm).translate((r / 2 * cos(i * 1turn / knobs), r / 2 * sin(i * 1turn / knobs), h + gap))
  }
}
";

/// What the drum uses.
const KNOB: &str = "fn knob(r: length) = sphere(r)\n";

/// A folder with the drum, a scan of it with other inputs than its defaults, and a fit.
fn fitted() -> TempDir {
    let folder = tempdir().expect("a folder");
    write(folder.path(), "drum.gml", DRUM);
    write(folder.path(), "knob.gml", KNOB);
    let inputs = ["--input", "knobs=5", "--input", "tall=true", "--input", "gap=3mm"];
    let scan = ["scan", "drum.gml", "-p", "r=42mm", "--spacing", "4mm", "--noise", "0.1mm", "-o", "scan.ply"];
    gmlc(folder.path(), &[&scan[..], &inputs].concat());
    gmlc(folder.path(), &[&["fit", "drum.gml", "scan.ply", "-o", "fit.json"][..], &inputs].concat());
    folder
}

fn write(folder: &Path, name: &str, text: &str) {
    std::fs::write(folder.join(name), text).expect("written");
}

#[test]
fn a_fit_keeps_its_inputs() {
    let folder = fitted();
    let fit = json(&folder.path().join("fit.json"));
    let inputs: Vec<_> = fit["inputs"].as_array().expect("inputs").iter().map(|i| (&i["name"], &i["value"])).collect();
    assert_eq!(
        format!("{inputs:?}"),
        r#"[(String("knobs"), Number(5.0)), (String("tall"), Number(1.0)), (String("gap"), Number(3.0))]"#
    );

    // The model of the fit has eight parts, with the default inputs it would have six.
    let out = gmlc(folder.path(), &["mesh", "drum.gml", "--params", "fit.json", "-o", "drum.ply"]);
    assert!(out.contains("8 parts"), "{out}");
    let options = ["--resolution", "128", "--device", "cpu", "-o", "out"];
    gmlc(folder.path(), &[&["variance", "drum.gml", "scan.ply", "--params", "fit.json"][..], &options].concat());
    let report = json(&folder.path().join("out/variance.json"));
    assert_eq!(report["parts"].as_array().map(Vec::len), Some(8));
    assert_eq!(report["unmatched"]["triangles"], 0, "the model explains the knobs and the height");
    gmlc(folder.path(), &["scan", "drum.gml", "--params", "fit.json", "--spacing", "4mm", "-o", "again.ply"]);
    let (status, out) = gmlc_with_input(folder.path(), &["repl", "drum.gml", "--params", "fit.json"], "h\nr > 41mm\n");
    assert_eq!(status, Some(0), "{out}");
    assert!(out.contains("8 parts") && out.ends_with("50 mm\ntrue\n"), "{out}");
}

/// Another shape of the surfaces of a loop names them without their numbers, behind which more may follow.
#[test]
fn a_fit_names_the_parts_of_a_loop_without_their_numbers() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    let legs = "part legs = for i in 0..2 { {wall: cylinder(r, 20mm).translate((40mm * i, 0mm, 0mm))} }";
    write(folder, "legs.gml", &format!("model legs {{\n param r: length in 5mm..15mm = 8mm\n {legs}\n}}\n"));
    gmlc(folder, &["scan", "legs.gml", "-p", "r=9mm", "--spacing", "2mm", "-o", "scan.ply"]);
    gmlc(folder, &["fit", "legs.gml", "scan.ply", "-o", "fit.json"]);
    let mut fit = json(&folder.join("fit.json"));
    let args = ["mesh", "legs.gml", "--params", "named.json", "-o", "legs.ply"];
    for (name, is_known) in [("legs.wall", true), ("legs[1].wall", true), ("legs", true), ("legs.lid", false)] {
        fit["alternatives"] = serde_json::json!([{ "parts": [name], "values": { "r": 9.5 }, "evidence": 0.0 }]);
        write(folder, "named.json", &fit.to_string());
        if is_known {
            gmlc(folder, &args);
        } else {
            assert!(fails(folder, &args, 1).contains("names the part 'legs.lid', which the model"));
        }
    }
}

#[test]
fn inputs_that_contradict_a_fit_are_refused() {
    let folder = fitted();
    let mesh = |more: &[&str], status| {
        let args = [&["mesh", "drum.gml", "--params", "fit.json", "-o", "drum.ply"][..], more].concat();
        match status {
            0 => gmlc(folder.path(), &args),
            _ => fails(folder.path(), &args, status),
        }
    };
    mesh(&["--input", "knobs=5", "--input", "gap=0.3cm"], 0);
    assert_eq!(mesh(&["--input", "knobs=4"], 2), "error: --input knobs=4: fit.json was fitted with knobs=5\n");
    assert_eq!(mesh(&["--input", "tall=false"], 2), "error: --input tall=false: fit.json was fitted with tall=true\n");
    assert_eq!(mesh(&["--input", "gap=2mm"], 2), "error: --input gap=2mm: fit.json was fitted with gap=3mm\n");
    let args = ["repl", "drum.gml", "--params", "fit.json", "--input", "knobs=4"];
    assert!(fails(folder.path(), &args, 2).contains("fit.json was fitted with knobs=5"));

    write(folder.path(), "drum.gml", &DRUM.replace("  input tall: bool = false\n", "  let tall = true\n"));
    let expected = "error: fit.json: was fitted with tall=true, and the model 'drum' has no input of that name\n";
    assert_eq!(mesh(&[], 1), expected);
    assert_eq!(fails(folder.path(), &["repl", "drum.gml", "--params", "fit.json"], 1), expected);
}

#[test]
fn a_fit_belongs_to_its_script() {
    let folder = fitted();
    let mesh = ["mesh", "-q", "drum.gml", "--params", "fit.json", "-o", "drum.ply"];
    let said = || text(&gmlc_in(folder.path(), &mesh).stderr);
    assert_eq!(said(), "");
    let changed = "warning: fit.json: the text of the script, or of what it uses, has changed since the fit\n";
    write(folder.path(), "drum.gml", &format!("// The same drum.\n{DRUM}"));
    assert_eq!(said(), changed);
    write(folder.path(), "drum.gml", DRUM);
    write(folder.path(), "knob.gml", &format!("// The same knob.\n{KNOB}"));
    assert_eq!(said(), changed);
    write(folder.path(), "knob.gml", KNOB);

    let refused = |script: &str| {
        write(folder.path(), "drum.gml", script);
        fails(folder.path(), &mesh, 1)
    };
    let other = "error: fit.json: is of the model 'drum', and this model is 'barrel'\n";
    assert_eq!(refused(&DRUM.replace("model drum", "model barrel")), other);
    let unlike = refused(&DRUM.replace("param r", "param rim").replace("(r", "(rim").replace(", r /", ", rim /"));
    let expected = "the fit has 'r', which the model has not; the model has 'rim', which the fit has not";
    assert!(unlike.contains(expected), "{unlike}");
}

/// The file as versions wrote it that knew neither inputs nor sums.
#[test]
fn a_fit_of_an_older_version_is_read() {
    let folder = fitted();
    let mut fit = json(&folder.path().join("fit.json"));
    let fields = fit.as_object_mut().expect("an object");
    assert!(fields.remove("inputs").is_some() && fields.remove("script_sha256").is_some());
    write(folder.path(), "fit.json", &fit.to_string());
    let mesh = ["mesh", "-q", "drum.gml", "--params", "fit.json", "--input", "tall=true", "-o", "drum.ply"];
    let output = gmlc_in(folder.path(), &mesh);
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success() && out.contains("6 parts"), "{out}{err}");
    let warnings = "warning: fit.json: does not say with which 'knobs' it was fitted: knobs=3 is taken
warning: fit.json: does not say with which 'gap' it was fitted: gap=2mm is taken
";
    assert_eq!(err, warnings);
}

/// `--search` selects the inputs: those of the winner are the fit's.
#[test]
fn a_search_names_its_inputs() {
    let folder = fitted();
    let fit = ["fit", "drum.gml", "scan.ply", "--input", "tall=true", "--input", "gap=3mm", "--search", "knobs=4..5"];
    let out = gmlc(folder.path(), &[&fit[..], &["-o", "found.json"]].concat());
    let found = json(&folder.path().join("found.json"));
    assert_eq!(found["inputs"][0]["value"], 5.0, "{out}");
    assert!(out.contains("inputs: knobs=5 tall=true gap=3mm"), "{out}");
    assert_eq!(found["script_sha256"], json(&folder.path().join("fit.json"))["script_sha256"]);
}

#[test]
fn the_status_tells_a_fit_from_a_failure() {
    let folder = fitted();
    // No ball is a drum.
    write(folder.path(), "ball.gml", "model ball {\n  param r: length in 1mm..4mm = 3mm\n  part ball = sphere(r)\n}\n");
    let fit = ["fit", "-q", "ball.gml", "scan.ply", "-o", "ball.json"];
    let error = fails(folder.path(), &fit, 4);
    assert!(
        error.starts_with("unreliable fit: only ") && error.contains("of the model") && error.lines().count() == 1,
        "{error}"
    );
    assert!(json(&folder.path().join("ball.json"))["inliers"].as_f64() < Some(0.5));
    let options = ["--resolution", "128", "--device", "cpu", "--tolerance", "0.001mm", "-o", "out"];
    let error = fails(folder.path(), &[&["inspect", "ball.gml", "scan.ply"][..], &options].concat(), 4);
    assert!(
        error.contains("undecided: ball: ")
            && error.contains("the fit cannot be relied on")
            && error.contains("unreliable fit: "),
        "{error}"
    );
    assert!(folder.path().join("out/report.html").exists());
}

/// The fit of a session names its script, not what else was entered.
#[test]
fn a_fit_of_a_session_belongs_to_its_script() {
    let folder = fitted();
    let lines = "let a = 1mm\n:set knobs=5\n:set tall=true\n:set gap=3mm\n:fit scan.ply -o session.json\n";
    let (status, out) = gmlc_with_input(folder.path(), &["repl", "drum.gml"], lines);
    assert_eq!(status, Some(0), "{out}");
    let [session, fit] = ["session.json", "fit.json"].map(|name| json(&folder.path().join(name)));
    for field in ["model", "script", "script_sha256", "inputs"] {
        assert_eq!(session[field], fit[field], "{field}");
    }
    let (status, _) = gmlc_with_input(folder.path(), &["repl", "drum.gml"], ":mesh drum.ply --params fit.json\n");
    assert_eq!(status, Some(1), "the values of a session are those that were set");
}

/// A body without any symmetry, with a pose that gmlc adds.
const WEDGE: &str = "model wedge {
  param a: length in 10mm..60mm = 30mm
  param b: length in 10mm..60mm = 20mm
  param r: length in 2mm..15mm = 6mm
  part base = |u, v| (u * a, v * b, 0mm)
  part wall = |u, v| (0mm, u * b, v * a / 2)
  part ball = sphere(r).translate((a, b, 2 * r))
  part knob = sphere(4mm).translate((a / 2, b / 3, 0mm))
}
";

/// The largest difference of a parameter of two fits, in standard deviations of the first.
fn moved(a: &serde_json::Value, b: &serde_json::Value) -> f64 {
    let all = |fit: &serde_json::Value| fit["parameters"].as_array().expect("parameters").clone();
    let difference = |(a, b): (serde_json::Value, serde_json::Value)| {
        let [value, other, sd] = [&a["value"], &b["value"], &a["sd"]].map(|x| x.as_f64().expect("a number"));
        (value - other).abs() / sd
    };
    all(a).into_iter().zip(all(b)).map(difference).fold(0.0, f64::max)
}

/// A folder with the wedge and a scan of it.
fn wedge() -> TempDir {
    let folder = tempdir().expect("a folder");
    write(folder.path(), "wedge.gml", WEDGE);
    scan_wedge(folder.path(), "4", "scan.ply");
    folder
}

/// Scans the wedge, in a position that follows from the seed.
fn scan_wedge(folder: &Path, seed: &str, name: &str) {
    let scan = ["scan", "wedge.gml", "-p", "a=41mm", "-p", "r=9mm", "--spacing", "1.5mm", "--noise", "0.1mm"];
    gmlc(folder, &[&scan[..], &["--seed", seed, "-o", name]].concat());
}

fn fit_wedge(folder: &Path, scan: &str, name: &str, more: &[&str]) -> serde_json::Value {
    gmlc(folder, &[&["fit", "wedge.gml", scan, "-o", name][..], more].concat());
    json(&folder.join(name))
}

#[test]
fn a_fit_goes_on_where_it_ended() {
    let folder = wedge();
    let fit = |name, more: &[&str]| fit_wedge(folder.path(), "scan.ply", name, more);
    let first = fit("fit.json", &[]);
    let evaluations = |fit: &serde_json::Value| fit["evaluations"].as_u64().expect("a number");
    let again = fit("again.json", &["--params", "fit.json"]);
    assert!(moved(&first, &again) < 0.1, "{}", moved(&first, &again));
    // No search; other poses are looked at anew, at some two hundred places.
    assert!(4 * evaluations(&again) < evaluations(&first), "{} of {}", evaluations(&again), evaluations(&first));

    // What was held is not held any longer.
    let held = fit("held.json", &["--fix", "r=9.2mm"]);
    assert!(moved(&first, &held) > 10.0);
    let released = fit("released.json", &["--params", "held.json"]);
    assert!(moved(&first, &released) < 0.5 && released["parameters"][2]["fixed"] == false, "{released}");
    assert!(evaluations(&released) < evaluations(&first), "{} of {}", evaluations(&released), evaluations(&first));
    let overridden = fit("overridden.json", &["--params", "fit.json", "-p", "a=32mm", "--fix", "r"]);
    assert_eq!(parameter(&overridden, "r"), parameter(&first, "r"), "held at the value of the fit");
    assert!(moved(&first, &overridden) < 1.0, "{}", moved(&first, &overridden));
}

/// The pose of a fit may be that of another scan.
#[test]
fn a_fit_that_explains_nothing_is_not_gone_on_with() {
    let folder = wedge();
    fit_wedge(folder.path(), "scan.ply", "fit.json", &[]);
    scan_wedge(folder.path(), "5", "elsewhere.ply");
    let elsewhere = fit_wedge(folder.path(), "elsewhere.ply", "elsewhere.json", &["--params", "fit.json"]);
    let off = |name, truth: f64| (parameter(&elsewhere, name) - truth).abs();
    assert!(off("a", 41.0) < 0.1 && off("b", 20.0) < 0.3 && off("r", 9.0) < 0.05, "{elsewhere}");
    let error = fails(folder.path(), &["fit", "wedge.gml", "scan.ply", "--params", "fit.json", "--no-pose"], 2);
    assert!(error.contains("--no-pose: the fit to go on from (--params) has a pose"), "{error}");
}

/// `inspect` goes on, too; a search may leave the inputs of the fit.
#[test]
fn inputs_are_kept_where_a_fit_goes_on() {
    let folder = fitted();
    let inspect = ["inspect", "drum.gml", "scan.ply", "--params", "fit.json", "--resolution", "128", "--device", "cpu"];
    gmlc(folder.path(), &[&inspect[..], &["-o", "out"]].concat());
    let [fit, gone_on] = ["fit.json", "out/fit.json"].map(|name| json(&folder.path().join(name)));
    assert_eq!(fit["inputs"], gone_on["inputs"]);
    assert!(gone_on["evaluations"].as_u64() < fit["evaluations"].as_u64());
    let search = ["fit", "drum.gml", "scan.ply", "--params", "fit.json", "--search", "knobs=4..5", "-o", "found.json"];
    gmlc(folder.path(), &search);
    assert_eq!(json(&folder.path().join("found.json"))["inputs"], fit["inputs"]);
}

/// What an earlier fit held equal is in its file, is free when a fit goes on from it, and that is said.
#[test]
fn what_was_held_is_named_where_a_fit_goes_on() {
    let folder = tempdir().expect("a folder");
    write(folder.path(), "wedge.gml", WEDGE);
    let scan = ["scan", "wedge.gml", "-p", "a=31mm", "-p", "b=30.8mm", "--spacing", "1.5mm", "--noise", "0.1mm"];
    gmlc(folder.path(), &[&scan[..], &["-o", "scan.ply"]].concat());
    let fit = |more: &[&str]| {
        let output = gmlc_in(folder.path(), &[&["fit", "wedge.gml", "scan.ply"][..], more].concat());
        (text(&output.stdout), text(&output.stderr))
    };
    let (out, _) = fit(&["--equal", "b, a", "--fix", "r=6mm", "-o", "held.json"]);
    assert!(out.contains("\nheld equal: a, b\n"), "{out}");
    let held = json(&folder.path().join("held.json"));
    assert_eq!(held["equal"], serde_json::json!([["a", "b"]]));

    let (_, err) = fit(&["--params", "held.json", "-o", "free.json"]);
    let expected = "warning: held.json: held 'r', now free again (--fix r would hold it)\n\
        warning: held.json: held 'a', 'b' equal, now free again (--equal a,b would hold them)\n";
    assert!(err.starts_with(expected), "{err}");
    let free = json(&folder.path().join("free.json"));
    assert_eq!(free["equal"], serde_json::Value::Null);
    // The optimum under the ties is none without them.
    assert!((parameter(&free, "a") - parameter(&free, "b") - 0.2).abs() < 0.1, "{free}");
    let (_, err) = fit(&["--params", "held.json", "--equal", "a,b", "--fix", "r"]);
    assert!(!err.contains("free again"), "{err}");
}

/// `check` shows the model of a fit.
#[test]
fn a_check_takes_the_values_of_a_fit() {
    let folder = fitted();
    let check =
        |more: &[&str]| gmlc(folder.path(), &[&["check", "drum.gml", "--params", "fit.json"][..], more].concat());
    let out = check(&["-p", "r=41.5mm"]);
    assert!(out.contains("parameter  value  from  to  unit") && out.contains("41.5"), "{out}");
    assert!(out.contains("knobs  5") && out.contains("k[4]"), "{out}");
    let document: serde_json::Value = serde_json::from_str(&check(&["--format", "json"])).expect("JSON");
    let fit = json(&folder.path().join("fit.json"));
    assert_eq!(document["values"], serde_json::json!([parameter(&fit, "r")]));
    assert_eq!(document["parameters"][0]["default"], 40.0);

    let error = fails(folder.path(), &["check", "drum.gml", "--params", "fit.json", "--input", "knobs=4"], 2);
    assert_eq!(error, "error: --input knobs=4: fit.json was fitted with knobs=5\n");
    let error = fails(folder.path(), &["check", "drum.gml", "-p", "r=70mm"], 1);
    assert!(error.contains("r = 70mm is not within its bounds"), "{error}");
    let error = fails(folder.path(), &["check", "knob.gml", "--params", "fit.json"], 2);
    assert_eq!(error, "error: --params and -p require a script with a model\n");
    write(folder.path(), "drum.gml", &DRUM.replace("model drum", "model barrel"));
    let error = fails(folder.path(), &["check", "drum.gml", "--params", "fit.json"], 1);
    assert_eq!(error, "error: fit.json: is of the model 'drum', and this model is 'barrel'\n");
}

/// A fit of a session goes on from an earlier one, not from the values that were set.
#[test]
fn a_fit_of_a_session_goes_on_from_a_file() {
    let folder = wedge();
    let first = fit_wedge(folder.path(), "scan.ply", "fit.json", &[]);
    let lines = "let a_value = 1mm\n:set b=50mm\n:fit scan.ply --params fit.json -o again.json\nr > 8.9mm\n";
    let (status, out) = gmlc_with_input(folder.path(), &["repl", "wedge.gml"], lines);
    assert_eq!(status, Some(0), "{out}");
    assert!(out.ends_with("the parameters are set to these values\ntrue\n"), "{out}");
    let again = json(&folder.path().join("again.json"));
    assert!(
        moved(&first, &again) < 0.1
            && 4 * again["evaluations"].as_u64().unwrap() < first["evaluations"].as_u64().unwrap()
    );

    let folder = fitted();
    let (status, _) = gmlc_with_input(folder.path(), &["repl", "drum.gml"], ":fit scan.ply --params fit.json\n");
    assert_eq!(status, Some(1), "the session has other inputs than the fit");
    let inputs = ":set knobs=5\n:set tall=true\n:set gap=3mm\n:fit scan.ply --params fit.json\n";
    let (status, out) = gmlc_with_input(folder.path(), &["repl", "drum.gml"], inputs);
    assert_eq!(status, Some(0), "{out}");
}

/// The deviations of the pose that gmlc adds are said, and the motions along which it is held.
#[test]
fn the_deviations_of_an_added_pose_are_said() {
    let folder = tempdir().expect("a folder");
    let tin = "model tin {\n  param r: length in 10mm..60mm = 30mm\n  part body = cylinder(r, 40mm)\n  part base = disc(r).flip()\n}\n";
    write(folder.path(), "tin.gml", tin);
    gmlc(folder.path(), &["scan", "tin.gml", "-p", "r=33mm", "--spacing", "3mm", "--noise", "0.1mm", "-o", "scan.ply"]);
    let out = gmlc(folder.path(), &["fit", "tin.gml", "scan.ply", "-o", "fit.json"]);
    let line = out.lines().find(|line| line.starts_with("  sd: shift ")).unwrap_or_else(|| panic!("{out}"));
    assert!(line.contains(" mm along x, y, z; turn ") && line.contains(" deg about x, y, z through ("), "{line}");
    assert!(out.contains("\n  held, a symmetry: a turn about ("), "{out}");
    // The first number is the root of the matrix's element.
    let covariance = &json(&folder.path().join("fit.json"))["pose_covariance"];
    let sd = covariance["matrix"][1][1].as_f64().expect("a number").sqrt();
    let said: f64 = line.split_whitespace().nth(2).and_then(|word| word.parse().ok()).expect("a number");
    assert!((said - sd).abs() < 1e-4 && sd > 0.0, "{line} {sd}");
}

/// The truth of a virtual scan has the values, the inputs and the pose that `--params` takes of a fit.
#[test]
fn a_truth_stands_in_the_place_of_a_fit() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    write(at, "drum.gml", DRUM);
    write(at, "knob.gml", KNOB);
    let inputs = ["--input", "knobs=5", "--input", "tall=true"];
    let scan = ["scan", "drum.gml", "-p", "r=42mm", "--spacing", "4mm", "--noise", "0.1mm", "--outliers", "0"];
    gmlc(at, &[&scan[..], &["-o", "scan.ply", "--truth", "truth.json"], &inputs].concat());
    let out = gmlc(at, &["mesh", "drum.gml", "--params", "truth.json", "-o", "drum.ply"]);
    assert!(out.contains("8 parts"), "{out}");
    let options = ["--params", "truth.json", "--resolution", "128", "--device", "cpu", "-o", "out"];
    gmlc(at, &[&["variance", "drum.gml", "scan.ply"][..], &options].concat());
    let report = json(&at.join("out/variance.json"));
    // Where the scan was taken: what is left are its noise and its chords.
    assert!(report["signed"]["median"].as_f64().is_some_and(|median| median.abs() < 0.05), "{report}");
    assert!(report["rms"].as_f64().is_some_and(|rms| rms < 0.3), "{report}");
    assert!(report["warnings"].as_array().expect("warnings").iter().all(|w| !w.to_string().contains("relied")));
    gmlc(at, &["check", "drum.gml", "--params", "truth.json"]);
    gmlc(at, &["fit", "drum.gml", "scan.ply", "--params", "truth.json", "-o", "fit.json"]);
    let fit = json(&at.join("fit.json"));
    assert!((parameter(&fit, "r") - 42.0).abs() < 0.1, "{fit}");
    gmlc(at, &["compare", "fit.json", "truth.json", "-o", "difference.json"]);
    let difference = json(&at.join("difference.json"));
    assert_eq!(
        (&difference["operands"][1]["kind"], &difference["parameters"][0]["b"]),
        (&"truth".into(), &42.0.into())
    );
    let r = &difference["parameters"][0];
    assert!(r["z"].as_f64().is_some_and(|z| z.abs() < 5.0), "what is exact has no deviation of its own: {r}");

    // A scan of what was fitted or scanned is where that was, and so is its truth.
    let again = ["scan", "drum.gml", "--params", "truth.json", "--spacing", "4mm", "--noise", "0mm", "--outliers", "0"];
    gmlc(at, &[&again[..], &["--seed", "7", "-o", "again.ply", "--truth", "again.json"]].concat());
    let options = ["--params", "again.json", "--resolution", "128", "--device", "cpu", "-o", "again"];
    gmlc(at, &[&["variance", "drum.gml", "again.ply"][..], &options].concat());
    let rms = json(&at.join("again/variance.json"))["rms"].as_f64().expect("a number");
    assert!(rms < 0.3, "{rms}");

    let error = fails(at, &["mesh", "drum.gml", "--params", "truth.json", "--input", "knobs=4", "-o", "drum.ply"], 2);
    assert!(error.contains("truth.json") && error.contains("knobs=5"), "{error}");
    write(at, "other.gml", "model other { param q: length = 1mm part p = sphere(q) }");
    let error = fails(at, &["mesh", "other.gml", "--params", "truth.json", "-o", "drum.ply"], 1);
    assert!(error.contains("truth.json"), "{error}");
}
