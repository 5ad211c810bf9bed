//! The session at a terminal.

use super::state::{Flow, Repl};
use super::{PROMPT, complete, history, is_unfinished};
use crate::cli::ReplArgs;
use crate::error::CommandError;
use crate::interrupt;
use gml_compiler::session::Session;
use gml_compiler::syntax::{Class, classes};
use rustyline::completion::Completer;
use rustyline::error::ReadlineError;
use rustyline::highlight::{CmdKind, Highlighter};
use rustyline::hint::Hinter;
use rustyline::history::FileHistory;
use rustyline::validate::{ValidationContext, ValidationResult, Validator};
use rustyline::{CompletionType, Config, Context, Editor, Helper};
use std::borrow::Cow;
use std::cell::RefCell;
use std::rc::Rc;

type Lines = Editor<Help, FileHistory>;

/// Reads and evaluates lines until Ctrl-D or `:quit`.
pub(crate) fn run(mut repl: Repl, args: &ReplArgs) -> Result<(), CommandError> {
    // What was entered stays when an evaluation is ended.
    let _grace = interrupt::grace();
    let mut lines = editor(&repl)?;
    let history = history::path().filter(|_| !args.no_history);
    if let Some(path) = history.as_ref().filter(|p| p.exists()) {
        lines.load_history(path).unwrap_or_else(|e| eprintln!("{}: cannot be read: {e}", path.display()));
    }
    println!("gmlc {}: :help lists the commands, Ctrl-D leaves", env!("CARGO_PKG_VERSION"));
    loop {
        match lines.readline(PROMPT) {
            Ok(text) => {
                if !text.trim().is_empty() {
                    lines.add_history_entry(text.trim_end()).map_err(CommandError::failed)?;
                }
                if repl.take(&text) == Flow::Quit {
                    break;
                }
            }
            // At the prompt Ctrl-C clears the line.
            Err(ReadlineError::Interrupted) => {}
            Err(ReadlineError::Eof) => break,
            Err(e) => return Err(CommandError::failed(e)),
        }
    }
    if let Some(path) = history {
        let folder = path.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(ReadlineError::from);
        folder
            .and_then(|()| lines.save_history(&path))
            .unwrap_or_else(|e| eprintln!("{}: the history cannot be saved: {e}", path.display()));
    }
    repl.end()
}

fn editor(repl: &Repl) -> Result<Lines, CommandError> {
    let config = Config::builder()
        .completion_type(CompletionType::List)
        .max_history_size(history::LINES)
        .and_then(|c| c.history_ignore_dups(true))
        .map_err(CommandError::failed)?
        .build();
    let mut lines = Lines::with_config(config).map_err(CommandError::failed)?;
    let colour = crate::verbosity::allows_colour();
    lines.set_helper(Some(Help { session: repl.session.clone(), colour }));
    Ok(lines)
}

/// Completion, hints, validation and highlighting for the editor.
struct Help {
    session: Rc<RefCell<Session>>,
    colour: bool,
}

impl Helper for Help {}

impl Completer for Help {
    type Candidate = String;

    fn complete(&self, line: &str, pos: usize, _: &Context<'_>) -> rustyline::Result<(usize, Vec<String>)> {
        Ok(complete::complete(&mut self.session.borrow_mut(), line, pos))
    }
}

impl Hinter for Help {
    type Hint = String;

    /// After `f(`, the labels of f's arguments.
    fn hint(&self, line: &str, pos: usize, _: &Context<'_>) -> Option<String> {
        if pos < line.len() || !line.ends_with('(') {
            return None;
        }
        let known = self.session.borrow().known(complete::called(line)?)?;
        (!known.labels.is_empty()).then(|| format!("{})", known.labels.join(", ")))
    }
}

impl Validator for Help {
    /// A line continues while a bracket is open; two empty lines end it anyway.
    fn validate(&self, context: &mut ValidationContext<'_>) -> rustyline::Result<ValidationResult> {
        let text = context.input();
        let abandoned = text.ends_with("\n\n");
        Ok(if is_unfinished(text) && !abandoned { ValidationResult::Incomplete } else { ValidationResult::Valid(None) })
    }
}

impl Highlighter for Help {
    fn highlight<'l>(&self, line: &'l str, _: usize) -> Cow<'l, str> {
        if !self.colour || line.trim_start().starts_with(':') {
            return Cow::Borrowed(line);
        }
        let mut out = String::with_capacity(line.len() * 2);
        let mut end = 0;
        for (range, class) in classes(line) {
            out.push_str(&line[end..range.start]);
            end = range.end;
            let piece = &line[range];
            match code(class) {
                "" => out.push_str(piece),
                code => out.push_str(&format!("\x1b[{code}m{piece}\x1b[0m")),
            }
        }
        out.push_str(&line[end..]);
        Cow::Owned(out)
    }

    fn highlight_hint<'h>(&self, hint: &'h str) -> Cow<'h, str> {
        if self.colour { Cow::Owned(format!("\x1b[2m{hint}\x1b[0m")) } else { Cow::Borrowed(hint) }
    }

    fn highlight_char(&self, _: &str, _: usize, kind: CmdKind) -> bool {
        self.colour && !matches!(kind, CmdKind::MoveCursor)
    }
}

/// The terminal's colour code for a class of text.
fn code(class: Class) -> &'static str {
    match class {
        Class::Keyword => "1;35",
        Class::Number => "36",
        Class::Text => "32",
        Class::Comment => "2",
        Class::Wrong => "31",
        Class::Name | Class::Sign => "",
    }
}
