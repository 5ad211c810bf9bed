//! Arguments of the commands that look at scans and convert them.

use super::JsonArgs;
use crate::values;
use clap::Args;
use gml_runtime::export::scan::ScanFormat;
use gml_runtime::mesh::Bounds;
use gml_runtime::scan::{ReadOptions, Unit};
use std::path::PathBuf;

/// What of a scan is read.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct ReadingArgs {
    /// Unit of the scan's coordinates: um, mm, cm, m, in or ft [default: what the file states, otherwise mm]
    #[arg(long, value_name = "UNIT")]
    pub(crate) unit: Option<Unit>,
    /// Of the scans in a file (E57, PTX) read only this one, counted from 0
    #[arg(long, value_name = "N")]
    pub(crate) scan_index: Option<usize>,
    /// Read only what lies in a box in the file's frame: three ranges of x, y and z, such as 1.2m..1.8m,..,0mm..2m,
    /// whose ends may be left out
    #[arg(long, value_name = "BOX", allow_hyphen_values = true, value_parser = values::crop)]
    pub(crate) crop: Option<Bounds>,
    /// Of the points of a cloud in a cube of this edge keep one, chosen by lot [default: all points, or of more than
    /// 16.8 millions as many as that allows]
    #[arg(long, value_name = "LENGTH", value_parser = values::positive_length)]
    pub(crate) voxel: Option<f64>,
    /// Keep only the largest of the pieces that do not hang together
    #[arg(long)]
    pub(crate) keep_largest: bool,
    /// Leave out the points of a cloud that lie on no surface, such as dust and spray
    #[arg(long)]
    pub(crate) drop_outliers: bool,
    /// Make triangles of a cloud, a surface through its points: from then on it is a mesh, and measured by rays
    #[arg(long)]
    pub(crate) surface: bool,
    /// Simplify a mesh to at most N triangles, whose corners are points of the scan; of a cloud keep N points, chosen
    /// by lot
    #[arg(long, value_name = "N", value_parser = values::whole(1_usize, usize::MAX))]
    pub(crate) decimate: Option<usize>,
}

impl ReadingArgs {
    /// The same for the reader.
    pub(crate) fn options(&self) -> ReadOptions {
        let mut options = ReadOptions::default();
        options.unit = self.unit;
        options.only = self.scan_index;
        options.crop = self.crop;
        options.voxel = self.voxel;
        options.keep_largest = self.keep_largest;
        options.drop_outliers = self.drop_outliers;
        options.surface = self.surface;
        options.decimate = self.decimate;
        options
    }
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc info scan.ply                          counts, extent, distances of points, noise, holes, what looks wrong
  gmlc info plant.e57 --scan-index 2          one of the scans of a file
  gmlc info scan.ply --json | jq .suspicions")]
pub(crate) struct InfoArgs {
    /// The scan, of any format that `gmlc fit` reads
    #[arg(value_name = "SCAN")]
    pub(crate) scan: PathBuf,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    #[command(flatten)]
    pub(crate) json: JsonArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc convert scan.e57 -o scan.ply
  gmlc convert plant.e57 --crop 1.2m..1.8m,..,0mm..2m --voxel 2mm -o pipe.laz
  gmlc convert part.3mf --output-unit in -o part.stl
  gmlc convert part.laz --surface -o part.stl         triangles of its points")]
pub(crate) struct ConvertArgs {
    /// The scan or mesh to read
    #[arg(value_name = "SCAN")]
    pub(crate) scan: PathBuf,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    /// The file to write; - is standard output
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Format of the file: obj, ply, stl, off, glb, 3mf, e57, las, laz, pcd, pts, ptx or xyz [default: by the ending of
    /// its name]
    #[arg(long, value_name = "FORMAT", value_parser = values::scan_format)]
    pub(crate) format: Option<ScanFormat>,
    /// Unit of the new file's coordinates; E57, LAS and glTF always have metres [default: that of the old file]
    #[arg(long, value_name = "UNIT")]
    pub(crate) output_unit: Option<Unit>,
    #[command(flatten)]
    pub(crate) json: JsonArgs,
}
