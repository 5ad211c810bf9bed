//! What all commands have in common: completions, manual pages, streams and messages.

use crate::support::{fails, gmlc};
use std::fs;
use std::io::Write;
use std::process::{Command, Stdio};
use tempfile::tempdir;

/// All commands.
pub(crate) const COMMANDS: [&str; 14] = [
    "check",
    "mesh",
    "diff",
    "emit",
    "doc",
    "fmt",
    "scan",
    "fit",
    "variance",
    "inspect",
    "compare",
    "repl",
    "completions",
    "man",
];

/// bash reads the script, and completes commands, options and values with it.
#[test]
fn shells_complete_commands_options_and_values() {
    let folder = tempdir().expect("a folder");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = gmlc(folder.path(), &["completions", shell]);
        for word in COMMANDS.iter().chain(&["max-distance", "averaged-normal"]) {
            assert!(script.contains(word), "{shell} has no `{word}`");
        }
    }
    assert!(fails(folder.path(), &["completions", "csh"], 2).contains("bash"));
    let script = gmlc(folder.path(), &["completions", "bash"]);
    let asked = "\nCOMP_WORDS=(gmlc fit --lo); COMP_CWORD=2; _gmlc gmlc --lo fit; echo ${COMPREPLY[@]}\n\
        COMP_WORDS=(gmlc fit --loss w); COMP_CWORD=3; _gmlc gmlc w --loss; echo ${COMPREPLY[@]}\n";
    let mut bash = Command::new("bash").stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("bash");
    bash.stdin.take().expect("a pipe").write_all((script + asked).as_bytes()).expect("written");
    let output = bash.wait_with_output().expect("its output");
    assert_eq!(crate::support::text(&output.stdout), "--loss\nwelsch\n");
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = tempdir().expect("a folder");
    gmlc(folder.path(), &["man", "-o", "man1"]);
    let page = |name: &str| fs::read_to_string(folder.path().join("man1").join(name)).expect("a page");
    for command in COMMANDS {
        let text = page(&format!("gmlc-{command}.1"));
        assert!(text.contains(&format!(".TH gmlc-{command} 1")) && text.contains(".SH OPTIONS"), "{command}: {text}");
        assert_eq!(text, gmlc(folder.path(), &["man", command]));
    }
    let all = page("gmlc.1");
    assert!(all.contains("gmlc\\-fit(1)") && all.contains("Exit status"), "{all}");
    assert_eq!(all, gmlc(folder.path(), &["man"]));
    assert_eq!(fs::read_dir(folder.path().join("man1")).expect("a folder").count(), COMMANDS.len() + 1);
    assert!(fails(folder.path(), &["man", "inspct"], 2).contains("did you mean 'inspect'?"));
}
