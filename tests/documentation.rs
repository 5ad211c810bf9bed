//! Every `gmlc` command in README.md and docs/ is run, in order, in a folder that has the examples and the scripts of the page.

mod support;

use std::fs;
use std::path::Path;
use support::{gmlc_in, root, text};

/// What a page asks of its reader.
enum Step {
    /// A command in a block marked `sh`.
    Run(String),
    /// A script: a block marked `gml` whose first line is `// NAME.gml`.
    Save(String, String),
}

fn steps(path: &Path) -> Vec<Step> {
    let page = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut steps = Vec::new();
    for block in page.split("```").skip(1).step_by(2) {
        if let Some(lines) = block.strip_prefix("sh\n") {
            let commands = lines.lines().filter(|l| l.starts_with("gmlc "));
            steps.extend(commands.map(|l| Step::Run(l.split('#').next().unwrap_or("").trim().to_owned())));
        } else if let Some((name, _)) = block.strip_prefix("gml\n// ").and_then(|b| b.split_once('\n'))
            && name.ends_with(".gml")
        {
            steps.push(Step::Save(name.to_owned(), block["gml\n".len()..].to_owned()));
        }
    }
    steps
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
    let pages = [
        "README.md",
        "docs/output.md",
        "docs/language.md",
        "docs/tutorial.md",
        "examples/cup/README.md",
        "examples/mug/README.md",
    ];
    for page in pages {
        for step in steps(&root().join(page)) {
            let command = match step {
                Step::Run(command) => command,
                Step::Save(name, script) => {
                    fs::write(folder.path().join(name), script).expect("written");
                    continue;
                }
            };
            let args: Vec<&str> = command.split_whitespace().skip(1).collect();
            let output = gmlc_in(folder.path(), &args);
            let errors = text(&output.stderr);
            assert!(output.status.success(), "{page}: {command}\n{errors}");
            count += 1;
        }
    }
    assert!(count >= 16, "the tour has commands, not {count}");
}
