//! The texts that are damaged.

use gml_compiler::check::CheckOptions;
use gml_compiler::program::check;
use gml_compiler::source::{NoFiles, Sources};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Cases of the language tests, examples, modules of the standard library, blocks of the reference. Texts without a
/// mistake occur several times, because their damaged versions reach later stages.
pub(crate) fn texts() -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut texts = Vec::new();
    for path in scripts(&root.join("tests/language")) {
        texts.extend(read(&path).split("// ---").map(without_marks));
    }
    for folder in folders(&root.join("examples")) {
        texts.extend(scripts(&folder).iter().map(|p| read(p)));
    }
    texts.extend(scripts(&root.join("stdlib")).iter().map(|p| read(p)));
    let reference = read(&root.join("docs/language.md"));
    texts.extend(reference.split("```gml\n").skip(1).filter_map(|b| b.split("```").next()).map(str::to_owned));
    texts.retain(|t| !t.trim().is_empty());
    assert!(texts.len() > 50, "there is a corpus");
    let good: Vec<String> = texts.iter().filter(|t| is_good(t)).cloned().collect();
    for _ in 0..3 {
        texts.extend(good.iter().cloned());
    }
    texts
}

fn is_good(text: &str) -> bool {
    let mut sources = Sources::default();
    let main = sources.add("test.gml", text);
    check(&mut sources, &NoFiles, main, &BTreeMap::new(), &CheckOptions::default()).0.is_some()
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|e| e.expect("an entry").path()).collect();
    paths.sort();
    paths
}

fn folders(folder: &Path) -> Vec<PathBuf> {
    entries(folder).into_iter().filter(|p| p.is_dir()).collect()
}

fn scripts(folder: &Path) -> Vec<PathBuf> {
    entries(folder).into_iter().filter(|p| p.extension().is_some_and(|e| e == "gml")).collect()
}

/// A case of the language tests without its expectations.
fn without_marks(case: &str) -> String {
    case.lines().skip(1).filter(|line| !line.trim_start().starts_with("//")).map(|line| format!("{line}\n")).collect()
}
