//! What counts as a failure.

use crate::case::{Case, Files, files_of};
use crate::process::Ended;
use std::fs;
use std::path::{Path, PathBuf};

/// Options by which a user asks for more work than the limits of an ordinary run.
const MORE: [&str; 6] = ["--bootstrap", "--limit", "--memory", "--chord", "--resolution", "--spacing"];

/// Whether a command may take longer than the limit of time: by its options, or as a fit of a damaged script to the
/// scan of something else, which takes a minute where there are a dozen parameters.
pub(crate) fn asks_for_work(args: &[String]) -> bool {
    let foreign = args.first().is_some_and(|a| a == "fit" || a == "inspect") && args.iter().any(|a| a == "s.gml");
    let small = |i: usize| args[i] == "--resolution" && args.get(i + 1).is_some_and(|v| v == "32");
    foreign || (0..args.len()).any(|i| MORE.iter().any(|more| args[i].starts_with(more)) && !small(i))
}

/// The class of a failure: its text up to what differs from case to case.
pub(crate) fn class(reason: &str) -> String {
    let line = reason.lines().take(2).collect::<Vec<_>>().join(" ");
    let words: String = line.chars().map(|c| if c.is_ascii_digit() { '0' } else { c }).collect();
    let mut short: String = words.replace("00", "0").chars().take(110).collect();
    while short.contains("00") {
        short = short.replace("00", "0");
    }
    short
}

/// The failure of a case that ended within the limits.
pub(crate) fn failure(case: &Case, folder: &Path, before: &Files, ended: &Ended) -> Option<String> {
    let error = ended.error.trim();
    if let Some(at) = error.find("panicked at") {
        return Some(format!("it panics: {}", &error[at..]));
    }
    let status = ended.status?;
    if !(0..=4).contains(&status) {
        return Some(format!("it ends with {status}, which is not documented: {error}"));
    }
    if matches!(status, 1 | 2) && error.is_empty() && case.args.first().is_none_or(|a| a != "fmt") {
        return Some(format!("it ends with {status} and says nothing"));
    }
    left(folder).or_else(|| files(case, folder, before, status, ended)).or_else(|| place(case, status, ended))
}

/// A temporary file that was left.
fn left(folder: &Path) -> Option<String> {
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for path in fs::read_dir(&next).into_iter().flatten().filter_map(|e| Some(e.ok()?.path())) {
            if path.file_name().is_some_and(|n| n.to_string_lossy().starts_with(".gmlc")) {
                return Some(format!("it leaves {}", relative(&path, folder)));
            }
            if path.is_dir() {
                open.push(path);
            }
        }
    }
    None
}

fn relative(path: &Path, folder: &Path) -> String {
    path.strip_prefix(folder).unwrap_or(path).display().to_string()
}

/// Inputs that were changed, outputs of a command that failed, and outputs that are not whole.
fn files(case: &Case, folder: &Path, before: &Files, status: i32, ended: &Ended) -> Option<String> {
    let formats = case.args.first().is_some_and(|a| a == "fmt");
    let after = files_of(folder);
    // A trace may replace what the command does not read, and is a table, whatever its name.
    let trace = case.args.iter().skip_while(|a| *a != "--trace").nth(1);
    for (name, content) in before {
        let replaced = trace == Some(name) && case.args.iter().filter(|a| *a == name).count() == 1;
        if after.get(name) != Some(content) && !(formats && name.ends_with(".gml")) && !replaced {
            return Some(format!("it changes {name}, an input"));
        }
    }
    // An interrupted fit is written, with the status of an error; a session goes on after one.
    let session = case.args.first().is_some_and(|a| a == "repl");
    let may_write = matches!(status, 0 | 3 | 4) || ended.interrupted || session;
    for (name, content) in after.iter().filter(|(name, _)| !before.contains_key(*name)) {
        if !may_write {
            return Some(format!("it ends with {status} and writes {name}: {}", ended.error.trim()));
        }
        if content.is_empty() {
            return Some(format!("it writes an empty {name}"));
        }
    }
    let is_trace = |path: &Path| trace.is_some_and(|trace| *trace == relative(path, folder));
    results(folder, before).into_iter().filter(|path| !is_trace(path)).find_map(|path| {
        let text = fs::read(&path).unwrap_or_default();
        let error = serde_json::from_slice::<serde_json::Value>(&text).err()?;
        Some(format!("it writes {}, which is no JSON: {error}", relative(&path, folder)))
    })
}

/// The files of JSON that were written into a folder and the folders in it.
fn results(folder: &Path, before: &Files) -> Vec<PathBuf> {
    let within = |f: &Path| fs::read_dir(f).into_iter().flatten().filter_map(|e| Some(e.ok()?.path())).collect();
    let mut paths: Vec<PathBuf> = within(folder);
    let deeper: Vec<PathBuf> =
        paths.iter().filter(|p| p.is_dir()).flat_map(|p| -> Vec<PathBuf> { within(p) }).collect();
    paths.extend(deeper);
    // The output of `doc` is a folder, whatever its name.
    paths.retain(|p| p.is_file());
    paths.retain(|p| p.extension().is_some_and(|e| e == "json") && !before.contains_key(&relative(p, folder)));
    paths
}

/// An error without its place: findings in a script have a line that points at it; others name a file or an option.
fn place(case: &Case, status: i32, ended: &Ended) -> Option<String> {
    let lines: Vec<&str> = ended.error.lines().collect();
    for (i, line) in lines.iter().enumerate() {
        let points = || lines[i + 1..].iter().take(6).any(|l| l.trim_start().starts_with("-->"));
        if (line.starts_with("error[") || line.starts_with("warning["))
            && !points()
            && !case.args.contains(&"repl".into())
        {
            return Some(format!("a finding without its place: {line}"));
        }
    }
    let reader = case.args.iter().any(|a| case.files.contains_key(a) && !a.ends_with(".gml"));
    if status == 1 && reader && !lines.iter().any(|l| names_something(case, l)) {
        return Some(format!("an error without its place: {}", ended.error.trim()));
    }
    None
}

fn names_something(case: &Case, line: &str) -> bool {
    // What a fit or a measurement does not find is said of the model, the parameters or the scan.
    let words = ["-->", "--", "the scan", "the model", "parameter", "part", "surface", "fit"];
    case.files.keys().any(|name| line.contains(name.as_str())) || words.iter().any(|w| line.contains(w))
}
