//! Every `gmlc` command in README.md, docs/ and the cup's README is run, in order, in a folder that has the examples
//! and the scripts of the page. Those of the other examples are run by tests/suite/examples.rs.

use crate::support::{Step, copy, gmlc_in, root, steps, text};
use std::collections::BTreeSet;
use std::fs;
use std::time::Instant;

#[test]
fn every_command_of_the_documentation_works() {
    let folder = tempfile::tempdir().expect("a folder");
    copy(&root().join("examples"), &folder.path().join("examples"));
    let (mut run, mut count) = (BTreeSet::new(), 0);
    let pages = [
        "README.md",
        "docs/output.md",
        "docs/command.md",
        "docs/scans.md",
        "docs/fitting.md",
        "docs/language.md",
        "docs/tutorial.md",
        "docs/repl.md",
        "examples/cup/README.md",
    ];
    for page in pages {
        for step in steps(&root().join(page)) {
            let command = match step {
                Step::Run(command) => command,
                Step::Save(name, script) => {
                    fs::write(folder.path().join(&name), script).expect("written");
                    run.retain(|command: &String| !command.contains(&name));
                    continue;
                }
            };
            // A command that a page repeats from another page writes the same files.
            if !run.insert(command.clone()) {
                continue;
            }
            let args: Vec<&str> = command.split_whitespace().collect();
            let started = Instant::now();
            let output = gmlc_in(folder.path(), &args);
            println!("{:.1} s: {command}", started.elapsed().as_secs_f64());
            let errors = text(&output.stderr);
            assert!(output.status.success(), "{page}: {command}\n{errors}");
            let said = text(&output.stdout);
            assert!(!said.contains("NOT CONVERGED") && !said.contains("does not explain"), "{page}: {command}\n{said}");
            count += 1;
        }
    }
    assert!(count >= 16, "the tour has commands, not {count}");
}
