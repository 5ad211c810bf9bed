//! Limits of time and memory, and values of options that are out of theirs: refused before the work, with the option.

use crate::support::{ball, fails, gmlc_in, text};
use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};
use tempfile::tempdir;

/// The options of a command that take a length, with the arguments that the command needs.
const LENGTHS: [(&[&str], &[&str]); 4] = [
    (
        &["variance", "ball.gml", "scan.ply", "-o", "out"],
        &[
            "--max-distance",
            "--averaging-width",
            "--form-cutoff",
            "--fill-holes",
            "--device-uncertainty",
            "--footprint",
            "--resolution",
            "--tolerance",
        ],
    ),
    (&["fit", "ball.gml", "scan.ply"], &["--sigma"]),
    (&["scan", "ball.gml", "-o", "new.ply"], &["--spacing", "--noise"]),
    (&["mesh", "ball.gml", "-o", "new.ply"], &["--chord"]),
];

#[test]
fn negative_values_are_refused_by_their_option() {
    let folder = ball::scanned(&["--no-pose"]);
    for (command, options) in LENGTHS {
        for option in options {
            for value in ["-1mm", "-.5mm"] {
                let error = fails(folder.path(), &[command, &[option, value]].concat(), 2);
                assert!(error.contains(option) && !error.contains("unexpected argument"), "{option} {value}: {error}");
                let says = ["below zero", "above zero", "power of two"].iter().any(|said| error.contains(said));
                assert!(says || *option == "--tolerance", "{option} {value}: {error}");
            }
        }
    }
    let negative = [
        (&["scan", "ball.gml", "-o", "new.ply", "--outliers", "-1"][..], "is not between 0 and 1"),
        (&["scan", "ball.gml", "-o", "new.ply", "--views", "-1"], "is not a whole number from 1 to 200"),
        (&["variance", "ball.gml", "scan.ply", "-o", "out", "--max-angle", "-1deg"], "must be above 0deg"),
        (&["mesh", "ball.gml", "-o", "new.ply", "-p", "-1"], "expected NAME=VALUE"),
        (&["mesh", "ball.gml", "-o", "new.ply", "-p", "r=-1mm"], "r = -1mm is not within its bounds 5mm..50mm"),
    ];
    for (args, expected) in negative {
        let error = text(&gmlc_in(folder.path(), args).stderr);
        assert!(error.contains(expected) && !error.contains("unexpected argument"), "{args:?}: {error}");
    }
}

#[test]
fn huge_values_are_refused_in_few_digits() {
    let folder = ball::scanned(&["--no-pose"]);
    let at = folder.path();
    let short = |args: &[&str]| {
        let output = gmlc_in(at, args);
        for said in [text(&output.stdout), text(&output.stderr)] {
            let long = said.split(|c: char| !c.is_ascii_digit()).find(|digits| digits.len() > 40);
            assert!(long.is_none() && !said.contains("panicked"), "{args:?}: {said}");
        }
        output.status.code()
    };
    for (command, options) in LENGTHS {
        for option in options {
            for value in ["1e300mm", "1e-300mm"] {
                assert_ne!(short(&[command, &[option, value]].concat()), Some(0), "{option} {value}");
            }
        }
    }
    for args in [
        &["mesh", "ball.gml", "-o", "new.ply", "-p", "r=1e300mm"][..],
        &["fit", "ball.gml", "scan.ply", "-p", "r=1e300mm"],
        &["fit", "ball.gml", "scan.ply", "--fix", "r=1e300mm"],
        &["check", "ball.gml", "--input", "n=1e300"],
    ] {
        assert_ne!(short(args), Some(0), "{args:?}");
    }
    fs::write(at.join("huge.obj"), "v 0 0 0\nv 1e300 0 0\nv 0 1e-300 0\nf 1 2 3\n").expect("written");
    short(&["fit", "ball.gml", "huge.obj"]);
    for (script, command) in [("= 1e300mm", "check"), ("in 1e299mm..1e300mm = 2e299mm", "check"), ("= 1e300mm", "mesh")]
    {
        let script = ball::BALL.replace("in 5mm..50mm = 20mm", script);
        fs::write(at.join("huge.gml"), script).expect("written");
        short(&[&[command, "huge.gml"][..], if command == "mesh" { &["-o", "new.ply"] } else { &[] }].concat());
    }
}

#[test]
fn work_beyond_a_limit_is_refused_before_it_begins() {
    let folder = ball::scanned(&["--no-pose"]);
    let at = folder.path();
    let parts = ball::BALL
        .replace("part p = sphere(r)", "for i in 0..4000 { part p = sphere(r).translate((i * 99mm, 0mm, 0mm)) }");
    fs::write(at.join("parts.gml"), parts).expect("written");
    let variance = ["variance", "ball.gml", "scan.ply", "-o", "out"];
    let averaged = ["--distance", "averaged-normal", "--averaging-width", "0.001mm"];
    let cases: [(Vec<&str>, i32, &str); 8] = [
        (
            [&variance[..], &["--resolution", "16384"]].concat(),
            2,
            "takes about 40.3GB of memory, more than the 4.0GB of --memory",
        ),
        ([&variance[..], &["--resolution", "0.001mm"]].concat(), 2, "--memory 40.3GB"),
        ([&variance[..], &["--resolution", "512", "--memory", "1MB"]].concat(), 2, "more than the 0.1GB of --memory"),
        ([&variance[..], &averaged].concat(), 2, "--averaging-width: bands of 0.001 mm may take"),
        ([&variance[..], &["--memory", "much"]].concat(), 2, "expected an amount such as 8GB"),
        (vec!["scan", "ball.gml", "--spacing", "0.001mm", "-o", "new.ply"], 1, "choose a wider spacing"),
        (vec!["mesh", "parts.gml", "-o", "new.ply"], 1, "the model has more than 1000 parts"),
        (vec!["check", "parts.gml", "--limit", "parts=10"], 1, "--limit parts=N"),
    ];
    for (args, status, expected) in cases {
        let begun = Instant::now();
        let error = fails(at, &args, status);
        assert!(error.contains(expected), "{args:?}: {error}");
        assert!(begun.elapsed() < Duration::from_secs(10), "{args:?}: {:?}", begun.elapsed());
    }
}

#[test]
fn many_unknown_names_are_told_soon() {
    let folder = tempdir().expect("a folder");
    let functions: String = (0..5000).map(|i| format!("fn function_{i}(x: real) = x\n")).collect();
    let unknown: String = (0..3000).map(|i| format!("let a{i} = functoin_{i}x\n")).collect();
    fs::write(folder.path().join("names.gml"), format!("{functions}model m {{\n{unknown}part p = sphere(1mm)\n}}\n"))
        .expect("written");
    let begun = Instant::now();
    let error = fails(folder.path(), &["check", "names.gml"], 1);
    assert!(error.contains("did you mean 'function_290'?") && error.contains("3000 errors in all"), "{error}");
    assert!(begun.elapsed() < Duration::from_secs(15), "{:?}", begun.elapsed());
}

#[test]
fn too_many_threads_are_a_warning() {
    let folder = ball::scanned(&["--no-pose"]);
    let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
    command.args(["fit", "ball.gml", "scan.ply"]).current_dir(folder.path()).env("RAYON_NUM_THREADS", "100000");
    let output = command.output().expect("gmlc");
    let said = text(&output.stderr);
    assert!(said.contains("RAYON_NUM_THREADS=100000: 256 threads are taken"), "{said}");
    assert!(matches!(output.status.code(), Some(0 | 4)), "{said}");
}
