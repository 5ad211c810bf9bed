//! A signal ends every command within a second, wherever it is.

use crate::support::{example, gmlc, text};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::{TempDir, tempdir};

const BUOY: &str = "model buoy {
  param r: length in 5mm..50mm = 20mm
  part shell = sphere(r)
  part lamp = sphere(6mm).translate((0mm, 0mm, r))
}
";

/// A script that takes minutes to check.
const SLOW: &str =
    "fn slow(r: length) = loop(r, 100000, |s, i| loop(s, 100000, |t, j| t + r * sin((i + j) * 1rad) * 1e-15))
model slowly {
  param r: length in 5mm..50mm = 20mm
  part p = sphere(slow(r))
}
";

/// The work that a command may do after a signal: a second of its two threads. It is processor time, which other
/// processes do not lengthen.
const END: f64 = 2.0;

/// A command that waits for something after a signal ends in this time on a busy machine.
const WAIT: Duration = Duration::from_secs(20);

/// Whether a process is over, and the seconds of processor time that it has taken.
fn state(process: u32) -> (bool, f64) {
    const TICKS: f64 = 100.0;
    let about = fs::read_to_string(format!("/proc/{process}/stat")).expect("a process that nobody has waited for");
    let words: Vec<&str> = about.rsplit(')').next().expect("words").split_whitespace().collect();
    let ticks = |word: usize| words[word].parse::<f64>().expect("a number");
    (matches!(words[0], "Z" | "X"), (ticks(11) + ticks(12)) / TICKS)
}

/// Runs a command until it has taken some processor time, sends a signal, and returns the processor time that it takes
/// from then on.
fn ends(at: &Path, args: &[&str], signal: &str, after: f64) -> f64 {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
    command.args(args).current_dir(at).env("NO_COLOR", "1").env("RAYON_NUM_THREADS", "2");
    let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("gmlc");
    let wait = |over: &dyn Fn((bool, f64)) -> bool, most: Duration| {
        let begun = Instant::now();
        loop {
            let now = state(child.id());
            if over(now) {
                return now;
            }
            assert!(begun.elapsed() < most, "{args:?} takes {:?}, {signal} after {after} s", begun.elapsed());
            std::thread::sleep(Duration::from_millis(5));
        }
    };
    let (is_over, before) = wait(&|(is_over, time)| is_over || time >= after, Duration::from_secs(300));
    assert!(!is_over, "{args:?} was over before {signal}");
    let sent = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status();
    assert!(sent.expect("kill").success());
    let (_, time) = wait(&|(is_over, _)| is_over, WAIT);
    let output = child.wait_with_output().expect("its output");
    let said = text(&output.stderr);
    assert!(output.status.code() == Some(1) && said.contains("interrupted"), "{args:?}: {:?} {said}", output.status);
    time - before
}

fn prepared() -> TempDir {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("buoy.gml"), BUOY).expect("written");
    fs::write(at.join("slow.gml"), SLOW).expect("written");
    gmlc(at, &["scan", "buoy.gml", "--spacing", "3mm", "-o", "scan.ply"]);
    gmlc(at, &["fit", "buoy.gml", "scan.ply", "-o", "fit.json"]);
    gmlc(at, &["scan", &example("can/can.gml"), "--spacing", "0.7mm", "-o", "can.ply"]);
    folder
}

/// Who starts a command so that it outlives the terminal does not want it to end with that.
#[test]
fn a_signal_that_is_ignored_stays_ignored() {
    let folder = prepared();
    let line = "trap '' HUP; exec \"$0\" \"$@\"";
    let mut command = Command::new("bash");
    command.args(["-c", line, env!("CARGO_BIN_EXE_gmlc"), "fit", "buoy.gml", "scan.ply", "-o", "again.json"]);
    let child = command.current_dir(folder.path()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("bash");
    std::thread::sleep(Duration::from_millis(300));
    _ = Command::new("kill").args(["-HUP", &child.id().to_string()]).stderr(Stdio::null()).status();
    let output = child.wait_with_output().expect("its output");
    assert!(output.status.code().is_some_and(|status| status != 1), "{:?}", output.status);
    assert!(folder.path().join("again.json").exists());
}

/// All commands that may take long end soon after a signal, wherever they are, and leave nothing but fits.
#[test]
fn signals_end_every_long_command() {
    if !Path::new("/proc/self/stat").exists() {
        println!("skipped: there is no /proc");
        return;
    }
    let folder = prepared();
    let at = folder.path();
    let can = example("can/can.gml");
    let variance = "variance buoy.gml scan.ply --params fit.json -o measured --resolution 4096 --device cpu";
    let commands: [Vec<&str>; 7] = [
        vec!["fit", &can, "can.ply", "--bootstrap", "100000", "-o", "best.json"],
        vec!["inspect", &can, "can.ply", "--bootstrap", "100000", "-o", "inspected"],
        variance.split(' ').collect(),
        vec!["compare", &can, "can.ply", "--resolution", "4096", "-o", "differences.json"],
        vec!["mesh", &can, "--chord", "0.000002mm", "-o", "can.stl"],
        vec!["scan", &can, "--spacing", "0.05mm", "-o", "large.ply"],
        vec!["check", "slow.gml", "--limit", "steps=1000000000000"],
    ];
    for args in &commands {
        for (signal, after) in [("TERM", 0.2), ("HUP", 1.0), ("INT", 3.0)] {
            let time = ends(at, args, signal, after);
            println!("{time:.2} s of processor time after {signal} at {after} s: {}", args[0]);
            assert!(time < END, "{args:?} took {time} s of processor time after {signal} at {after} s");
        }
    }
    let mut there: Vec<String> = fs::read_dir(at)
        .expect("a folder")
        .chain(["inspected", "measured"].iter().flat_map(|name| fs::read_dir(at.join(name)).expect("a folder")))
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    there.sort();
    let known = "best.json buoy.gml can.ply fit.json fit.json inspected measured scan.ply slow.gml";
    there.retain(|name| name != "unfinished-fit.json");
    assert_eq!(there.join(" "), known);
}
