//! A ball, which the tests of files and options scan and fit.

use super::gmlc;
use tempfile::{TempDir, tempdir};

pub(crate) const BALL: &str = "model ball {
  param r: length in 5mm..50mm = 20mm
  part p = sphere(r)
}
";

/// A folder with its script and a scan of it, made with further options.
pub(crate) fn scanned(options: &[&str]) -> TempDir {
    let folder = tempdir().expect("a folder");
    std::fs::write(folder.path().join("ball.gml"), BALL).expect("written");
    let scan = ["scan", "ball.gml", "--spacing", "3mm", "-o", "scan.ply"];
    gmlc(folder.path(), &[&scan, options].concat());
    folder
}

/// A folder with its script, a scan of it, and a fit.
pub(crate) fn fitted() -> TempDir {
    let folder = scanned(&[]);
    gmlc(folder.path(), &["fit", "ball.gml", "scan.ply", "-o", "fit.json"]);
    folder
}
