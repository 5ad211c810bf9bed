//! The built command: its printed text, its files, its failures.

use crate::support::{example, fails, gmlc, json};
use std::fs;
use tempfile::tempdir;

#[test]
fn help_of_every_command() {
    let folder = tempdir().expect("a folder");
    let mut all = gmlc(folder.path(), &["--help"]);
    for command in crate::options::COMMANDS {
        all.push_str(&format!("\n$ gmlc {command} --help\n"));
        all.push_str(&gmlc(folder.path(), &[command, "--help"]));
    }
    insta::assert_snapshot!(all);
}

#[test]
fn check_prints_a_table_of_parameters_and_parts() {
    let folder = tempdir().expect("a folder");
    insta::assert_snapshot!(gmlc(folder.path(), &["check", &example("cup/cup.gml")]));
}

#[test]
fn check_gives_json() {
    let folder = tempdir().expect("a folder");
    let out = gmlc(folder.path(), &["check", &example("cup/cup.gml"), "--format", "json"]);
    let document: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(document["ok"], true);
    assert_eq!(document["parameters"].as_array().map(Vec::len), Some(15));
    assert_eq!(document["parts"][3]["name"], "handle");
}

#[test]
fn a_script_with_errors_is_underlined() {
    let folder = tempdir().expect("a folder");
    fs::write(
        folder.path().join("wrong.gml"),
        "model wrong {\n  param r: length = 3mm\n  let a = r + 1\n  let b = sinn(2)\n  part p = |u, v| (r, r, r)\n}\n",
    )
    .expect("written");
    insta::assert_snapshot!(fails(folder.path(), &["check", "wrong.gml"], 1));
    let output = crate::support::gmlc_in(folder.path(), &["check", "wrong.gml", "--format", "json"]);
    assert_eq!(output.status.code(), Some(1));
    let document: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(document["ok"], false);
    assert_eq!(document["diagnostics"][0]["line"], 3);
}

#[test]
fn derivatives_are_printed_as_text() {
    let folder = tempdir().expect("a folder");
    let all = gmlc(folder.path(), &["diff", &example("cup/cup.gml")]);
    let one = gmlc(folder.path(), &["diff", &example("cup/cup.gml"), "--wrt", "h1"]);
    assert!(one.len() < all.len());
    insta::assert_snapshot!(one);
    let error = fails(folder.path(), &["diff", &example("cup/cup.gml"), "--wrt", "hh"], 2);
    assert!(error.contains("no parameter of that name") || error.contains("hh"), "{error}");
}

#[test]
fn derivatives_are_what_a_person_would_write() {
    let folder = tempdir().expect("a folder");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/derivatives/rules.gml");
    insta::assert_snapshot!(gmlc(folder.path(), &["diff", script]));
}

#[test]
fn every_stage_is_emitted() {
    let folder = tempdir().expect("a folder");
    for (stage, expected) in [("ast", "model"), ("typed", "handle"), ("ir", "cos"), ("clif", "fmul"), ("asm", "mulsd")]
    {
        let out = gmlc(folder.path(), &["emit", &example("cup/cup.gml"), "--stage", stage]);
        assert!(out.contains(expected), "--stage {stage} has no '{expected}':\n{}", &out[..out.len().min(2000)]);
    }
}

/// A folder with three scripts: one is formatted, one is not, one has an error.
fn unformatted(folder: &std::path::Path) {
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, text).expect("written");
    };
    write("all/good.gml", "let a = 1\n");
    write("all/deeper/bad.gml", "/// A number.\nlet a = 1 // one\nlet b=2\n");
    write("all/notes.txt", "let a=1");
    write("all/.hidden.gml", "let a=1");
    write("wrong.gml", "let a = (1\n");
}

#[test]
fn scripts_are_formatted_in_place() {
    let folder = tempdir().expect("a folder");
    unformatted(folder.path());
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).expect("a file");
    let error = fails(folder.path(), &["fmt", "--check", "all"], 1);
    assert!(error.contains("not everything is formatted"), "{error}");
    assert!(read("all/deeper/bad.gml").contains("b=2"), "--check changes nothing");
    let out = gmlc(folder.path(), &["fmt", "all"]);
    assert_eq!(out, "formatted all/deeper/bad.gml\n1 file formatted, 1 file unchanged\n");
    assert_eq!(read("all/deeper/bad.gml"), "/// A number.\nlet a = 1  // one\nlet b = 2\n");
    assert_eq!(read("all/notes.txt"), "let a=1");
    assert_eq!(gmlc(folder.path(), &["fmt", "--check", "all"]), "0 files to be formatted, 2 files unchanged\n");
}

#[test]
fn formatting_reports_for_people_and_programs() {
    let folder = tempdir().expect("a folder");
    unformatted(folder.path());
    let check = crate::support::gmlc_in(folder.path(), &["fmt", "--check", "all", "wrong.gml"]);
    assert_eq!(check.status.code(), Some(1));
    let out = crate::support::text(&check.stdout);
    assert_eq!(
        out,
        "all/deeper/bad.gml:2: is not formatted\n1 file to be formatted, 1 file unchanged, 1 file with errors\n"
    );
    assert!(crate::support::text(&check.stderr).contains("'(' is never closed"));
    let check = crate::support::gmlc_in(folder.path(), &["fmt", "--check", "all", "wrong.gml", "--format", "json"]);
    let document: serde_json::Value = serde_json::from_slice(&check.stdout).expect("JSON");
    assert_eq!(document[0], serde_json::json!({ "file": "all/deeper/bad.gml", "status": "changed", "line": 2 }));
    assert_eq!(document[2]["status"], "error");
    // A script that cannot be parsed is left as it is.
    fails(folder.path(), &["fmt", "wrong.gml"], 1);
    assert_eq!(fs::read_to_string(folder.path().join("wrong.gml")).expect("a file"), "let a = (1\n");
    assert!(fails(folder.path(), &["fmt", "none.gml"], 1).contains("no such file"));
    assert!(fails(folder.path(), &["fmt", "-", "all"], 2).contains("cannot be combined"));
}

/// Suggestions are shown in the file that they change.
#[test]
fn several_files_with_errors_are_told_apart() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("a.gml"), "let a = 3 mm\n").expect("written");
    fs::write(folder.path().join("b.gml"), "// another\nlet b = 4 cm\n").expect("written");
    let error = fails(folder.path(), &["fmt", "--check", "a.gml", "b.gml"], 1);
    assert!(error.contains("1 | let a = 3mm") && error.contains("2 | let b = 4cm"), "{error}");
}

#[test]
fn standard_input_is_formatted_to_standard_output() {
    let folder = tempdir().expect("a folder");
    let (status, out) = crate::support::gmlc_with_input(folder.path(), &["fmt", "-"], "let a=1");
    assert_eq!((status, out.as_str()), (Some(0), "let a = 1\n"));
    let (status, out) = crate::support::gmlc_with_input(folder.path(), &["fmt", "--check", "-"], "let a=1");
    assert_eq!(status, Some(1));
    assert!(out.starts_with("standard input:1: is not formatted\n"), "{out}");
}

#[test]
fn reference_pages_are_printed_or_written() {
    let folder = tempdir().expect("a folder");
    let cup = gmlc(folder.path(), &["doc", &example("cup/cup.gml")]);
    assert!(cup.starts_with("# cup.gml\n\n## Model cup\n\nThe generative cup"), "{cup}");
    assert!(cup.contains("| `r` | length | `15mm` | `80mm` | `40mm` | Radius at the rim. |"), "{cup}");
    assert_eq!(gmlc(folder.path(), &["doc", &example("cup/cup.gml"), "-o", "new/pages"]), "");
    assert_eq!(fs::read_to_string(folder.path().join("new/pages/cup.md")).expect("a page"), cup);
    gmlc(folder.path(), &["doc", "std", "-o", "std"]);
    assert!(["std/README.md", "std/curve.md"].iter().all(|page| folder.path().join(page).exists()));
    fs::write(folder.path().join("wrong.gml"), "model m {").expect("written");
    assert!(fails(folder.path(), &["doc", "wrong.gml"], 1).contains("never closed"));
}

#[test]
fn meshes_in_three_formats() {
    let folder = tempdir().expect("a folder");
    let script = example("cup/cup.gml");
    for name in ["cup.obj", "cup.ply", "new/folder/cup.stl"] {
        let out = gmlc(folder.path(), &["mesh", &script, "-p", "r=42mm", "-p", "alpha=90deg", "-o", name]);
        assert!(out.contains("4 parts"), "{out}");
        assert!(folder.path().join(name).exists());
    }
    let obj = fs::read_to_string(folder.path().join("cup.obj")).expect("an OBJ file");
    assert_eq!(obj.lines().filter(|l| l.starts_with("g ")).count(), 4);
    assert!(obj.lines().any(|l| l.starts_with("vt ")));
    // Turned by 90 degrees about x, the axis lies along -y: the rim's largest z is its radius.
    let z = obj.lines().filter(|l| l.starts_with("v ")).filter_map(|l| l.split(' ').nth(3)?.parse::<f64>().ok());
    assert!((z.fold(f64::MIN, f64::max) - 42.0).abs() < 0.05);
}

#[test]
fn what_is_wrong_with_files_and_options_is_said() {
    let folder = tempdir().expect("a folder");
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("written");
    write("empty.ply", "");
    write("text.stl", "this is no mesh");
    write("cloud.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    write("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
    write("flat.obj", "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n");
    write("empty.gml", "");
    let cup = example("cup/cup.gml");
    let table: [(&[&str], i32, &[&str]); 20] = [
        (&["check", "none.gml"], 1, &["none.gml", "no such file"]),
        (&["check", "."], 1, &["folder"]),
        (&["check", "empty.gml"], 1, &["model"]),
        (&["check", "cloud.obj"], 1, &["error"]),
        (&["fit", "cloud.obj", &cup], 1, &["script", "first"]),
        (&["check", &cup, "--input", "lid=yes"], 2, &["lid", "true"]),
        (&["fit", &cup, "none.ply"], 1, &["none.ply"]),
        (&["fit", &cup, "empty.ply"], 1, &["empty.ply"]),
        (&["fit", &cup, "text.stl"], 1, &["text.stl"]),
        (&["fit", &cup, "nan.obj"], 1, &["nan.obj", "finite"]),
        (&["fit", &cup, "flat.obj"], 1, &["flat.obj"]),
        (&["inspect", &cup, "cloud.obj", "--fill-holes", "2mm", "-o", "out"], 1, &["cloud.obj", "triangles"]),
        (&["fit", &cup, "cloud.obj", "--unit", "furlong"], 2, &["--unit", "furlong"]),
        (&["fit", &cup, "cloud.obj", "-p", "r=42"], 2, &["r", "42mm"]),
        (&["fit", &cup, "cloud.obj", "-p", "q=42mm"], 2, &["q", "shape"]),
        (&["mesh", &cup, "-o", "cup.step"], 2, &["cup.step", ".stl"]),
        (&["mesh", &cup, "-p", "r=1000mm", "-o", "cup.obj"], 1, &["r", "bounds"]),
        (&["variance", "flat.obj", "cloud.obj", "-o", "out", "--resolution", "1000"], 2, &["power of two"]),
        (&["inspect", &cup, "cloud.obj", "-o", "out", "--max-distance=-3mm"], 2, &["--max-distance"]),
        (&["inspect", &cup, "cloud.obj", "-o", "out", "--tolerance", "1mm/1mm"], 2, &["--tolerance", "equal"]),
    ];
    for (args, status, words) in table {
        let error = fails(folder.path(), args, status);
        for word in words {
            assert!(error.contains(word), "gmlc {}: no '{word}' in\n{error}", args.join(" "));
        }
    }
    assert!(!folder.path().join("cup.obj").exists());
}

/// For every limit there is a script that reaches it and compiles without it; the error names the option that raises
/// the limit.
#[test]
fn limits_are_options() {
    let folder = tempdir().expect("a folder");
    let script = "\
fn count(n: int) -> real = if n == 0 { 0 } else { 1 + count(n - 1) }
fn halvings(x: real) -> real = if x < 1 { 0 } else { 1 + halvings(x / 2) }
model m {
  param a: real in 1..1e9 = 1000
  let known = count(20)
  let many = sum(for i in 0..40 { i })
  let long = fold(0.0, 0..100, |s, i| s + a / (i + 1))
  part p = cylinder(1mm * (known + many + halvings(a) + long), 1mm)
}
";
    fs::write(folder.path().join("m.gml"), script).expect("written");
    let all = "steps=1000000,depth=1000,nesting=400,instances=20000,iterations=4096,nodes=4000000,operations=800000";
    let mut args = vec!["mesh", "m.gml", "-o", "m.ply", "--chord", "1mm"];
    all.split(',').for_each(|limit| args.extend(["--limit", limit]));
    gmlc(folder.path(), &args);
    let table = [
        ("steps=20", "takes more than 20 steps (see --limit steps)"),
        ("depth=5", "nested deeper than 5 (see --limit depth)"),
        ("nesting=10", "calls are nested more than 10 deep"),
        ("instances=15", "functions are instantiated more than 15 times"),
        ("iterations=30", "this loop has 40 iterations, but at most 30 can be unrolled"),
        ("nodes=100", "the script grows beyond 100 nodes"),
        ("operations=20", "the limit 'operations' is 20"),
    ];
    for (limit, said) in table {
        let error = fails(folder.path(), &["mesh", "m.gml", "-o", "m.ply", "--limit", limit], 1);
        let name = limit.split('=').next().unwrap_or_default();
        assert!(error.contains(said) && error.contains(&format!("--limit {name}")), "{limit}: {error}");
        assert!(error.contains("m.gml"), "{limit}: {error}");
    }
    for (limit, said) in [
        ("steps=0", "must be at least 1"),
        ("steps=many", "not a whole number"),
        ("speed=3", "the limits are steps, depth, nesting, instances, iterations, parts, nodes, operations"),
        ("steps", "--limit"),
    ] {
        let error = fails(folder.path(), &["check", "m.gml", "--limit", limit], 2);
        assert!(error.contains(said), "{limit}: {error}");
    }
}

#[test]
fn a_virtual_scan_is_the_same_for_the_same_seed() {
    let folder = tempdir().expect("a folder");
    let script = example("cup/octagonal_cup.gml");
    for (name, seed) in [("a.ply", "3"), ("b.ply", "3"), ("c.ply", "4")] {
        gmlc(folder.path(), &["scan", &script, "--spacing", "3mm", "--seed", seed, "-o", name]);
    }
    let bytes = |name: &str| fs::read(folder.path().join(name)).expect("a scan");
    assert!(bytes("a.ply") == bytes("b.ply"));
    assert!(bytes("a.ply") != bytes("c.ply"));
}

/// A picture has the requested size and shows the model; each view gives another picture.
#[test]
fn a_model_as_a_picture() {
    let folder = tempdir().expect("a folder");
    let cup = example("cup/cup.gml");
    let mut seen = Vec::new();
    for view in ["corner", "front", "back", "top", "below", "inside", "-100,5"] {
        gmlc(folder.path(), &["mesh", &cup, "--view", view, "--size", "96x80", "-o", "cup.png"]);
        let file = std::fs::File::open(folder.path().join("cup.png")).expect("the picture");
        let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("its size")];
        let frame = reader.next_frame(&mut pixels).expect("pixels");
        assert_eq!((frame.width, frame.height), (96, 80));
        let corner = pixels[..3].to_vec();
        let drawn = pixels.chunks_exact(3).filter(|p| *p != corner).count();
        assert!(drawn > 96 * 80 / 5, "{view}: {drawn} pixels");
        assert!(!seen.contains(&pixels), "{view}");
        seen.push(pixels);
    }
    for (args, word) in [
        (["--view", "sideways", "-o", "a.png"], "AZIMUTH"),
        (["--size", "5", "-o", "a.png"], "pixels"),
        (["--view", "top", "-o", "a.obj"], ".png"),
    ] {
        let err = fails(folder.path(), &[&["mesh", &cup][..], &args].concat(), 2);
        assert!(err.contains(word), "{err}");
    }
}

/// With the mesh of the scanned model as the reference, the deviations are the scanner's noise.
#[test]
fn a_reference_mesh_without_texture_coordinates_is_measured() {
    let folder = tempdir().expect("a folder");
    let script = example("cup/octagonal_cup.gml");
    gmlc(folder.path(), &["mesh", &script, "-o", "cup.stl"]);
    let scan =
        ["scan", &script, "--no-pose", "--noise", "0.2mm", "--spacing", "1.5mm", "--outliers", "0", "-o", "scan.ply"];
    gmlc(folder.path(), &scan);
    let out = gmlc(
        folder.path(),
        &["variance", "cup.stl", "scan.ply", "-o", "out", "--max-distance", "2mm", "--resolution", "512"],
    );
    assert!(out.contains("positive: the scan lies outside"), "{out}");
    let report = json(&folder.path().join("out/variance.json"));
    let rms = report["rms"].as_f64().expect("a number");
    // The noise of 0.2 mm is along the view direction. Along the normal, and interpolated between points, it is
    // smaller, but more than a third of that.
    assert!((0.07..0.2).contains(&rms), "rms {rms}");
    assert!(report["signed"]["mean"].as_f64().expect("a number").abs() < 0.02);
    assert!(report["coverage"].as_f64().expect("a number") > 0.85);
    for name in ["distance.png", "distance.tif", "colours.png"] {
        assert!(folder.path().join("out").join(name).exists(), "{name}");
    }

    let measured = |tolerance, folder| {
        let options = ["--max-distance", "3mm", "--resolution", "256", "--tolerance", tolerance, "-o", folder];
        [&["variance", "cup.stl", "scan.ply"], &options[..]].concat()
    };
    gmlc(folder.path(), &measured("1mm", "in"));
    let error = fails(folder.path(), &measured("+0.15/+0.3mm", "out_of"), 3);
    assert!(error.contains("does not conform: ") && error.contains("0.1500 to 0.3000 mm"), "{error}");
    for (out, outcome) in [("in", "conforms"), ("out_of", "does not conform")] {
        let report = json(&folder.path().join(out).join("variance.json"));
        let conformance = &report["tolerance"];
        assert_eq!(
            (&report["verdict"]["outcome"], &report["parts"][0]["verdict"]["outcome"]),
            (&outcome.into(), &outcome.into())
        );
        let area = |name: &str| conformance[name].as_f64().expect("a number");
        let sum = area("area_below") + area("area_within") + area("area_above");
        assert!((sum / report["measured_area"].as_f64().expect("a number") - 1.0).abs() < 1e-9);
        assert_eq!(area("share") == 1.0, conformance["within"] == true);
    }
}

/// As in `gmlc doc std | head`.
#[test]
#[cfg(unix)]
fn a_reader_that_leaves_is_no_error() {
    use std::process::{Command, Stdio};
    let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
    let mut child =
        command.args(["doc", "std"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// What is a text is JSON with the text in it.
#[test]
fn texts_are_printed_as_json() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let parsed = |args: &[&str]| serde_json::from_str::<serde_json::Value>(&gmlc(at, args)).expect("JSON");
    let cup = example("cup/cup.gml");
    for (args, key, value) in [
        (vec!["diff", &cup, "--wrt", "r"], "wrt", "r"),
        (vec!["emit", &cup, "--stage", "ir"], "stage", "ir"),
        (vec!["emit", &cup, "--stage", "ast"], "stage", "ast"),
    ] {
        let document = parsed(&[&args[..], &["--json"]].concat());
        assert_eq!(document["text"], gmlc(at, &args));
        assert_eq!(document[key], value);
    }
    let document = parsed(&["doc", &cup, "--json"]);
    assert_eq!(
        (&document["pages"][0]["name"], &document["pages"][0]["text"]),
        (&"cup.md".into(), &gmlc(at, &["doc", &cup]).into())
    );
    let document = parsed(&["doc", &cup, "-o", "pages", "--json"]);
    assert_eq!(document, serde_json::json!({ "output": "pages", "files": ["cup.md"] }));
}
