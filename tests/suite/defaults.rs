//! Defaults of options in a file beside the script, and tables for people.

use crate::support::{ball, fails, gmlc, gmlc_in, json, text};
use serde_json::Value;
use std::fs;
use tempfile::tempdir;

/// A setting of a result's provenance: its value, and whether it was given.
fn setting(result: &Value, name: &str) -> (String, bool) {
    let settings = result["provenance"]["settings"].as_array().expect("settings");
    let found = settings.iter().find(|setting| setting["name"] == name).expect(name);
    (found["values"][0].as_str().expect("a value").to_owned(), found["given"].as_bool().expect("yes or no"))
}

#[test]
fn defaults_lie_beside_the_script() {
    let folder = ball::fitted();
    let at = folder.path();
    let toml = "[variance]\nresolution = 64\nmax-distance = \"3mm\"\npoints = true\n\n[scan]\nspacing = \"4mm\"\n";
    fs::write(at.join("gmlc.toml"), toml).expect("written");
    let run = |options: &[&str], out: &str| {
        let args = [&["variance", "ball.gml", "scan.ply", "--params", "fit.json", "-o", out], options].concat();
        let output = gmlc_in(at, &args);
        assert!(output.status.success(), "{}", text(&output.stderr));
        (json(&at.join(out).join("variance.json")), text(&output.stderr))
    };
    let (taken, said) = run(&[], "taken");
    assert!(said.contains("defaults from ./gmlc.toml: resolution, max-distance, points"), "{said}");
    assert_eq!(setting(&taken, "max-distance"), ("3mm".to_owned(), false));
    assert!(taken["max_distance"] == 3.0 && at.join("taken/points.ply").exists());
    let files = taken["provenance"]["files"].as_array().expect("files");
    assert!(files.iter().any(|file| file["role"] == "defaults" && file["name"] == "gmlc.toml"), "{files:?}");
    // The command line goes before them.
    let (given, said) = run(&["--max-distance", "2mm"], "given");
    assert_eq!(setting(&given, "max-distance"), ("2mm".to_owned(), true));
    assert!(given["max_distance"] == 2.0 && !said.contains("max-distance"), "{said}");
    let (without, said) = run(&["--no-defaults", "--resolution", "64"], "without");
    assert!(without["max_distance"] != 3.0 && !said.contains("gmlc.toml"), "{said}");
    let (_, quiet) = run(&["-q"], "quiet");
    assert!(!quiet.contains("gmlc.toml"), "{quiet}");
}

/// Of two things that are compared, the first script's defaults are taken.
#[test]
fn defaults_of_a_comparison() {
    let folder = ball::fitted();
    let at = folder.path();
    fs::write(at.join("gmlc.toml"), "[compare]\nresolution = 64\n").expect("written");
    for [a, b] in [["ball.gml", "fit.json"], ["fit.json", "./ball.gml"]] {
        let output = gmlc_in(at, &["compare", a, b]);
        let said = text(&output.stderr);
        assert!(output.status.success() && said.contains("gmlc.toml: resolution"), "{a} {b}: {said}");
    }
}

/// A file from elsewhere names no files, and what is wrong with it is said with its line.
#[test]
fn defaults_that_are_none_are_refused() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("ball.gml"), ball::BALL).expect("written");
    let mesh = ["mesh", "ball.gml", "-o", "ball.ply"];
    for (toml, said) in [
        ("[mesh]\nchrod = \"1mm\"\n", "./gmlc.toml:2: `gmlc mesh` has no option `chrod`; did you mean `chord`?"),
        ("\n[mesh]\noutput = \"/tmp/x.ply\"\n", "./gmlc.toml:3: `output` has no default here"),
        ("[fit]\nparams = \"/etc/passwd\"\n", "./gmlc.toml:2: `params` has no default here"),
        ("[mesh]\nchord = \"-1mm\"\n", "./gmlc.toml:2: invalid value '-1mm' for '--chord <LENGTH>': is below zero"),
        ("[mesh]\nchord = 1e\n", "./gmlc.toml:2: is not TOML"),
        ("[draw]\n", "./gmlc.toml:1: `draw` takes no defaults"),
    ] {
        fs::write(at.join("gmlc.toml"), toml).expect("written");
        let error = fails(at, &mesh, 1);
        assert!(error.contains(said), "{toml}: {error}");
    }
    // Commands that take none do not read it.
    gmlc(at, &["check", "ball.gml"]);
    fs::write(at.join("secret.txt"), "password = 1\n").expect("written");
    fs::remove_file(at.join("gmlc.toml")).expect("removed");
    std::os::unix::fs::symlink("secret.txt", at.join("gmlc.toml")).expect("a link");
    let error = fails(at, &mesh, 1);
    assert!(error.contains("link to a file of another name") && !error.contains("password"), "{error}");
    assert!(!at.join("ball.ply").exists());
}

/// Every number of the tables: none has more digits than mean something.
#[test]
fn tables_have_units_and_few_digits() {
    let folder = ball::fitted();
    let at = folder.path();
    let measured = ["variance", "ball.gml", "scan.ply", "--params", "fit.json", "--resolution", "64", "-o", "out"];
    let variance = gmlc(at, &measured);
    for heading in ["area mm2", "rms mm", "signed mean mm", "largest mm"] {
        assert!(variance.contains(heading), "{heading}: {variance}");
    }
    let fit = gmlc(at, &["fit", "ball.gml", "scan.ply"]);
    let compare = gmlc(at, &["compare", "fit.json", "ball.gml"]);
    for out in [&variance, &fit, &compare] {
        let tables = out.lines().filter(|line| line.contains("  ") && !line.starts_with(' '));
        for word in tables.flat_map(str::split_whitespace).filter(|word| word.parse::<f64>().is_ok()) {
            let digits = word.trim_start_matches(['-', '0', '.']).split('e').next().unwrap_or_default();
            let digits = digits.chars().filter(char::is_ascii_digit).count();
            assert!(digits <= 7 && !(word.contains('.') && digits > 6), "{word} in\n{out}");
        }
    }
    // The radius has two digits of its standard deviation.
    let row: Vec<&str> = fit.lines().find(|line| line.starts_with("r ")).expect("r").split_whitespace().collect();
    let decimals = |word: &str| word.split_once('.').map_or(0, |(_, behind)| behind.len());
    assert!(decimals(row[1]) == decimals(row[2]), "{row:?}");
    assert_eq!(row[2].trim_start_matches(['0', '.']).len(), 2, "{row:?}");
}
