//! `gmlc completions` and `gmlc man`: what shells and `man` show of the command line, made from its definition, so that
//! neither can differ from `--help`.

use crate::cli::{self, CompletionsArgs, ManArgs};
use crate::error::CommandError;
use crate::outputs;
use clap::Command;
use gml_runtime::export::atomic;

/// `gmlc completions SHELL`.
pub(crate) fn completions(args: &CompletionsArgs) -> Result<(), CommandError> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut cli::definition(), "gmlc", &mut script);
    print!("{}", String::from_utf8_lossy(&script));
    Ok(())
}

/// `gmlc man`.
pub(crate) fn pages(args: &ManArgs) -> Result<(), CommandError> {
    let mut all = cli::definition();
    // Subcommands know the name of the whole command only then.
    all.build();
    if let Some(folder) = &args.output {
        outputs::make_folder(folder)?;
        let pages: Vec<(String, String)> =
            std::iter::once(&all).chain(subcommands(&all)).map(page).collect::<Result<_, _>>()?;
        for (name, text) in &pages {
            atomic::write(&folder.join(name), text.as_bytes()).map_err(CommandError::failed)?;
        }
        outputs::wrote_files(folder, &pages[0].0, pages.len());
        return Ok(());
    }
    let command = match &args.command {
        None => &all,
        Some(name) => {
            subcommands(&all).find(|command| command.get_name() == name).ok_or_else(|| unknown(&all, name))?
        }
    };
    print!("{}", page(command)?.1);
    Ok(())
}

/// All commands but `help`, which clap adds and which has pages of its own for each of them.
fn subcommands(all: &Command) -> impl Iterator<Item = &Command> {
    all.get_subcommands().filter(|command| command.get_name() != "help")
}

fn unknown(all: &Command, name: &str) -> CommandError {
    let names: Vec<&str> = subcommands(all).map(Command::get_name).collect();
    CommandError::usage(match gml_compiler::suggest::nearest(name, names.iter().copied()) {
        Some(near) => format!("there is no command '{name}'; did you mean '{near}'?"),
        None => format!("there is no command '{name}'; the commands are {}", names.join(", ")),
    })
}

/// The page of a command in roff, and the name of its file, such as `gmlc-fit.1`.
fn page(command: &Command) -> Result<(String, String), CommandError> {
    let command = command.clone().version(env!("CARGO_PKG_VERSION"));
    let manual = clap_mangen::Man::new(command).manual("gmlc").source(concat!("gmlc ", env!("CARGO_PKG_VERSION")));
    let name = manual.get_filename();
    let mut text = Vec::new();
    manual.render(&mut text).map_err(CommandError::failed)?;
    Ok((name, String::from_utf8_lossy(&text).into_owned()))
}
