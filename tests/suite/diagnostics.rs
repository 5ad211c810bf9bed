//! The diagnostics of `gmlc check` for the mistakes in `tests/diagnostics/*.gml`, printed exactly as a user reads them;
//! snapshots stand beside the scripts.
//!
//! A case begins with a line `// --- its title`, each further file of the case with `// +++ its name`. Characters that
//! an editor or git would not keep are written `{BOM}`, `{TAB}`, `{CR}` and `{NBSP}`; `{EOF}` ends a file without a
//! line end. Every suggestion of every case is applied, after which its diagnostic must be gone.

use crate::support::{gmlc_in, root, text};
use gml_compiler::diagnostic::{Code, Severity};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// A script with a mistake, and the files that it uses; the first is checked.
struct Case {
    title: String,
    files: Vec<(String, String)>,
}

fn folder() -> PathBuf {
    root().join("tests/diagnostics")
}

/// The cases of a file.
fn cases(text: &str) -> Vec<Case> {
    let mut cases: Vec<Case> = Vec::new();
    for line in text.lines() {
        if let Some(title) = line.strip_prefix("// --- ") {
            cases.push(Case { title: title.to_owned(), files: vec![("script.gml".to_owned(), String::new())] });
            continue;
        }
        let case = cases.last_mut().expect("a case begins with `// --- `");
        if let Some(name) = line.strip_prefix("// +++ ") {
            case.files.push((name.to_owned(), String::new()));
            continue;
        }
        let (_, text) = case.files.last_mut().expect("a file");
        text.push_str(line);
        text.push('\n');
    }
    for (_, text) in cases.iter_mut().flat_map(|c| &mut c.files) {
        *text = special_characters(text);
    }
    cases
}

fn special_characters(text: &str) -> String {
    let text = text.trim_end_matches('\n').to_owned() + "\n";
    let text = text.strip_suffix("{EOF}\n").map_or(text.clone(), str::to_owned);
    let table = [("{BOM}", "\u{feff}"), ("{TAB}", "\t"), ("{CR}", "\r"), ("{NBSP}", "\u{a0}")];
    table.iter().fold(text, |text, (name, character)| text.replace(name, character))
}

impl Case {
    fn write(&self, folder: &Path) {
        for (name, text) in &self.files {
            let path = folder.join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, text).expect("written");
        }
    }

    /// The text that the user reads.
    fn printed(&self) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        self.write(folder.path());
        text(&gmlc_in(folder.path(), &["check", "script.gml"]).stderr)
    }

    /// The diagnostics as JSON.
    fn findings(&self) -> Vec<Value> {
        let folder = tempfile::tempdir().expect("a folder");
        self.write(folder.path());
        let output = gmlc_in(folder.path(), &["check", "script.gml", "--format", "json"]);
        let document: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{}: {e}", self.title));
        document["diagnostics"].as_array().expect("a list").clone()
    }

    /// The case after the edits of a suggestion.
    fn corrected(&self, suggestion: &Value) -> Case {
        let mut files = self.files.clone();
        for edit in suggestion["edits"].as_array().expect("edits").iter().rev() {
            let file = files.iter_mut().find(|(name, _)| *name == edit["file"]).expect("a file of the case");
            let number = |field: &str| edit[field].as_u64().expect("a number") as usize;
            file.1.replace_range(number("start")..number("end"), edit["replacement"].as_str().expect("a text"));
        }
        Case { title: self.title.clone(), files }
    }
}

/// Applies a function to every item, on two threads.
fn parallel<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let (left, right) = items.split_at(items.len() / 2);
    std::thread::scope(|scope| {
        let other = scope.spawn(|| right.iter().map(&f).collect::<Vec<R>>());
        let mut all: Vec<R> = left.iter().map(&f).collect();
        all.extend(other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        all
    })
}

fn case_files() -> Vec<PathBuf> {
    let entries = fs::read_dir(folder()).expect("the folder of the cases").map(|e| e.expect("an entry").path());
    let mut paths: Vec<PathBuf> = entries.filter(|p| p.extension().is_some_and(|e| e == "gml")).collect();
    paths.sort();
    paths
}

fn cases_of(path: &Path) -> Vec<Case> {
    cases(&fs::read_to_string(path).expect("a readable file"))
}

#[test]
fn mistakes_as_the_user_reads_of_them() {
    let mut count = 0;
    for path in case_files() {
        let cases = cases_of(&path);
        count += cases.len();
        let mut shown = String::new();
        for (case, printed) in cases.iter().zip(parallel(&cases, Case::printed)) {
            let _ = writeln!(shown, "--- {}\n\n{printed}", case.title);
        }
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        insta::with_settings!({ snapshot_path => folder(), prepend_module_to_snapshot => false, omit_expression => true }, {
            insta::assert_snapshot!(name, shown);
        });
    }
    assert!(count >= 200, "there are {count} cases");
}

#[test]
fn every_suggestion_corrects_its_finding() {
    let cases: Vec<Case> = case_files().iter().flat_map(|path| cases_of(path)).collect();
    let wrong: String = parallel(&cases, uncorrected).concat();
    assert!(wrong.is_empty(), "{wrong}");
    let followed: usize =
        parallel(&cases, |c| c.findings().iter().map(|f| suggestions(f).len()).sum::<usize>()).iter().sum();
    assert!(followed >= 60, "there are {followed} suggestions");
}

fn suggestions(finding: &Value) -> &Vec<Value> {
    finding["suggestions"].as_array().expect("a list")
}

/// The suggestions of a case after which their diagnostic is still there, or others have come.
fn uncorrected(case: &Case) -> String {
    let findings = case.findings();
    let mut wrong = String::new();
    for (finding, suggestion) in findings.iter().flat_map(|f| suggestions(f).iter().map(move |s| (f, s))) {
        let corrected = case.corrected(suggestion);
        let after = corrected.findings();
        let same = |list: &[Value]| {
            list.iter().filter(|f| f["code"] == finding["code"] && f["message"] == finding["message"]).count()
        };
        // Warnings are not reported beside errors: they may appear when an error is gone.
        let weight = |list: &[Value]| list.iter().filter(|f| f["severity"] == finding["severity"]).count();
        if same(&after) >= same(&findings) || weight(&after) >= weight(&findings) {
            let (title, question) = (&case.title, &suggestion["message"]);
            let _ = writeln!(wrong, "{title}: {question} gives\n{}\n{}", corrected.files[0].1, corrected.printed());
        }
    }
    wrong
}

/// Codes without an example: they are limits, or need several files, a session or the command line.
const WITHOUT_EXAMPLE: [Code; 12] = [
    Code::Derivative,
    Code::Internal,
    Code::Interrupted,
    Code::Limit,
    Code::MachineCode,
    Code::NotFinite,
    Code::RunTime,
    Code::TooLong,
    Code::TooManyErrors,
    Code::TooManyFiles,
    Code::UnknownInput,
    Code::UseCycle,
];

#[test]
fn every_code_is_explained_by_an_example_that_is_diagnosed_so() {
    let wrong = parallel(Code::ALL, |code| match code.example() {
        None if WITHOUT_EXAMPLE.contains(code) => None,
        None => Some(format!("{code} has no example")),
        Some(example) => {
            let case = Case { title: code.to_string(), files: vec![("script.gml".into(), example.into())] };
            let diagnosed = case.findings().iter().any(|f| f["code"] == code.text());
            (!diagnosed).then(|| format!("{code}: {}", case.printed()))
        }
    });
    let wrong: Vec<String> = wrong.into_iter().flatten().collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The second half of docs/diagnostics.md repeats the compiler's explanations; `GMLC_UPDATE=1` in the environment
/// writes it anew.
#[test]
fn the_page_of_diagnostics_has_all_explanations() {
    let path = root().join("docs/diagnostics.md");
    let page = fs::read_to_string(&path).expect("a readable page");
    let (introduction, _) = page.split_once("\n## Codes: errors\n").expect("a heading of the errors");
    let mut expected = introduction.to_owned();
    for (severity, heading) in [(Severity::Error, "errors"), (Severity::Warning, "warnings")] {
        let _ = write!(expected, "\n## Codes: {heading}\n");
        for code in Code::ALL.iter().filter(|code| code.severity() == severity) {
            let _ = write!(expected, "\n### {code}\n\n{}", code.explanation());
        }
    }
    if std::env::var_os("GMLC_UPDATE").is_some() {
        fs::write(&path, expected).expect("written");
    } else {
        assert!(page == expected, "docs/diagnostics.md is old: run this test once with GMLC_UPDATE=1");
    }
}

#[test]
fn codes_are_explained_on_the_command_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let told = crate::support::gmlc(folder.path(), &["check", "--explain", "dimension-mismatch"]);
    assert!(told.contains("3mm") && told.contains("```gml"), "{told}");
    let error = crate::support::fails(folder.path(), &["check", "--explain", "dimension"], 2);
    assert!(error.contains("dimension-mismatch"), "{error}");
}

/// Diagnostics that quote the library are compared in part: line numbers of the library change.
#[test]
fn mistakes_within_the_library_are_shown_at_the_call() {
    let table = [
        (
            "fn f() = mix(1mm, 2, 0.5)",
            "'mix' cannot be called with these arguments: a length cannot be subtracted from a bare number",
            "^^^^^^^^^^^^^^^^",
        ),
        (
            "fn f() = map([1, 2], |a, b| a + b)",
            "'map' cannot be called with these arguments: a function is called here without 'b'",
            "in 'map'",
        ),
        ("fn f() = map([1mm, 2mm], |x| x + 1)", "a bare number cannot be added to a length", "in 'map', called here"),
    ];
    for (script, message, shown) in table {
        let case = Case { title: script.into(), files: vec![("script.gml".into(), script.into())] };
        let printed = case.printed();
        assert!(printed.contains(message) && printed.contains(shown), "{printed}");
        assert!(printed.contains("--> script.gml:1:") && printed.contains("::: std."), "{printed}");
    }
}
