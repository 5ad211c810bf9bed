//! Scripts: each requirement and each part of the language tests that run and of the examples, and the derivatives of
//! parts.

use super::{Case, conforms};
use gml_compiler::check::CheckOptions;
use gml_compiler::internals::diff;
use gml_compiler::internals::ir::lower::lower;
use gml_compiler::internals::ir::scalar::Scalar::{self, Real};
use gml_compiler::program::check;
use gml_compiler::source::{Loader, SourceFile, Sources};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Files that the language tests `use`.
struct Files;

impl Loader for Files {
    fn load(&self, path: &str, _from: &str) -> Result<SourceFile, String> {
        let text = std::fs::read_to_string(root().join("tests/language/files").join(path));
        text.map(|text| SourceFile { name: path.to_owned(), text }).map_err(|e| e.to_string())
    }
}

fn scripts(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|e| e.expect("an entry").path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "gml"));
    paths.sort();
    paths
}

/// The functions of a script that has no errors, lowered and with their derivatives expanded, at its defaults and
/// beside them. `derivatives` adds the Jacobian and the pullback of each part.
fn case(name: &str, text: &str, derivatives: bool) -> Option<Case> {
    let mut sources = Sources::default();
    let main = sources.add(name, text);
    let (model, _) = check(&mut sources, &Files, main, &BTreeMap::new(), &CheckOptions::default());
    let model = model?;
    let lowered = lower(&model).ok()?;
    let mut module = lowered.module;
    let requires = lowered.requires.iter().map(|r| r.condition.function).chain([lowered.bounds]);
    let surfaces = lowered.parts.iter().map(|p| p.surface.function);
    diff::expand(&mut module, &requires.chain(surfaces).collect::<Vec<_>>()).ok()?;
    let defaults: Vec<Scalar> = model.params.iter().map(|p| Real(p.declared.default)).collect();
    let beside: Vec<Scalar> = model.params.iter().map(|p| Real(p.declared.default * 0.93 + 0.01)).collect();
    let mut runs = Vec::new();
    for x in [&defaults, &beside] {
        runs.push((lowered.bounds, x.clone()));
        runs.extend(lowered.requires.iter().map(|r| (r.condition.function, r.condition.arguments(x, &[]))));
        for uv in [[0.0, 0.5], [0.3, 0.7], [1.0, 1.0]] {
            let surfaces = lowered.parts.iter().map(|p| &p.surface);
            runs.extend(surfaces.map(|s| (s.function, s.arguments(x, &uv.map(Real)))));
        }
    }
    for surface in lowered.parts.iter().map(|p| &p.surface).filter(|_| derivatives) {
        let wrt: Vec<u32> = (0..surface.params.len() as u32).collect();
        let (jacobian, _) = diff::jacobian(&mut module, surface.function, &wrt).ok()?;
        let pullback = diff::pullback(&mut module, surface.function, &wrt, true).ok()?;
        for x in [&defaults, &beside] {
            let arguments = surface.arguments(x, &[Real(0.3), Real(0.7)]);
            runs.push((jacobian, arguments.clone()));
            runs.push((pullback, [&arguments[..], &[Real(1.0), Real(-0.5), Real(0.25)]].concat()));
        }
    }
    Some(Case { name: name.to_owned(), module, runs })
}

#[test]
fn language_tests() {
    let (mut cases, mut results) = (0, 0);
    for path in scripts(&root().join("tests/language")) {
        let text = std::fs::read_to_string(&path).expect("a readable test");
        for (k, text) in text.split("// ---").enumerate().skip(1) {
            // The rest of the line that begins a case is its title.
            let name = format!("{}, case {k}", path.display());
            if let Some(case) = case(&name, &format!("//{text}"), true) {
                cases += 1;
                results += conforms(&case);
            }
        }
    }
    assert!(cases > 30 && results > 500, "{cases} cases, {results} results");
}

#[test]
fn examples() {
    let folders = std::fs::read_dir(root().join("examples")).expect("the examples");
    let mut count = 0;
    for folder in folders.map(|e| e.expect("an entry").path()).filter(|p| p.is_dir()) {
        for path in scripts(&folder) {
            let text = std::fs::read_to_string(&path).expect("a readable script");
            let case = case(&path.display().to_string(), &text, true);
            let case = case.unwrap_or_else(|| panic!("{} has errors", path.display()));
            assert!(conforms(&case) > 0);
            count += 1;
        }
    }
    assert!(count >= 3, "{count} examples");
}
