//! What a command may not do whatever it is given: replace what it reads, read what it was not given, mix two results,
//! or end in a panic.

use crate::support::{ball, fails, gmlc, gmlc_in, gmlc_with_input, text};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::tempdir;

fn read(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[test]
fn inputs_are_never_replaced() {
    let folder = ball::fitted();
    let at = folder.path();
    fs::create_dir(at.join("out")).expect("a folder");
    fs::copy(at.join("scan.ply"), at.join("out/unmatched.ply")).expect("copied");
    fs::copy(at.join("fit.json"), at.join("out/fit.json")).expect("copied");
    std::os::unix::fs::symlink("ball.gml", at.join("link.gml")).expect("a link");
    let before: Vec<Vec<u8>> = ["ball.gml", "scan.ply", "fit.json"].map(|name| read(at, name)).into();
    fs::create_dir(at.join("lib")).expect("a folder");
    fs::write(at.join("lib/size.gml"), "let size = 20mm\n").expect("written");
    let user = ball::BALL.replace("= 20mm", "= size");
    fs::write(at.join("user.gml"), format!("use \"lib/size.gml\" (size)\n{user}")).expect("written");
    fs::write(at.join("report.toml"), "Operator = \"A\"\n").expect("written");
    let wrong: [&[&str]; 19] = [
        &["fit", "ball.gml", "scan.ply", "-o", "report.toml"],
        &["fit", "ball.gml", "scan.ply", "--trace", "report.toml"],
        &["inspect", "ball.gml", "scan.ply", "--trace", "report.toml", "-o", "new"],
        &["fit", "ball.gml", "scan.ply", "-o", "scan.ply"],
        &["fit", "ball.gml", "scan.ply", "-o", "./out/../ball.gml"],
        &["fit", "link.gml", "scan.ply", "-o", "ball.gml"],
        &["fit", "ball.gml", "scan.ply", "--params", "fit.json", "-o", "fit.json"],
        &["fit", "ball.gml", "scan.ply", "--trace", "scan.ply"],
        &["scan", "ball.gml", "-o", "new.ply", "--truth", "ball.gml"],
        &["compare", "fit.json", "scan.ply", "-o", "fit.json"],
        &["inspect", "ball.gml", "scan.ply", "--trace", "ball.gml", "-o", "new"],
        &["inspect", "ball.gml", "scan.ply", "--trace", "scan.ply", "-o", "new"],
        &["inspect", "user.gml", "scan.ply", "--trace", "lib/size.gml", "-o", "new"],
        &["fit", "user.gml", "scan.ply", "-o", "lib/size.gml"],
        &["scan", "user.gml", "-o", "new.ply", "--truth", "lib/size.gml"],
        &["compare", "fit.json", "user.gml", "-o", "lib/size.gml"],
        &["compare", "fit.json", "scan.ply", "-o", "ball.gml"],
        &["inspect", "ball.gml", "out/unmatched.ply", "-o", "out"],
        &["inspect", "ball.gml", "scan.ply", "--params", "out/fit.json", "-o", "out"],
    ];
    for args in wrong {
        let error = fails(at, args, 2);
        assert!(error.contains("is an input"), "{args:?}: {error}");
    }
    for args in [
        ["scan", "ball.gml", "-o", "new.ply", "--truth", "./new.ply"].as_slice(),
        &["fit", "ball.gml", "scan.ply", "-o", "new.json", "--trace", "new.json"],
    ] {
        assert!(fails(at, args, 2).contains("two outputs"), "{args:?}");
    }
    let after: Vec<Vec<u8>> = ["ball.gml", "scan.ply", "fit.json"].map(|name| read(at, name)).into();
    assert!(before == after && !at.join("new.ply").exists());
    // The fit that a measurement begins from may stand in its folder: it is not replaced.
    gmlc(at, &["variance", "ball.gml", "scan.ply", "--params", "out/fit.json", "-o", "out", "--resolution", "64"]);
    assert_eq!(read(at, "out/fit.json"), read(at, "fit.json"));
}

/// A session knows what it was begun with.
#[test]
fn a_session_replaces_neither_its_script_nor_its_fit() {
    let folder = ball::fitted();
    let at = folder.path();
    let before = ["ball.gml", "fit.json"].map(|name| read(at, name));
    for line in [":fit scan.ply -o ball.gml", ":fit scan.ply -o fit.json", ":fit scan.ply --trace ball.gml"] {
        let (status, _) = gmlc_with_input(at, &["repl", "ball.gml", "--params", "fit.json"], &format!("{line}\n"));
        assert_eq!(status, Some(1), "{line}");
    }
    assert_eq!(before, ["ball.gml", "fit.json"].map(|name| read(at, name)));
}

/// A file that others may not read stays so.
#[cfg(unix)]
#[test]
fn a_new_version_has_the_permissions_of_the_old_one() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempdir().expect("a folder");
    let script = folder.path().join("a.gml");
    fs::write(&script, "model a{part b=disc(1mm)}\n").expect("written");
    fs::set_permissions(&script, PermissionsExt::from_mode(0o600)).expect("set");
    gmlc(folder.path(), &["fmt", "a.gml"]);
    assert_eq!(fs::metadata(&script).expect("there").permissions().mode() & 0o777, 0o600);
}

/// What the values that are given do not allow is an error of `check` as of all commands.
#[test]
fn values_at_which_the_model_does_not_exist_are_errors_of_check() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let script =
        "model m {\n param r: length in 1mm..9mm = 8mm\n require r > 6mm, \"too small\"\n part p = disc(r)\n}\n";
    fs::write(at.join("m.gml"), script).expect("written");
    gmlc(at, &["check", "m.gml", "-p", "r=7mm"]);
    let error = fails(at, &["check", "m.gml", "-p", "r=2mm"], 1);
    assert!(error.contains("at these values: too small") && error.contains("m.gml:3:2"), "{error}");
    let output = gmlc_in(at, &["check", "m.gml", "-p", "r=2mm", "--json"]);
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let diagnostics = json["diagnostics"].as_array().expect("a list");
    let is_error = |of: &Value| of["code"] == "evaluation" && of["line"] == 3 && of["severity"] == "error";
    assert!(json["ok"] == false && diagnostics.iter().any(is_error), "{json:#}");
    for (tolerance, expected) in [("-1mm", "must not be negative"), ("1mm * (0 / 0.0)", "not a")] {
        fs::write(at.join("t.gml"), format!("model t {{\n part p tolerance {tolerance} = disc(5mm)\n}}\n"))
            .expect("written");
        let error = fails(at, &["check", "t.gml"], 1);
        assert!(error.contains(expected) && error.contains("t.gml:2:"), "{error}");
    }
}

/// So is a measure that cannot be computed at the defaults.
#[test]
fn measures_without_a_value_are_errors_of_check() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let script =
        "model m {\n param r: length in 1mm..9mm = 8mm\n measure root = sqrt((4mm - r) / 1mm)\n part p = disc(r)\n}\n";
    fs::write(at.join("m.gml"), script).expect("written");
    let error = fails(at, &["check", "m.gml"], 1);
    assert!(error.contains("'root' cannot be computed") && error.contains("m.gml:3:"), "{error}");
    gmlc(at, &["check", "m.gml", "-p", "r=3mm"]);
    assert!(fails(at, &["check", "m.gml", "-p", "r=7mm"], 1).contains("'root' cannot be computed"));
}

/// U+009B is what ESC [ is.
#[test]
fn controls_beyond_ascii_are_not_printed() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("c.gml"), "model c {\n  part w = cylinder(1, \"\u{9b}31mXX\")\n}\n").expect("written");
    let error = fails(at, &["check", "c.gml"], 1);
    assert!(error.contains("31mXX") && !error.contains('\u{9b}'), "{error}");
}

/// A surface of a thousand kinks, and a loop of millions of steps at each point: both took minutes.
#[test]
fn surfaces_that_are_slow_to_look_at_do_not_take_minutes() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let kinks = "sum(for i in 0..1000 { abs(sin(u * 1rad * i)) })";
    fs::write(at.join("k.gml"), format!("model k {{ part p = |u, v| (1mm * u, 1mm * v, 1mm * {kinks}) }}\n"))
        .expect("written");
    let begun = Instant::now();
    gmlc(at, &["check", "k.gml"]);
    assert!(begun.elapsed() < Duration::from_secs(30), "{:?}", begun.elapsed());
    let steps = "loop(0.0, 9000000, |a, i| a + sin(a * 1rad + u * 1rad))";
    fs::write(at.join("l.gml"), format!("model l {{ part p = |u, v| (1mm * u, 1mm * v, 1mm * {steps}) }}\n"))
        .expect("written");
    let error = fails(at, &["check", "l.gml"], 1);
    assert!(error.contains("--limit steps)"), "{error}");
}

#[test]
fn what_is_no_file_is_not_read() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("ball.gml"), ball::BALL).expect("written");
    let made = Command::new("mkfifo").args([at.join("pipe.gml"), at.join("pipe.ply")]).status().expect("mkfifo");
    assert!(made.success());
    for args in [
        ["check", "/dev/zero"],
        ["check", "/dev/urandom"],
        ["check", "pipe.gml"],
        ["fmt", "/dev/zero"],
        ["doc", "/dev/zero"],
    ] {
        let begun = Instant::now();
        let error = fails(at, &args, 1);
        assert!(error.contains("a pipe or a device") && begun.elapsed() < Duration::from_secs(5), "{args:?}: {error}");
    }
    let error = fails(at, &["mesh", "ball.gml", "-o", "pipe.ply"], 1);
    assert!(error.contains("is a pipe"), "{error}");
    let error = fails(at, &["check", "ball.gml", "--params", "/dev/zero"], 1);
    assert!(error.contains("a pipe or a device"), "{error}");
}

#[test]
fn scripts_read_scripts_in_their_folder_only() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    for (name, content) in [
        ("library/size.gml", "let size = 20mm\n"),
        ("secret.txt", "hunter2\n"),
        ("model/secret.gml", ""),
        ("model/outside.gml", "use \"../library/size.gml\" (size)\nmodel m { part p = sphere(size) }\n"),
        ("model/text.gml", "use \"../secret.txt\" (a)\nmodel m { part p = sphere(a) }\n"),
        ("model/linked.gml", "use \"secret.gml\" (a)\nmodel m { part p = sphere(a) }\n"),
        ("model/absolute.gml", "use \"/etc/passwd\" (a)\nmodel m { part p = sphere(a) }\n"),
    ] {
        let path = at.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, content).expect("written");
    }
    fs::remove_file(at.join("model/secret.gml")).expect("removed");
    std::os::unix::fs::symlink("../secret.txt", at.join("model/secret.gml")).expect("a link");
    let error = fails(at, &["check", "model/outside.gml"], 1);
    assert!(error.contains("outside of the script's folder") && error.contains("--allow-path"), "{error}");
    gmlc(at, &["check", "model/outside.gml", "--allow-path", "library"]);
    for script in ["model/text.gml", "model/linked.gml", "model/absolute.gml"] {
        let error = fails(at, &["check", script], 1);
        assert!(error.contains("is not a script") && !error.contains("hunter2") && !error.contains("root:"), "{error}");
    }
}

#[test]
fn a_full_disk_is_an_error_and_no_panic() {
    if !Path::new("/dev/full").exists() {
        println!("skipped: there is no /dev/full");
        return;
    }
    let folder = ball::fitted();
    let commands: [&[&str]; 6] = [
        &["check", "ball.gml"],
        &["diff", "ball.gml"],
        &["doc", "ball.gml"],
        &["fit", "ball.gml", "scan.ply"],
        &["check", "ball.gml", "--format", "json"],
        &["check", "absent.gml"],
    ];
    for args in commands {
        for (out, err) in [(true, false), (false, true), (true, true)] {
            let full = || Stdio::from(fs::File::options().write(true).open("/dev/full").expect("/dev/full"));
            let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
            command.args(args).current_dir(folder.path());
            command.stdout(if out { full() } else { Stdio::piped() });
            command.stderr(if err { full() } else { Stdio::piped() });
            let output = command.spawn().and_then(std::process::Child::wait_with_output).expect("gmlc");
            let (status, said) = (output.status.code(), text(&output.stderr));
            let expected = i32::from(out || args[1] == "absent.gml");
            assert!(status == Some(expected) && !said.contains("panicked"), "{args:?}: {status:?} {said}");
            assert!(err || !out || args[1] == "absent.gml" || said.contains("standard output"), "{args:?}: {said}");
        }
    }
}

#[test]
fn what_a_terminal_obeys_does_not_reach_it() {
    let folder = tempdir().expect("a folder");
    let script = "/// A \u{1b}[31mred\u{1b}[0m ball.\u{9b}2J\nmodel ball {\n  /// \u{1b}]0;title\u{7}\n  param r: length in 5mm..50mm = 20mm\n  part p = sphere(r) + nothing \u{1b}[2J\n}\n";
    fs::write(folder.path().join("wrong.gml"), script).expect("written");
    fs::write(folder.path().join("right.gml"), script.replace(" + nothing \u{1b}[2J", "")).expect("written");
    let strange = "no\u{1b}[31m.gml";
    for args in [["check", "wrong.gml"], ["check", "right.gml"], ["doc", "right.gml"], ["check", strange]] {
        let output = gmlc_in(folder.path(), &args);
        for said in [text(&output.stdout), text(&output.stderr)] {
            let found = said.chars().find(|c| c.is_control() && !matches!(c, '\n' | '\t'));
            assert!(found.is_none(), "{args:?}: {found:?} in {said:?}");
        }
    }
}

#[test]
fn a_model_that_is_huge_or_far_away_is_no_panic() {
    let folder = ball::fitted();
    let scripts = [
        "model pole { param k: real in 0.01..1 = 1\n param r: length in 5mm..50mm = 20mm\n part q = sphere(r / (k - 0.5) ^ 40) }",
        "model far { param x: length in 0mm..1e21mm = 1e19mm\n param r: length in 5mm..50mm = 20mm\n part q = |u, v| (x + r * cos(u * 1turn), r * sin(u * 1turn), v * 30mm) }",
        "model huge { param r: length in 5mm..1e300mm = 1e200mm\n part q = sphere(r) }",
    ];
    for script in scripts {
        fs::write(folder.path().join("odd.gml"), script).expect("written");
        let output = gmlc_in(folder.path(), &["fit", "odd.gml", "scan.ply"]);
        let said = text(&output.stderr);
        assert!(matches!(output.status.code(), Some(0 | 1 | 4)) && !said.contains("panicked"), "{script}: {said}");
    }
}

#[test]
fn texts_with_marks_and_in_other_encodings_are_read_or_named() {
    let folder = tempdir().expect("a folder");
    let utf_16: Vec<u8> = [0xfeff].into_iter().chain(ball::BALL.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    fs::write(folder.path().join("marked.gml"), [b"\xef\xbb\xbf", ball::BALL.as_bytes()].concat()).expect("written");
    fs::write(folder.path().join("wide.gml"), utf_16).expect("written");
    gmlc(folder.path(), &["check", "marked.gml"]);
    assert!(fails(folder.path(), &["check", "wide.gml"], 1).contains("UTF-16"));
}

#[test]
fn inputs_under_other_names_are_inputs_still() {
    let folder = ball::fitted();
    let at = folder.path();
    fs::hard_link(at.join("scan.ply"), at.join("same.ply")).expect("a link");
    fs::create_dir(at.join("out")).expect("a folder");
    // A link to an input, under the name of a result, and an input that is a link there.
    std::os::unix::fs::symlink("../scan.ply", at.join("out/filled.ply")).expect("a link");
    let variance = |scan: &'static str| ["variance", "ball.gml", scan, "--params", "fit.json", "-o", "out"];
    for args in [
        &variance("scan.ply")[..],
        &variance("out/filled.ply"),
        &variance("same.ply"),
        &["fit", "ball.gml", "scan.ply", "-o", "same.ply"],
        &["scan", "ball.gml", "-o", "new.ply", "--truth", "ball.gml"],
    ] {
        let error = fails(at, args, 2);
        assert!(error.contains("is an input"), "{args:?}: {error}");
    }
    assert!(fs::symlink_metadata(at.join("out/filled.ply")).expect("it is there").is_symlink());
    assert_eq!(read(at, "same.ply"), read(at, "scan.ply"));
}

/// A folder that another process has locked: the run says so, and goes on as soon as it may.
#[test]
fn a_locked_folder_is_waited_for_aloud() {
    let folder = ball::fitted();
    let at = folder.path();
    fs::create_dir(at.join("out")).expect("a folder");
    let held = fs::File::open(at.join("out")).expect("a folder");
    held.lock().expect("a lock");
    let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
    command.args(["inspect", "ball.gml", "scan.ply", "-o", "out", "--resolution", "64"]).current_dir(at);
    let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("gmlc");
    std::thread::sleep(Duration::from_secs(3));
    drop(held);
    let output = child.wait_with_output().expect("its output");
    let said = text(&output.stderr);
    assert!(output.status.success() && said.contains("`out` is locked by"), "{said}");
    assert!(at.join("out/report.html").exists());
}

#[test]
fn scripts_that_are_skipped_are_named() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("ball.gml"), ball::BALL).expect("written");
    std::os::unix::fs::symlink("ball.gml", at.join("link.gml")).expect("a link");
    assert!(Command::new("mkfifo").arg(at.join("pipe.gml")).status().expect("mkfifo").success());
    let said = text(&gmlc_in(at, &["fmt", "."]).stderr);
    assert!(said.contains("skipped ./pipe.gml: is a pipe") && said.contains("skipped ./link.gml: is a link"), "{said}");
}

/// A driver's layer asks for a display where there is none, and says so on standard error.
#[test]
fn drivers_say_nothing_without_a_display() {
    let folder = ball::fitted();
    let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
    command.args(["inspect", "-q", "ball.gml", "scan.ply", "-o", "out", "--resolution", "64"]);
    let output = command
        .current_dir(folder.path())
        .env_remove("XDG_RUNTIME_DIR")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .expect("gmlc");
    assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
}
