//! Every `gmlc` command in README.md and docs/ is run, in order, in a folder that has the examples.

mod support;

use std::fs;
use std::path::Path;
use support::{gmlc_in, root, text};

/// The commands in fenced blocks marked `sh` that begin with `gmlc`.
fn commands(path: &Path) -> Vec<String> {
    let page = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let blocks = page.split("```").skip(1).step_by(2).filter_map(|b| b.strip_prefix("sh\n").map(str::to_owned));
    let lines = blocks.flat_map(|b| b.lines().map(str::to_owned).collect::<Vec<_>>());
    lines.filter(|l| l.starts_with("gmlc ")).map(|l| l.split('#').next().unwrap_or("").trim().to_owned()).collect()
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        let target = to.join(path.file_name().expect("a name"));
        if path.is_dir() { copy(&path, &target) } else { fs::copy(&path, &target).map(|_| ()).expect("copied") }
    }
}

#[test]
fn every_command_of_the_documentation_works() {
    let folder = tempfile::tempdir().expect("a folder");
    copy(&root().join("examples"), &folder.path().join("examples"));
    let mut count = 0;
    let pages = ["README.md", "docs/output.md", "docs/language.md", "docs/repl.md", "examples/cup/README.md", "examples/mug/README.md"];
    for page in pages {
        for command in commands(&root().join(page)) {
            let args: Vec<&str> = command.split_whitespace().skip(1).collect();
            let output = gmlc_in(folder.path(), &args);
            let errors = text(&output.stderr);
            assert!(output.status.success(), "{page}: {command}\n{errors}");
            count += 1;
        }
    }
    assert!(count >= 8, "the tour has commands, not {count}");
}
