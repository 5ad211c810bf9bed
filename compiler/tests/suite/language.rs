//! Runs the language tests: `tests/language/*.gml` beside the workspace's manifest.
//!
//! A file holds cases, each of which begins with a line `// --- its title`. The expected diagnostics stand above the
//! line that they are for, with their columns (from 1, the end excluded):
//!
//! ```text
//! // Error: 9-12 the message
//! // Hint: the hint
//! let a = sin(30)
//! ```
//!
//! `Warning` is used likewise, and `Fails` for failures of the model at the defaults of its parameters: a `require`
//! that does not hold, or a part that cannot be evaluated. A case without such lines compiles and runs. A line
//! `// Parts:` lists the names of the model's parts. With `GMLC_UPDATE=1` the test rewrites these lines to the present
//! results; check them before you commit them.

use gml_compiler::check::CheckOptions;
use gml_compiler::check::typed::Model;
use gml_compiler::diagnostic::{Code, Diagnostic, Severity};
use gml_compiler::internals::diff::expand;
use gml_compiler::internals::ir::interpret::{Limits, RunError, run};
use gml_compiler::internals::ir::lower::lower;
use gml_compiler::internals::ir::scalar::Scalar;
use gml_compiler::internals::ir::{FunctionId, Module};
use gml_compiler::program::check;
use gml_compiler::source::{FileId, Loader, SourceFile, Sources, Span};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

const MARKS: [&str; 4] = ["// Error:", "// Warning:", "// Fails:", "// Hint:"];

const PARTS: &str = "// Parts:";

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/language")
}

/// Loads the files that the tests `use` from a folder of their own.
struct Files;

impl Loader for Files {
    fn load(&self, path: &str, _from: &str) -> Result<SourceFile, String> {
        let text = std::fs::read_to_string(folder().join("files").join(path)).map_err(|_| "no such file".to_owned())?;
        Ok(SourceFile { name: path.to_owned(), text })
    }
}

#[test]
fn language() {
    let update = std::env::var_os("GMLC_UPDATE").is_some();
    let mut wrong = String::new();
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder())
        .expect("the folder of the language tests")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|e| e == "gml"))
        .collect();
    paths.sort();
    assert!(!paths.is_empty(), "there are language tests");
    for path in paths {
        let text = std::fs::read_to_string(&path).expect("a readable test");
        let found: String = cases(&text).iter().map(|case| annotated(case)).collect();
        if update && found != text {
            std::fs::write(&path, &found).expect("a writable test");
        } else if found != text {
            let _ = writeln!(wrong, "{}:\n{}", path.display(), difference(&text, &found));
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

/// The texts of the cases, with the lines that begin them.
fn cases(text: &str) -> Vec<String> {
    let mut cases: Vec<String> = vec![String::new()];
    for line in text.split_inclusive('\n') {
        if line.starts_with("// ---") {
            cases.push(String::new());
        }
        if let Some(case) = cases.last_mut() {
            case.push_str(line);
        }
    }
    cases
}

/// The case with the present results in place of the expected ones.
fn annotated(case: &str) -> String {
    let text: String = case.split_inclusive('\n').filter(|line| !is_mark(line) || line.starts_with(PARTS)).collect();
    let mut sources = Sources::default();
    let main = sources.add("test.gml", text.clone());
    let (model, findings) = check(&mut sources, &Files, main, &BTreeMap::new(), &CheckOptions::default());
    let mut marks: Vec<(usize, String)> = Vec::new();
    for finding in &findings {
        let word = if finding.severity == Severity::Error { "Error" } else { "Warning" };
        marks.push(mark(&text, main, word, finding));
    }
    let parts: Vec<&str> = model.iter().flat_map(|m| &m.parts).map(|p| p.name.as_str()).collect();
    let parts = format!("{PARTS} {}\n", parts.join(", "));
    for failure in model.as_ref().map(failures).unwrap_or_default() {
        marks.push(mark(&text, main, "Fails", &failure));
    }
    let mut out = String::new();
    for (number, line) in text.split_inclusive('\n').enumerate() {
        let indent = &line[..line.len() - line.trim_start_matches(' ').len()];
        for (_, mark) in marks.iter().filter(|(at, _)| *at == number) {
            mark.lines().for_each(|m| out.push_str(&format!("{indent}{m}\n")));
        }
        out.push_str(if line.starts_with(PARTS) { &parts } else { line });
    }
    out
}

/// The failure of the model at its defaults: of its requirements, then of each part at some points.
fn failures(model: &Model) -> Vec<Diagnostic> {
    let mut lowered = match lower(model) {
        Ok(lowered) => lowered,
        Err(error) => return vec![error.diagnostic()],
    };
    let requires = lowered.requires.iter().map(|r| r.condition.function);
    let roots: Vec<FunctionId> = requires.chain(lowered.parts.iter().map(|p| p.surface.function)).collect();
    if let Err(error) = expand(&mut lowered.module, &roots) {
        return vec![Diagnostic::new(Code::Derivative, error.span(), error.to_string())];
    }
    let defaults: Vec<Scalar> = model.params.iter().map(|p| Scalar::Real(p.declared.default)).collect();
    let mut failures = Vec::new();
    for require in &lowered.requires {
        let condition = &require.condition;
        match evaluate(&lowered.module, condition.function, &condition.arguments(&defaults, &[])) {
            Err(failure) => failures.push(*failure),
            Ok(values) if values == [Scalar::Bool(true)] => {}
            Ok(_) => failures.push(Diagnostic::new(Code::Require, require.span, &require.message)),
        }
    }
    for (part, lowered_part) in model.parts.iter().zip(&lowered.parts) {
        let points = [(0.25, 0.5), (0.5, 0.75), (0.875, 0.125)];
        let failure = points.iter().find_map(|(u, v)| {
            let surface = &lowered_part.surface;
            let args = surface.arguments(&defaults, &[Scalar::Real(*u), Scalar::Real(*v)]);
            let values = evaluate(&lowered.module, surface.function, &args);
            match values {
                Err(failure) => Some(*failure),
                Ok(values) if values.iter().all(|v| v.is_finite()) => None,
                Ok(_) => Some(Diagnostic::new(Code::NotFinite, part.span, "the part is not finite")),
            }
        });
        failures.extend(failure);
    }
    failures
}

fn evaluate(module: &Module, function: FunctionId, args: &[Scalar]) -> Result<Vec<Scalar>, Box<Diagnostic>> {
    run(module, function, args, Limits::default()).map_err(|error| {
        let message = match &error {
            RunError::Failed(id) => module.failures[id.0 as usize].message.clone(),
            other => other.to_string(),
        };
        Box::new(Diagnostic::new(Code::RunTime, error.span(module), message))
    })
}

/// The line of a diagnostic (from 0), and the text that stands above it.
fn mark(text: &str, main: FileId, word: &str, finding: &Diagnostic) -> (usize, String) {
    let Span { file, start, end } = finding.span;
    let hint = finding.hint.iter().map(|h| format!("\n// Hint: {h}")).collect::<String>();
    if file != main {
        return (0, format!("// {word}: elsewhere: {}{hint}", finding.message));
    }
    let position = |at: u32| {
        let before = &text[..at as usize];
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        (before.matches('\n').count(), column)
    };
    let ((line, from), (last, to)) = (position(start), position(end));
    let to = if last > line { format!("+{}:{to}", last - line) } else { to.to_string() };
    // The end of the file has no line of its own.
    (line.min(text.lines().count().saturating_sub(1)), format!("// {word}: {from}-{to} {}{hint}", finding.message))
}

fn is_mark(line: &str) -> bool {
    MARKS.iter().chain([&PARTS]).any(|m| line.trim_start().starts_with(m))
}

/// The lines that differ, which are all expectations: those of the test with `-`, the present ones with `+`, and the
/// line below them.
fn difference(test: &str, found: &str) -> String {
    let (test, found): (Vec<&str>, Vec<&str>) = (test.lines().collect(), found.lines().collect());
    let mut out = String::new();
    let (mut i, mut j) = (0, 0);
    while i < test.len() || j < found.len() {
        if test.get(i) == found.get(j) {
            (i, j) = (i + 1, j + 1);
        } else if test.get(i).is_some_and(|line| is_mark(line)) {
            let _ = writeln!(out, "{:4} - {}", i + 1, test[i]);
            i += 1;
        } else {
            let _ = writeln!(out, "{:4} + {}", i + 1, found.get(j).copied().unwrap_or("(nothing)"));
            let below = found.get(j + 1).filter(|line| !is_mark(line));
            below.iter().for_each(|line| out.push_str(&format!("       {line}\n")));
            j += 1;
            i += usize::from(j > found.len());
        }
    }
    out
}
