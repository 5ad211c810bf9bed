//! Arguments of the commands that require a script and no scan.

use super::{CompileArgs, JsonArgs, ResultArgs, ScriptArgs, ValueArgs};
use crate::picture;
use crate::values;
use clap::{Args, ValueEnum};
use gml_compiler::check::InputValue;
use gml_runtime::export::render::View;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  gmlc check examples/cup/cup.gml\n  gmlc check cup.gml --params fit.json\n  gmlc check cup.gml --format json | jq '.parameters[].name'\n  gmlc check --explain dimension-mismatch"
)]
pub(crate) struct CheckArgs {
    /// The script (.gml)
    #[arg(value_name = "MODEL.gml", required_unless_present = "explain")]
    pub(crate) model: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) compile: CompileArgs,
    #[command(flatten)]
    pub(crate) values: ValueArgs,
    /// Explain a diagnostic's code, with an example
    #[arg(long, value_name = "CODE")]
    pub(crate) explain: Option<String>,
    #[command(flatten)]
    pub(crate) result: ResultArgs,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  gmlc mesh examples/cup/cup.gml -p r=42mm -o cup.obj\n  gmlc mesh cup.gml --params fit.json --chord 0.005mm -o cup.ply\n  gmlc mesh cup.gml --view 35,25 --size 640x480 -o cup.png\n  gmlc mesh cup.gml --format stl -o - | gzip > cup.stl.gz"
)]
pub(crate) struct MeshArgs {
    #[command(flatten)]
    pub(crate) script: ScriptArgs,
    #[command(flatten)]
    pub(crate) values: ValueArgs,
    /// The file to write: .obj (with texture coordinates and groups), .ply or .stl; or .png, a picture with a tint for
    /// every part; - is standard output
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Format of the file [default: by the ending of its name]
    #[arg(long, value_name = "FORMAT", value_parser = ["obj", "ply", "stl", "png"])]
    pub(crate) format: Option<String>,
    #[command(flatten)]
    pub(crate) json: JsonArgs,
    /// Largest distance between the mesh and the exact surface [default: 0.02mm, or a fifth of a pixel for a picture]
    #[arg(long, value_name = "LENGTH", value_parser = values::positive_length)]
    pub(crate) chord: Option<f64>,
    /// Viewpoint of a picture: corner, front, back, top, below, inside (cut open), or AZIMUTH,ELEVATION in degrees
    /// (from the front to the right, and upwards) [default: corner]
    #[arg(long, value_name = "VIEW", allow_hyphen_values = true, value_parser = picture::parse_view)]
    pub(crate) view: Option<View>,
    /// Size of a picture in pixels: 640, or 640x480 [default: 640]
    #[arg(long, value_name = "PIXELS", value_parser = picture::parse_size)]
    pub(crate) size: Option<(usize, usize)>,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  gmlc diff examples/cup/cup.gml --wrt r\n  gmlc diff cup.gml")]
pub(crate) struct DiffArgs {
    #[command(flatten)]
    pub(crate) script: ScriptArgs,
    /// Differentiate only with respect to this parameter
    #[arg(long, value_name = "NAME")]
    pub(crate) wrt: Option<String>,
    #[command(flatten)]
    pub(crate) json: JsonArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Stage {
    /// The syntax tree
    Ast,
    /// The typed tree, generics instantiated
    Typed,
    /// Scalar functions in SSA form, simplified
    Ir,
    /// Cranelift's intermediate representation
    Clif,
    /// Machine code
    Asm,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  gmlc emit examples/cup/cup.gml --stage ir")]
pub(crate) struct EmitArgs {
    #[command(flatten)]
    pub(crate) script: ScriptArgs,
    /// The stage to print
    #[arg(long, value_enum)]
    pub(crate) stage: Stage,
    #[command(flatten)]
    pub(crate) json: JsonArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc doc examples/cup/cup.gml            the page of a script, in Markdown, to standard output
  gmlc doc examples/cup/cup.gml -o pages   into a file of that folder
  gmlc doc std -o pages/std                the standard library, a page a module")]
pub(crate) struct DocArgs {
    /// The script (.gml), or std for the standard library
    #[arg(value_name = "MODEL.gml|std")]
    pub(crate) script: PathBuf,
    /// Folder for the pages [default: they are printed]
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) json: JsonArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc completions bash > ~/.local/share/bash-completion/completions/gmlc
  gmlc completions zsh > ~/.zfunc/_gmlc
  gmlc completions fish > ~/.config/fish/completions/gmlc.fish")]
pub(crate) struct CompletionsArgs {
    /// The shell that reads them
    #[arg(value_name = "SHELL")]
    pub(crate) shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc man | man -l -                   read the page of gmlc
  gmlc man fit | man -l -               that of `gmlc fit`
  gmlc man -o ~/.local/share/man/man1   write the pages of all commands, for `man gmlc-fit`")]
pub(crate) struct ManArgs {
    /// The command whose page is printed [default: the page of gmlc itself]
    #[arg(value_name = "COMMAND", conflicts_with = "output")]
    pub(crate) command: Option<String>,
    /// Folder for the pages of all commands
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc fmt cup.gml                  one script, in place
  gmlc fmt --check examples stdlib  list scripts that are not formatted, and change nothing
  gmlc fmt - < cup.gml              to standard output

A script with syntax errors is left as it is. Meaning and comments never change.")]
pub(crate) struct FmtArgs {
    /// Scripts, or folders of scripts; - reads standard input
    #[arg(value_name = "PATH", required = true)]
    pub(crate) paths: Vec<PathBuf>,
    /// Change nothing; list scripts that are not formatted, with the first line that would change, and exit with status
    /// 1
    #[arg(long)]
    pub(crate) check: bool,
    #[command(flatten)]
    pub(crate) result: ResultArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc repl examples/cup/cup.gml               then: r * 2, outer(0.5), :set r=42mm, :grad r * h, :help
  gmlc repl -p r=42mm cup.gml
  echo 'mix(2mm, 4mm, 0.5)' | gmlc repl        without a terminal: no prompts; the status is 1 if anything failed

The history is in $XDG_STATE_HOME/gmlc/history (or ~/.local/state/gmlc/history). See docs/repl.md.")]
pub(crate) struct ReplArgs {
    /// The script to load first (.gml)
    #[arg(value_name = "MODEL.gml")]
    pub(crate) model: Option<PathBuf>,
    /// Set an input of the model, such as bolts=6 (may be repeated)
    #[arg(long = "input", value_name = "NAME=VALUE", value_parser = values::input)]
    pub(crate) inputs: Vec<(String, InputValue)>,
    /// Set a parameter, such as r=42mm (may be repeated)
    #[arg(short = 'p', long = "param", value_name = "NAME=VALUE", value_parser = values::assignment)]
    pub(crate) values: Vec<(String, String)>,
    /// Take the parameters and inputs from a result of `gmlc fit`, or from the truth of
    /// `gmlc scan`; -p overrides parameters
    #[arg(long, value_name = "FIT.json", requires = "model")]
    pub(crate) params: Option<PathBuf>,
    /// Allow what is entered to `use` the scripts in this folder and below, besides those in the current folder and in
    /// that of a loaded script (may be repeated)
    #[arg(long = "allow-path", value_name = "FOLDER")]
    pub(crate) allowed: Vec<PathBuf>,
    /// Do not load or save the history of lines
    #[arg(long)]
    pub(crate) no_history: bool,
    /// Without a terminal, also print the prompts and the input
    #[arg(long)]
    pub(crate) echo: bool,
}
