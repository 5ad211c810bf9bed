//! Many scans: what a batch finds beside the truth, and what is left of it when it is ended.

use crate::support::{fails, gmlc, gmlc_in, json, parameter, text};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::{TempDir, tempdir};

/// A closed tin.
const TIN: &str = "use std.surface (revolve, flip)
model tin {
  param r: length in 10mm..60mm = 20mm
  param h: length in 10mm..90mm = 50mm
  measure width tolerance 0.6mm = 2 * r
  part wall = revolve(|t| (r, h * t))
  part lid = flip(revolve(|t| (r * t, h)))
  part base = revolve(|t| (r * t, 0mm))
}
";

/// The same with a ring about its middle, 0.3 mm high, as of a worn tool.
const WORN: (&str, &str) = ("(r, h * t)", "(r + 0.3mm * (4 * t * (1 - t)) ^ 8, h * t)");

/// Radius and height of each tin: neighbours differ, and the height follows the radius.
fn truth(i: usize) -> [f64; 2] {
    let step = ((i * 5) % 11) as f64 - 5.0;
    [20.0 + 0.05 * step, 50.0 + 0.1 * step + 0.02 * ((i * 3) % 7) as f64]
}

/// A folder with tin.gml and so many scans of tins, or of worn ones.
pub(crate) fn tins(count: usize, is_worn: bool) -> TempDir {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("tin.gml"), TIN).expect("written");
    let real = if is_worn { TIN.replace(WORN.0, WORN.1) } else { TIN.to_owned() };
    fs::write(at.join("real.gml"), real).expect("written");
    fs::create_dir(at.join("scans")).expect("made");
    for i in 0..count {
        let [r, h] = truth(i);
        let (r, h, seed) = (format!("r={r}mm"), format!("h={h}mm"), i.to_string());
        let scan = format!("scans/tin_{i}.ply");
        let args = ["scan", "real.gml", "-p", &r, "-p", &h, "--spacing", "2mm", "--noise", "0.05mm", "-q"];
        gmlc(at, &[&args[..], &["--outliers", "0", "--seed", &seed, "-o", &scan]].concat());
    }
    folder
}

/// The options that all batches here have: small textures and no documents.
const FAST: [&str; 5] = ["--documents", "figures", "--resolution", "128", "-q"];

fn batch<'a>(output: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["batch", "tin.gml", "scans", "-o", output], &FAST[..], more].concat()
}

/// The table: a map from column to cell for each row.
fn table(folder: &Path) -> Vec<BTreeMap<String, String>> {
    let text = fs::read_to_string(folder.join("table.csv")).expect("a table");
    let mut lines = text.split_terminator("\r\n").map(cells);
    let head = lines.next().expect("a head");
    lines.map(|cells| head.iter().cloned().zip(cells).collect()).collect()
}

/// The cells of a line (RFC 4180).
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut quoted) = (vec![String::new()], false);
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            c => cells.last_mut().expect("one").push(c),
        }
    }
    cells
}

/// The table without what differs from run to run.
fn figures(folder: &Path) -> Vec<BTreeMap<String, String>> {
    let mut rows = table(folder);
    rows.iter_mut().for_each(|row| row.retain(|name, _| !["seconds", "time"].contains(&name.as_str())));
    rows
}

fn figure(row: &BTreeMap<String, String>, name: &str) -> f64 {
    row.get(name).and_then(|cell| cell.parse().ok()).unwrap_or_else(|| panic!("{name}: {row:?}"))
}

#[test]
fn a_population_is_found_as_it_was_made() {
    let folder = tins(8, false);
    let at = folder.path();
    fs::rename(at.join("scans/tin_7.ply"), at.join("scans/tin_10.ply")).expect("renamed");
    let said = gmlc(at, &batch("out", &[]));
    assert!(said.contains("8 scans, 8 fitted and measured, 8 conforms"), "{said}");
    let rows = table(&at.join("out"));
    assert_eq!(rows.len(), 8);
    // In the order of the numbers in the names.
    assert_eq!(rows[7]["name"], "tin_10");
    for (i, row) in rows.iter().enumerate() {
        for (k, name) in ["param.r", "param.h"].iter().enumerate() {
            let error = figure(row, name) - truth(i)[k];
            let sd = figure(row, &format!("{name}.sd"));
            assert!(error.abs() < 5.0 * sd, "{name} of {i}: {error} with {sd}");
        }
        assert_eq!(row["measure.width.verdict"], "conforms");
    }
    let summary = json(&at.join("out/summary.json"));
    let series = |name: &str| {
        let all = summary["series"].as_array().expect("series").clone();
        all.into_iter().find(|s| s["name"] == name).unwrap_or_else(|| panic!("no {name}"))
    };
    for (k, name) in ["r", "h"].iter().enumerate() {
        let values: Vec<f64> = (0..8).map(|i| truth(i)[k]).collect();
        let mean = values.iter().sum::<f64>() / 8.0;
        let sd = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 7.0).sqrt();
        let effects = &series(name)["effects"];
        // Measurement moves a mean of eight by a few micrometres, and the spread by its square.
        assert!((effects["mean"].as_f64().expect("a mean") - mean).abs() < 0.02, "{name}: {effects}");
        assert!((effects["between"].as_f64().expect("a spread") / sd - 1.0).abs() < 0.1, "{name}: {effects}");
    }
    let correlation = summary["correlations"][0]["r"].as_f64().expect("a correlation");
    assert!(correlation > 0.9, "{}", summary["correlations"]);
    let widths: Vec<f64> = rows.iter().map(|row| figure(row, "measure.width")).collect();
    let mean = widths.iter().sum::<f64>() / 8.0;
    let sd = (widths.iter().map(|w| (w - mean).powi(2)).sum::<f64>() / 7.0).sqrt();
    let ppk = (40.6 - mean).min(mean - 39.4) / (3.0 * sd);
    let found = series("width")["capability"]["ppk"]["value"].as_f64().expect("it has a tolerance");
    assert!((found - ppk).abs() < 1e-9, "{found} {ppk}");
    // The same figures as those of an inspection.
    gmlc(at, &["inspect", "tin.gml", "scans/tin_3.ply", "-o", "alone", "--resolution", "128", "-q"]);
    let alone = parameter(&json(&at.join("alone/fit.json")), "r");
    assert_eq!(alone, figure(&rows[3], "param.r"));
}

#[test]
fn what_all_tins_share_is_in_the_map() {
    let folder = tins(4, true);
    let at = folder.path();
    // Widths near their limits may be undecided.
    let status = gmlc_in(at, &batch("out", &[])).status.code();
    assert!(matches!(status, Some(0 | 4)), "{status:?}");
    let file = fs::read(at.join("out/deviation-mean.tif")).expect("a map");
    let mut decoder = tiff::decoder::Decoder::new(std::io::Cursor::new(file)).expect("TIFF");
    let tiff::decoder::DecodingResult::F32(mean) = decoder.read_image().expect("pixels") else { panic!("floats") };
    let measured: Vec<f32> = mean.into_iter().filter(|d| d.is_finite()).collect();
    let largest = measured.iter().copied().fold(f32::MIN, f32::max);
    // The ring is 0.3 mm high; the fit raises the wall by some of its mean, which is 0.08 mm.
    assert!((0.2..0.33).contains(&largest), "{largest}");
    let high = measured.iter().filter(|d| **d > 0.1).count() as f64 / measured.len() as f64;
    assert!((0.08..0.3).contains(&high), "the ring is a part of the wall: {high}");
}

#[test]
fn a_bad_scan_stops_nobody_and_a_second_run_does_only_what_is_new() {
    let folder = tins(4, false);
    let at = folder.path();
    fs::write(at.join("scans/tin_9.ply"), "ply\nnothing").expect("written");
    fs::copy(at.join("scans/tin_1.ply"), at.join("scans/tin_1b.ply")).expect("copied");
    let said = fails(at, &batch("out", &[]), 1);
    assert!(said.contains("1 of 6 scans have no result"), "{said}");
    let rows = table(&at.join("out"));
    let row = |name: &str, rows: &[BTreeMap<String, String>]| {
        rows.iter().find(|row| row["name"] == name).cloned().unwrap_or_else(|| panic!("{name}"))
    };
    assert_eq!(row("tin_9", &rows)["status"], "failed");
    assert!(!row("tin_9", &rows)["reason"].is_empty());
    assert_eq!(row("tin_1b", &rows)["status"], "copy");
    assert!(row("tin_1b", &rows)["reason"].contains("the same file as scans/tin_1.ply"));
    // Nothing is done again, not what has failed either.
    fails(at, &batch("out", &[]), 1);
    assert_eq!(table(&at.join("out")), rows);
    // One scan has another content, and the bad one is mended.
    fs::copy(at.join("scans/tin_3.ply"), at.join("scans/tin_9.ply")).expect("copied");
    gmlc(at, &["scan", "real.gml", "--seed", "99", "--spacing", "2mm", "-q", "-o", "scans/tin_3.ply"]);
    fs::remove_file(at.join("scans/tin_1b.ply")).expect("removed");
    gmlc(at, &batch("out", &[]));
    let after = table(&at.join("out"));
    assert_eq!(after.len(), 5);
    for name in ["tin_0", "tin_1", "tin_2"] {
        assert_eq!(row(name, &after), row(name, &rows));
    }
    assert_ne!(row("tin_3", &after)["param.r"], row("tin_3", &rows)["param.r"]);
    assert_eq!(row("tin_9", &after)["status"], "inspected");
    // Another option: all of it.
    gmlc(at, &batch("out", &["--loss", "tukey"]));
    assert_ne!(table(&at.join("out"))[0]["key"], rows[0]["key"]);
}

/// Killed at several moments, and run again: the table is that of a batch that was left alone.
#[test]
fn a_batch_that_is_killed_goes_on_where_it_was() {
    let folder = tins(4, false);
    let at = folder.path();
    let args = batch("out", &["--start-from", "previous", "-j", "2"]);
    let mut kept = 0;
    for wait in [300, 700, 1500] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
        let mut child =
            command.args(&args).current_dir(at).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it runs");
        sleep(Duration::from_millis(wait));
        _ = child.kill();
        child.wait().expect("it ends");
        let done = |entry: fs::DirEntry| entry.path().join("row.json").is_file();
        let finished =
            fs::read_dir(at.join("out/scans")).map_or(0, |all| all.flatten().map(done).filter(|d| *d).count());
        assert!(finished >= kept, "{finished} rows are there, and {kept} were");
        kept = finished;
    }
    gmlc(at, &args);
    // With one worker, and never ended.
    gmlc(at, &batch("whole", &["--start-from", "previous", "-j", "1"]));
    let (found, expected) = (figures(&at.join("out")), figures(&at.join("whole")));
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(&expected) {
        let differs = |(name, cell): &(&String, &String)| expected.get(*name) != Some(*cell);
        assert_eq!(found.iter().filter(differs).collect::<Vec<_>>(), [], "{expected:?}");
    }
    let left = fs::read_dir(at.join("out/scans/tin_0")).expect("results").flatten();
    let names: Vec<String> = left.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    assert!(names.iter().all(|name| !name.starts_with(".gmlc")), "{names:?}");
}

/// An interrupt keeps what is finished, says what is not, and ends soon.
#[cfg(unix)]
#[test]
fn an_interrupted_batch_writes_the_table_of_what_is_done() {
    let folder = tins(5, false);
    let at = folder.path();
    let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
    let child = command.args(batch("out", &["-j", "1"])).current_dir(at).stdout(Stdio::null()).stderr(Stdio::piped());
    let child = child.spawn().expect("it runs");
    let begun = Instant::now();
    while !at.join("out/scans/tin_1/row.json").is_file() && begun.elapsed() < Duration::from_secs(60) {
        sleep(Duration::from_millis(20));
    }
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    assert!(sent.success());
    let output = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("the same command goes on with them"), "{said}");
    let rows = table(&at.join("out"));
    assert!((2..5).contains(&rows.len()), "{}", rows.len());
    assert!(rows.iter().all(|row| row["status"] == "inspected"));
    gmlc(at, &batch("out", &[]));
    assert_eq!(table(&at.join("out")).len(), 5);
}

#[test]
fn wrong_command_lines_are_refused_before_the_work() {
    let folder = tins(1, false);
    let at = folder.path();
    let refused = |args: &[&str], expected: &str| {
        let said = fails(at, args, 2);
        assert!(said.contains(expected), "{args:?}: {said}");
    };
    refused(&["batch", "tin.gml", "scans", "-o", "scans"], "among the scans");
    refused(&["batch", "tin.gml", "none*.ply", "-o", "out"], "no file has a name of this pattern");
    refused(&["batch", "tin.gml", "-o", "out"], "SCAN");
    refused(&["batch", "tin.gml", "scans", "--trace", "t.csv", "-o", "out"], "--trace");
    refused(&["batch", "tin.gml", "scans", "-p", "q=3mm", "-o", "out"], "q");
    assert!(!at.join("out").exists());
    let absent = gmlc_in(at, &["batch", "tin.gml", "absent.ply", "-o", "out", "-q"]);
    assert_eq!(absent.status.code(), Some(1));
    assert_eq!(table(&at.join("out"))[0]["reason"], "there is no such file");
}

/// A stub that is a little wider below than above, with a pin on one side: upside down it nearly fits as well, with the
/// taper's sign turned.
const STUB: &str = "use std.frame (rotate, translate)
use std.surface (cylinder, disc, flip, revolve)
model stub {
  param r: length in 15mm..40mm = 25mm
  param h: length in 20mm..80mm = 45mm
  param taper: angle in -15deg..15deg = 3deg
  let top_r = r - h * tan(taper)
  part wall = revolve(|t| (r - h * tan(taper) * t, h * t))
  part top = disc(top_r).translate((0mm, 0mm, h))
  part base = flip(disc(r))
  part pin = cylinder(5mm, 14mm).rotate(90deg, (0, 1, 0)).translate((r - 4mm, 0mm, 0.35 * h))
}
";

/// The taper of each stub in degrees: one is another object.
fn stub_taper(i: i32) -> f64 {
    if i == 3 { 6.0 } else { 3.0 }
}

/// Objects lie anywhere: the pose of the scan before says nothing, and a fit that begins there may end upside down,
/// with every point near it.
#[test]
fn a_series_of_objects_that_lie_anywhere_is_not_upside_down() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("stub.gml"), STUB).expect("written");
    fs::create_dir(at.join("scans")).expect("made");
    for i in 0..5 {
        let [r, taper, seed] =
            [format!("r={}mm", 25.0 + 0.1 * f64::from(i % 5)), format!("taper={}deg", stub_taper(i)), i.to_string()];
        let args = ["scan", "stub.gml", "-p", &r, "-p", &taper, "--spacing", "2mm", "--noise", "0.05mm", "-q"];
        gmlc(at, &[&args[..], &["--seed", &seed, "-o", &format!("scans/stub_{i}.ply")]].concat());
    }
    let series = ["--start-from", "previous"];
    let output = gmlc_in(at, &[&["batch", "stub.gml", "scans", "-o", "out"], &FAST[..], &series].concat());
    for (i, row) in (0..).zip(table(&at.join("out"))) {
        let taper = figure(&row, "param.taper").to_degrees();
        assert!((taper - stub_taper(i)).abs() < 0.2, "{}: {taper} deg", row["name"]);
    }
    let said = text(&output.stdout);
    let outlying = said.lines().find(|line| line.starts_with("outlying: stub_3, taper 6."));
    assert!(outlying.is_some_and(|line| line.matches(" deg").count() == 2), "{said}");
}

/// What is measured once counts once, also where a file became the copy of another one after both had a result.
#[test]
fn a_file_that_becomes_a_copy_counts_no_more() {
    let folder = tins(2, false);
    let at = folder.path();
    gmlc_in(at, &batch("out", &[]));
    fs::copy(at.join("scans/tin_1.ply"), at.join("scans/tin_0.ply")).expect("copied");
    gmlc_in(at, &batch("out", &[]));
    let statuses =
        |rows: Vec<BTreeMap<String, String>>| rows.iter().map(|row| row["status"].clone()).collect::<Vec<_>>();
    assert_eq!(statuses(table(&at.join("out"))), ["inspected", "copy"]);
    // And is measured where the other one is gone.
    fs::remove_file(at.join("scans/tin_0.ply")).expect("removed");
    gmlc_in(at, &batch("out", &[]));
    assert_eq!(statuses(table(&at.join("out"))), ["inspected"]);
}
