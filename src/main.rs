//! `gmlc`, the command: one module per subcommand. Only this crate prints, reads arguments or exits.

mod check;
mod cli;
mod compare;
mod deviations;
mod diagnostics;
mod diff;
mod dimensions;
mod doc;
mod emit;
mod error;
mod findings;
mod fit;
mod fmt;
mod inspect;
mod measure;
mod mesh;
mod picture;
mod progress;
mod provenance;
mod repl;
mod saved;
mod scan;
mod script;
mod search;
mod subject;
mod table;
mod values;
mod variance;

use clap::Parser;
use cli::{Cli, Command};
use std::process::ExitCode;

fn main() -> ExitCode {
    // A reader that closes the pipe early, such as `head`, ends the command quietly.
    sigpipe::reset();
    let cli = Cli::parse();
    let result = match &cli.command {
        Command::Check(args) => check::run(args),
        Command::Mesh(args) => mesh::run(args),
        Command::Diff(args) => diff::run(args),
        Command::Doc(args) => doc::run(args),
        Command::Emit(args) => emit::run(args),
        Command::Fmt(args) => fmt::run(args),
        Command::Scan(args) => scan::run(args),
        Command::Fit(args) => fit::run(args),
        Command::Variance(args) => variance::run(args),
        Command::Inspect(args) => inspect::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Repl(args) => repl::run(args),
    };
    let Err(error) = result else { return ExitCode::SUCCESS };
    error.print();
    ExitCode::from(error.status())
}
