//! Ctrl-C ends a fit within seconds, with the best solution so far.

use crate::support::{example, gmlc, json, text};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::tempdir;

#[test]
fn an_interrupted_fit_leaves_the_best_so_far() {
    let folder = tempdir().expect("a folder");
    let (script, scan, fit) = (example("can/can.gml"), "scan.ply", "fit.json");
    gmlc(folder.path(), &["scan", &script, "--spacing", "2mm", "-o", scan]);
    // This number of bootstrap samples takes minutes.
    let child = Command::new(env!("CARGO_BIN_EXE_gmlc"))
        .args(["fit", &script, scan, "-o", fit, "--bootstrap", "100000"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("gmlc");
    std::thread::sleep(Duration::from_secs(5));
    let pressed = Instant::now();
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    assert!(sent.success());
    let output = child.wait_with_output().expect("its output");
    // An idle machine takes a tenth of this.
    assert!(pressed.elapsed() < Duration::from_secs(10), "{:?}", pressed.elapsed());
    let err = text(&output.stderr);
    assert!(output.status.code() == Some(1) && err.contains("interrupted"), "{:?} {err}", output.status);
    let fit = json(&folder.path().join(fit));
    assert_eq!(fit["interrupted"], true);
    assert!(fit["parameters"].as_array().is_some_and(|p| p.len() > 3), "{fit}");
}
