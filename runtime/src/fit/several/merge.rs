//! Scans of one object in the frame of the first.

use crate::fit::problem::isometry::Isometry;
use crate::model::Motion;
use crate::scan::{Scan, Station};

/// All scans as one in the frame of the first, by the motions that take the model to each.
pub(super) fn merged(scans: &[Scan], motions: &[Isometry]) -> Scan {
    let poses: Vec<Motion> = motions.iter().map(|motion| Motion::from(*motion)).collect();
    in_first_frame(scans, &poses)
}

/// All scans as one in the frame of the first, by the model's poses in them.
///
/// # Panics
/// If there are not as many poses as scans, or none.
#[must_use]
pub fn in_first_frame(scans: &[Scan], poses: &[Motion]) -> Scan {
    let frame = |pose: &Motion| {
        let motion = poses[0].after(&pose.inverse());
        Station { place: motion.translation, rotation: motion.rotation }
    };
    let mut frames: Vec<Station> = poses.iter().map(frame).collect();
    // Not even rounding moves the first one.
    frames[0] = Station::at([0.0; 3]);
    Scan::merged(scans, &frames)
}
