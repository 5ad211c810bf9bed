//! Files that are not what they are taken for: fits that were edited, cut, or are of something else, and other files
//! under the name of a script.

use crate::support::{ball, fails, gmlc_in, json, text};
use serde_json::{Value, json as of};
use std::fs;
use std::path::Path;
use tempfile::tempdir;

type Change = fn(&mut Value);

/// Writes the fit with a change as `edited.json`.
fn edit(folder: &Path, change: impl Fn(&mut Value)) {
    let mut fit = json(&folder.join("fit.json"));
    change(&mut fit);
    fs::write(folder.join("edited.json"), fit.to_string()).expect("written");
}

#[test]
fn fits_that_cannot_be_are_refused_by_all_commands() {
    let folder = ball::fitted();
    let at = folder.path();
    let changes: [(&str, Change); 24] = [
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
