//! Several scans of one object.

use crate::cli::{MoreScansArgs, ScanArgs};
use crate::error::CommandError;
use crate::fit::read_scan;
use gml_compiler::number::plain;
use gml_runtime::fit::{copied, in_first_frame};
use gml_runtime::model::Motion;
use gml_runtime::scan::{Scan, ScanSource};
use std::path::PathBuf;

/// The files of the scans, in their order.
pub(crate) fn paths<'a>(scan: &'a ScanArgs, more: &'a MoreScansArgs) -> impl Iterator<Item = &'a PathBuf> + Clone {
    std::iter::once(&scan.scan).chain(&more.scans)
}

/// Reads the scans: one, or with --same-pose one of all. Others stay apart.
pub(crate) fn read(scan: &ScanArgs, more: &MoreScansArgs) -> Result<Vec<Scan>, CommandError> {
    if more.scans.is_empty() && more.same_pose {
        return Err(CommandError::usage("--same-pose is for several scans, and only one is given"));
    }
    let mut known: Vec<&PathBuf> = Vec::new();
    for path in paths(scan, more) {
        if known.contains(&path) {
            return Err(CommandError::usage(format!("{}: the scan is given twice", path.display())));
        }
        known.push(path);
    }
    let one = |path: &PathBuf| read_scan(&ScanArgs { scan: path.clone(), reading: scan.reading.clone() });
    let scans = paths(scan, more).map(one).collect::<Result<Vec<Scan>, CommandError>>()?;
    for (i, scan) in scans.iter().enumerate() {
        // What is measured once counts once, under whatever names.
        if let Some(other) = scans[..i].iter().find(|other| other.source.sha256 == scan.source.sha256) {
            let (path, other) = (&scan.source.path, &other.source.path);
            return Err(CommandError::usage(format!("{path}: the scan is that of {other}; give it once")));
        }
        let copy = scans[..i].iter().find_map(|other| Some((other, copied(other, scan)?)));
        if let Some((other, scale)) = copy {
            return Err(CommandError::usage(same_points(&scan.source.path, &other.source.path, scale)));
        }
    }
    Ok(if more.same_pose { vec![Scan::in_one_frame(&scans)] } else { scans })
}

/// The sentence on two files with the same points.
fn same_points(path: &str, other: &str, scale: f64) -> String {
    let size = if scale == 1.0 { String::new() } else { format!(" times {} (is --unit that of both?)", plain(scale)) };
    format!(
        "{path}: its points are those of {other}{size}, in another file, frame or order; what is measured once counts \
         once, so give one of them"
    )
}

/// The scans as one in the frame of the first, by the poses of a fit of all of them.
pub(crate) fn in_frame_of_fit(scans: Vec<Scan>, poses: &[Motion]) -> Result<Scan, CommandError> {
    let count = scans.len();
    let mut scans = scans;
    match (count, poses.len()) {
        (1, 0) => Ok(scans.swap_remove(0)),
        (_, fitted) if fitted == count => Ok(in_first_frame(&scans, poses)),
        (_, 0) => Err(CommandError::usage(format!(
            "where the {count} scans lie to each other is not known: name a fit of all of them (--params), or say \
             --same-pose if they have one frame"
        ))),
        (_, fitted) => Err(CommandError::usage(format!(
            "--params is a fit of {fitted} scans, and {count} are given: name the same ones in the same order"
        ))),
    }
}

/// The files of all scans: of several that are one now, those of its parts.
pub(crate) fn sources(scans: &[Scan]) -> Vec<ScanSource> {
    scans.iter().map(|scan| scan.source.clone()).collect()
}
