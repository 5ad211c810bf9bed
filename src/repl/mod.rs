//! `gmlc repl`: a session at the terminal, or with lines from standard input.
//!
//! `state` holds the session and evaluates lines; `commands` are the lines that begin with a colon;
//! `editor` is the terminal: completion (`complete`), colours, history.

mod commands;
mod complete;
mod editor;
mod history;
mod show;
mod state;
mod watch;
mod work;

use crate::cli::ReplArgs;
use crate::error::CommandError;
use gml_compiler::syntax;
use state::{Flow, Repl};
use std::io::{BufRead, IsTerminal};

/// Prompts of a first line and of a continued one.
const PROMPT: &str = "> ";
const CONTINUATION: &str = ". ";

pub(crate) fn run(args: &ReplArgs) -> Result<(), CommandError> {
    let interactive = std::io::stdin().is_terminal() && std::io::stdout().is_terminal();
    let repl = Repl::new(args, interactive)?;
    if interactive { editor::run(repl, args) } else { piped(repl, args.echo) }
}

/// Lines from standard input, without a terminal.
fn piped(mut repl: Repl, echo: bool) -> Result<(), CommandError> {
    let mut pending = String::new();
    let mut lines = std::io::stdin().lock();
    loop {
        let mut line = String::new();
        let read = lines.read_line(&mut line).map_err(CommandError::failed)?;
        if read == 0 {
            break;
        }
        if echo {
            let prompt = if pending.is_empty() { PROMPT } else { CONTINUATION };
            print!("{}", format!("{prompt}{}", line.trim_end()).trim_end().to_owned() + "\n");
        }
        pending.push_str(&line);
        if is_unfinished(&pending) {
            continue;
        }
        if repl.take(std::mem::take(&mut pending).trim_end()) == Flow::Quit {
            return repl.end();
        }
    }
    if !pending.trim().is_empty() {
        repl.take(pending.trim_end());
    }
    repl.end()
}

/// Whether a text continues in the next line; commands are single lines.
fn is_unfinished(text: &str) -> bool {
    !text.trim_start().starts_with(':') && syntax::is_incomplete(text)
}
