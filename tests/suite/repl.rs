//! `gmlc repl`, with lines on standard input, and through a pseudo-terminal as a person uses it.

use crate::support::{example, gmlc, gmlc_with_input, root};
use rexpect::reader::Options;
use rexpect::session::{PtySession, spawn_with_options};
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Runs lines; returns the exit status and standard output.
fn lines(folder: &Path, args: &[&str], input: &str) -> (Option<i32>, String) {
    gmlc_with_input(folder, &[&["repl"], args].concat(), input)
}

/// By Leibniz' rule from the derivatives of exp, ln and 1/x, computed apart. Denominators that are squared at each
/// order overflow from the tenth on.
#[test]
fn high_derivatives_of_quotients_are_right() {
    let folder = tempfile::tempdir().expect("a folder");
    for (function, order, at, expected) in [
        ("exp(x) / (x + 2)", 10, "1", "2.96935\n"),
        ("exp(x) * ln(x + 2)", 11, "1", "9.39487\n"),
        ("exp(x) * ln(x + 2)", 12, "1", "-0.586664\n"),
        ("x^2 * ln(x + 2)", 11, "1", "110.617\n"),
        ("exp(x) / x", 7, "0.001", "-5.04e27\n"),
    ] {
        let line = format!("(|x| {function}){}({at})\n", "'".repeat(order));
        assert_eq!(lines(folder.path(), &[], &line), (Some(0), expected.into()), "{line}");
    }
}

#[test]
fn results_are_printed_and_failures_are_counted() {
    let folder = tempfile::tempdir().expect("a folder");
    assert_eq!(lines(folder.path(), &[], "let a = 2mm\na * 3\n"), (Some(0), "a = 2 mm\n6 mm\n".into()));
    assert_eq!(lines(folder.path(), &[], "1 +* 2\n40 + 2\n"), (Some(1), "42\n".into()), "it goes on after an error");
    assert_eq!(lines(folder.path(), &[], ":nonsense\n:quit\n1\n"), (Some(1), String::new()));
    assert_eq!(
        lines(folder.path(), &[], ":mesh x.obj\n:reload\n1\n"),
        (Some(1), "1\n".into()),
        "there is no model yet"
    );
    assert_eq!(lines(folder.path(), &[], "fn f(x) {\n  x + 1\n}\n\nf(\n1)"), (Some(0), "fn f(x)\n2\n".into()));
    let cup = example("cup/cup.gml");
    let (status, out) = lines(folder.path(), &[&cup, "-p", "r=50mm"], "r\n:params\n:mesh cup.ply\n:doc outer\n");
    assert_eq!(status, Some(0), "{out}");
    assert!(out.starts_with("model cup: 15 parameters, 4 parts\n50 mm\nmodel cup\n\nparameter"), "{out}");
    assert!(out.contains("cup.ply: ") && out.ends_with("fn outer(t: real) -> real\n"), "{out}");
    assert!(fs::metadata(folder.path().join("cup.ply")).is_ok_and(|m| m.len() > 1000));
    // The command line is checked before anything is read.
    assert_eq!(lines(folder.path(), &[&cup, "-p", "r=500mm"], "1\n").0, Some(1));
    assert_eq!(lines(folder.path(), &[&cup, "--input", "n=5"], "1\n").0, Some(2));
}

#[test]
fn every_command_has_help_and_the_stages_are_shown() {
    let folder = tempfile::tempdir().expect("a folder");
    let (status, help) = lines(folder.path(), &[], ":help\n");
    assert_eq!(status, Some(0));
    let names = help.lines().filter_map(|l| l.trim_start().strip_prefix(':')?.split_whitespace().next());
    let input: String = names.map(|n| format!(":help {n}\n")).collect();
    assert!(input.lines().count() >= 17, "{help}");
    assert_eq!(lines(folder.path(), &[], &input).0, Some(0));
    let cup = example("cup/cup.gml");
    for (command, expected) in [
        (":ir r * h", "mul"),
        (":clif r * h", "fmul"),
        (":asm r * h", "mul"),
        (":diff h1", "part handle"),
        (":time r * h", "runs in"),
    ] {
        let (status, out) = lines(folder.path(), &[&cup], &format!("{command}\n"));
        assert!(status == Some(0) && out.contains(expected), "{command}: {}", &out[..out.len().min(2000)]);
    }
}

/// Enters every line of the documentation's dialogues and compares the printed text with the page.
#[test]
fn the_dialogues_of_the_documentation_hold() {
    let page = fs::read_to_string(root().join("docs/repl.md")).expect("the page");
    let blocks: Vec<&str> = page.split("```").skip(1).step_by(2).filter_map(|b| b.strip_prefix("repl\n")).collect();
    let told: String = blocks.concat();
    let entered = |l: &str| l.strip_prefix("> ").or_else(|| l.strip_prefix(". ")).map(str::to_owned);
    let input: String = told.lines().filter_map(entered).map(|l| l + "\n").collect();
    let mut command = Command::new("sh");
    command.args(["-c", "exec \"$0\" repl --echo 2>&1", env!("CARGO_BIN_EXE_gmlc")]).current_dir(root());
    command.env("NO_COLOR", "1").stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().expect("a shell");
    child.stdin.take().expect("a pipe").write_all(input.as_bytes()).expect("written");
    let output = child.wait_with_output().expect("its output");
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    // The page shows only the first line of errors and programs.
    let mut rest = printed.lines();
    for line in told.lines() {
        let found = rest.by_ref().find(|l| l.trim_end() == line.trim_end());
        assert!(found.is_some(), "the page says\n{line}\nbut the dialogue is\n{printed}");
    }
    let answers = |text: &str| text.lines().filter(|l| l.ends_with(" mm")).count();
    assert_eq!(answers(&printed), answers(&told), "{printed}");
    assert_eq!(output.status.code(), Some(1), "two lines of the page are wrong on purpose");
}

#[test]
fn files_that_change_are_read_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("m.gml");
    let model = |k: &str| {
        format!("model m {{\n  param a: length = 3mm\n  let b = a * {k}\n  part p = |u, v| (a * u, b * v, 0mm)\n}}\n")
    };
    fs::write(&path, model("2")).expect("written");
    let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
    command.args(["repl", "m.gml"]).current_dir(folder.path());
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("gmlc");
    let (mut input, output) = (child.stdin.take().expect("a pipe"), child.stdout.take().expect("a pipe"));
    let mut output = BufReader::new(output).lines().map(|l| l.expect("a line"));
    assert_eq!(output.next().as_deref(), Some("model m: 1 parameter, 1 part"));
    writeln!(input, ":set a=4mm\nlet c = b\nc").expect("written");
    assert_eq!(output.next().as_deref(), Some("c = 8 mm"));
    assert_eq!(output.next().as_deref(), Some("8 mm"));
    // The new text has another length, so that the change is noticed even if the file system's clock is coarse.
    fs::write(&path, model("10.0")).expect("written");
    writeln!(input, "c").expect("written");
    assert_eq!(output.next().as_deref(), Some("m.gml has changed and is read again"));
    assert_eq!(output.next().as_deref(), Some("40 mm"), "the parameter keeps its value");
    drop(input);
    assert_eq!(child.wait().expect("its status").code(), Some(0));
}

/// A dialogue at a pseudo-terminal, with timeouts for a slow machine.
fn terminal(folder: &Path, args: &[&str]) -> PtySession {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
    command.arg("repl").args(args).current_dir(folder);
    command.env("NO_COLOR", "1").env("TERM", "xterm").env("XDG_STATE_HOME", folder);
    let options = Options::new().timeout_ms(Some(60_000)).strip_ansi_escape_codes(true);
    spawn_with_options(command, options).expect("a pseudo-terminal")
}

/// Sends a line, and waits for a text that the line does not contain, and for the next prompt.
fn ask(p: &mut PtySession, line: &str, expected: &str) {
    assert!(!line.contains(expected), "the echo of '{line}' would do");
    p.send_line(line).expect("sent");
    p.exp_string(expected).unwrap_or_else(|e| panic!("{line}: {e}"));
    p.exp_string("> ").expect("a prompt");
}

/// Sends a line whose answer is a number with this unit; returns the number.
fn number(p: &mut PtySession, line: &str, unit: &str) -> f64 {
    p.send_line(line).expect("sent");
    let (_, found) = p.exp_regex(&format!(r"\n-?[0-9.e-]+ {unit}")).unwrap_or_else(|e| panic!("{line}: {e}"));
    p.exp_string("> ").expect("a prompt");
    found.trim().split(' ').next().and_then(|n| n.parse().ok()).unwrap_or_else(|| panic!("{line}: {found}"))
}

#[test]
fn a_dialogue_at_a_terminal() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::copy(example("cup/cup.gml"), folder.path().join("cup.gml")).expect("copied");
    let mut p = terminal(folder.path(), &[]);
    p.exp_string("Ctrl-D leaves").expect("a greeting");
    p.exp_string("> ").expect("a prompt");
    ask(&mut p, "let a = 6mm * 7", "a = 42 mm");
    // A function over several lines, and its use.
    p.send_line("fn twice(x: length) -> length {").expect("sent");
    p.send_line("2 * x").expect("sent");
    p.send_line("}").expect("sent");
    p.exp_regex(r"-> length\r?\n").expect("its signature");
    p.exp_string("> ").expect("a prompt");
    ask(&mut p, "twice(a)", "84 mm");
    // The dialogue goes on after an error.
    ask(&mut p, "a + 1", "dimension-mismatch");
    ask(&mut p, "a / 2", "21 mm");
    // Tab completes a file's name, and a name of the model.
    p.send(":load cu\t").expect("sent");
    ask(&mut p, "", "15 parameters, 4 parts");
    p.send("oute\t").expect("sent");
    ask(&mut p, "(0.5)", "0.0625");
    ask(&mut p, ":set r=50mm", "\n");
    ask(&mut p, "r * 1.5", "75 mm");
    // A derivative against central differences. The dialogue prints six digits, of which the subtraction leaves four;
    // the error of the differences is step^2 / 6 of the third derivative, less than 1e-4 here.
    p.send_line(":grad outer(0.9) * h").expect("sent");
    let (_, row) = p.exp_regex(r"shape +-?[0-9.]+ mm").expect("a row");
    p.exp_string("> ").expect("a prompt");
    let exact: f64 = row.split_whitespace().nth(1).and_then(|n| n.parse().ok()).expect("a number");
    ask(&mut p, ":set shape=1.1", "\n");
    let high = number(&mut p, "outer(0.9) * h", "mm");
    ask(&mut p, ":set shape=0.9", "\n");
    let low = number(&mut p, "outer(0.9) * h", "mm");
    let difference = (high - low) / 0.2;
    assert!((difference - exact).abs() < 2e-3 * exact.abs(), "{exact} {difference}");
    ask(&mut p, ":mesh cup.obj", "triangles");
    assert!(fs::metadata(folder.path().join("cup.obj")).is_ok_and(|m| m.len() > 1000));
    // Ctrl-C at the prompt clears the line.
    p.send("nonsense +").expect("sent");
    p.send_control('c').expect("sent");
    p.exp_string("> ").expect("a prompt");
    ask(&mut p, "3 * 41", "123");
    leave(p);
    let history = fs::read_to_string(folder.path().join("gmlc/history")).expect("a history");
    assert!(history.contains("twice(a)") && history.contains("let a = 6mm * 7"), "{history}");
}

#[test]
fn what_is_running_can_be_interrupted() {
    let folder = tempfile::tempdir().expect("a folder");
    let scan = gmlc(folder.path(), &["scan", &example("cup/cup.gml"), "-o", "scan.ply"]);
    assert!(scan.contains("points"));
    let mut p = terminal(folder.path(), &["--no-history", &example("cup/cup.gml")]);
    p.exp_string("Ctrl-D leaves").expect("a greeting");
    p.exp_string("> ").expect("a prompt");
    for (line, running, patience) in [
        // This takes the interpreter hours.
        ("fold(0.0, 0..1000000000000, |a, i| a + sin(1deg * i))", Duration::from_millis(300), 5),
        (":fit scan.ply", Duration::from_millis(900), 20),
    ] {
        p.send_line(line).expect("sent");
        std::thread::sleep(running);
        let asked = Instant::now();
        p.send_control('c').expect("sent");
        p.exp_string("interrupted").unwrap_or_else(|e| panic!("{line}: {e}"));
        p.exp_string("> ").expect("a prompt");
        // An idle machine takes a second, but tests run side by side.
        assert!(asked.elapsed() < Duration::from_secs(patience), "{line}: {:?}", asked.elapsed());
        ask(&mut p, "40 + 2.5", "42.5");
    }
    leave(p);
    assert!(!folder.path().join("gmlc/history").exists());
}

fn leave(mut p: PtySession) {
    p.send_control('d').expect("sent");
    p.exp_eof().expect("the end");
    let status = p.process().wait().expect("a status");
    assert!(format!("{status:?}").contains(", 0"), "{status:?}");
}
