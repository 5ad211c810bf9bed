//! Arguments of the commands that compare a model with a scan.

use super::{CompileArgs, ReadingArgs, ResultArgs, ScriptArgs, ValueArgs};
use crate::values::{self, Choice, Range};
use clap::{Args, ValueEnum};
use gml_runtime::export::exchange;
use gml_runtime::export::x3d::SceneFormat;
use gml_runtime::fit::{LossKind, Weights};
use gml_runtime::scan::Unit;
use gml_runtime::variance::{DecisionRule, Device, DistanceKind, Matching, Resolution, Tolerance};
use std::path::PathBuf;

/// A scan, and what of it is read.
#[derive(Debug, Args)]
pub(crate) struct ScanArgs {
    /// The scan: a mesh (.ply, .obj, .stl, .off, .gltf, .glb, .3mf) or a point cloud (.e57, .las, .laz, .pcd, .pts,
    /// .ptx, .xyz, .csv, .ply); its content tells the format, and it may be compressed (.gz)
    #[arg(value_name = "SCAN")]
    pub(crate) scan: PathBuf,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
}

/// More scans of the same object.
#[derive(Debug, Default, Args)]
pub(crate) struct MoreScansArgs {
    /// More scans of the same object, which need not overlap: the model has one shape, and a pose in each. Options of
    /// reading apply to all
    #[arg(value_name = "SCAN")]
    pub(crate) scans: Vec<PathBuf>,
    /// The scans have one frame already, as those of one station network: they are taken for one scan
    #[arg(long)]
    pub(crate) same_pose: bool,
}

/// What the user states of the work.
#[derive(Debug, Default, Args)]
pub(crate) struct ReportArgs {
    /// State something of the part, the operator, the instrument or its calibration, such as "Part number=A-17": the
    /// report, fit.json and variance.json repeat it. A file report.toml beside the script states the same (may be
    /// repeated)
    #[arg(long = "report-field", value_name = "NAME=TEXT", value_parser = values::report_field)]
    pub(crate) fields: Vec<(String, String)>,
}

/// Options of a fit.
#[derive(Debug, Args)]
pub(crate) struct FitControls {
    /// Start a parameter at a value, such as r=42mm (may be repeated)
    #[arg(short = 'p', long = "param", value_name = "NAME=VALUE", value_parser = values::assignment)]
    pub(crate) values: Vec<(String, String)>,
    /// Hold a parameter fixed: NAME at its start value, or NAME=VALUE, which is also tested against the scan (may be
    /// repeated)
    #[arg(long, value_name = "NAME[=VALUE]")]
    pub(crate) fix: Vec<String>,
    /// Hold parameters equal: NAME,NAME,... (may be repeated)
    #[arg(long, value_name = "NAMES")]
    pub(crate) equal: Vec<String>,
    /// Scale of the loss at the end of the fit [default: from the scan's noise]
    #[arg(long, value_name = "LENGTH", value_parser = values::positive_length)]
    pub(crate) sigma: Option<f64>,
    /// Loss function at the end of the fit
    #[arg(long, default_value = "welsch", value_parser = values::one_of(&LOSSES))]
    pub(crate) loss: LossKind,
    /// How much the points of a mesh count
    #[arg(long, default_value = "area", value_parser = values::one_of(&WEIGHTS))]
    pub(crate) weights: Weights,
    /// Do not fit a pose: only the script's own parameters move the model
    #[arg(long)]
    pub(crate) no_pose: bool,
    /// Whether the scan's normals decide to which side of a thin wall a point belongs
    #[arg(long, value_enum, default_value_t)]
    pub(crate) normals: NormalsArg,
    /// Fit the model's ends, too: surface that the scanner could have seen and that lies beyond the scan counts against
    /// a fit
    #[arg(long)]
    pub(crate) coverage: bool,
    /// Judge the fit by the scan's points alone: surface of the model where the scan shows empty space does not count
    /// against it, and open ends stay where they are
    #[arg(long)]
    pub(crate) one_sided: bool,
    /// Also fit N scans resampled from the scan, for confidence intervals with few assumptions
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = values::whole(0_u32, 100_000))]
    pub(crate) bootstrap: u32,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = values::whole(0, u64::MAX))]
    pub(crate) seed: u64,
    /// Write the optimisers' steps to a table, to plot the convergence
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) trace: Option<PathBuf>,
}

const LOSSES: [Choice<LossKind>; 4] = [
    Choice { name: "welsch", help: "Bounded and smooth: outliers do not affect the fit", value: LossKind::Welsch },
    Choice { name: "squared", help: "Least squares, for scans without outliers", value: LossKind::Squared },
    Choice { name: "huber", help: "Quadratic for small distances, linear for large ones", value: LossKind::Huber },
    Choice { name: "tukey", help: "Bounded, and constant beyond 1.7 sigma", value: LossKind::Tukey },
];

const WEIGHTS: [Choice<Weights>; 2] = [
    Choice {
        name: "area",
        help: "As the area that they stand for, however finely the mesh is divided",
        value: Weights::Area,
    },
    Choice { name: "points", help: "All alike, as those of a cloud", value: Weights::Points },
];

/// How the scan's normals are used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum NormalsArg {
    /// Points belong to the nearest surface that faces the same way
    #[default]
    Use,
    /// Points belong to the nearest surface, whichever way it faces
    Ignore,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc fit examples/cup/cup.gml scan.ply -o fit.json
  gmlc fit mug.gml mug.ply --unit m -p height=80mm --fix wall=2mm -o fit.json
  gmlc fit examples/mug/mug.gml front.ply back.ply -o fit.json    two scans of one mug, each with its own pose
  gmlc fit examples/flange/flange.gml flange.ply --search bolts=3..12 -o fit.json
  gmlc fit examples/cup/cup.gml scan.ply --params fit.json --coverage -o covered.json")]
pub(crate) struct FitArgs {
    #[command(flatten)]
    pub(crate) script: ScriptArgs,
    #[command(flatten)]
    pub(crate) scan: ScanArgs,
    #[command(flatten)]
    pub(crate) more: MoreScansArgs,
    #[command(flatten)]
    pub(crate) controls: FitControls,
    #[command(flatten)]
    pub(crate) report: ReportArgs,
    /// Go on from a result of `gmlc fit`, or from the truth of `gmlc scan`: from its parameters, pose and inputs; -p
    /// overrides parameters
    #[arg(long, value_name = "FIT.json")]
    pub(crate) params: Option<PathBuf>,
    /// Fit every value of a whole-number input, such as bolts=3..16, and select the best (may be repeated)
    #[arg(long, value_name = "NAME=LOW..HIGH", value_parser = values::range)]
    pub(crate) search: Vec<Range>,
    /// Where to write the result; - is standard output
    #[arg(short, long, value_name = "FIT.json")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) result: ResultArgs,
}

const DEVICES: [Choice<Device>; 3] = [
    Choice { name: "auto", help: "A real GPU if there is one, otherwise native code", value: Device::Auto },
    Choice { name: "cpu", help: "Native code", value: Device::Cpu },
    Choice {
        name: "gpu",
        help: "A GPU, or a software implementation of one; native code if there is neither",
        value: Device::Gpu,
    },
];

const DISTANCES: [Choice<DistanceKind>; 3] = [
    Choice {
        name: "normal",
        help: "Along the model's normal, as displacement shaders draw it",
        value: DistanceKind::Normal,
    },
    Choice {
        name: "averaged-normal",
        help: "Along normals that are averaged where patches meet, so that the displaced surface is closed at its edges",
        value: DistanceKind::AveragedNormal,
    },
    Choice {
        name: "closest",
        help: "To the closest point of the scan, positive on the side of the model's normal",
        value: DistanceKind::Closest,
    },
];

const MATCHINGS: [Choice<Matching>; 2] = [
    Choice {
        name: "mutual",
        help: "Those that do not lie much nearer to another place of the model, and are no spikes of the scan",
        value: Matching::Mutual,
    },
    Choice { name: "all", help: "All that are met, as in the paper", value: Matching::All },
];

const SCENES: [Choice<SceneFormat>; 2] = [
    Choice { name: "x3d", help: "model.x3d: XML, which people can read", value: SceneFormat::X3d },
    Choice { name: "x3dz", help: "model.x3dz: the same, compressed to half of it", value: SceneFormat::X3dz },
];

const EXPORTS: [Choice<exchange::Format>; 5] = [
    Choice {
        name: "ply",
        help: "deviations.ply and points.ply: distance, part and class at the model's points and at the scan's",
        value: exchange::Format::Ply,
    },
    Choice {
        name: "vtp",
        help: "The same for ParaView and PyVista: deviations.vtp, points.vtp",
        value: exchange::Format::Vtp,
    },
    Choice {
        name: "glb",
        help: "deviations.glb: the parts in the colours of the deviations",
        value: exchange::Format::Glb,
    },
    Choice {
        name: "csv",
        help: "parts.csv, parameters.csv and labels.csv, for spreadsheets",
        value: exchange::Format::Csv,
    },
    Choice {
        name: "svg",
        help: "legend.svg, histogram.svg and section.svg: drawings for documents",
        value: exchange::Format::Svg,
    },
];

/// Options of a measurement.
#[derive(Debug, Args)]
pub(crate) struct VarianceControls {
    /// How far from the model to look for the scan [default: a tenth of the model's size]
    #[arg(long, value_name = "LENGTH", value_parser = values::positive_length)]
    pub(crate) max_distance: Option<f64>,
    /// Where distances are measured to
    #[arg(long, default_value = "normal", value_parser = values::one_of(&DISTANCES))]
    pub(crate) distance: DistanceKind,
    /// Which places of the scan count
    #[arg(long, default_value = "mutual", value_parser = values::one_of(&MATCHINGS))]
    pub(crate) matching: Matching,
    /// With --distance averaged-normal: width of the band beside an edge in which normals turn from the average to the
    /// surface's own [default: a fiftieth of the model's size]
    #[arg(long, value_name = "LENGTH", value_parser = values::positive_length)]
    pub(crate) averaging_width: Option<f64>,
    /// Cut-off of the Gaussian filter behind which flatness, roundness and so on are measured [default: nine distances
    /// between the scan's points, at most a fifth of the part]
    #[arg(long, value_name = "LENGTH", value_parser = values::positive_length)]
    pub(crate) form_cutoff: Option<f64>,
    /// The part that is the datum: coaxiality, concentricity, parallelism and perpendicularity of the other parts to it
    /// are reported (ISO 1101)
    #[arg(long, value_name = "PART")]
    pub(crate) datum: Option<String>,
    /// Close holes of the scan up to this size, such as 5mm: rays do not pass through them, and texels that look at
    /// them count as filled, not as measured
    #[arg(long, value_name = "LENGTH", value_parser = values::positive_length)]
    pub(crate) fill_holes: Option<f64>,
    /// Largest angle between the normals of the model and of the scan
    #[arg(long, value_name = "ANGLE", default_value = "90deg", value_parser = values::acute_angle)]
    pub(crate) max_angle: f64,
    /// Allowed deviations, such as 0.5mm (either way) or +0.3/-0.1mm, of parts to which the script gives no tolerance;
    /// the exit status is 3 if a part, or a measure of the script, does not conform to its tolerance, and 4 if the
    /// measurement does not tell
    #[arg(long, value_name = "TOLERANCE", allow_hyphen_values = true, value_parser = values::tolerance)]
    pub(crate) tolerance: Option<Tolerance>,
    /// Decision rule of the verdicts: guarded (1.65 standard uncertainties away from a limit, ISO 14253-1), simple (the
    /// value alone), or the probability of conformance that is required, such as p=0.95
    #[arg(long, value_name = "RULE", default_value = "guarded", value_parser = values::decision)]
    pub(crate) decision: DecisionRule,
    /// A part conforms only if at least this share of its area was measured
    #[arg(long, value_name = "SHARE", default_value_t = 0.8, value_parser = values::fraction)]
    pub(crate) min_coverage: f64,
    /// Standard uncertainty of the scanner that neighbouring points share, such as that of its calibration; measures
    /// that are lengths have it, too [default: 0mm]
    #[arg(long, value_name = "LENGTH", value_parser = values::length)]
    pub(crate) device_uncertainty: Option<f64>,
    /// Edge of the square of surface whose median deviation is decided on [default: 25 points of the scan, and from a
    /// thousandth to a hundredth of the part's area]
    #[arg(long, value_name = "LENGTH", value_parser = values::positive_length)]
    pub(crate) footprint: Option<f64>,
    /// Texels per side of the distance texture, a power of two such as 2048, or the width of a texel, such as 0.2mm
    /// (the smallest texture whose texels are no wider on average)
    #[arg(long, value_name = "N|LENGTH", default_value = "1024", value_parser = values::resolution)]
    pub(crate) resolution: Resolution,
    /// The most memory that the distance texture, or the bands of --averaging-width, may take, such as 12GB: what
    /// takes more is refused
    #[arg(long, value_name = "AMOUNT", default_value = "4GB", value_parser = values::memory)]
    pub(crate) memory: u64,
    /// What casts the rays
    #[arg(long, default_value = "auto", value_parser = values::one_of(&DEVICES))]
    pub(crate) device: Device,
    /// Draw a map for every parameter: how far the surface moves along its normal per unit of it (sensitivity-NAME.png)
    #[arg(long)]
    pub(crate) sensitivities: bool,
    /// Where the colour scale of pictures ends, either way [default: at three times the tolerance if all parts that
    /// have one share it, otherwise at the robust range of the deviations]
    #[arg(long, value_name = "LENGTH", value_parser = values::positive_length)]
    pub(crate) scale: Option<f64>,
    /// Also write the signed distances as OpenEXR (distance.exr)
    #[arg(long)]
    pub(crate) exr: bool,
    /// Also write the scan's points with their signed distances from the surface and the number of its part
    /// (points.ply, with scalars that CloudCompare shows)
    #[arg(long)]
    pub(crate) points: bool,
    /// Format of the scene
    #[arg(long, value_name = "FORMAT", default_value = "x3d", value_parser = values::one_of(&SCENES))]
    pub(crate) scene: SceneFormat,
    /// Also write files for other tools, such as vtp,csv (may be repeated)
    #[arg(long, value_name = "FORMAT", value_delimiter = ',', value_parser = values::one_of(&EXPORTS))]
    pub(crate) export: Vec<exchange::Format>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc variance examples/cup/cup.gml --params fit.json scan.ply -o out
  gmlc variance design.stl scan.ply --max-distance 2mm -o out
  gmlc variance design.stl scan.ply --tolerance +0.3/-0.1mm --device-uncertainty 0.02mm -o out
  gmlc variance design.stl scan.ply --tolerance 0.3mm --decision p=0.99 --min-coverage 0.95 --footprint 5mm -o out")]
pub(crate) struct VarianceArgs {
    /// A script (.gml, with --params) or a reference mesh (.obj, .stl, .ply, .off, .gltf, .glb, .3mf) in the scan's
    /// position
    #[arg(value_name = "REFERENCE")]
    pub(crate) reference: PathBuf,
    #[command(flatten)]
    pub(crate) compile: CompileArgs,
    #[command(flatten)]
    pub(crate) values: ValueArgs,
    #[command(flatten)]
    pub(crate) scan: ScanArgs,
    #[command(flatten)]
    pub(crate) more: MoreScansArgs,
    /// Unit of the reference mesh's coordinates: um, mm, cm, m, in or ft [default: what the file
    /// states, otherwise mm]
    #[arg(long, value_name = "UNIT")]
    pub(crate) reference_unit: Option<Unit>,
    #[command(flatten)]
    pub(crate) controls: VarianceControls,
    #[command(flatten)]
    pub(crate) report: ReportArgs,
    /// Folder for the results
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) result: ResultArgs,
}

/// Options that say how to fit.
const OF_A_FIT: [&str; 14] = [
    "values",
    "fix",
    "equal",
    "sigma",
    "loss",
    "weights",
    "no_pose",
    "normals",
    "coverage",
    "one_sided",
    "bootstrap",
    "seed",
    "trace",
    "search",
];

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc inspect examples/cup/cup.gml scan.ply -o out/cup
  gmlc inspect examples/mug/mug.gml mug.ply --unit m --max-distance 25mm --resolution 2048 -o out/mug
  gmlc inspect examples/cup/cup.gml scan.ply --tolerance 0.5mm --device-uncertainty 0.05mm -o out/cup
  gmlc inspect examples/mug/mug.gml front.ply back.ply -o out/mug
  gmlc inspect examples/cup/cup.gml scan.ply --params fit.json --no-fit -o out/cup")]
pub(crate) struct InspectArgs {
    #[command(flatten)]
    pub(crate) script: ScriptArgs,
    #[command(flatten)]
    pub(crate) scan: ScanArgs,
    #[command(flatten)]
    pub(crate) more: MoreScansArgs,
    #[command(flatten)]
    pub(crate) fit: FitControls,
    /// Go on from a result of `gmlc fit`, or from the truth of `gmlc scan`: from its parameters, pose and inputs; -p
    /// overrides parameters
    #[arg(long, value_name = "FIT.json")]
    pub(crate) params: Option<PathBuf>,
    /// Measure and document the fit of --params as it is, without fitting again
    #[arg(long, requires = "params", conflicts_with_all = OF_A_FIT)]
    pub(crate) no_fit: bool,
    /// Fit every value of a whole-number input, such as bolts=3..16, and select the best (may be repeated)
    #[arg(long, value_name = "NAME=LOW..HIGH", value_parser = values::range)]
    pub(crate) search: Vec<Range>,
    #[command(flatten)]
    pub(crate) variance: VarianceControls,
    #[command(flatten)]
    pub(crate) report: ReportArgs,
    /// Folder for the results
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) result: ResultArgs,
}
