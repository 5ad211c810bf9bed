//! The command line's arguments and help.

mod batch;
mod compare;
mod comparison;
mod language;
mod scanner;
mod scans;

pub(crate) use batch::{BatchArgs, StartFrom};
pub(crate) use compare::CompareArgs;
pub(crate) use comparison::{
    FitArgs, FitControls, InspectArgs, MoreScansArgs, NormalsArg, ReportArgs, ScanArgs, VarianceArgs, VarianceControls,
};
pub(crate) use language::{
    CheckArgs, CompletionsArgs, DiffArgs, DocArgs, EmitArgs, FmtArgs, ManArgs, MeshArgs, ReplArgs, Stage,
};
pub(crate) use scanner::VirtualScanArgs;
pub(crate) use scans::{ConvertArgs, InfoArgs, ReadingArgs};

use crate::error::CommandError;
use crate::outputs;
use crate::values;
use crate::verbosity::Verbosity;
use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};
use gml_compiler::check::InputValue;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Generative models, compiled and differentiated, fitted to laser scans and compared with them.
#[derive(Debug, Parser)]
#[command(name = "gmlc", version, max_term_width = 110, after_help = AFTER_HELP)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
    #[command(flatten)]
    pub(crate) verbosity: Verbosity,
    /// Leave out the defaults in a file gmlc.toml beside the script
    #[arg(long, global = true, display_order = 1002)]
    pub(crate) no_defaults: bool,
}

const AFTER_HELP: &str = "\
Examples:
  gmlc check cup.gml                             list the contents of a script, or its errors
  gmlc scan octagonal_cup.gml -o scan.ply        make a virtual scan of a model
  gmlc info scan.e57                             what is in a scan, and what looks wrong with it
  gmlc inspect cup.gml scan.ply -o out/cup       fit, measure and document, all in one
  gmlc inspect mug.gml mug.ply --unit m -o out   a scan whose file is in metres
  gmlc batch cup.gml scans/ -o out/cups          all scans of a folder, and what they say together
  gmlc compare monday.json friday.json           where two fits differ, and by which parameters

Exit status: 0 success; 1 an error in a script, a scan or another file, or no result;
2 an error in the command line; 3 a part or a measure does not conform to its tolerance; 4 it is
undecided whether one does, or the fit did not converge, or explains fewer than half of the scan's
points. All files are written with 3 and 4.";

/// What a status other than 0 and 2 means, by command.
const STATUSES: [(&[&str], &str); 7] = [
    (&["check"], "1 the script has errors"),
    (&["fmt"], "1 a script has errors, or with --check, is not formatted"),
    (&["fit"], "1 no fit, or an interrupted one; 4 the fit, which is written, cannot be relied on"),
    (
        &["variance", "inspect"],
        "1 no result; all files are written with 3, a part or a measure does not conform\nto its tolerance, and with 4, it is \
         undecided whether one does, or the fit cannot be relied on",
    ),
    (
        &["batch"],
        "1 scans have no result; 3 a part or a measure of an object does not conform to its\ntolerance; 4 it is undecided \
         whether one does, or fits cannot be relied on; all files are written",
    ),
    (&["repl"], "1 without a terminal: an entry has failed"),
    (&[], "1 an error in a script or another file, or no result"),
];

/// The definition of the command line, with the exit statuses in the help of every command.
pub(crate) fn definition() -> clap::Command {
    // Many textures are looked at together, and none alone.
    let coarser = |command: clap::Command| command.mut_arg("resolution", |arg| arg.default_value("512"));
    Cli::command().mut_subcommand("batch", coarser).mut_subcommands(|command| {
        let is_named = |names: &[&str]| names.is_empty() || names.contains(&command.get_name());
        let meaning = STATUSES.iter().find(|(names, _)| is_named(names)).map_or("", |(_, meaning)| meaning);
        let help = command.get_after_help().map_or_else(String::new, |help| format!("{help}\n\n"));
        command.after_help(format!("{help}Exit status: 0 success; {meaning}; 2 an error in the command line"))
    })
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Check a script: diagnostics, or a table of its parameters, inputs, measures and parts
    Check(CheckArgs),
    /// Write the model's surface as a mesh, or as a picture
    Mesh(MeshArgs),
    /// Print the derivative program as readable text
    Diff(DiffArgs),
    /// Print the output of a compiler stage
    Emit(EmitArgs),
    /// Write reference pages from doc comments
    Doc(DocArgs),
    /// Format scripts
    Fmt(FmtArgs),
    /// Scan a model or a mesh with the virtual scanner
    Scan(VirtualScanArgs),
    /// Say what is in a scan, and what looks wrong with it
    Info(InfoArgs),
    /// Convert a scan or a mesh to another format, and cut, thin or clean it
    Convert(ConvertArgs),
    /// Fit a model's parameters and pose to a scan
    Fit(FitArgs),
    /// Measure the deviations of a scan from a model or a reference mesh
    Variance(VarianceArgs),
    /// Fit, measure and document: everything into one folder
    Inspect(InspectArgs),
    /// Inspect many scans of one kind of object, and say how they differ
    Batch(BatchArgs),
    /// Compare two models, fits or meshes: where they differ, and by which parameters
    Compare(CompareArgs),
    /// Evaluate expressions and definitions interactively
    Repl(ReplArgs),
    /// Print the completions of all commands and options for a shell
    Completions(CompletionsArgs),
    /// Print a manual page, or write those of all commands
    Man(ManArgs),
}

impl Command {
    /// The parameter or input that is set twice, with its option: which of the values was meant is not known.
    pub(crate) fn given_twice(&self) -> Option<String> {
        let (values, compile): (&[(String, String)], &CompileArgs) = match self {
            Self::Check(args) => (&args.values.values, &args.compile),
            Self::Mesh(args) => (&args.values.values, &args.script.compile),
            Self::Scan(args) => (&args.values.values, &args.compile),
            Self::Variance(args) => (&args.values.values, &args.compile),
            Self::Fit(args) => (&args.controls.values, &args.script.compile),
            Self::Inspect(args) => (&args.fit.values, &args.script.compile),
            Self::Batch(args) => (&args.fit.values, &args.script.compile),
            Self::Repl(args) => return twice("-p", &args.values).or_else(|| twice("--input", &args.inputs)),
            Self::Diff(args) => (&[], &args.script.compile),
            Self::Emit(args) => (&[], &args.script.compile),
            Self::Compare(args) => return twice("--limit", &args.limits),
            Self::Doc(_) | Self::Fmt(_) | Self::Info(_) | Self::Convert(_) | Self::Completions(_) | Self::Man(_) => {
                return None;
            }
        };
        let CompileArgs { inputs, limits, .. } = compile;
        twice("-p", values).or_else(|| twice("--input", inputs)).or_else(|| twice("--limit", limits))
    }
}

/// The first name that is there twice.
fn twice<T>(option: &str, values: &[(String, T)]) -> Option<String> {
    let is_again = |i: &usize| values[..*i].iter().any(|(name, _)| *name == values[*i].0);
    let again = (0..values.len()).find(is_again)?;
    Some(format!("{option} {0}: two values of {0} are given; leave one out", values[again].0))
}

/// A script and how it is compiled.
#[derive(Clone, Debug, Args)]
pub(crate) struct ScriptArgs {
    /// The script (.gml)
    #[arg(value_name = "MODEL.gml")]
    pub(crate) model: PathBuf,
    #[command(flatten)]
    pub(crate) compile: CompileArgs,
}

/// Inputs of a script, and limits on the work that it may cause.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct CompileArgs {
    /// Set an input of the model, such as bolts=6 (may be repeated)
    #[arg(long = "input", value_name = "NAME=VALUE", value_parser = values::input)]
    pub(crate) inputs: Vec<(String, InputValue)>,
    /// Set a limit on the script's work: steps, depth, nesting, instances, iterations, parts, nodes or operations,
    /// such as steps=1000000 (may be repeated)
    #[arg(long = "limit", value_name = "NAME=N", value_parser = values::limit)]
    pub(crate) limits: Vec<(String, u64)>,
    /// Allow the script to `use` the scripts in this folder and below, besides those in its own (may be repeated)
    #[arg(long = "allow-path", value_name = "FOLDER")]
    pub(crate) allowed: Vec<PathBuf>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// For people
    #[default]
    Text,
    /// For programs
    Json,
}

/// How a result is printed by commands whose --format says so, too.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(crate) struct ResultArgs {
    /// How to print the result
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    #[command(flatten)]
    json: JsonArgs,
}

impl ResultArgs {
    /// Whether the result is for programs.
    pub(crate) fn is_json(self) -> bool {
        self.format == Format::Json || self.json.json
    }

    /// The text of a result for people: nothing where it is for programs.
    pub(crate) fn text(self, text: &str) {
        if !self.is_json() {
            print!("{text}");
        }
    }
}

/// How a result is printed.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(crate) struct JsonArgs {
    /// Print the result as JSON on standard output
    #[arg(long)]
    json: bool,
}

impl JsonArgs {
    /// Refuses two streams on standard output.
    pub(crate) fn require_apart(self, output: &Path) -> Result<(), CommandError> {
        if self.json && outputs::is_stream(output) {
            return Err(CommandError::usage("--json and -o - both write to standard output; leave one out"));
        }
        Ok(())
    }

    /// Prints a result that is a text: as it is, or as JSON.
    pub(crate) fn print_text(self, text: &str, result: impl FnOnce() -> serde_json::Value) {
        if self.json {
            println!("{:#}", result());
        } else {
            print!("{text}");
        }
    }

    /// Prints a result: as JSON, or in a line, which is a note where the output itself is on standard output.
    pub(crate) fn print(self, output: &Path, result: &serde_json::Value, line: &str) {
        match (self.json, outputs::is_stream(output)) {
            (true, _) => println!("{result:#}"),
            (_, true) => note!("{line}"),
            _ => println!("{line}"),
        }
    }
}

/// Values of parameters.
#[derive(Debug, Args)]
pub(crate) struct ValueArgs {
    /// Set a parameter, such as r=42mm, alpha=30deg or shape=4 (may be repeated)
    #[arg(short = 'p', long = "param", value_name = "NAME=VALUE", value_parser = values::assignment)]
    pub(crate) values: Vec<(String, String)>,
    /// Take the parameters, the pose and the inputs from a result of `gmlc fit`, or from the truth of
    /// `gmlc scan`; -p overrides parameters
    #[arg(long, value_name = "FIT.json")]
    pub(crate) params: Option<PathBuf>,
}

/// The words of a command line in which a negative value belongs to the option before it: `--noise -1mm` is
/// `--noise=-1mm`, so that the option itself says what is wrong with it. No option begins with a digit.
pub(crate) fn with_negative_values(words: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut joined: Vec<OsString> = Vec::new();
    let mut options = true;
    for word in words {
        let text = word.to_str().unwrap_or_default();
        options &= text != "--";
        let is_negative =
            text.strip_prefix('-').is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit() || c == '.'));
        let takes = |last: &&mut OsString| {
            last.to_str().is_some_and(|last| last.starts_with('-') && last.len() > 1 && !last.contains('='))
        };
        match joined.last_mut().filter(takes) {
            Some(last) if options && is_negative => {
                last.push("=");
                last.push(&word);
            }
            _ => joined.push(word),
        }
    }
    joined
}

/// Options whose value is NAME=VALUE.
const ASSIGNMENTS: [&str; 7] = ["-p", "--param", "--param-a", "--param-b", "--input", "--input-a", "--input-b"];

/// A sentence on a value that is divided into two words: `-p r 42mm`. For a command line that cannot be parsed.
pub(crate) fn divided(words: &[OsString]) -> Option<String> {
    let is_name = |word: &str| !word.contains('=') && word.chars().all(|c| c.is_alphanumeric() || c == '_');
    let is_value = |word: &str| word.trim_start_matches(['+', '-', '.']).starts_with(|c: char| c.is_ascii_digit());
    words.windows(3).find_map(|three| {
        let [option, name, value] = [0, 1, 2].map(|k| three[k].to_str().unwrap_or_default());
        let is_divided = ASSIGNMENTS.contains(&option) && is_name(name) && is_value(value);
        is_divided.then(|| format!("{option} {name} {value}: name and value are one word: {option} {name}={value}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_values_belong_to_the_option_before_them() {
        let joined = |words: &[&str]| {
            let words = with_negative_values(words.iter().map(OsString::from));
            words.iter().map(|w| w.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(joined(&["gmlc", "fit", "--noise", "-1mm", "a.gml"]), "gmlc fit --noise=-1mm a.gml");
        assert_eq!(joined(&["gmlc", "-p", "-.5", "--view", "-30,20"]), "gmlc -p=-.5 --view=-30,20");
        assert_eq!(
            joined(&["gmlc", "a", "-1", "--x=1", "-2", "--", "--noise", "-1"]),
            "gmlc a -1 --x=1 -2 -- --noise -1"
        );
    }
}
