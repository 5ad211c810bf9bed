//! `gmlc`, the command: one module per subcommand. Only this crate prints, reads arguments or exits.
//!
//! It is a library so that the Python package has the same command, and the same options for its functions.

#[macro_use]
mod print;

mod batch;
mod check;
mod cli;
mod closedness;
mod command_line;
mod compare;
mod convert;
mod defaults;
mod deviations;
mod diagnostics;
mod diff;
mod dimensions;
mod doc;
pub mod embedded;
mod emit;
pub mod environment;
mod error;
mod files;
mod findings;
mod fit;
mod fmt;
mod info;
mod inspect;
mod inspection;
mod interrupt;
mod manual;
mod measure;
mod mesh;
mod outputs;
mod picture;
mod progress;
mod provenance;
mod record;
mod repl;
mod saved;
mod scan;
mod scanner;
mod script;
mod search;
mod several;
mod subject;
mod table;
mod values;
mod variance;
mod verbosity;

use cli::Command;
use error::CommandError;
use std::ffi::OsString;

/// Does what a command line says, whose first word is the program's name; returns the exit status.
#[must_use]
pub fn command(words: Vec<OsString>) -> u8 {
    command_line::keep(&words);
    let cli = match defaults::parse(cli::with_negative_values(words.iter().cloned())) {
        Ok(cli) => cli,
        Err(error) => {
            error.print();
            return error.status();
        }
    };
    cli.verbosity.apply();
    defaults::say();
    if let Some(notice) = gml_runtime::workers::limit_threads() {
        eprintln!("warning: {notice}");
    }
    if let Some(twice) = cli.command.given_twice() {
        eprintln!("error: {twice}");
        return 2;
    }
    let result = interrupt::handle().and_then(|()| run(&cli.command));
    let status = result.map_or_else(
        |error| {
            error.print();
            error.status()
        },
        |()| 0,
    );
    match print::finish() {
        // A reader of the output has not got all of it.
        Err(reason) if status == 0 => {
            eprintln!("error: {reason}");
            1
        }
        _ => status,
    }
}

fn run(command: &Command) -> Result<(), CommandError> {
    match command {
        Command::Check(args) => check::run(args),
        Command::Mesh(args) => mesh::run(args),
        Command::Diff(args) => diff::run(args),
        Command::Doc(args) => doc::run(args),
        Command::Emit(args) => emit::run(args),
        Command::Fmt(args) => fmt::run(args),
        Command::Scan(args) => scan::run(args),
        Command::Info(args) => info::run(args),
        Command::Convert(args) => convert::run(args),
        Command::Fit(args) => fit::run(args),
        Command::Variance(args) => variance::run(args),
        Command::Inspect(args) => inspect::run(args),
        Command::Batch(args) => batch::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Repl(args) => repl::run(args),
        Command::Completions(args) => manual::completions(args),
        Command::Man(args) => manual::pages(args),
    }
}
