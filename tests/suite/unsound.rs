//! Files that are not what they are taken for: fits that were edited, cut, or are of something else, and other files
//! under the name of a script.

use crate::support::{ball, fails, gmlc, gmlc_in, json, text};
use serde_json::{Value, json as of};
use std::fs;
use std::path::Path;
use tempfile::{TempDir, tempdir};

type Change = fn(&mut Value);

/// Writes the fit with a change as `edited.json`.
fn edit(folder: &Path, change: impl Fn(&mut Value)) {
    let mut fit = json(&folder.join("fit.json"));
    change(&mut fit);
    fs::write(folder.join("edited.json"), fit.to_string()).expect("written");
}

fn piece(beside: &[&str], share: f64) -> Value {
    of!({ "share": share, "place": [0.0, 0.0, 0.0], "beside": beside, "shaped_by": [] })
}

fn held(name: &str, held: &[f64], p: f64) -> Value {
    let one = [1.0];
    of!({ "parameters": [name], "held": held, "free": one, "sd": one, "statistic": 1.0, "degrees": 1, "p": p })
}

#[test]
fn fits_that_cannot_be_are_refused_by_all_commands() {
    let folder = ball::fitted();
    let at = folder.path();
    let changes: [(&str, Change); 41] = [
        ("has a pose whose rotation is none: it mirrors the model", |fit| {
            let rows = fit["pose"]["rotation"].as_array_mut().expect("rows");
            rows.swap(0, 1);
        }),
        ("has a pose whose rotation is none: row 1 has the length", |fit| {
            let row = fit["pose"]["rotation"][0].as_array_mut().expect("a row");
            row.iter_mut().for_each(|c| *c = of!(2.0 * c.as_f64().expect("a number")));
        }),
        ("has a pose that moves the model by 1e30 mm, beyond 1e12", |fit| fit["pose"]["translation"][1] = of!(1e30)),
        ("has the parameter 'r' twice", |fit| {
            let r = fit["parameters"][0].clone();
            fit["parameters"].as_array_mut().expect("a list").push(r);
        }),
        ("has the parameter 'r' in `cm`; convert its value: such files have `mm` for it", |fit| {
            fit["parameters"][0]["unit"] = of!("cm");
        }),
        ("has the value 1e200 for 'r'", |fit| fit["parameters"][0]["value"] = of!(1e200)),
        ("the model has 'r', which the fit has not", |fit| {
            fit["parameters"] = of!([]);
            for name in ["covariance", "pose_covariance"] {
                fit.as_object_mut().expect("an object").remove(name);
            }
        }),
        ("'r' measured something else", |fit| {
            fit["parameters"][0]["quantity"] = of!("angle");
            fit["parameters"][0]["unit"] = of!("rad");
        }),
        ("is of the model 'cube', and this model is 'ball'", |fit| fit["model"] = of!("cube")),
        ("has `sigma` = -1e0", |fit| fit["sigma"] = of!(-1.0)),
        ("has `inliers` = 2e0", |fit| fit["inliers"] = of!(2.0)),
        ("has a `covariance` that is not a matrix of 1 x 1", |fit| fit["covariance"]["matrix"] = of!([])),
        ("has a `covariance` of 'q', which is not one of its parameters", |fit| {
            fit["covariance"]["parameters"][0] = of!("q");
        }),
        ("has a `covariance` with the variance -1e0 in row 1, column 1", |fit| {
            fit["covariance"]["matrix"][0][0] = of!(-1)
        }),
        ("has a `covariance` with the variance 1e300", |fit| fit["covariance"]["matrix"][0][0] = of!(1e300)),
        ("has `sd` = -1e0 for 'r', which is below zero", |fit| fit["parameters"][0]["sd"] = of!(-1)),
        ("has `sd` = 1e0 for 'r', where its `covariance` has", |fit| fit["parameters"][0]["sd"] = of!(1)),
        ("has a `pose_covariance` with 1e0 in row 2, column 1, which is another one across", |fit| {
            fit["pose_covariance"]["matrix"][1][0] = of!(1);
        }),
        ("has a `pose_covariance` with 1e3 in row 2, column 1, beyond the product", |fit| {
            fit["pose_covariance"]["matrix"][1][0] = of!(1e3);
            fit["pose_covariance"]["matrix"][0][1] = of!(1e3);
        }),
        ("has a `pose_covariance` and no `pose`", |fit| {
            fit.as_object_mut().expect("an object").remove("pose");
        }),
        ("has `scan.sha256` = \"../..\", which is no SHA-256", |fit| fit["scan"]["sha256"] = of!("../..")),
        ("`sigam` is no field of such a file: it is misspelt, or from another version", |fit| fit["sigam"] = of!(1)),
        ("`values` is no field", |fit| fit["parameters"][0]["values"] = of!(1)),
        ("has the model \"pin\\u000aerror: forged line\", which is no model's name", |fit| {
            fit["model"] = of!("pin\nerror: forged line");
        }),
        ("has the parameter \"r\\u202eb\", which is no parameter's name", |fit| {
            fit["parameters"][0]["name"] = of!("r\u{202e}b");
        }),
        ("has the unit \"mm\\u000aforged\", which is no unit's name", |fit| fit["scan"]["unit"] = of!("mm\nforged")),
        ("has the part \"a | b\", which is no part's name", |fit| fit["unexplained"] = of!([piece(&["a | b"], 0.5)])),
        ("names the part 'lid', which the model 'ball' has not", |fit| {
            fit["unexplained"] = of!([piece(&["lid"], 0.5)]);
        }),
        ("has the share 2e0 in `unexplained`, which is not between", |fit| {
            fit["unexplained"] = of!([piece(&["p"], 2.0)]);
        }),
        ("has both `sd` and `without_sd` for 'r'", |fit| fit["parameters"][0]["without_sd"] = of!("fixed")),
        ("has a standard deviation of 'r' that is not in `covariance`", |fit| {
            let fit = fit.as_object_mut().expect("an object");
            fit.remove("covariance");
            fit.remove("pose_covariance");
        }),
        ("has a `covariance` of 'r' twice", |fit| fit["covariance"]["parameters"] = of!(["r", "r"])),
        ("has a `equal` of 'q', which is not one of its parameters", |fit| fit["equal"] = of!([["r", "q"]])),
        ("has a `tests` of 'q', which is not", |fit| fit["tests"] = of!([held("q", &[20.0], 0.5)])),
        ("has an entry of `tests` whose lists", |fit| fit["tests"] = of!([held("r", &[20.0, 21.0], 0.5)])),
        ("has p = 2e0 in `tests`, which is not between 0e0 and 1e0", |fit| {
            fit["tests"] = of!([held("r", &[20.0], 2.0)]);
        }),
        ("has a `alternatives` of 'q', which is not", |fit| {
            fit["alternatives"] = of!([{ "parts": ["p"], "values": { "q": 1.0 }, "evidence": 0.0 }]);
        }),
        ("has the area -1e0 in `contradicted`", |fit| {
            fit["contradicted"] = of!([{ "part": "p", "area": -1.0, "share": 0.5, "place": [0.0, 0.0, 0.0] }]);
        }),
        ("has a symmetry whose `turn` has the length 2e0, neither 1 nor 0", |fit| {
            let turn = of!([2.0, 0.0, 0.0]);
            fit["pose_covariance"]["symmetries"] = of!([{ "shift": [0.0, 0.0, 0.0], "turn": turn, "text": "a turn" }]);
        }),
        ("expected a whole number that is not negative, found integer `-1`", |fit| fit["iterations"] = of!(-1)),
        ("expected an object of JSON (`{`), found a text that begins `[]`", |fit| *fit = of!([])),
    ];
    let commands: [&[&str]; 4] = [
        &["variance", "ball.gml", "scan.ply", "--params", "edited.json", "-o", "out"],
        &["mesh", "ball.gml", "--params", "edited.json", "-o", "mesh.ply"],
        &["fit", "ball.gml", "scan.ply", "--params", "edited.json"],
        &["compare", "edited.json", "ball.gml", "--script", "ball.gml"],
    ];
    for (expected, change) in changes {
        edit(at, change);
        for args in commands {
            let error = fails(at, args, 1);
            assert!(error.contains("edited.json: ") && error.contains(expected), "{args:?}: {error}\n not: {expected}");
        }
    }
    // Bounds may have been narrowed since: another fit begins within them.
    edit(at, |fit| fit["parameters"][0]["value"] = of!(4000));
    let outside = "edited.json: r = 4000mm is not within its bounds 5mm..50mm";
    for args in [commands[0], commands[1], commands[3]] {
        assert!(fails(at, args, 1).contains(outside), "{args:?}");
    }
    let said = text(&gmlc_in(at, commands[2]).stderr);
    assert!(said.contains(&format!("warning: {outside}: the fit begins at the nearest bound")), "{said}");
}

/// A ball with inputs and a measure.
const PIN: &str = "model pin {
  input k: int = 1
  input wide: bool = true
  param r: length in 5mm..50mm = 19.9mm
  measure d tolerance 0.5mm = 2 * r
  require k > 0 or wide, \"k is a count\"
  part p = sphere(r)
}
";

/// A folder with the script, and a fit of it.
fn pin() -> TempDir {
    let folder = ball::scanned(&[]);
    fs::write(folder.path().join("pin.gml"), PIN).expect("written");
    gmlc(folder.path(), &["fit", "pin.gml", "scan.ply", "-o", "fit.json"]);
    folder
}

#[test]
fn inputs_have_values_of_their_types() {
    let folder = pin();
    let at = folder.path();
    let mesh = ["mesh", "pin.gml", "--params", "edited.json", "-o", "mesh.ply"];
    for value in [2.999999, 1.5, 1e300] {
        edit(at, |fit| fit["inputs"][0]["value"] = of!(value));
        let error = fails(at, &mesh, 1);
        assert!(error.contains("'k'") && (value > 1e12 || error.contains("which is a whole number")), "{error}");
    }
    for value in [2.0, 0.5, -1.0] {
        edit(at, |fit| fit["inputs"][1]["value"] = of!(value));
        assert!(fails(at, &mesh, 1).contains(&format!("has the input 'wide' = {value}, which is 0 or 1")));
    }
    edit(at, |fit| fit["inputs"][0]["name"] = of!("k\nerror: forged"));
    assert!(fails(at, &mesh, 1).contains("has the input \"k\\u000aerror: forged\", which is no input's name"));
    let long = "k".repeat(3000);
    edit(at, |fit| fit["inputs"][0]["name"] = of!(long));
    let error = fails(at, &mesh, 1);
    assert!(error.len() < 300 && error.contains("kkk..."), "{error}");
}

/// Verdicts on measures rest on the script, the parameters and their covariance, whatever the file states of them.
#[test]
fn measures_of_a_file_are_computed() {
    let folder = pin();
    let at = folder.path();
    let variance = |change: &dyn Fn(&mut Value)| {
        edit(at, |fit| change(&mut fit["measures"][0]));
        let args =
            ["variance", "-q", "pin.gml", "scan.ply", "--params", "edited.json", "-o", "out", "--resolution", "64"];
        let output = gmlc_in(at, &args);
        (output.status.code(), text(&output.stderr))
    };
    let verdict = || json(&at.join("out/variance.json"))["measures"][0].clone();
    assert_eq!(variance(&|_| {}), (Some(0), String::new()));
    let right = verdict();
    assert_eq!((&right["lower"], &right["upper"]), (&of!(-0.5), &of!(0.5)), "{right}");
    let changes: [(&str, Change); 5] = [
        ("has another tolerance of 'd' than the script", |d| d["tolerance"] = of!({ "lower": -50.0, "upper": 50.0 })),
        ("has another tolerance of 'd' than the script", |d| d["tolerance"] = of!({ "lower": -0.5, "upper": 0.4 })),
        ("has another value of the measure 'd'", |d| d["value"] = of!(99.0)),
        ("has another standard deviation of the measure 'd'", |d| d["sd"] = of!(1e9)),
        ("has other derivatives of the measure 'd'", |d| d["derivatives"]["r"] = of!(1e3)),
    ];
    for (expected, change) in changes {
        let (status, said) = variance(&change);
        assert!(status == Some(0) && said.contains(&format!("warning: edited.json: {expected}")), "{said}");
        assert_eq!(verdict(), right, "{expected}");
    }
    let (_, said) = variance(&|d| d["name"] = of!("e"));
    assert!(said.contains("measures that the script has not, left out: 'e'"), "{said}");
    assert!(said.contains("lacks the measure 'd'") && verdict() == right, "{said}");
    let (status, said) = variance(&|d| d["nominal"] = of!(60.0));
    assert!(said.contains("the nominal value 60 mm of 'd', where the script's defaults give 39.8 mm"), "{said}");
    assert_eq!(status, Some(3), "{said}");
    for (expected, change) in [
        ("has the tolerance 5e0 to -5e0 for 'd', which leaves nothing", of!({ "lower": 5.0, "upper": -5.0 })),
        ("expected a number, found null", of!({ "lower": null, "upper": 1.0 })),
    ] {
        let (status, said) = variance(&|d| d["tolerance"] = change.clone());
        assert!(status == Some(1) && said.contains(expected), "{said}");
    }
    // A parameter that was held is no start value that nobody knows.
    gmlc(at, &["fit", "pin.gml", "scan.ply", "--fix", "r=20mm", "-o", "fit.json"]);
    assert_eq!(variance(&|_| {}).1.matches("nominal value").count(), 0);
}

/// What a file says beside names is shown, and not obeyed.
#[test]
fn other_texts_of_a_fit_forge_no_lines() {
    let folder = ball::fitted();
    let at = folder.path();
    let path = format!("a\nerror: forged \u{202e}{}", "x".repeat(3000));
    edit(at, |fit| {
        fit["scan"]["path"] = of!(path);
        fit["scan"]["sha256"] = of!("0".repeat(64));
    });
    let args = ["variance", "ball.gml", "scan.ply", "--params", "edited.json", "-o", "out", "--resolution", "64"];
    let output = gmlc_in(at, &args);
    let said = text(&output.stdout) + &text(&output.stderr);
    assert!(said.contains("another scan (a\\u000aerror: forged \\u202ex"), "{said}");
    assert!(!said.contains("\nerror: forged") && !said.contains(&"x".repeat(100)), "{said}");
}

/// A fit from somebody else names its script: no other file is read and quoted by that.
#[test]
fn what_a_fit_names_is_read_only_if_it_is_a_script() {
    let folder = ball::fitted();
    let at = folder.path();
    fs::write(at.join("secret.txt"), "the secret\n").expect("written");
    let names = |script: &str| {
        edit(at, |fit| fit["script"] = of!(script));
        fails(at, &["compare", "edited.json", "scan.ply"], 1)
    };
    for script in ["secret.txt", "./secret.txt"] {
        let error = names(script);
        assert!(error.contains(&format!("its script `{script}` is none (.gml) and is not read")), "{error}");
        assert!(!error.contains("the secret"), "{error}");
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("secret.txt", at.join("link.gml")).expect("a link");
        let error = names("link.gml");
        assert!(error.contains("is none (.gml) and is not read") && !error.contains("the secret"), "{error}");
    }
    assert!(names("gone.gml").contains("found neither from here nor from the folder of the fit"));
}

#[test]
fn fits_of_something_else_are_told() {
    let folder = ball::fitted();
    let at = folder.path();
    // The same points, and not the same file.
    let scan = fs::read(at.join("scan.ply")).expect("read");
    fs::write(at.join("other.ply"), [b"ply\ncomment another\n", &scan[4..]].concat()).expect("written");
    let variance = |params: &str, scan: &str, more: &[&str]| {
        let args = ["variance", "ball.gml", scan, "--params", params, "-o", "out", "--resolution", "64"];
        let output = gmlc_in(at, &[&args, more].concat());
        (output.status.code(), text(&output.stdout) + &text(&output.stderr))
    };
    let (_, said) = variance("fit.json", "scan.ply", &[]);
    assert!(!said.contains("another scan") && !said.contains("relied"), "{said}");
    let (_, said) = variance("fit.json", "other.ply", &[]);
    assert!(said.contains("fit.json: the model was fitted to another scan (scan.ply) than other.ply"), "{said}");
    let (status, said) = variance("fit.json", "scan.ply", &["--unit", "cm"]);
    assert!(status == Some(1) && said.contains("was fitted to this scan in mm, not in cm: --unit mm"), "{said}");
    for (change, expected) in [
        ((|fit| fit["converged"] = of!(false)) as Change, "relied on: the last stage did not converge"),
        (|fit| fit["interrupted"] = of!(true), "relied on: it was interrupted"),
        (|fit| fit["script_sha256"] = of!("0".repeat(64)), "the text of the script, or of what it uses, has changed"),
    ] {
        edit(at, change);
        let (_, said) = variance("edited.json", "scan.ply", &[]);
        assert!(said.contains(expected), "{said}");
        let output = gmlc_in(at, &["mesh", "ball.gml", "--params", "edited.json", "-o", "mesh.ply"]);
        assert!(text(&output.stderr).contains(expected), "{}", text(&output.stderr));
    }
}

#[test]
fn other_files_under_the_name_of_a_script_are_named() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("user.gml"), format!("use \"page.gml\" (a)\n{}", ball::BALL)).expect("written");
    fs::write(at.join("page.gml"), "<!DOCTYPE html>\n<html>").expect("written");
    fs::write(at.join("pointer.gml"), "version https://git-lfs.github.com/spec/v1\noid sha256:0\n").expect("written");
    fs::write(at.join("fit.gml"), "{\"model\": \"ball\"}").expect("written");
    for (script, expected) in [
        ("page.gml", "expected a script, found an HTML page; download the file again"),
        ("pointer.gml", "found a pointer of Git LFS, not the file itself; `git lfs pull` fetches that"),
        ("fit.gml", "expected a script, found a JSON file; name a script (.gml)"),
        ("user.gml", "page.gml: expected a script, found an HTML page"),
    ] {
        for command in ["check", "fmt", "doc"] {
            if command != "check" && script == "user.gml" {
                continue;
            }
            let error = fails(at, &[command, script], 1);
            assert!(error.contains(expected), "{command} {script}: {error}");
        }
    }
}

/// A box of eight vertices, each once, has one normal at each in most programs: between those of its three faces.
#[test]
fn a_box_that_is_larger_on_all_sides_is_so_by_as_much() {
    let folder = tempdir().expect("a folder");
    for (name, by) in [("box.off", 0.0), ("larger.off", 0.3)] {
        let corner = |i: usize| {
            let side = |bit: usize, half: f64| if i & bit == 0 { -half - by } else { half + by };
            format!("{} {} {}\n", side(1, 30.0), side(2, 20.0), side(4, 10.0))
        };
        let corners: String = (0..8).map(corner).collect();
        let faces = "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n";
        fs::write(folder.path().join(name), format!("OFF\n8 6 0\n{corners}{faces}")).expect("written");
    }
    let args = ["variance", "box.off", "larger.off", "--tolerance", "0.32mm", "--resolution", "128", "-o", "out"];
    gmlc(folder.path(), &args);
    let mean = json(&folder.path().join("out/variance.json"))["signed"]["mean"].as_f64().expect("a mean");
    assert!((mean - 0.3).abs() < 1e-4, "{mean}");
}
