//! `gmlc fmt`.

use crate::cli::FmtArgs;
use crate::error::CommandError;
use crate::files;
use gml_compiler::format::{FormatError, format};
use gml_compiler::program::Failed;
use gml_compiler::source::Sources;
use gml_runtime::export::atomic;
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

pub(crate) fn run(args: &FmtArgs) -> Result<(), CommandError> {
    if args.paths.iter().any(|p| p == Path::new("-")) {
        return if args.paths.len() == 1 {
            standard(args)
        } else {
            Err(CommandError::usage("'-' cannot be combined with other paths"))
        };
    }
    let mut files = Vec::new();
    for path in &args.paths {
        if path.is_dir() { scripts(path, &mut files)? } else { files.push(path.clone()) }
    }
    let mut report = Report::default();
    for path in &files {
        let result = files::read_script(path).and_then(|text| {
            let change = Change::of(path, text)?;
            if !args.check && change.line.is_some() {
                atomic::write(path, change.text.as_bytes()).map_err(CommandError::failed)?;
            }
            Ok(change.line)
        });
        report.add(path, result, args);
    }
    report.finish(files.len(), args)
}

/// Formats standard input to standard output.
fn standard(args: &FmtArgs) -> Result<(), CommandError> {
    let mut text = String::new();
    std::io::stdin()
        .take(files::LARGEST_TEXT)
        .read_to_string(&mut text)
        .map_err(|e| CommandError::Failed(format!("standard input: {}", files::reason(&e))))?;
    let path = Path::new("standard input");
    let change = Change::of(path, text)?;
    if args.check {
        let mut report = Report::default();
        report.add(path, Ok(change.line), args);
        return report.finish(1, args);
    }
    std::io::stdout().write_all(change.text.as_bytes()).map_err(CommandError::failed)
}

/// Collects the scripts in a folder and its subfolders, in the order of their names, without hidden ones.
fn scripts(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), CommandError> {
    let failed = |e: std::io::Error| CommandError::Failed(format!("{}: {}", folder.display(), files::reason(&e)));
    let mut entries = std::fs::read_dir(folder).map_err(failed)?.collect::<Result<Vec<_>, _>>().map_err(failed)?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let path = entry.path();
        let hidden = entry.file_name().as_encoded_bytes().starts_with(b".");
        let kind = entry.file_type().map_err(failed)?;
        if kind.is_dir() && !hidden {
            scripts(&path, files)?;
        } else if path.extension().is_some_and(|e| e == "gml") && !hidden {
            if kind.is_file() {
                files.push(path);
            } else if !kind.is_dir() {
                let link = "is a link; name it to format what it leads to";
                let what = if kind.is_symlink() { link } else { "is a pipe or a device" };
                eprintln!("skipped {}: {what}", path.display());
            }
        }
    }
    Ok(())
}

/// The result of formatting a file.
struct Change {
    text: String,
    /// The first line that differs, from 1; none if the file is formatted.
    line: Option<usize>,
}

impl Change {
    fn of(path: &Path, text: String) -> Result<Change, CommandError> {
        let mut sources = Sources::default();
        let id = sources.add(path.display().to_string(), text.as_str());
        match format(id, &text) {
            Ok(formatted) => {
                let line = (formatted != text).then(|| first_difference(&text, &formatted));
                Ok(Change { text: formatted, line })
            }
            Err(FormatError::Syntax(diagnostics)) => Err(CommandError::from(Failed { diagnostics, sources })),
            Err(other) => Err(CommandError::Failed(format!("{}: {other}", path.display()))),
        }
    }
}

fn first_difference(a: &str, b: &str) -> usize {
    a.split('\n').zip(b.split('\n')).take_while(|(a, b)| a == b).count() + 1
}

/// The results of all files.
#[derive(Default)]
struct Report {
    changed: usize,
    failures: Vec<String>,
    errors: Option<Failed>,
    documents: Vec<Value>,
}

impl Report {
    fn add(&mut self, path: &Path, result: Result<Option<usize>, CommandError>, args: &FmtArgs) {
        let name = path.display().to_string();
        self.documents.push(match &result {
            Ok(line) => {
                json!({ "file": name, "status": if line.is_some() { "changed" } else { "unchanged" }, "line": line })
            }
            Err(_) => json!({ "file": name, "status": "error", "line": null }),
        });
        match result {
            Ok(None) => {}
            Ok(Some(line)) => {
                self.changed += 1;
                match (args.result.is_json(), args.check) {
                    (true, _) => {}
                    (false, true) => println!("{name}:{line}: is not formatted"),
                    (false, false) => println!("formatted {name}"),
                }
            }
            Err(CommandError::Script(errors)) => self.add_errors(*errors),
            Err(CommandError::Reported) => {}
            Err(error) => self.failures.push(error.reason()),
        }
    }

    /// Adds the errors of a file to those of other files.
    fn add_errors(&mut self, errors: Failed) {
        let all = self.errors.get_or_insert_with(|| Failed { diagnostics: Vec::new(), sources: Sources::default() });
        let Some((_, file)) = errors.sources.iter().next() else { return };
        let id = all.sources.add(file.name.as_str(), file.text.as_str());
        for mut diagnostic in errors.diagnostics {
            diagnostic.span.file = id;
            diagnostic.related.iter_mut().for_each(|(span, _)| span.file = id);
            diagnostic.suggestions.iter_mut().flat_map(|s| &mut s.edits).for_each(|edit| edit.span.file = id);
            all.diagnostics.push(diagnostic);
        }
    }

    fn finish(self, count: usize, args: &FmtArgs) -> Result<(), CommandError> {
        match args.result.is_json() {
            true => println!("{:#}", Value::Array(self.documents)),
            false => {
                let files = |n: usize| format!("{n} file{}", if n == 1 { "" } else { "s" });
                let done = if args.check { "to be formatted" } else { "formatted" };
                let failed = self.failures.len() + self.errors.iter().map(|e| e.sources.iter().count()).sum::<usize>();
                let rest = count - self.changed - failed;
                let also = if failed > 0 { format!(", {} with errors", files(failed)) } else { String::new() };
                println!("{} {done}, {} unchanged{also}", files(self.changed), files(rest));
            }
        }
        if let Some(errors) = self.errors {
            self.failures.iter().for_each(|message| eprintln!("error: {message}"));
            return Err(errors.into());
        }
        if !self.failures.is_empty() {
            return Err(CommandError::Failed(self.failures.join("\nerror: ")));
        }
        if args.check && self.changed > 0 {
            return Err(CommandError::Failed("not everything is formatted: run gmlc fmt without --check".into()));
        }
        Ok(())
    }
}
