//! Damaged scripts through all commands that take one.

use crate::case::Case;
use crate::damage::{self, Random};
use crate::mutate::choose;
use crate::root;
use std::fs;
use std::ops::Range;
use std::path::Path;

/// The scripts that are damaged: of the examples, the library, the language tests, the diagnostics.
pub(crate) fn texts() -> Vec<String> {
    let mut texts = vec![crate::case::BALL.to_owned(); 8];
    for folder in ["examples", "stdlib", "tests/language", "tests/diagnostics", "tests/nist", "tests/derivatives"] {
        collect(&root().join(folder), &mut texts);
    }
    assert!(texts.len() > 100, "there are scripts");
    texts
}

fn collect(folder: &Path, into: &mut Vec<String>) {
    let mut paths: Vec<_> = fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            collect(&path, into);
        } else if path.extension().is_some_and(|e| e == "gml") {
            let text = fs::read_to_string(&path).expect("a script");
            // Files of tests hold many small scripts.
            into.extend(text.split("// ---").map(without_marks).filter(|t| !t.trim().is_empty()));
        }
    }
}

/// A script of a test without its expectations and the name that stood after the dashes.
fn without_marks(case: &str) -> String {
    let body = if case.starts_with(' ') { case.split_once('\n').map_or("", |c| c.1) } else { case };
    body.lines().filter(|line| !line.trim_start().starts_with("// ->")).map(|line| format!("{line}\n")).collect()
}

/// Commands by how often they are run: those that only compile, and those that go on to the runtime.
const COMPILE: [&[&str]; 13] = [
    &["check", "s.gml"],
    &["check", "s.gml", "--format", "json"],
    &["diff", "s.gml"],
    &["diff", "s.gml", "--wrt", "r"],
    &["emit", "s.gml", "--stage", "ast"],
    &["emit", "s.gml", "--stage", "typed"],
    &["emit", "s.gml", "--stage", "ir"],
    &["emit", "s.gml", "--stage", "clif"],
    &["emit", "s.gml", "--stage", "asm"],
    &["doc", "s.gml"],
    &["doc", "s.gml", "-o", "pages"],
    &["fmt", "s.gml"],
    &["fmt", "--check", "s.gml", "--format", "json"],
];

const RUN: [&[&str]; 9] = [
    &["mesh", "s.gml", "-o", "new.obj"],
    &["mesh", "s.gml", "-o", "new.stl"],
    &["mesh", "s.gml", "-o", "new.png", "--size", "64"],
    &["scan", "s.gml", "-o", "new.ply"],
    &["check", "s.gml", "--params", "fit.json"],
    &["fit", "s.gml", "scan.ply", "-o", "new.json"],
    &["variance", "s.gml", "scan.ply", "--device", "cpu", "-o", "out"],
    &["inspect", "s.gml", "scan.ply", "--device", "cpu", "-o", "out"],
    &["compare", "ball.gml", "s.gml", "-o", "new.json"],
];

/// A random case.
pub(crate) fn case(texts: &[String], random: &mut Random) -> Case {
    if random.below(8) == 0 {
        return session(damage::input(texts, random), random);
    }
    let runs = random.below(2) == 0;
    let args = if runs { choose(random, &RUN) } else { choose(random, &COMPILE) };
    // Most scripts for the runtime only have other numbers: they still have a meaning.
    let text = if runs && random.below(4) > 0 { renumbered(texts, random) } else { damage::input(texts, random) };
    let mut case = Case::of(args).with("s.gml", text.into_bytes());
    if args == ["fmt", "s.gml"] {
        case.then = ["fmt", "--check", "s.gml"].map(str::to_owned).to_vec();
    }
    case
}

/// Numbers in place of those of a model.
const NUMBERS: [&str; 24] = [
    "0",
    "1",
    "2",
    "3",
    "-1",
    "0.5",
    "1.5",
    "10",
    "100",
    "1e-320",
    "1e-100",
    "1e-15",
    "1e-6",
    "1e-3",
    "0.999999999",
    "1e4",
    "1e6",
    "1e12",
    "1e15",
    "1e38",
    "1e154",
    "1e300",
    "0.0 / 0.0",
    "(1 / 0)",
];

/// A model with other numbers, in front of the same units.
fn renumbered(texts: &[String], random: &mut Random) -> String {
    let models: Vec<&String> = texts.iter().filter(|t| t.contains("model ") && t.contains("part ")).collect();
    let mut text = models[random.below(models.len())].clone();
    for _ in 0..1 + random.below(3) {
        let numbers = numbers(&text);
        if numbers.is_empty() {
            break;
        }
        let at = numbers[random.below(numbers.len())].clone();
        text.replace_range(at, choose(random, &NUMBERS));
    }
    text
}

/// Where numbers stand, without their units, outside of comments.
fn numbers(text: &str) -> Vec<Range<usize>> {
    let bytes = text.as_bytes();
    let digit = |i: usize| bytes.get(i).is_some_and(u8::is_ascii_digit);
    let (mut numbers, mut i, mut comment) = (Vec::new(), 0, false);
    while i < bytes.len() {
        comment = bytes[i] != b'\n' && (comment || bytes[i..].starts_with(b"//"));
        let begins =
            digit(i) && !comment && (i == 0 || !(bytes[i - 1].is_ascii_alphanumeric() || bytes[i - 1] == b'_'));
        let start = i;
        i += 1;
        if begins {
            while digit(i) || bytes.get(i) == Some(&b'.') && digit(i + 1) {
                i += 1;
            }
            numbers.push(start..i);
        }
    }
    numbers
}

/// Lines that begin with a colon, for the REPL.
const COMMANDS: [&str; 31] = [
    ":help",
    ":help fit",
    ":type x",
    ":type",
    ":load ball.gml",
    ":load fit.json",
    ":load /dev/zero",
    ":load absent.gml",
    ":reload",
    ":params",
    ":set r=42mm",
    ":set r=1e999",
    ":set n=1/0",
    ":set r",
    ":doc sphere",
    ":doc r",
    ":grad r * sin(1)",
    ":grad",
    ":diff r",
    ":diff",
    ":ir",
    ":clif r^2",
    ":asm 1",
    ":time 1 + 1",
    ":mesh new.stl",
    ":mesh new.png --size 0",
    ":fit scan.ply",
    ":inspect scan.ply out",
    ":m",
    ":",
    ":quit",
];

/// A session of the REPL with damaged lines.
fn session(text: String, random: &mut Random) -> Case {
    let mut lines: Vec<&str> = text.lines().collect();
    for _ in 0..random.below(5) {
        let at = random.below(lines.len() + 1);
        lines.insert(at, choose(random, &COMMANDS));
    }
    let mut case = if random.below(2) == 0 { Case::of(&["repl"]) } else { Case::of(&["repl", "--echo"]) };
    case.input = lines.join("\n").into_bytes();
    case
}
