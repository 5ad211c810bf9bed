//! What all commands have in common: completions, manual pages, streams and messages.

use crate::support::{ball, fails, gmlc, gmlc_in, text};
use rexpect::session::spawn_command;
use std::fs;
use std::io::Write;
use std::path::Path;
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
    assert_eq!(text(&output.stdout), "--loss\nwelsch\n");
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

/// What a command says on standard error; it succeeds.
fn said(folder: &Path, args: &[&str]) -> String {
    let output = gmlc_in(folder, args);
    let err = text(&output.stderr);
    assert!(output.status.success(), "gmlc {}\n{err}", args.join(" "));
    err
}

#[test]
fn every_command_says_where_it_wrote() {
    let folder = ball::fitted();
    let at = folder.path();
    let measured = ["--resolution", "64", "-o"];
    let variance = [&["variance", "ball.gml", "scan.ply", "--params", "fit.json"], &measured[..]].concat();
    let inspect = [&["inspect", "ball.gml", "scan.ply"], &measured[..]].concat();
    for (args, wrote) in [
        (&["mesh", "ball.gml", "-o", "new/ball.obj"][..], "wrote new/ball.obj\n"),
        (&["mesh", "ball.gml", "-o", "ball.png"], "wrote ball.png\n"),
        (&["scan", "ball.gml", "--spacing", "3mm", "-o", "s.ply", "--truth", "t.json"], "wrote s.ply\nwrote t.json\n"),
        (&["fit", "ball.gml", "scan.ply", "-o", "f.json", "--trace", "t.csv"], "wrote f.json\nwrote t.csv\n"),
        (&["compare", "fit.json", "ball.gml", "-o", "c.json"], "wrote c.json\n"),
        (&["doc", "ball.gml", "-o", "pages"], "wrote pages/ball.md\n"),
        (&["man", "-o", "man1/"], "wrote man1/: gmlc.1 and 14 other files\n"),
        (&[&variance[..], &["v"]].concat(), "wrote v/: "),
        (&[&inspect[..], &["i"]].concat(), "wrote i/: report.html and "),
    ] {
        let err = said(at, args);
        assert!(err.contains(wrote), "gmlc {}: {err}", args.join(" "));
        let quiet = said(at, &[args, &["--quiet"]].concat());
        assert!(!quiet.contains("wrote"), "gmlc {}: {quiet}", args.join(" "));
    }
    // Warnings and errors stay.
    assert!(fails(at, &["-q", "check", "absent.gml"], 1).contains("no such file"));
    fs::write(at.join("unused.gml"), ball::BALL.replace("part", "let a = 1\n  part")).expect("written");
    assert!(said(at, &["check", "-q", "unused.gml"]).contains("warning"));
}

#[test]
fn stages_are_timed_on_demand() {
    let folder = ball::scanned(&[]);
    let fit = ["fit", "ball.gml", "scan.ply"];
    let err = said(folder.path(), &[&fit[..], &["-v"]].concat());
    let times: Vec<&str> = err.lines().filter(|line| line.ends_with(" s")).collect();
    for stage in ["compiling: ", "reading the scan: ", "stage "] {
        assert!(times.iter().any(|line| line.starts_with(stage)), "no `{stage}`: {err}");
    }
    assert!(!said(folder.path(), &fit).contains("compiling"));
    assert!(fails(folder.path(), &[&fit[..], &["-v", "-q"]].concat(), 2).contains("cannot be used with"));
}

/// On a terminal; an empty value counts as none.
#[test]
fn colours_can_be_forbidden() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("wrong.gml"), "model m {").expect("written");
    for (value, coloured) in [(None, true), (Some(""), true), (Some("1"), false)] {
        for args in [&["check", "wrong.gml"][..], &["check", "--wrong"]] {
            let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
            command.args(args).current_dir(folder.path()).env("TERM", "xterm").env_remove("NO_COLOR");
            value.iter().for_each(|value| _ = command.env("NO_COLOR", value));
            let mut session = spawn_command(command, Some(30_000)).expect("a terminal");
            let shown = session.exp_eof().expect("its output");
            assert_eq!(shown.contains("\u{1b}["), coloured, "{value:?}: {shown}");
        }
    }
}
