//! Arguments of `gmlc batch`.

use super::{FitControls, ReadingArgs, ReportArgs, ResultArgs, ScriptArgs, VarianceControls};
use crate::values::{self, Choice};
use clap::{Args, ValueEnum};
use gml_runtime::export::measurement::Extent;
use std::path::PathBuf;

const EXTENTS: [Choice<Extent>; 3] = [
    Choice { name: "all", help: "Everything that gmlc inspect writes", value: Extent::All },
    Choice {
        name: "report",
        help: "report.html, overview.png, fit.json, variance.json and distance.tif",
        value: Extent::Report,
    },
    Choice { name: "figures", help: "fit.json, variance.json and distance.tif: the fastest", value: Extent::Figures },
];

/// Where the fit of a scan begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum StartFrom {
    /// At the script's defaults, or at --params
    #[default]
    Defaults,
    /// Where the fit of the scan before it ended: for series of nearly equal parts. Every sixteenth begins at the
    /// defaults, and so does one after a fit that cannot be relied on
    Previous,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gmlc batch cup.gml scans/ -o out/cups                       all scans of a folder, in the order of their names
  gmlc batch cup.gml 'scans/2026-*/*.ply' --unit m -o out/cups
  gmlc batch cup.gml --list scans.txt --documents figures -o out/cups
  gmlc batch cup.gml scans/ --tolerance 0.5mm --start-from previous --jobs 8 -o out/cups
  gmlc batch cup.gml scans/ -o out/cups --retry               once more, and the failed ones again

A batch that was ended at any moment goes on where it was when it is run again: what is finished is not done again,
unless the scan, the script or an option that matters has changed.")]
pub(crate) struct BatchArgs {
    #[command(flatten)]
    pub(crate) script: ScriptArgs,
    /// Scans, folders of scans, and patterns such as 'scans/*.ply': each file is one object
    #[arg(value_name = "SCAN", required_unless_present = "list")]
    pub(crate) scans: Vec<PathBuf>,
    /// A text with a scan, folder or pattern on each line, relative to the text's folder; # begins a comment (may be
    /// repeated)
    #[arg(long, value_name = "FILE.txt")]
    pub(crate) list: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    #[command(flatten)]
    pub(crate) fit: FitControls,
    /// Begin every fit with a result of `gmlc fit`: with its parameters and inputs; -p overrides parameters
    #[arg(long, value_name = "FIT.json")]
    pub(crate) params: Option<PathBuf>,
    /// Where the fit of a scan begins
    #[arg(long, value_enum, default_value_t)]
    pub(crate) start_from: StartFrom,
    #[command(flatten)]
    pub(crate) variance: VarianceControls,
    #[command(flatten)]
    pub(crate) report: ReportArgs,
    /// What is written of every scan
    #[arg(long, default_value = "report", value_parser = values::one_of(&EXTENTS))]
    pub(crate) documents: Extent,
    /// Scans that are worked on at once [default: as many as there are processors]
    #[arg(short, long, value_name = "N", value_parser = values::whole(1_u32, 1024))]
    pub(crate) jobs: Option<u32>,
    /// Try again what has failed before
    #[arg(long)]
    pub(crate) retry: bool,
    /// Have the workers of a Dask cluster do it, such as tcp://scheduler:8786: only with the command of the Python
    /// package; workers must be able to read the scans and to write to the folder of the results
    #[arg(long, value_name = "ADDRESS")]
    pub(crate) dask: Option<String>,
    /// Folder for the results: table.csv, table.parquet, summary.html, and a folder for each scan
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) result: ResultArgs,
}
