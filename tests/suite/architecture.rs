//! The arrows of ARCHITECTURE.md, checked against the `use` declarations and paths of the source.

use std::fs;
use std::path::{Path, PathBuf};

/// Every .rs file below a folder.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(&next).unwrap_or_else(|e| panic!("{}: {e}", next.display())) {
            let path = entry.expect("a folder's entry").path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// The source without its tests (which may use anything) and without comments.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let body = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("");
    body.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

fn is_test(path: &Path) -> bool {
    path.components().any(|c| c.as_os_str().to_string_lossy().contains("tests"))
}

/// Panics where a file below `folder` names one of `forbidden`.
fn must_not_name(folder: &str, forbidden: &[&str]) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    for path in rust_files(&root).iter().filter(|p| !is_test(p)) {
        let code = code(path);
        for name in forbidden {
            assert!(!code.contains(name), "{} names {name}: see Arrows in ARCHITECTURE.md", path.display());
        }
    }
}

#[test]
fn stages_of_the_compiler_know_only_earlier_ones() {
    must_not_name("compiler/src/syntax", &["crate::check", "crate::ir", "crate::diff", "crate::jit", "crate::program"]);
    must_not_name("compiler/src/check", &["crate::ir", "crate::diff", "crate::jit", "crate::program"]);
    must_not_name("compiler/src/ir", &["crate::diff", "crate::jit", "crate::program"]);
    must_not_name("compiler/src/format", &["crate::check", "crate::ir", "crate::diff", "crate::jit", "crate::program"]);
    must_not_name("compiler/src/reference", &["crate::ir", "crate::diff", "crate::jit", "crate::program"]);
    must_not_name("compiler/src/diff", &["crate::check", "crate::jit", "crate::program", "crate::syntax"]);
    must_not_name("compiler/src/jit", &["crate::check", "crate::program", "crate::syntax"]);
}

#[test]
fn the_compiler_is_pure() {
    let impure = ["std::fs", "std::net", "std::thread", "std::time", "rayon", "println!", "eprintln!", "gml_runtime"];
    must_not_name("compiler/src", &impure);
}

#[test]
fn packages_hold_all_their_files() {
    // A path that goes up two folders from a module leaves the package's sources.
    for folder in ["src", "compiler/src", "runtime/src", "stdlib"] {
        must_not_name(folder, &["include_str!(\"../..", "include_bytes!(\"../.."]);
    }
}

#[test]
fn the_runtimes_modules_use_what_they_may() {
    must_not_name("runtime/src/bvh", &["crate::fit", "crate::variance", "crate::export", "crate::simulate"]);
    must_not_name("runtime/src/scan", &["crate::fit", "crate::variance", "crate::export", "crate::model"]);
    must_not_name("runtime/src/model", &["crate::fit", "crate::variance", "crate::export", "crate::scan"]);
    let above = ["crate::fit", "crate::variance", "crate::export", "crate::scan", "crate::simulate"];
    must_not_name("runtime/src/feet", &above);
    must_not_name("runtime/src/figures", &above);
    must_not_name("runtime/src/feet", &["crate::figures"]);
    must_not_name("runtime/src/model", &["crate::feet", "crate::figures"]);
    must_not_name("runtime/src/fit", &["crate::variance", "crate::export", "crate::simulate"]);
    must_not_name("runtime/src/variance", &["crate::fit", "crate::simulate"]);
    must_not_name("runtime/src", &["println!", "eprintln!", "std::process", "clap::"]);
}

#[test]
fn stages_of_a_fit_know_only_earlier_ones() {
    let stages = ["correspond", "problem", "optimise", "register", "refine", "infer", "scene", "several"];
    for (i, stage) in stages.iter().enumerate() {
        let later: Vec<String> =
            stages[i + 1..].iter().flat_map(|s| [format!("fit::{s}"), format!("super::{s}")]).collect();
        let later: Vec<&str> = later.iter().map(String::as_str).collect();
        must_not_name(&format!("runtime/src/fit/{stage}"), &later);
    }
}

#[test]
fn stages_behind_programs_are_the_compilers_own() {
    for folder in ["src", "runtime/src"] {
        must_not_name(folder, &["gml_compiler::internals"]);
    }
}

#[test]
fn unsafe_code_is_where_it_may_be() {
    for folder in ["src", "compiler/src", "runtime/src"] {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        for path in rust_files(&root).iter().filter(|p| !is_test(p)) {
            let places = ["compiler/src/jit/", "runtime/src/bvh/dispatch.rs", "src/environment.rs"];
            let allowed = places.iter().any(|place| path.to_string_lossy().contains(place));
            let code = code(path);
            let names_it = ["unsafe {", "unsafe fn", "unsafe impl"].iter().any(|u| code.contains(u));
            assert!(allowed || !names_it, "{} has unsafe code", path.display());
        }
    }
}
