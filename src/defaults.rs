//! `gmlc.toml` beside a script: defaults of options, in a table for each command. The command line goes before them.
//!
//! The file may be a stranger's, as the script beside it may be. It sets only the options that are listed here, which
//! name no files and raise no limits.

use crate::cli::{self, Cli};
use crate::error::CommandError;
use crate::files::{self, folder_of};
use clap::parser::ValueSource;
use clap::{ArgMatches, Command, FromArgMatches};
use gml_compiler::suggest::nearest;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

const FILE: &str = "gmlc.toml";

/// Options of a mesh and of a picture.
const MESH: &[&str] = &["chord", "view", "size"];
/// Options of the virtual scanner.
const SCANNER: &[&str] = &[
    "scanner",
    "cloud",
    "spacing",
    "noise",
    "noise-range",
    "noise-angle",
    "noise-correlation",
    "noise-share",
    "mixed-pixels",
    "views",
    "stations",
    "table",
    "clutter",
    "outliers",
    "dropouts",
    "holes",
    "no-pose",
    "seed",
];
/// Options of a fit.
const FIT: &[&str] = &["sigma", "loss", "weights", "no-pose", "normals", "coverage", "one-sided", "bootstrap", "seed"];
/// Options of a measurement.
const MEASUREMENT: &[&str] = &[
    "max-distance",
    "distance",
    "matching",
    "averaging-width",
    "form-cutoff",
    "datum",
    "fill-holes",
    "max-angle",
    "tolerance",
    "decision",
    "min-coverage",
    "device-uncertainty",
    "footprint",
    "resolution",
    "device",
    "sensitivities",
    "scale",
    "scene",
    "exr",
    "points",
    "export",
];
const UNIT: &[&str] = &["unit"];
/// Options of a comparison.
const COMPARISON: &[&str] = &["max-distance", "align", "resolution"];

/// The commands that take defaults, with what may be set for each.
const COMMANDS: [(&str, &[&[&str]]); 7] = [
    ("mesh", &[MESH]),
    ("scan", &[UNIT, SCANNER]),
    ("fit", &[UNIT, FIT]),
    ("variance", &[UNIT, MEASUREMENT]),
    ("inspect", &[UNIT, FIT, MEASUREMENT]),
    ("batch", &[UNIT, FIT, MEASUREMENT]),
    ("compare", &[COMPARISON]),
];

/// The arguments that may be the script beside which the file lies: the first that is one.
const SCRIPTS: [&str; 4] = ["model", "reference", "a", "b"];

/// The defaults that this process works with.
#[derive(Debug)]
pub(crate) struct Defaults {
    /// The file.
    pub(crate) path: PathBuf,
    pub(crate) text: String,
    /// The options that were taken from it, without those that the command line sets.
    pub(crate) taken: Vec<String>,
    /// The command line with them.
    pub(crate) words: Vec<OsString>,
}

static DEFAULTS: OnceLock<Defaults> = OnceLock::new();

/// The defaults of this process, if it has any.
pub(crate) fn of_process() -> Option<&'static Defaults> {
    DEFAULTS.get()
}

/// Parses a command line, with the defaults beside its script. Help and errors of the command line itself end the
/// process.
pub(crate) fn parse(words: Vec<OsString>) -> Result<Cli, CommandError> {
    let all = cli::definition();
    let mut matches = match (all.clone().try_get_matches_from(&words), cli::divided(&words)) {
        (Ok(matches), _) => matches,
        (Err(_), Some(divided)) => return Err(CommandError::Usage(divided)),
        (Err(error), None) => error.exit(),
    };
    if let Some(defaults) = beside(&all, &matches, &words)? {
        matches = all.try_get_matches_from(&defaults.words).map_err(|error| refused(&defaults.path, &error))?;
        _ = DEFAULTS.set(defaults);
    }
    Cli::from_arg_matches(&matches).map_err(CommandError::usage)
}

/// Says which defaults were taken.
pub(crate) fn say() {
    if let Some(defaults) = of_process().filter(|defaults| !defaults.taken.is_empty()) {
        note!("defaults from {}: {}", defaults.path.display(), defaults.taken.join(", "));
    }
}

/// The defaults of a command line; none where there is no file, or the command takes none.
fn beside(all: &Command, matches: &ArgMatches, words: &[OsString]) -> Result<Option<Defaults>, CommandError> {
    let Some((name, of_command)) = matches.subcommand() else { return Ok(None) };
    let takes = COMMANDS.iter().any(|(command, _)| *command == name);
    let mut given = SCRIPTS.into_iter().filter_map(|id| of_command.try_get_one::<PathBuf>(id).ok().flatten());
    let Some(script) = given.find(|path| takes && path.extension() == Some(OsStr::new("gml"))) else {
        return Ok(None);
    };
    let path = folder_of(script).join(FILE);
    if of_command.get_flag("no_defaults") || !path.is_file() {
        return Ok(None);
    }
    require_own(&path)?;
    let text = files::read_settings(&path)?;
    let options = options(&path, &text)?;
    let command = all.find_subcommand(name).ok_or_else(|| CommandError::usage(name))?;
    let is_free = |option: &&Setting| option.command == name && !is_given(command, of_command, &option.name);
    let free: Vec<&Setting> = options.iter().filter(is_free).collect();
    for option in &free {
        let alone = with(words, name, &[option]);
        if let Err(error) = all.clone().try_get_matches_from(alone) {
            return Err(failed(&path, &text, option.place, &first_line(&error)));
        }
    }
    let taken = free.iter().map(|option| option.name.clone()).collect();
    let words = with(words, name, &free);
    Ok(Some(Defaults { path, text, taken, words }))
}

/// Refuses a link to a file of another name: what a stranger's link leads to is not read, and not quoted in messages.
fn require_own(path: &Path) -> Result<(), CommandError> {
    match path.canonicalize() {
        Ok(real) if real.file_name() == Some(OsStr::new(FILE)) => Ok(()),
        _ => Err(CommandError::Failed(format!("{}: is a link to a file of another name", path.display()))),
    }
}

/// Whether the command line sets an option, or has one to which it would be no default.
fn is_given(command: &Command, matches: &ArgMatches, name: &str) -> bool {
    let arg = command.get_arguments().find(|arg| arg.get_long() == Some(name));
    let is_set = |id: &str| matches.value_source(id) == Some(ValueSource::CommandLine);
    // Of a fit that is documented as it is, no option says how to fit.
    let is_idle = FIT.contains(&name) && matches.try_get_one::<bool>("no_fit").ok().flatten() == Some(&true);
    is_idle || arg.is_some_and(|arg| is_set(arg.get_id().as_str()))
}

/// A command line with some options behind the command's name.
fn with(words: &[OsString], command: &str, options: &[&Setting]) -> Vec<OsString> {
    let place = words.iter().skip(1).position(|word| word == command).map_or(words.len(), |place| place + 2);
    let (before, behind) = words.split_at(place);
    let added = options.iter().filter_map(|option| option.word.clone()).map(OsString::from);
    before.iter().cloned().chain(added).chain(behind.iter().cloned()).collect()
}

/// An option of the file.
struct Setting {
    command: String,
    name: String,
    /// As the command line has it; none for a flag that is not set.
    word: Option<String>,
    /// In the text.
    place: usize,
}

/// All options of a file, for whichever command; what is none is refused.
fn options(path: &Path, text: &str) -> Result<Vec<Setting>, CommandError> {
    let failed = |place: usize, what: &str| failed(path, text, place, what);
    let tables = DeTable::parse(text).map_err(|error| {
        failed(error.span().map_or(0, |span| span.start), &format!("is not TOML: {}", error.message()))
    })?;
    let mut options = Vec::new();
    for (command, table) in tables.get_ref() {
        let place = command.span().start;
        let name = command.get_ref().as_ref();
        let Some((_, known)) = COMMANDS.iter().find(|(command, _)| *command == name) else {
            return Err(failed(place, &unknown_command(name)));
        };
        let Some(table) = table.get_ref().as_table() else {
            return Err(failed(place, &format!("`{name}` is a table: write `[{name}]`, and its options below")));
        };
        for (key, value) in table {
            let place = key.span().start;
            let option = key.get_ref().as_ref();
            if !known.iter().any(|group| group.contains(&option)) {
                return Err(failed(place, &unknown_option(name, option, known)));
            }
            let word = word(name, option, value).map_err(|what| failed(place, &what))?;
            options.push(Setting { command: name.to_owned(), name: option.to_owned(), word, place });
        }
    }
    Ok(options)
}

fn unknown_command(name: &str) -> String {
    let names = COMMANDS.map(|(command, _)| command);
    match nearest(name, names) {
        Some(near) => format!("`{name}` takes no defaults; did you mean `[{near}]`?"),
        None => format!("`{name}` takes no defaults; the tables are those of {}", names.join(", ")),
    }
}

fn unknown_option(command: &str, option: &str, known: &[&[&str]]) -> String {
    let all = cli::definition();
    let exists = all.find_subcommand(command).is_some_and(|c| c.get_arguments().any(|a| a.get_long() == Some(option)));
    if exists {
        return format!("`{option}` has no default here: only options that name no files and raise no limits have one");
    }
    match nearest(option, known.iter().copied().flatten().copied()) {
        Some(near) => format!("`gmlc {command}` has no option `{option}`; did you mean `{near}`?"),
        None => format!("`gmlc {command}` has no option `{option}`"),
    }
}

/// An option as the command line has it: `--tolerance=0.2mm`, `--coverage`, or nothing for a flag that is not set.
fn word(command: &str, option: &str, value: &Spanned<DeValue<'_>>) -> Result<Option<String>, String> {
    let all = cli::definition();
    let arg = all.find_subcommand(command).and_then(|c| c.get_arguments().find(|a| a.get_long() == Some(option)));
    let takes_value = arg.is_some_and(|arg| arg.get_action().takes_values());
    match (value.get_ref(), takes_value) {
        (DeValue::Boolean(set), false) => Ok(set.then(|| format!("--{option}"))),
        (_, false) => Err(format!("`{option}` is true or false")),
        (DeValue::String(text), true) => Ok(Some(format!("--{option}={text}"))),
        (DeValue::Integer(number), true) if number.radix() == 10 => Ok(Some(format!("--{option}={}", number.as_str()))),
        (DeValue::Float(number), true) => Ok(Some(format!("--{option}={}", number.as_str()))),
        (_, true) => Err(format!("`{option}` is a text or a number, such as \"0.2mm\"")),
    }
}

/// An error in a line of the file.
fn failed(path: &Path, text: &str, place: usize, what: &str) -> CommandError {
    let line = text.as_bytes().iter().take(place).filter(|byte| **byte == b'\n').count() + 1;
    CommandError::Failed(format!("{}:{line}: {what}", path.display()))
}

/// An error that only several options together have.
fn refused(path: &Path, error: &clap::Error) -> CommandError {
    CommandError::Failed(format!("{}: {}", path.display(), first_line(error)))
}

/// What clap says, in a line.
fn first_line(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let line = text.lines().next().unwrap_or_default();
    line.trim_start_matches("error: ").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No option of the lists names a file, and each is one of its command.
    #[test]
    fn defaults_are_options_that_name_no_files() {
        let all = cli::definition();
        for (command, groups) in COMMANDS {
            let arguments = all.find_subcommand(command).expect("a command");
            for name in groups.iter().copied().flatten() {
                let arg = arguments.get_arguments().find(|arg| arg.get_long() == Some(name)).expect(name);
                let is_path = arg.get_value_parser().type_id() == std::any::TypeId::of::<PathBuf>();
                assert!(!is_path, "{command} --{name}");
            }
        }
    }

    #[test]
    fn wrong_files_are_refused_with_their_line() {
        let said = |text: &str| match options(Path::new("gmlc.toml"), text) {
            Err(CommandError::Failed(message)) => message,
            _ => String::new(),
        };
        assert_eq!(said("[inspect]\ntolerance = \"0.2mm\"\n\n[scan]\nseed = 3\nno-pose = true\n"), "");
        for (text, expected) in [
            ("\n[inspct]\n", "gmlc.toml:2: `inspct` takes no defaults; did you mean `[inspect]`?"),
            ("[fit]\nsigam = \"1mm\"\n", "gmlc.toml:2: `gmlc fit` has no option `sigam`; did you mean `sigma`?"),
            ("[fit]\n\noutput = \"/etc/passwd\"\n", "gmlc.toml:3: `output` has no default here"),
            ("[fit]\nallow-path = \"/\"\n", "gmlc.toml:2: `allow-path` has no default here"),
            ("[fit]\ncoverage = \"yes\"\n", "gmlc.toml:2: `coverage` is true or false"),
            ("[fit]\nsigma = [1]\n", "gmlc.toml:2: `sigma` is a text or a number"),
            ("sigma = 1\n", "gmlc.toml:1: `sigma` takes no defaults"),
            ("fit = 1\n", "gmlc.toml:1: `fit` is a table"),
            ("[fit]\nsigma = \n", "gmlc.toml:2: is not TOML"),
        ] {
            assert!(said(text).starts_with(expected), "{text}: {}", said(text));
        }
    }
}
