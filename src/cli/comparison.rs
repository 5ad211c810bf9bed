//! Commands that compare a model with a scan.

use super::{Format, LimitArgs, ScriptArgs, ValueArgs};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

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
