//! `--search`: discrete inputs are found from virtual scans.

use crate::support::{example, fails, gmlc, json};
use serde_json::Value;
use std::path::Path;
use tempfile::tempdir;

/// Scans an example with an input, searches the input, and returns fit.json and the printed text.
fn searched(folder: &Path, name: &str, scan: &[&str], search: &str) -> (Value, String) {
    let script = example(name);
    let mut args = vec!["scan", &script, "-o", "scan.ply"];
    args.extend(scan);
    gmlc(folder, &args);
    let text = gmlc(folder, &["fit", &script, "scan.ply", "--search", search, "-o", "fit.json"]);
    (json(&folder.join("fit.json")), text)
}

/// Panics unless a search ended with this value of an input, with strong evidence for it.
fn wins_clearly(fit: &Value, input: &str, value: i64, text: &str) {
    assert_eq!(fit["search"]["candidates"][0]["inputs"][input], value, "{text}");
    assert!(fit["search"]["margin"].as_f64() > Some(10.0), "{text}");
}

#[test]
fn bolts_of_a_flange_are_counted() {
    let folder = tempdir().expect("a folder");
    let scan = ["--input", "bolts=5", "-p", "rim=86mm", "--spacing", "4mm", "--noise", "0.2mm"];
    let (fit, text) = searched(folder.path(), "flange/flange.gml", &scan, "bolts=5..6");
    wins_clearly(&fit, "bolts", 5, &text);
    assert_eq!(fit["search"]["candidates"].as_array().map(Vec::len), Some(2), "{text}");
    assert!(text.contains("bolts=5 wins, bolts=6 is next"), "{text}");
    // The result is that of the winner.
    assert!((crate::support::parameter(&fit, "rim") - 86.0).abs() < 0.1, "{text}");
}

#[test]
fn flutes_of_a_column_are_counted() {
    let folder = tempdir().expect("a folder");
    let scan = ["--input", "flutes=16", "--spacing", "45mm", "--noise", "1mm"];
    let (fit, text) = searched(folder.path(), "column/column.gml", &scan, "flutes=16..17");
    wins_clearly(&fit, "flutes", 16, &text);
}

/// Ridges at which the flutes meet are kinks; and twenty flutes keep step with any grid of five samples.
#[test]
fn flutes_with_sharp_ridges_are_counted() {
    let folder = tempdir().expect("a folder");
    let script = folder.path().join("pot.gml").display().to_string();
    let text = "model pot {\n  input flutes: int in 6..40 = 16\n\
        param foot: length in 15mm..60mm = 25mm\n  param rim: length in 20mm..80mm = 38mm\n\
        param groove: length in 0mm..10mm = 1mm\n\
        part wall = |u, v| polar(mix(foot, rim, v) - groove * abs(sin(flutes * u * 180deg)), u * 1turn, v * 60mm)\n}\n";
    std::fs::write(&script, text).expect("it can be written");
    let scan = ["scan", &script, "-o", "scan.ply", "--input", "flutes=20", "-p", "groove=3mm", "-p", "rim=42mm"];
    gmlc(folder.path(), &[&scan[..], &["--spacing", "3mm", "--noise", "0.1mm"]].concat());
    let text = gmlc(folder.path(), &["fit", &script, "scan.ply", "--search", "flutes=20..21", "-o", "fit.json"]);
    let fit = json(&folder.path().join("fit.json"));
    wins_clearly(&fit, "flutes", 20, &text);
    assert!((crate::support::parameter(&fit, "groove") - 3.0).abs() < 0.03, "{text}");
    // A cone of one height slides within itself: what it is at its ends follows from where the scan ends.
    let reasons: Vec<Option<&str>> =
        fit["parameters"].as_array().expect("parameters").iter().map(|p| p["without_sd"].as_str()).collect();
    assert_eq!(reasons, [Some("the scan ends there"), Some("the scan ends there"), None], "{text}");
    assert!(fit["converged"] == true, "{text}");
}

#[test]
fn sides_of_a_polygonal_cup_are_counted() {
    let folder = tempdir().expect("a folder");
    let scan = ["--input", "sides=7", "--spacing", "3mm", "--noise", "0.2mm"];
    let (fit, text) = searched(folder.path(), "cup/octagonal_cup.gml", &scan, "sides=7..8");
    wins_clearly(&fit, "sides", 7, &text);
    // The corners stand out by 0.75 mm, which is four standard deviations of the noise.
    assert!((crate::support::parameter(&fit, "wave") - 0.75).abs() < 0.05, "{text}");
}

#[test]
fn searches_that_make_no_sense_are_refused() {
    let folder = tempdir().expect("a folder");
    let flange = example("flange/flange.gml");
    gmlc(folder.path(), &["scan", &flange, "--spacing", "15mm", "-o", "scan.ply"]);
    let refused = |more: &[&str]| {
        let mut args = vec!["fit", &flange, "scan.ply"];
        args.extend(more);
        fails(folder.path(), &args, 2)
    };
    assert!(refused(&["--search", "screws=3..6"]).contains("no input of that name; it has bolts"));
    assert!(refused(&["--search", "bolts=3"]).contains("expected two whole numbers, such as 3..16"));
    assert!(refused(&["--search", "bolts=6..3"]).contains("the range is reversed: did you mean 3..6?"));
    assert!(refused(&["--search", "bolts=3..90"]).contains("goes from 3 to 24"));
    assert!(refused(&["--search", "bolts=3..6", "--input", "bolts=4"]).contains("also set with --input"));
    assert!(refused(&["--search", "bolts=3..4", "--search", "bolts=5..6"]).contains("searched twice"));
}

/// Of many values most are given up after a quick fit.
#[test]
fn a_search_over_many_values_is_a_race() {
    let folder = tempdir().expect("a folder");
    let scan = ["--input", "bolts=5", "-p", "rim=86mm", "--spacing", "4mm", "--noise", "0.2mm"];
    let (fit, text) = searched(folder.path(), "flange/flange.gml", &scan, "bolts=3..8");
    wins_clearly(&fit, "bolts", 5, &text);
    let candidates = fit["search"]["candidates"].as_array().expect("candidates");
    let given_up = |c: &&Value| c["quick"] == true;
    assert_eq!(candidates.len(), 6, "{text}");
    assert!(!candidates[..2].iter().any(|c| given_up(&c)), "{text}");
    let count = candidates.iter().filter(given_up).count();
    assert!(count >= 2 && text.matches("  given up\n").count() == count, "{text}");
    // The result is a whole fit.
    assert!(fit["covariance"].is_object() && fit["converged"] == true, "{text}");
    assert!((crate::support::parameter(&fit, "rim") - 86.0).abs() < 0.1, "{text}");
}
