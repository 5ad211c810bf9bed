//! Arguments of the virtual scanner.

use super::{CompileArgs, JsonArgs, ValueArgs};
use crate::{scanner, values};
use clap::Args;
use gml_runtime::export::scan::ScanFormat;
use gml_runtime::scan::Unit;
use gml_runtime::simulate::Kind;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc scan examples/cup/octagonal_cup.gml -o out/cup_scan.ply --truth out/cup_truth.json
  gmlc scan cup.gml -p shape=4 --noise 0.1mm --spacing 0.5mm --seed 3 -o scan.ply
  gmlc scan cup.gml --scanner panorama --stations 6 --table --clutter 5 -o cup.e57
  gmlc scan part.stl --mesh-unit in --scanner hand-held --noise 50um -o part.laz
  gmlc scan mug.gml --scanner ct --spacing 0.3mm -o mug.stl")]
pub(crate) struct VirtualScanArgs {
    /// The script (.gml), or a mesh
    #[arg(value_name = "MODEL")]
    pub(crate) model: PathBuf,
    #[command(flatten)]
    pub(crate) compile: CompileArgs,
    #[command(flatten)]
    pub(crate) values: ValueArgs,
    /// Unit of the coordinates of a mesh that is scanned: um, mm, cm, m, in or ft [default: what its file states,
    /// otherwise mm]
    #[arg(long, value_name = "UNIT")]
    pub(crate) mesh_unit: Option<Unit>,
    /// The scan to write; - is standard output
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Format of the scan: obj, ply, stl, off, glb, 3mf, e57, las, laz, pcd, pts, ptx or xyz [default: by the ending of
    /// its name]
    #[arg(long, value_name = "FORMAT", value_parser = values::scan_format)]
    pub(crate) format: Option<ScanFormat>,
    /// Unit of the scan's coordinates; E57, LAS, PTX and glTF always have metres [default: mm]
    #[arg(long, value_name = "UNIT")]
    pub(crate) unit: Option<Unit>,
    #[command(flatten)]
    pub(crate) json: JsonArgs,
    /// Also write the true parameters and pose, which a fit should find
    #[arg(long, value_name = "FILE.json")]
    pub(crate) truth: Option<PathBuf>,
    /// The scanner: views from all around that become one mesh (structured-light), terrestrial stations whose points
    /// stay apart (panorama), line profiles along a path (hand-held), or the whole surface, inside and out (ct)
    #[arg(long, value_name = "SCANNER", default_value = "structured-light",
          value_parser = values::one_of(scanner::KINDS))]
    pub(crate) scanner: Kind,
    /// Write points only: of structured light those of every view apart
    #[arg(long)]
    pub(crate) cloud: bool,
    /// Distance between neighbouring points on the object [default: 0.8mm, or a 500th of the model's size if that is
    /// more]
    #[arg(long, value_name = "LENGTH", value_parser = values::positive_length)]
    pub(crate) spacing: Option<f64>,
    /// Standard deviation of the noise: of the range, or with ct along the normal
    #[arg(long, value_name = "LENGTH", default_value = "0.3mm", value_parser = values::length)]
    pub(crate) noise: f64,
    /// Noise that grows with the range, such as 50ppm or 0.05mm/m: the standard deviation is the root of the sum of its
    /// square and that of --noise [default: 0ppm]
    #[arg(long, value_name = "PPM", value_parser = scanner::of_range)]
    pub(crate) noise_range: Option<f64>,
    /// Divide the standard deviation by the cosine of the angle between ray and normal
    #[arg(long)]
    pub(crate) noise_angle: bool,
    /// Correlate noise over the surface: at a distance d by exp(-d^2 / (2 LENGTH^2)) [default: white noise; with ct
    /// twice the spacing]
    #[arg(long, value_name = "LENGTH", value_parser = values::length)]
    pub(crate) noise_correlation: Option<f64>,
    /// Share of the noise's variance that is correlated; the rest is white [default: 0.5]
    #[arg(long, value_name = "FRACTION", value_parser = values::fraction)]
    pub(crate) noise_share: Option<f64>,
    /// Give the beam a diameter: where it meets two surfaces, the range is between them
    #[arg(long, value_name = "DIAMETER", value_parser = values::positive_length)]
    pub(crate) mixed_pixels: Option<f64>,
    /// Number of view points of structured light [default: 24]
    #[arg(long, value_name = "N", value_parser = values::whole(1_u32, 200))]
    pub(crate) views: Option<u32>,
    /// Number of stations of a panorama, around the object [default: 4]
    #[arg(long, value_name = "N", value_parser = values::whole(1_u32, 200), conflicts_with = "station")]
    pub(crate) stations: Option<u32>,
    /// Place of a station in the model's own coordinates, such as 2m,-1m,1.6m (may be repeated)
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = scanner::place)]
    pub(crate) station: Vec<[f64; 3]>,
    /// Put a table under the model, which is scanned too
    #[arg(long)]
    pub(crate) table: bool,
    /// Number of boxes and balls that stand beside the model
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = values::whole(0_u32, 1000))]
    pub(crate) clutter: u32,
    /// Fraction of the scan's points that have a wrong range [default: 0.001; with ct 0]
    #[arg(long, value_name = "FRACTION", value_parser = values::fraction)]
    pub(crate) outliers: Option<f64>,
    /// Fraction of points that are missing [default: 0.01; with ct 0]
    #[arg(long, value_name = "FRACTION", value_parser = values::part)]
    pub(crate) dropouts: Option<f64>,
    /// Number of holes of a few millimetres [default: 6; with ct 0]
    #[arg(long, value_name = "N", value_parser = values::whole(0_u32, 10_000))]
    pub(crate) holes: Option<u32>,
    /// Leave the scan in the model's own position
    #[arg(long)]
    pub(crate) no_pose: bool,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = values::whole(0, u64::MAX))]
    pub(crate) seed: u64,
}
