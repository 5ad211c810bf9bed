//! Arguments of `gmlc compare`.

use super::ResultArgs;
use crate::values;
use clap::Args;
use gml_compiler::check::InputValue;
use gml_runtime::scan::Unit;
use gml_runtime::variance::Resolution;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "\
A fit stands for the script that it names, at its parameters. Two models are compared in the model's frame, whatever
the poses of their scans; a model and a mesh in the mesh's, so that a fit is where its scan is. Nothing else is moved:
`gmlc fit` brings a model to a mesh, and --align one state of a model to another one.

Examples:
  gmlc compare monday.fit.json friday.fit.json -o drift.json
  gmlc compare examples/cup/cup.gml fit.json
  gmlc compare cup.gml cup.gml --param-b r=42mm
  gmlc compare fit.json design.stl --max-distance 2mm
  gmlc compare old.ply new.obj --unit-b m --format json")]
pub(crate) struct CompareArgs {
    /// A script (.gml), a result of `gmlc fit` (.json) or a mesh (.ply, .obj, .stl)
    #[arg(value_name = "A")]
    pub(crate) a: PathBuf,
    /// Likewise
    #[arg(value_name = "B")]
    pub(crate) b: PathBuf,
    /// Set a parameter of A, such as r=42mm (may be repeated)
    #[arg(long, value_name = "NAME=VALUE", value_parser = values::assignment)]
    pub(crate) param_a: Vec<(String, String)>,
    /// Set a parameter of B (may be repeated)
    #[arg(long, value_name = "NAME=VALUE", value_parser = values::assignment)]
    pub(crate) param_b: Vec<(String, String)>,
    /// Set an input of A, such as bolts=6 (may be repeated)
    #[arg(long, value_name = "NAME=VALUE", value_parser = values::input)]
    pub(crate) input_a: Vec<(String, InputValue)>,
    /// Set an input of B (may be repeated)
    #[arg(long, value_name = "NAME=VALUE", value_parser = values::input)]
    pub(crate) input_b: Vec<(String, InputValue)>,
    /// Unit of the coordinates of A, if it is a mesh: um, mm, cm, m, in or ft [default: mm]
    #[arg(long, value_name = "UNIT")]
    pub(crate) unit_a: Option<Unit>,
    /// Unit of the coordinates of B, if it is a mesh [default: mm]
    #[arg(long, value_name = "UNIT")]
    pub(crate) unit_b: Option<Unit>,
    /// The script of the fits, instead of the one that they name
    #[arg(long, value_name = "MODEL.gml")]
    pub(crate) script: Option<PathBuf>,
    /// Set a limit on the scripts' work: steps, depth, nesting, instances, iterations, parts, nodes or operations,
    /// such as steps=1000000 (may be repeated)
    #[arg(long = "limit", value_name = "NAME=N", value_parser = values::limit)]
    pub(crate) limits: Vec<(String, u64)>,
    /// Allow scripts to `use` the scripts in this folder and below, besides those in their own (may be repeated)
    #[arg(long = "allow-path", value_name = "FOLDER")]
    pub(crate) allowed: Vec<PathBuf>,
    /// How far from a surface to look for its counterpart [default: a tenth of the smaller surface's size]
    #[arg(long, value_name = "LENGTH", value_parser = values::positive_length)]
    pub(crate) max_distance: Option<f64>,
    /// Move B so that the same places of two states of a model lie as near to each other as can be
    #[arg(long)]
    pub(crate) align: bool,
    /// Samples of each surface: those of a texture of N x N texels, a power of two, or their distance from each other,
    /// such as 0.2mm [default: 512, or less where that takes long]
    #[arg(long, value_name = "N|LENGTH", value_parser = values::resolution)]
    pub(crate) resolution: Option<Resolution>,
    /// Where to write the result; - is standard output
    #[arg(short, long, value_name = "FILE.json")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) result: ResultArgs,
}
