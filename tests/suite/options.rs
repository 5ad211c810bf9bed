//! What all commands have in common: completions, manual pages, streams and messages.

use crate::support::{ball, fails, gmlc, gmlc_in, json, text};
use rexpect::session::spawn_command;
use serde_json::{Value, json as of};
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::tempdir;

/// All commands.
pub(crate) const COMMANDS: [&str; 17] = [
    "check",
    "mesh",
    "diff",
    "emit",
    "doc",
    "fmt",
    "scan",
    "info",
    "convert",
    "fit",
    "variance",
    "inspect",
    "batch",
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
        (&["fit", "ball.gml", "scan.ply", "-o", "f.json", "--trace", "t.csv"], "wrote t.csv\nwrote f.json\n"),
        (&["compare", "fit.json", "ball.gml", "-o", "c.json"], "wrote c.json\n"),
        (&["doc", "ball.gml", "-o", "pages"], "wrote pages/ball.md\n"),
        (&["man", "-o", "man1/"], "wrote man1/: gmlc.1 and 17 other files\n"),
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

/// One file on standard output is the file that would have been written.
#[test]
fn one_file_may_go_to_standard_output() {
    let folder = ball::fitted();
    let at = folder.path();
    let stream = |args: &[&str]| {
        let output = gmlc_in(at, args);
        assert!(output.status.success(), "gmlc {}: {}", args.join(" "), text(&output.stderr));
        assert!(!text(&output.stderr).contains("wrote"), "{}", text(&output.stderr));
        output.stdout
    };
    for format in ["obj", "ply", "stl", "png"] {
        let name = format!("ball.{format}");
        gmlc(at, &["mesh", "ball.gml", "-o", &name]);
        let streamed = stream(&["mesh", "ball.gml", "--format", format, "-o", "-"]);
        assert!(streamed == fs::read(at.join(&name)).expect("a file"), "{format}");
    }
    gmlc(at, &["mesh", "ball.gml", "--format", "stl", "-o", "ball.bin"]);
    assert!(fs::read(at.join("ball.bin")).expect("a file") == fs::read(at.join("ball.stl")).expect("a file"));
    let scan = ["scan", "ball.gml", "--spacing", "3mm", "--format", "ply", "-o"];
    assert!(stream(&[&scan[..], &["-"]].concat()) == fs::read(at.join("scan.ply")).expect("a scan"));
    let fit: Value = serde_json::from_slice(&stream(&["fit", "ball.gml", "scan.ply", "-o", "-"])).expect("JSON");
    assert_eq!(fit["parameters"], json(&at.join("fit.json"))["parameters"]);
    let compared: Value =
        serde_json::from_slice(&stream(&["compare", "fit.json", "ball.gml", "-o", "-"])).expect("JSON");
    assert_eq!(compared["operands"][0]["kind"], "fit");
    assert!(!at.join("-").exists());
    assert!(fails(at, &["mesh", "ball.gml", "-o", "-"], 2).contains("--format"));
    assert!(fails(at, &["mesh", "ball.gml", "--format", "ply", "--json", "-o", "-"], 2).contains("leave one out"));
}

#[test]
fn results_are_printed_as_json() {
    let folder = ball::fitted();
    let at = folder.path();
    let printed = |args: &[&str]| -> Value {
        let out = gmlc(at, args);
        serde_json::from_str(&out).unwrap_or_else(|e| panic!("gmlc {}: {e}\n{out}", args.join(" ")))
    };
    let check = printed(&["check", "ball.gml", "--json"]);
    assert_eq!(check, printed(&["check", "ball.gml", "--format", "json"]));
    assert_eq!(printed(&["fmt", "--check", "ball.gml", "--json"])[0]["status"], "unchanged");
    let mesh = printed(&["mesh", "ball.gml", "-o", "ball.ply", "--json"]);
    assert_eq!((&mesh["output"], &mesh["parts"], &mesh["warnings"]), (&"ball.ply".into(), &1.into(), &of!([])));
    assert!(mesh["triangles"].as_u64() > mesh["vertices"].as_u64() && mesh["chord"].as_f64() < Some(0.02));
    let picture = printed(&["mesh", "ball.gml", "-o", "ball.png", "--size", "64x48", "--json"]);
    assert_eq!((&picture["width"], &picture["height"]), (&64.into(), &48.into()));
    let mut scan = printed(&["scan", "ball.gml", "--spacing", "3mm", "-o", "s.ply", "--truth", "truth.json", "--json"]);
    assert_eq!(scan.as_object_mut().expect("an object").remove("output"), Some("s.ply".into()));
    assert_eq!(scan, json(&at.join("truth.json")));
    let fit = printed(&["fit", "ball.gml", "scan.ply", "-o", "f.json", "--json"]);
    assert_eq!(fit, json(&at.join("f.json")));
    let measured = ["--resolution", "64", "--json", "-o"];
    let variance = [&["variance", "ball.gml", "scan.ply", "--params", "fit.json"], &measured[..], &["v"]].concat();
    assert_eq!(printed(&variance), json(&at.join("v/variance.json")));
    let inspected = printed(&[&["inspect", "ball.gml", "scan.ply"], &measured[..], &["i"]].concat());
    assert_eq!(inspected["fit"], json(&at.join("i/fit.json")));
    assert_eq!((&inspected["variance"], &inspected["output"]), (&json(&at.join("i/variance.json")), &"i".into()));
    assert_eq!(printed(&["compare", "fit.json", "ball.gml", "--json"])["operands"][1]["kind"], "script");
}

/// The documents of a measurement are those of an inspection, from a script as from a mesh.
#[test]
fn measurements_are_documented() {
    let folder = ball::fitted();
    let at = folder.path();
    let run = |reference: &str, options: &[&str], out: &str| {
        let args = [&["variance", reference, "scan.ply", "--resolution", "64", "-o", out], options].concat();
        (gmlc(at, &args), fs::read_to_string(at.join(out).join("report.html")).expect("a report"))
    };
    let (_, fitted) = run("ball.gml", &["--params", "fit.json"], "fitted");
    assert!(fitted.contains("<title>ball compared with scan.ply") && fitted.contains("Converged"), "the fit is shown");
    let (_, given) = run("ball.gml", &["--params", "fit.json", "-p", "r=20.5mm"], "given");
    assert!(given.contains("not the fitted one") && !given.contains("Converged"));
    gmlc(at, &["mesh", "ball.gml", "--params", "fit.json", "-o", "ball.stl"]);
    let (_, mesh) = run("ball.stl", &[], "mesh");
    assert!(mesh.contains("<title>ball.stl compared with scan.ply"));
    for out in ["fitted", "given", "mesh"] {
        assert!(["views.png", "model.x3d"].iter().all(|name| at.join(out).join(name).exists()), "{out}");
        assert!(!at.join(out).join("fit.json").exists(), "{out}");
    }
    // A fit.json of the user stays, and that of an inspection goes with it.
    fs::copy(at.join("fit.json"), at.join("mesh/fit.json")).expect("copied");
    run("ball.stl", &[], "mesh");
    assert!(at.join("mesh/fit.json").exists());
    gmlc(at, &["inspect", "ball.gml", "scan.ply", "--resolution", "64", "-o", "mesh"]);
    run("ball.stl", &[], "mesh");
    assert!(!at.join("mesh/fit.json").exists());
}

#[test]
fn a_fit_is_documented_without_fitting() {
    let folder = ball::scanned(&["--no-pose"]);
    let at = folder.path();
    gmlc(at, &["fit", "ball.gml", "scan.ply", "-o", "fit.json"]);
    let inspect = ["inspect", "ball.gml", "scan.ply", "--resolution", "64", "--no-fit"];
    let with = |more: &[&'static str]| [&inspect[..], more].concat();
    gmlc(at, &with(&["--params", "fit.json", "-o", "out"]));
    assert_eq!(json(&at.join("out/fit.json")), json(&at.join("fit.json")));
    assert!(at.join("out/report.html").exists());
    let variance = ["variance", "ball.gml", "scan.ply", "--resolution", "64", "--params", "fit.json", "-o", "v"];
    gmlc(at, &variance);
    let rms = |out: &str| json(&at.join(out).join("variance.json"))["rms"].clone();
    assert_eq!(rms("out"), rms("v"));
    // Into the folder of the fit, which stays as it is.
    let bytes = fs::read(at.join("out/fit.json")).expect("a fit");
    gmlc(at, &with(&["--params", "out/fit.json", "-o", "out"]));
    assert!(fs::read(at.join("out/fit.json")).expect("a fit") == bytes);
    // Another scan is said to be one.
    gmlc(at, &["scan", "ball.gml", "--spacing", "3mm", "--no-pose", "--seed", "2", "-o", "scan.ply"]);
    let out = gmlc(at, &with(&["--params", "fit.json", "-o", "out"]));
    assert!(out.contains("fitted to another scan"), "{out}");
    assert!(fails(at, &with(&["-o", "out"]), 2).contains("--params"));
    assert!(fails(at, &with(&["--params", "fit.json", "--coverage", "-o", "out"]), 2).contains("--coverage"));
    assert!(fails(at, &with(&["--params", "fit.json", "-p", "r=20mm", "-o", "out"]), 2).contains("--param"));
}
