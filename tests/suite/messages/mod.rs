//! Messages of wrong uses, as a new user reads them: tests/messages/commands.txt lists the commands, and the snapshot
//! has what each says on standard error. A message says what is wrong, where, and what to do.

mod files;

use crate::support::{root, text};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Words of the libraries that gmlc is made with, and of Rust, which are nothing to its users.
const JARGON: [&str; 16] = [
    "os error",
    "invalid digit",
    "invalid length",
    "invalid type",
    "entity not found",
    "unknown variant",
    "missing field",
    "struct ",
    "usize",
    "u64",
    "f64",
    "Some(",
    "Err(",
    "panicked",
    "XDG_RUNTIME_DIR",
    ".gmlc-",
];
/// No number has more digits, and no line more characters: a terminal of 100 columns shows it in three.
const MOST_DIGITS: usize = 20;
const MOST_CHARACTERS: usize = 300;

/// What a command says: its line, its status, and its standard error without the folder's name.
fn said(line: &str, folder: &Path) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
    command.args(line.split(' ').skip(1)).current_dir(folder).stdin(Stdio::null());
    command.env("NO_COLOR", "1").env("HOME", folder).env_remove("XDG_RUNTIME_DIR");
    files::as_ordinary_user(&mut command);
    let output = command.output().expect("gmlc");
    let message = text(&output.stderr).replace(&folder.display().to_string(), "FOLDER");
    let status = output.status.code().map_or("none: a signal".to_owned(), |code| code.to_string());
    format!("$ {line}\n{}\nstatus {status}\n\n", message.trim_end())
}

/// What is poor about a message, whatever it says.
fn flaw(message: &str) -> Option<String> {
    if message.lines().count() < 3 {
        return Some("nothing is said".to_owned());
    }
    if let Some(word) = JARGON.iter().find(|word| message.contains(**word)) {
        return Some(format!("`{word}` is a programmer's word"));
    }
    if message.split(|c: char| !c.is_ascii_digit()).any(|digits| digits.len() > MOST_DIGITS) {
        return Some("a number is endless".to_owned());
    }
    message.lines().find(|line| line.chars().count() > MOST_CHARACTERS).map(|line| format!("a long line: {line}"))
}

#[test]
fn messages_of_wrong_uses() {
    let list = fs::read_to_string(root().join("tests/messages/commands.txt")).expect("the list of commands");
    let lines: Vec<&str> = list.lines().filter(|line| !line.is_empty()).collect();
    let folder = files::folder();
    let answers: Vec<Mutex<String>> = lines.iter().map(|line| Mutex::new(format!("{line}\n\n"))).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some(line) = lines.get(next.fetch_add(1, Ordering::Relaxed)) {
            if line.starts_with("gmlc ") {
                let place = lines.iter().position(|other| std::ptr::eq(*other, *line)).expect("its place");
                *answers[place].lock().expect("a lock") = said(line, folder.path());
            }
        }
    };
    std::thread::scope(|scope| (0..2).for_each(|_| _ = scope.spawn(work)));
    let answers: Vec<String> = answers.into_iter().map(|answer| answer.into_inner().expect("an answer")).collect();
    let commands = answers.iter().filter(|answer| answer.starts_with('$'));
    let flaws: Vec<String> =
        commands.clone().filter_map(|a| Some(format!("{}: {}", a.lines().next()?, flaw(a)?))).collect();
    assert!(flaws.is_empty(), "{}", flaws.join("\n"));
    assert!(commands.count() >= 100);
    files::inputs_are_whole(folder.path());
    if !files::is_refused_writing(folder.path()) {
        println!("skipped: this user may write into read-only folders");
        return;
    }
    insta::with_settings!({ prepend_module_to_snapshot => false, snapshot_path => "../../messages", omit_expression => true }, {
        insta::assert_snapshot!("messages", answers.concat());
    });
}
