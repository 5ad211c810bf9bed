//! Every `gmlc` command in README.md, docs/ and the cup's README is run, in order, in a folder that has the examples. Those of
//! the other examples are run by tests/examples.rs.

mod support;

use support::{commands, copy, gmlc_in, root, text};

#[test]
fn every_command_of_the_documentation_works() {
    let folder = tempfile::tempdir().expect("a folder");
    copy(&root().join("examples"), &folder.path().join("examples"));
    let mut count = 0;
    let pages = ["README.md", "docs/output.md", "docs/language.md", "examples/cup/README.md"];
    for page in pages {
        for command in commands(&root().join(page)) {
            let args: Vec<&str> = command.split_whitespace().collect();
            let output = gmlc_in(folder.path(), &args);
            let errors = text(&output.stderr);
            assert!(output.status.success(), "{page}: {command}\n{errors}");
            count += 1;
        }
    }
    assert!(count >= 8, "the tour has commands, not {count}");
}
