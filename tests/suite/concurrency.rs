//! What runs at the same time: threads, and two runs into one folder.

use crate::support::{gmlc, results, text};
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tempfile::{TempDir, tempdir};

const BUOY: &str = "model buoy {
  param r: length in 5mm..50mm = 20mm
  part shell = sphere(r)
  part lamp = sphere(6mm).translate((0mm, 0mm, r))
}
";

fn buoy() -> TempDir {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("buoy.gml"), BUOY).expect("written");
    gmlc(folder.path(), &["scan", "buoy.gml", "--spacing", "3mm", "-o", "scan.ply"]);
    folder
}

fn begin(at: &Path, args: &[&str], threads: &str) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
    command.args(args).current_dir(at).env("NO_COLOR", "1").env("RAYON_NUM_THREADS", threads);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("gmlc")
}

#[test]
fn results_are_those_of_one_thread_whatever_their_number() {
    let folder = buoy();
    let at = folder.path();
    let run = |threads: &str| {
        let out = format!("out{threads}");
        let options = ["--resolution", "64", "--device", "cpu", "--bootstrap", "4", "--tolerance", "0.5mm"];
        let files = ["--points", "--exr", "--sensitivities", "-o", &out];
        let args = [&["inspect", "buoy.gml", "scan.ply"][..], &options, &files].concat();
        let output = begin(at, &args, threads).wait_with_output().expect("its output");
        let printed = text(&output.stdout).replace(&out, "out");
        let printed: Vec<String> =
            printed.lines().filter(|line| !line.starts_with("converged after")).map(str::to_owned).collect();
        // A run that takes more than ten seconds, as on a busy machine, says where it is (`casting rays (...)`), which
        // is nothing that it found.
        const FOUND: [&str; 5] = ["error: ", "warning: ", "unreliable fit: ", "undecided: ", "does not conform: "];
        let is_found = |line: &&str| FOUND.iter().any(|begin| line.starts_with(begin));
        let said: Vec<String> = text(&output.stderr).lines().filter(is_found).map(str::to_owned).collect();
        (output.status.code(), printed, said, results(&at.join(out)))
    };
    let (status, printed, said, expected) = run("1");
    assert!(matches!(status, Some(0 | 3 | 4)) && expected.len() > 10, "{said:?}");
    for threads in ["2", "3", "8", "64"] {
        let (other, lines, words, files) = run(threads);
        assert_eq!((other, &lines, &words), (status, &printed, &said), "{threads} threads");
        assert_eq!(files.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
        let differ: Vec<&String> = files.keys().filter(|name| files[*name] != expected[*name]).collect();
        assert!(differ.is_empty(), "{differ:?} with {threads} threads differ from those with one");
    }
}

/// Two runs into one folder at once, at several distances in time: what is there is the result of one of them.
#[test]
fn of_two_runs_at_once_one_is_there_whole() {
    let folder = buoy();
    let at = folder.path();
    let args =
        |tolerance| ["inspect", "buoy.gml", "scan.ply", "-o", "out", "--resolution", "64", "--tolerance", tolerance];
    let alone = ["0.7125mm", "0.9375mm"].map(|tolerance| {
        begin(at, &args(tolerance), "1").wait().expect("its status");
        let files = results(&at.join("out"));
        fs::remove_dir_all(at.join("out")).expect("removed");
        files
    });
    for delay in [0, 20, 100] {
        let one = begin(at, &args("0.7125mm"), "1");
        std::thread::sleep(Duration::from_millis(delay));
        let two = begin(at, &args("0.9375mm"), "1");
        let ended = [one, two].map(|child| child.wait_with_output().expect("its output"));
        for output in &ended {
            let said = text(&output.stderr);
            assert!(matches!(output.status.code(), Some(0 | 3 | 4)), "{said}");
        }
        let files = results(&at.join("out"));
        assert!(alone.contains(&files), "after {delay} ms the folder has files of two runs: {:?}", files.keys());
    }
}
