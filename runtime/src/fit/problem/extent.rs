//! Scans that cannot determine a model, whatever it is: too few points, points on a line, points in a plane.

use super::Problem;
use super::points::{Points, moments};
use crate::eigen;
use crate::fit::tuning::FLAT_NOISE;
use nalgebra::Matrix3;

/// A sentence where the scan's points are too few for the unknowns, or have no extent in some direction.
pub(crate) fn degenerate(problem: &Problem) -> Option<String> {
    let Problem { points, start, pose, scan, .. } = problem;
    let parameters = pose.free(start).len();
    let unknowns = parameters + if pose.moving { 6 } else { 0 };
    if points.len() <= unknowns {
        let and_pose = if pose.moving { " and the pose" } else { "" };
        return Some(format!(
            "the scan has {} points for {unknowns} unknowns ({parameters} parameters{and_pose}): any model fits so few, and nothing says how well",
            points.len()
        ));
    }
    // A flat thing is flat up to its noise. Without any, up to the rounding of single precision.
    let flat = (FLAT_NOISE * scan.noise).max(1e-6 * problem.radius);
    let [_, second, least] = extents(&problem.thin);
    if second <= flat {
        Some(format!(
            "the scan's points lie on a line, up to {second:.3} mm (standard deviation): they determine no surface"
        ))
    } else if least <= flat {
        Some(format!(
            "the scan's points lie in a plane, up to {least:.3} mm (standard deviation): they determine nothing of the model but a face in that plane"
        ))
    } else {
        None
    }
}

/// The standard deviations of points along their principal axes, largest first. Millimetres.
fn extents(points: &Points) -> [f64; 3] {
    let (_, covariance) = moments(&points.position);
    let covariance = Matrix3::from_column_slice(&covariance.to_cols_array());
    let mut extents: Vec<f64> = eigen::symmetric(covariance).eigenvalues.iter().map(|e| e.max(0.0).sqrt()).collect();
    extents.sort_by(|a, b| b.total_cmp(a));
    [extents[0], extents[1], extents[2]]
}
