//! The command line: what can be asked for, and its help.

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Generative models, compiled and differentiated, fitted to laser scans and compared with them.
#[derive(Debug, Parser)]
#[command(name = "gmlc", version, max_term_width = 110, after_help = AFTER_HELP)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

const AFTER_HELP: &str = "\
Examples:
  gmlc check cup.gml                             what is in a script, or what is wrong with it
  gmlc scan octagonal_cup.gml -o scan.ply        make a virtual scan of a model
  gmlc inspect cup.gml scan.ply -o out/cup       fit, measure and document, all in one
  gmlc inspect mug.gml mug.ply --unit m -o out   a scan whose file is in metres

Exit status: 0 done; 1 something in a script, a scan or another file is wrong, or the result cannot be had;
2 the command line is wrong.";

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Check a script: diagnostics, or a table of its parameters, inputs and parts
    Check(CheckArgs),
    /// Write the model's surface as a mesh, or as a picture
    Mesh(MeshArgs),
    /// Print the derivative program as readable text
    Diff(DiffArgs),
    /// Print what a compiler stage makes of a script
    Emit(EmitArgs),
    /// Write reference pages from doc comments
    Doc(DocArgs),
    /// Format scripts
    Fmt(FmtArgs),
    /// Scan a model with the virtual laser scanner
    Scan(VirtualScanArgs),
    /// Fit a model's parameters and pose to a scan
    Fit(FitArgs),
    /// Measure the deviations of a scan from a model or a reference mesh
    Variance(VarianceArgs),
    /// Fit, measure and document: everything into one folder
    Inspect(InspectArgs),
    /// Evaluate expressions and definitions interactively, with a model at hand
    Repl(ReplArgs),
}

/// A script and its inputs.
#[derive(Clone, Debug, Args)]
pub(crate) struct ScriptArgs {
    /// The script (.gml)
    #[arg(value_name = "MODEL.gml")]
    pub(crate) model: PathBuf,
    /// Set an input of the model, such as bolts=6 (may be repeated)
    #[arg(long = "input", value_name = "NAME=VALUE")]
    pub(crate) inputs: Vec<String>,
    #[command(flatten)]
    pub(crate) limits: LimitArgs,
}

/// What bounds the work that a script may make.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct LimitArgs {
    /// Set a limit on what the script may take: steps, depth, nesting, instances, turns, nodes or operations, such as
    /// steps=1000000 (may be repeated)
    #[arg(long = "limit", value_name = "NAME=N")]
    pub(crate) limits: Vec<String>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// For people
    #[default]
    Text,
    /// For programs
    Json,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  gmlc check examples/cup/cup.gml\n  gmlc check cup.gml --format json | jq '.parameters[].name'\n  gmlc check --explain dimension-mismatch"
)]
pub(crate) struct CheckArgs {
    /// The script (.gml)
    #[arg(value_name = "MODEL.gml", required_unless_present = "explain")]
    pub(crate) model: Option<PathBuf>,
    /// Set an input of the model, such as bolts=6 (may be repeated)
    #[arg(long = "input", value_name = "NAME=VALUE")]
    pub(crate) inputs: Vec<String>,
    #[command(flatten)]
    pub(crate) limits: LimitArgs,
    /// Tell what a diagnostic's code stands for, with an example
    #[arg(long, value_name = "CODE")]
    pub(crate) explain: Option<String>,
    /// How to print the result
    #[arg(long, value_enum, default_value_t)]
    pub(crate) format: Format,
}

/// Values of parameters.
#[derive(Debug, Args)]
pub(crate) struct ValueArgs {
    /// Set a parameter, such as r=42mm, alpha=30deg or shape=4 (may be repeated)
    #[arg(short = 'p', long = "param", value_name = "NAME=VALUE")]
    pub(crate) values: Vec<String>,
    /// Take the parameters from a result of `gmlc fit`; -p goes over it
    #[arg(long, value_name = "FIT.json")]
    pub(crate) params: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  gmlc mesh examples/cup/cup.gml -p r=42mm -o cup.obj\n  gmlc mesh cup.gml --params fit.json --chord 0.005mm -o cup.ply\n  gmlc mesh cup.gml --view 35,25 --size 640x480 -o cup.png"
)]
pub(crate) struct MeshArgs {
    #[command(flatten)]
    pub(crate) script: ScriptArgs,
    #[command(flatten)]
    pub(crate) values: ValueArgs,
    /// The file to write: .obj (texture coordinates, groups), .ply or .stl; or .png, a picture with a tint for every part
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Largest distance between the mesh and the exact surface [default: 0.02mm; in a picture, a fifth of a pixel]
    #[arg(long, value_name = "LENGTH")]
    pub(crate) chord: Option<String>,
    /// Of a picture, from where: corner, front, back, top, below, inside (cut open), or AZIMUTH,ELEVATION in degrees, from the front
    /// to the right and upwards [default: corner]
    #[arg(long, value_name = "VIEW", allow_hyphen_values = true)]
    pub(crate) view: Option<String>,
    /// Of a picture, how many pixels: 640, or 640x480 [default: 640]
    #[arg(long, value_name = "PIXELS")]
    pub(crate) size: Option<String>,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  gmlc diff examples/cup/cup.gml --wrt r\n  gmlc diff cup.gml")]
pub(crate) struct DiffArgs {
    #[command(flatten)]
    pub(crate) script: ScriptArgs,
    /// Only with respect to this parameter
    #[arg(long, value_name = "NAME")]
    pub(crate) wrt: Option<String>,
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
    /// Which stage
    #[arg(long, value_enum)]
    pub(crate) stage: Stage,
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
    /// Folder for the pages; without it they are printed
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc fmt cup.gml                  one script, in place
  gmlc fmt --check examples stdlib  says which are not formatted, and changes nothing
  gmlc fmt - < cup.gml              to standard output

A script with syntax errors is left as it is. Meaning and comments never change.")]
pub(crate) struct FmtArgs {
    /// Scripts, or folders whose scripts are meant; - reads standard input
    #[arg(value_name = "PATH", required = true)]
    pub(crate) paths: Vec<PathBuf>,
    /// Change nothing; list what is not formatted with its first line that would change, and exit with status 1
    #[arg(long)]
    pub(crate) check: bool,
    /// How to print what was done
    #[arg(long, value_enum, default_value_t)]
    pub(crate) format: Format,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc scan examples/cup/octagonal_cup.gml -o out/cup_scan.ply --truth out/cup_truth.json
  gmlc scan cup.gml -p shape=4 --noise 0.1mm --spacing 0.5mm --seed 3 -o scan.ply")]
pub(crate) struct VirtualScanArgs {
    #[command(flatten)]
    pub(crate) script: ScriptArgs,
    #[command(flatten)]
    pub(crate) values: ValueArgs,
    /// The scan to write (.ply, .obj or .stl)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Also write parameters and pose, the truth that a fit should find
    #[arg(long, value_name = "FILE.json")]
    pub(crate) truth: Option<PathBuf>,
    /// Distance between neighbouring points on the object
    #[arg(long, value_name = "LENGTH", default_value = "0.8mm")]
    pub(crate) spacing: String,
    /// Standard deviation of the range noise
    #[arg(long, value_name = "LENGTH", default_value = "0.3mm")]
    pub(crate) noise: String,
    /// Number of view points
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = clap::value_parser!(u32).range(1..=200))]
    pub(crate) views: u32,
    /// Fraction of points with a wrong range
    #[arg(long, value_name = "FRACTION", default_value_t = 0.001)]
    pub(crate) outliers: f64,
    /// Fraction of points that are lost
    #[arg(long, value_name = "FRACTION", default_value_t = 0.01)]
    pub(crate) dropouts: f64,
    /// Number of holes of some millimetres
    #[arg(long, value_name = "N", default_value_t = 6)]
    pub(crate) holes: u32,
    /// Leave the scan in the model's own position
    #[arg(long)]
    pub(crate) no_pose: bool,
    /// Seed of all that is random
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
}

/// A scan and its unit.
#[derive(Debug, Args)]
pub(crate) struct ScanArgs {
    /// The scan: .ply, .obj or .stl
    #[arg(value_name = "SCAN")]
    pub(crate) scan: PathBuf,
    /// Unit of the scan's coordinates: mm, cm, m or in
    #[arg(long, value_name = "UNIT", default_value = "mm")]
    pub(crate) unit: String,
}

/// What steers a fit.
#[derive(Debug, Args)]
pub(crate) struct FitControls {
    /// Start a parameter at a value, such as r=42mm (may be repeated)
    #[arg(short = 'p', long = "param", value_name = "NAME=VALUE")]
    pub(crate) values: Vec<String>,
    /// Hold a parameter: NAME at its start, or NAME=VALUE, which is also tested against the scan (may be repeated)
    #[arg(long, value_name = "NAME[=VALUE]")]
    pub(crate) fix: Vec<String>,
    /// Hold parameters equal: NAME,NAME,... (may be repeated)
    #[arg(long, value_name = "NAMES")]
    pub(crate) equal: Vec<String>,
    /// Width of the loss at the end of the fit; by default from the scan's noise
    #[arg(long, value_name = "LENGTH")]
    pub(crate) sigma: Option<String>,
    /// How distances are counted at the end of the fit
    #[arg(long, value_enum, default_value_t)]
    pub(crate) loss: LossArg,
    /// Neither add nor search a pose: only the script's own parameters move the model
    #[arg(long)]
    pub(crate) no_pose: bool,
    /// Whether the scan's normals say which side of a thin wall a point belongs to
    #[arg(long, value_enum, default_value_t)]
    pub(crate) normals: NormalsArg,
    /// Hold the model's ends to the scan: what could be seen of it and lies beyond the scan counts as well
    #[arg(long)]
    pub(crate) coverage: bool,
    /// Fit so many scans drawn from the scan itself, for intervals that assume little
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) bootstrap: usize,
    /// Seed of all that is random
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Write the steps of the optimisers to a table, for a plot of the convergence
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) trace: Option<PathBuf>,
}

/// How distances are counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum LossArg {
    /// Bounded and smooth: what the model does not explain does not pull it
    #[default]
    Welsch,
    /// Least squares, for scans without anything foreign
    Squared,
    /// Least squares near, absolute values far
    Huber,
    /// Bounded, and constant beyond 1.7 sigma
    Tukey,
}

/// What the scan's normals are for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum NormalsArg {
    /// Points belong to surfaces that face as they do
    #[default]
    Use,
    /// Points belong to the nearest surface
    Ignore,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc fit examples/cup/cup.gml scan.ply -o fit.json
  gmlc fit mug.gml mug.ply --unit m -p height=80mm --fix wall=2mm -o fit.json
  gmlc fit examples/flange/flange.gml flange.ply --search bolts=3..12 -o fit.json")]
pub(crate) struct FitArgs {
    #[command(flatten)]
    pub(crate) script: ScriptArgs,
    #[command(flatten)]
    pub(crate) scan: ScanArgs,
    #[command(flatten)]
    pub(crate) controls: FitControls,
    /// Fit every value of an input that is a whole number, such as bolts=3..16, and take the best (may be repeated)
    #[arg(long, value_name = "NAME=LOW..HIGH")]
    pub(crate) search: Vec<String>,
    /// Where to write the result
    #[arg(short, long, value_name = "FIT.json")]
    pub(crate) output: Option<PathBuf>,
    /// Print the result as JSON instead of a table
    #[arg(long, value_enum, default_value_t)]
    pub(crate) format: Format,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum DeviceArg {
    /// A real GPU where there is one, else native code
    #[default]
    Auto,
    /// Native code
    Cpu,
    /// The GPU, software ones included; an error where there is none
    Gpu,
}

/// Where distances are measured to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum DistanceArg {
    /// Along the model's normal, as displacement shaders draw it
    #[default]
    Normal,
    /// Along normals that are averaged where patches meet, so that the displaced surface is closed at its edges
    AveragedNormal,
    /// To the closest point of the scan, positive on the side of the model's normal
    Closest,
}

impl DistanceArg {
    /// As in variance.json.
    pub(crate) fn name(self) -> &'static str {
        match self {
            DistanceArg::Normal => "normal",
            DistanceArg::AveragedNormal => "averaged-normal",
            DistanceArg::Closest => "closest",
        }
    }
}

/// What steers the measurement of deviations.
#[derive(Debug, Args)]
pub(crate) struct VarianceControls {
    /// How far from the model the scan is looked for; by default a tenth of the model's size
    #[arg(long, value_name = "LENGTH")]
    pub(crate) max_distance: Option<String>,
    /// Where distances are measured to
    #[arg(long, value_enum, default_value_t)]
    pub(crate) distance: DistanceArg,
    /// With --distance averaged-normal: within which distance of an edge normals turn from the average to the surface's own; by
    /// default a fiftieth of the model's size
    #[arg(long, value_name = "LENGTH")]
    pub(crate) averaging_width: Option<String>,
    /// Close holes of the scan up to this far across, such as 5mm: no ray passes through them, and what looks at them counts as filled,
    /// not as measured
    #[arg(long, value_name = "LENGTH")]
    pub(crate) fill_holes: Option<String>,
    /// The largest angle between the model's normal and that of the scan where it is measured
    #[arg(long, value_name = "ANGLE", default_value = "90deg")]
    pub(crate) max_angle: String,
    /// How far deviations may go, such as 0.5mm (either way) or +0.3/-0.1mm, on parts to which the script gives no tolerance; the exit
    /// status is 3 if any goes further
    #[arg(long, value_name = "TOLERANCE", allow_hyphen_values = true)]
    pub(crate) tolerance: Option<String>,
    /// Side of the square distance texture, a power of two such as 2048, or how fine its texels are to be, such as 0.2mm (the
    /// smallest texture whose texels are no wider on the average)
    #[arg(long, value_name = "N|LENGTH", default_value = "1024")]
    pub(crate) resolution: String,
    /// What casts the rays
    #[arg(long, value_enum, default_value_t)]
    pub(crate) device: DeviceArg,
    /// Draw a map of every parameter: how far the surface moves along its normal for a unit of it (sensitivity-NAME.png)
    #[arg(long)]
    pub(crate) sensitivities: bool,
    /// Write the signed distances as OpenEXR, too (distance.exr)
    #[arg(long)]
    pub(crate) exr: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc variance examples/cup/cup.gml --params fit.json scan.ply -o out
  gmlc variance design.stl scan.ply --max-distance 2mm -o out")]
pub(crate) struct VarianceArgs {
    /// A script (.gml, with --params) or a reference mesh (.obj, .stl, .ply) in the scan's position
    #[arg(value_name = "REFERENCE")]
    pub(crate) reference: PathBuf,
    /// Set an input of the model, such as bolts=6 (may be repeated)
    #[arg(long = "input", value_name = "NAME=VALUE")]
    pub(crate) inputs: Vec<String>,
    #[command(flatten)]
    pub(crate) limits: LimitArgs,
    #[command(flatten)]
    pub(crate) values: ValueArgs,
    #[command(flatten)]
    pub(crate) scan: ScanArgs,
    /// Unit of the reference mesh's coordinates
    #[arg(long, value_name = "UNIT", default_value = "mm")]
    pub(crate) reference_unit: String,
    #[command(flatten)]
    pub(crate) controls: VarianceControls,
    /// Folder for the results
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc inspect examples/cup/cup.gml scan.ply -o out/cup
  gmlc inspect examples/mug/mug.gml mug.ply --unit m --max-distance 25mm --resolution 2048 -o out/mug")]
pub(crate) struct InspectArgs {
    #[command(flatten)]
    pub(crate) script: ScriptArgs,
    #[command(flatten)]
    pub(crate) scan: ScanArgs,
    #[command(flatten)]
    pub(crate) fit: FitControls,
    /// Fit every value of an input that is a whole number, such as bolts=3..16, and take the best (may be repeated)
    #[arg(long, value_name = "NAME=LOW..HIGH")]
    pub(crate) search: Vec<String>,
    #[command(flatten)]
    pub(crate) variance: VarianceControls,
    /// Folder for the results
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc repl examples/cup/cup.gml               then: r * 2, outer(0.5), :set r=42mm, :grad r * h, :help
  gmlc repl -p r=42mm cup.gml
  echo 'mix(2mm, 4mm, 0.5)' | gmlc repl        without a terminal: no prompts; the status is 1 if anything failed

Lines are kept in $XDG_STATE_HOME/gmlc/history (else ~/.local/state/gmlc/history). docs/repl.md tells more.")]
pub(crate) struct ReplArgs {
    /// The script to begin with (.gml)
    #[arg(value_name = "MODEL.gml")]
    pub(crate) model: Option<PathBuf>,
    /// Set an input of the model, such as bolts=6 (may be repeated)
    #[arg(long = "input", value_name = "NAME=VALUE")]
    pub(crate) inputs: Vec<String>,
    /// Set a parameter, such as r=42mm (may be repeated)
    #[arg(short = 'p', long = "param", value_name = "NAME=VALUE")]
    pub(crate) values: Vec<String>,
    /// Neither read nor keep the lines of other times
    #[arg(long)]
    pub(crate) no_history: bool,
    /// Without a terminal, print the prompts and what is read as well
    #[arg(long)]
    pub(crate) echo: bool,
}
