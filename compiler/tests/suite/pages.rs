//! Runs the examples of the documentation: every block marked `gml` of the pages in docs/, of the README files, and of
//! the doc comments of the standard library and of the examples.
//!
//! A block is entered in a session of its own, line by line. A line that ends in `// = VALUE` states its value as a
//! session prints it. A block marked `gml error` must be rejected; if it contains a line `// Error: TEXT`, an error
//! must contain that text. A block that begins with `// NAME.gml` is also a file that the blocks below it can `use`.
//! Models are compiled, and instantiated with their defaults. In docs/diagnostics.md each block is a script for which
//! the compiler reports the code of the heading above it.

use gml_compiler::check;
use gml_compiler::diagnostic::{Code, Diagnostic};
use gml_compiler::program::{self, Options};
use gml_compiler::session::{self, Session};
use gml_compiler::source::{FileId, Loader, NoFiles, SourceFile};
use gml_compiler::syntax::{self, ast::Item, ast::ItemKind};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Relative tolerance of stated numbers, which have six significant digits.
const TOLERANCE: f64 = 1e-5;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The files of a folder with an extension, in the order of their names.
fn files(folder: &str, extension: &str) -> Vec<PathBuf> {
    let folder = root().join(folder);
    let entries = fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|e| e.expect("an entry").path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == extension));
    paths.sort();
    paths
}

/// A fenced block.
struct Block {
    /// The text after the backticks: `gml`, `gml error`, `sh`.
    kind: String,
    text: String,
    /// The number of its first line, from 1.
    line: usize,
    /// The heading that it stands under.
    heading: String,
}

fn blocks(markdown: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let (mut open, mut heading) = (false, String::new());
    for (i, line) in markdown.lines().enumerate() {
        match (line.trim_start().strip_prefix("```"), open) {
            (Some(kind), false) => {
                let kind = kind.trim().to_owned();
                blocks.push(Block { kind, text: String::new(), line: i + 2, heading: heading.clone() });
                open = true;
            }
            (Some(_), true) => open = false,
            (None, true) => blocks.last_mut().expect("an open block").text.push_str(&format!("{line}\n")),
            (None, false) if line.starts_with('#') => heading = line.trim_start_matches('#').trim().to_owned(),
            (None, false) => {}
        }
    }
    blocks
}

/// Files that stand as blocks on the same page, and files beside the page.
struct Files {
    known: BTreeMap<String, String>,
    folder: PathBuf,
}

impl Loader for Files {
    fn load(&self, path: &str, _from: &str) -> Result<SourceFile, String> {
        let beside = || fs::read_to_string(self.folder.join(path)).map_err(|_| "there is no such file".to_owned());
        let text = self.known.get(path).cloned().map_or_else(beside, Ok)?;
        Ok(SourceFile { name: path.to_owned(), text })
    }
}

/// Enters a block after `before`; returns the block's failures.
fn run(before: &str, block: &Block, files: &dyn Loader) -> Vec<String> {
    let mut session = Session::new(session::Options::default());
    session.enter(before, files).unwrap_or_else(|e| panic!("{before}: {e}"));
    match (attempt(&mut session, &block.text, files), block.kind.as_str()) {
        (Ok(values), "gml") => wrong_values(&block.text, &values),
        (Ok(_), _) => vec!["it must not be accepted, and is".to_owned()],
        (Err(errors), "gml") => errors.iter().map(|e| e.message.clone()).collect(),
        (Err(errors), _) => stated_errors(&block.text)
            .filter(|text| !errors.iter().any(|e| says(e, text)))
            .map(|text| format!("no error says '{text}': {:?}", errors.iter().map(|e| &e.message).collect::<Vec<_>>()))
            .collect(),
    }
}

fn says(error: &Diagnostic, text: &str) -> bool {
    error.message.contains(text) || error.label.contains(text) || error.hint.as_ref().is_some_and(|h| h.contains(text))
}

/// Enters a block and compiles its model; returns the values with the lines (from 0) on which they end.
fn attempt(session: &mut Session, text: &str, files: &dyn Loader) -> Result<Vec<(usize, String)>, Vec<Diagnostic>> {
    let answers = session.enter(text, files).map_err(|e| e.diagnostics)?;
    if session.model().is_some() {
        let program = session.compile(&Options::default()).map_err(|e| e.diagnostics)?.program;
        if let Err(e) = program.instantiate(&program.defaults()) {
            return Err(vec![Diagnostic::new(Code::Evaluation, e.span.unwrap_or_default(), e.message)]);
        }
    }
    let line = |end: u32| text[..end as usize].trim_end().matches('\n').count();
    Ok(answers.iter().filter_map(|a| Some((line(a.span.end), a.value.as_ref()?.to_string()))).collect())
}

/// The values that lines state, by their lines from 0.
fn stated_values(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().filter_map(|(i, line)| Some((i, line.split_once("// = ")?.1.trim())))
}

fn stated_errors(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter_map(|line| line.trim().strip_prefix("// Error: "))
}

fn wrong_values(text: &str, values: &[(usize, String)]) -> Vec<String> {
    let mut wrong = Vec::new();
    for (line, stated) in stated_values(text) {
        match values.iter().rev().find(|(at, _)| *at == line) {
            Some((_, found)) if agree(stated, found) => {}
            Some((_, found)) => wrong.push(format!("line {}: {stated} is stated, {found} is found", line + 1)),
            None => wrong.push(format!("line {}: {stated} is stated, and the line has no value", line + 1)),
        }
    }
    wrong
}

/// Whether texts are equal but for small differences of the numbers in them.
fn agree(a: &str, b: &str) -> bool {
    let (a, b) = (pieces(a), pieces(b));
    a.len() == b.len()
        && a.iter().zip(&b).all(|(a, b)| match (a.parse::<f64>(), b.parse::<f64>()) {
            (Ok(x), Ok(y)) => x == y || (x - y).abs() <= TOLERANCE * x.abs().max(1e-4),
            _ => a == b,
        })
}

/// Splits a text into numbers and the texts between them.
fn pieces(text: &str) -> Vec<String> {
    let mut pieces: Vec<String> = Vec::new();
    let mut number = false;
    for c in text.chars().filter(|c| !c.is_whitespace()) {
        let last = pieces.last().and_then(|p| p.chars().last());
        let exponent = number && (c == 'e' || (matches!(c, '-' | '+') && last == Some('e')));
        let of_number = c.is_ascii_digit() || exponent || (c == '.' && number) || (c == '-' && !number);
        match pieces.last_mut() {
            Some(piece) if of_number == number => piece.push(c),
            _ => pieces.push(c.to_string()),
        }
        number = of_number;
    }
    pieces
}

/// Adds the failures of a page's examples to `wrong`; returns the number of examples.
fn check_page(path: &Path, wrong: &mut String) -> usize {
    let name = path.strip_prefix(root()).unwrap_or(path).display().to_string();
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let mut files = Files { known: BTreeMap::new(), folder };
    let mut count = 0;
    for block in blocks(&read(path)) {
        if block.kind != "gml" && block.kind != "gml error" {
            continue;
        }
        count += 1;
        for finding in run("", &block, &files) {
            wrong.push_str(&format!("{name}:{}: {finding}\n", block.line));
        }
        let first = block.text.lines().next().and_then(|line| line.strip_prefix("// "));
        if let Some(file) = first.filter(|f| f.ends_with(".gml") && !f.contains(' ')) {
            files.known.insert(file.to_owned(), block.text.clone());
        }
    }
    count
}

#[test]
fn every_example_of_the_pages() {
    let mut pages = files("docs", "md");
    pages.retain(|p| !p.ends_with("diagnostics.md"));
    pages.push(root().join("README.md"));
    for example in fs::read_dir(root().join("examples")).expect("the examples") {
        let page = example.expect("an entry").path().join("README.md");
        pages.extend(page.exists().then_some(page));
    }
    let mut wrong = String::new();
    let count: usize = pages.iter().map(|page| check_page(page, &mut wrong)).sum();
    assert!(wrong.is_empty(), "\n{wrong}");
    assert!(count > 30, "the pages have examples, not {count}");
}

#[test]
fn every_example_of_a_diagnostic() {
    let page = read(&root().join("docs/diagnostics.md"));
    let mut wrong = String::new();
    // How parts meet is found by the runtime: the command's tests have these.
    let of_runtime = [Code::InsideOut, Code::NothingLeft, Code::PassedThrough, Code::Touching].map(Code::text);
    let of_compiler = |heading: &str| !of_runtime.contains(&heading);
    for block in blocks(&page).iter().filter(|b| b.kind == "gml" && of_compiler(&b.heading)) {
        let script = SourceFile { name: "example.gml".to_owned(), text: block.text.clone() };
        // Like `gmlc check`, which adds lints and probes if the script compiles.
        let found = match program::compile(script, &NoFiles, &Options::default()) {
            Ok(compilation) => [compilation.warnings, lints(&block.text), compilation.program.probe()].concat(),
            Err(failed) if failed.diagnostics.iter().all(|d| d.code == Code::NoModel) => {
                [failed.diagnostics, lints(&block.text)].concat()
            }
            Err(failed) => failed.diagnostics,
        };
        let codes: Vec<&str> = found.iter().map(|d| d.code.text()).collect();
        if !codes.contains(&block.heading.as_str()) {
            wrong.push_str(&format!(
                "docs/diagnostics.md:{}: {} is not found, but {codes:?}\n",
                block.line, block.heading
            ));
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

fn lints(text: &str) -> Vec<Diagnostic> {
    [check::lints(&syntax::parse(FileId(0), text).0), syntax::look_alikes(FileId(0), text)].concat()
}

/// The items of a script, with those of its models.
fn items(text: &str) -> Vec<Item> {
    let (tree, _) = syntax::parse(FileId(0), text);
    let of_models = tree.items.iter().filter_map(|i| match &i.kind {
        ItemKind::Model(model) => Some(model.items.clone()),
        _ => None,
    });
    let inner: Vec<Item> = of_models.flatten().collect();
    tree.items.into_iter().chain(inner).collect()
}

fn name(item: &Item) -> Option<&str> {
    match &item.kind {
        ItemKind::Function(decl) => Some(&decl.name.text),
        ItemKind::Model(model) => Some(&model.name.text),
        _ => None,
    }
}

#[test]
fn every_example_of_the_library() {
    let mut wrong = String::new();
    for path in files("stdlib", "gml") {
        let module = path.file_stem().expect("a name").to_string_lossy().into_owned();
        for item in items(&read(&path)) {
            for block in blocks(&item.doc).iter().filter(|b| b.kind.starts_with("gml")) {
                for finding in run(&format!("use std.{module}"), block, &NoFiles) {
                    let name = name(&item).unwrap_or("?");
                    wrong.push_str(&format!("std.{module}, {name}: {finding}\n"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

/// The examples in the doc comments of the examples' scripts see the script itself.
#[test]
fn every_example_of_the_scripts() {
    let mut wrong = String::new();
    for entry in fs::read_dir(root().join("examples")).expect("the examples") {
        let folder = entry.expect("an entry").path();
        if !folder.is_dir() {
            continue;
        }
        let scripts = files(&folder.display().to_string(), "gml");
        for path in scripts {
            let text = read(&path);
            for item in items(&text) {
                let files = Files { known: BTreeMap::new(), folder: folder.clone() };
                for block in blocks(&item.doc).iter().filter(|b| b.kind.starts_with("gml")) {
                    for finding in run(&text, block, &files) {
                        wrong.push_str(&format!("{}: {finding}\n", path.display()));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

#[test]
fn every_function_of_the_library_states_a_value() {
    let mut missing = Vec::new();
    for path in files("stdlib", "gml") {
        let module = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let (tree, _) = syntax::parse(FileId(0), &read(&path));
        for item in &tree.items {
            let Some(name) = name(item).filter(|n| !n.starts_with('_')) else { continue };
            let states = |b: &Block| b.kind == "gml" && stated_values(&b.text).next().is_some();
            if !blocks(&item.doc).iter().any(states) {
                missing.push(format!("{module}.{name}"));
            }
        }
    }
    assert!(
        missing.is_empty(),
        "these functions of the library need an example in their doc comments that states a value \
         (```gml, a line that ends in `// = VALUE`), or a name that begins with `_`:\n{}",
        missing.join("\n")
    );
}

/// The pages of the library are those that `gmlc doc std -o docs/std` writes. GMLC_UPDATE=1 writes them.
#[test]
fn the_pages_of_the_library_are_up_to_date() {
    let folder = root().join("docs/std");
    let pages = gml_compiler::reference::library();
    if std::env::var_os("GMLC_UPDATE").is_some() {
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).expect("a folder");
        pages.iter().for_each(|page| fs::write(folder.join(&page.name), &page.text).expect("written"));
    }
    let mut expected: Vec<&str> = pages.iter().map(|p| p.name.as_str()).collect();
    expected.sort_unstable();
    let found = files("docs/std", "md");
    let names: Vec<String> =
        found.iter().map(|p| p.file_name().expect("a name").to_string_lossy().into_owned()).collect();
    assert_eq!(names, expected, "run gmlc doc std -o docs/std");
    for page in &pages {
        assert!(
            read(&folder.join(&page.name)) == page.text,
            "{} is out of date: run gmlc doc std -o docs/std",
            page.name
        );
    }
}
