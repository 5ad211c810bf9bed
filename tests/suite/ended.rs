//! What ends a run early: a kill, a disk that is full, a signal. The earlier result is whole, or the later one is, and
//! nothing else is left.
//!
//! `cargo test --release --test suite ended:: -- --include-ignored --nocapture` kills and interrupts many runs, in some
//! four minutes.

use crate::support::{ball, gmlc, gmlc_in, is_thorough, results, text};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

type Files = BTreeMap<String, Vec<u8>>;

/// A measurement of half a second with a dozen files; the tolerance tells whose it is.
const MEASURE: &str =
    "variance ball.gml scan.ply --params fit.json -o out --resolution 64 --points --exr --device cpu --tolerance";
const EARLIER: &str = "0.7125mm";
const LATER: &str = "0.9375mm";

fn words<'a>(line: &'a str, last: &'a str) -> Vec<&'a str> {
    line.split(' ').chain([last]).collect()
}

fn begin(at: &Path, args: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
    command.args(args).current_dir(at).env("NO_COLOR", "1").env("RAYON_NUM_THREADS", "2");
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("gmlc")
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).stderr(Stdio::null()).status();
    sent.expect("kill");
}

/// A folder with an earlier result, the files of that and those that a later run would leave, and its time.
fn with_results(line: &str) -> (TempDir, Files, Files, Duration) {
    let folder = ball::fitted();
    let at = folder.path();
    let begun = Instant::now();
    let [later, earlier] = [LATER, EARLIER].map(|tolerance| {
        gmlc_in(at, &words(line, tolerance));
        results(&at.join("out"))
    });
    assert!(earlier.len() > 8 && earlier != later);
    (folder, earlier, later, begun.elapsed() / 2)
}

/// The names of a folder that begin with a dot.
fn left_over(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    names.map(|name| name.to_string_lossy().into_owned()).filter(|name| name.starts_with('.')).collect()
}

/// Puts the earlier result back.
fn restore(out: &Path, earlier: &Files) {
    fs::remove_dir_all(out).and_then(|()| fs::create_dir(out)).expect("an empty folder");
    earlier.iter().for_each(|(name, bytes)| fs::write(out.join(name), bytes).expect("written"));
}

/// Kills runs over an earlier result at moments all over their time, every third while it puts its files into their
/// place. The folder then has the earlier result whole, or the later one, or says that it has not, which the next run
/// mends; that leaves nothing behind. Returns how many there were of each.
fn kill_runs(kills: u32) -> [u32; 3] {
    let (folder, earlier, later, time) = with_results(MEASURE);
    let at = folder.path();
    let out = at.join("out");
    let mut counts = [0; 3];
    for k in 0..kills {
        let mut child = begin(at, &words(MEASURE, LATER));
        let share = f64::from(k + 1) / f64::from(kills + 1);
        match k % 3 {
            0 => std::thread::sleep(time.mul_f64(share)),
            1 => std::thread::sleep(time.mul_f64(0.85 + 0.2 * share)),
            _ => {
                let is_moving = || out.join(".gmlc-complete").exists() || out.join("INCOMPLETE.txt").exists();
                while !is_moving() && child.try_wait().expect("its status").is_none() {}
            }
        }
        _ = child.kill();
        _ = child.wait();
        let is_mixed = out.join("INCOMPLETE.txt").exists() || out.join(".gmlc-complete").exists();
        if !is_mixed {
            let there = results(&out);
            assert!(there == earlier || there == later, "after {k}: {:?}", there.keys());
        }
        // A run that ends with an error leaves a result of its own nowhere.
        let next = gmlc_in(at, &[&words(MEASURE, LATER)[..], &["--max-distance", "0.001mm"]].concat());
        assert_eq!(next.status.code(), Some(2), "{}", text(&next.stderr));
        let there = results(&out);
        assert!(there == earlier || there == later, "after {k} and another run: {:?}", there.keys());
        assert!(!is_mixed || there == later, "after {k}: a result that was complete is lost");
        assert_eq!(left_over(&out), [""; 0], "after {k}");
        counts[if is_mixed { 2 } else { usize::from(there == later) }] += 1;
        restore(&out, &earlier);
    }
    counts
}

#[test]
fn a_killed_run_leaves_one_result() {
    kill_runs(if is_thorough() { 12 } else { 5 });
}

#[test]
#[ignore = "two minutes"]
fn a_hundred_kills_leave_one_result_each() {
    let [earlier, later, mixed] = kill_runs(100);
    println!("100 kills: {earlier} folders had the earlier result, {later} the later one, none files of both unsaid");
    println!("{mixed} said that they were incomplete, and the next run completed them");
}

/// Runs the command with a limit on the size of files, in KiB: they cannot grow beyond it, or (where `is_killed`) the
/// run is killed when one would.
fn with_limit(at: &Path, limit: usize, is_killed: bool, args: &[&str]) -> Output {
    let trap = if is_killed { "" } else { "trap '' XFSZ; " };
    let line = format!("{trap}ulimit -c 0; ulimit -f {limit}; exec \"$0\" \"$@\"");
    let mut command = Command::new("bash");
    command.args(["-c", &line, env!("CARGO_BIN_EXE_gmlc")]).args(args).current_dir(at);
    command.output().expect("a shell")
}

/// From nothing to the largest file, in steps, and one KiB less than each file has.
fn limits(sizes: impl Iterator<Item = usize>, steps: usize) -> Vec<usize> {
    let each: Vec<usize> = sizes.map(|size| size.saturating_sub(1) / 1024).collect();
    let most = each.iter().copied().max().expect("a file");
    let mut limits: Vec<usize> = each.into_iter().chain((0..steps).map(|k| k * most / steps)).collect();
    limits.sort_unstable();
    limits.dedup();
    limits
}

/// A disk that is full at any write, as a limit on the size of files has it: the earlier result stays whole.
#[test]
fn a_disk_that_is_full_at_any_write_leaves_the_earlier_result() {
    let (folder, earlier, later, _) = with_results(MEASURE);
    let at = folder.path();
    let out = at.join("out");
    // A file of the later result may be smaller than that of the earlier one.
    let size = |name: &String| fs::metadata(out.join(name)).expect("there").len() as usize;
    let sizes = earlier.keys().map(|name| size(name).min(later[name].len()));
    let limits = limits(sizes, 6);
    assert!(limits.len() > 8, "{limits:?}");
    let every = if is_thorough() { 1 } else { 4 };
    for (k, limit) in limits.into_iter().enumerate().step_by(every) {
        let output = with_limit(at, limit, false, &words(MEASURE, LATER));
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{limit} KiB: {said}");
        assert!(said.contains("larger than the system allows") && !said.contains("panicked"), "{limit} KiB: {said}");
        assert!(results(&out) == earlier, "{limit} KiB: the earlier result has changed");
        assert_eq!(left_over(&out), [""; 0], "{limit} KiB");
        if k % 4 == 0 {
            let output = with_limit(at, limit, true, &words(MEASURE, LATER));
            assert!(output.status.code() != Some(0) && results(&out) == earlier, "{limit} KiB, killed");
            gmlc_in(at, &[&words(MEASURE, LATER)[..], &["--max-distance", "0.001mm"]].concat());
            assert!(results(&out) == earlier && left_over(&out).is_empty(), "{limit} KiB, killed");
        }
    }
}

/// A batch ends there, and no scan is said to have no result.
#[test]
fn a_batch_goes_on_when_there_is_room_again() {
    let folder = crate::batch::tins(3, false);
    let at = folder.path();
    let args = words("batch tin.gml scans -o out --documents figures --resolution 128 --jobs 1", "-q");
    let output = with_limit(at, 4, false, &args);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("larger than the system allows") && !said.contains("no result"), "{said}");
    gmlc(at, &args);
    let table = fs::read_to_string(at.join("out/table.csv")).expect("a table");
    assert_eq!((table.lines().count(), table.matches("inspected").count()), (4, 3), "{table}");
}

/// The same of outputs that are single files.
#[test]
fn a_disk_that_is_full_leaves_the_earlier_file() {
    let folder = ball::fitted();
    let at = folder.path();
    let commands: [&[&str]; 4] = [
        &["mesh", "ball.gml", "--chord", "0.1mm", "-o", "made/ball.ply"],
        &["mesh", "ball.gml", "-o", "made/ball.png"],
        &["scan", "ball.gml", "--spacing", "1.5mm", "-o", "made/other.ply"],
        &["compare", "fit.json", "ball.gml", "--param-b", "r=21mm", "-o", "made/differences.json"],
    ];
    for args in commands {
        gmlc(at, args);
        let file = at.join(args.last().expect("a file"));
        let whole = fs::read(&file).expect("read");
        for (k, limit) in limits([whole.len()].into_iter(), 2).into_iter().enumerate() {
            for is_killed in if k == 0 { &[true, false][..] } else { &[false] } {
                let is_killed = *is_killed;
                let output = with_limit(at, limit, is_killed, args);
                let said = text(&output.stderr);
                assert_eq!(output.status.code(), (!is_killed).then_some(1), "{args:?} {limit} KiB: {said}");
                assert!(fs::read(&file).expect("read") == whole, "{args:?} {limit} KiB");
                if !is_killed {
                    // Nor is anything left of the run that was killed before.
                    assert!(said.contains("larger than the system allows"), "{args:?} {limit} KiB: {said}");
                    assert_eq!(left_over(&at.join("made")), [""; 0], "{args:?} {limit} KiB");
                }
            }
        }
    }
}

/// Interrupts inspections over an earlier result at moments all over their time.
fn interrupt_runs(count: u32) {
    const INSPECT: &str = "inspect ball.gml scan.ply -o out --resolution 64 --device cpu --tolerance";
    let (folder, earlier, later, time) = with_results(INSPECT);
    let at = folder.path();
    let out = at.join("out");
    let mut kept = 0;
    for k in 0..count {
        let child = begin(at, &words(INSPECT, LATER));
        std::thread::sleep(time.mul_f64(f64::from(k) / f64::from(count)));
        signal(&child, ["INT", "TERM", "HUP"][k as usize % 3]);
        let output = child.wait_with_output().expect("its output");
        let said = text(&output.stderr);
        let mut there = results(&out);
        assert_eq!(left_over(&out), [""; 0], "after {k}: {said}");
        let is_kept = there.remove("unfinished-fit.json").is_some();
        kept += u32::from(is_kept);
        match output.status.code() {
            // Before the command handles signals, they end it by themselves.
            None => assert!(there == earlier, "after {k}"),
            // The signal may come when the files are in their place.
            Some(1) => assert!(there == earlier || there == later, "after {k}: {:?}", there.keys()),
            _ => assert!(there == later, "after {k}: {:?}", there.keys()),
        }
        assert!(output.status.code() != Some(1) || said.contains("interrupted"), "{said}");
        assert_eq!(is_kept, said.contains("the fit is in"), "{said}");
        restore(&out, &earlier);
    }
    println!("{count} interruptions: {kept} left the fit beside the earlier result");
}

#[test]
fn an_interrupted_run_leaves_one_result() {
    interrupt_runs(if is_thorough() { 6 } else { 3 });
}

#[test]
#[ignore = "a minute"]
fn twenty_interruptions_leave_one_result_each() {
    interrupt_runs(20);
}
