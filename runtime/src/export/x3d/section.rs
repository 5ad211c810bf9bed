//! Outlines of the model and of the scan in the plane of the front view through the model's middle.

use super::annotations::flat;
use super::frame::Frame;
use super::numbers::{list, number};
use super::scan::simplified;
use crate::export::section::segments;
use crate::mesh::TriangleMesh;
use glam::DVec3;
use std::fmt::Write;

/// The most segments of an outline that are written as they are; a scan of 100 million triangles has some 20,000.
const MOST_SEGMENTS: usize = 30_000;

/// The section's plane as X3D writes one: its normal and distance, in the file's coordinates. What lies behind it as
/// seen from the front is kept.
pub(super) fn plane(frame: &Frame) -> [f64; 4] {
    let normal = normal(frame);
    [normal.x, normal.y, normal.z, 0.0]
}

fn normal(frame: &Frame) -> DVec3 {
    frame.upright.transpose() * DVec3::NEG_Z
}

/// A shape with the outline of a mesh.
pub(super) fn outline(mesh: &TriangleMesh, colour: &str, frame: &Frame, out: &mut String) {
    let mut segments = cut(mesh, frame);
    if segments.len() > MOST_SEGMENTS {
        segments = cut(&simplified(mesh), frame);
        segments.truncate(MOST_SEGMENTS);
    }
    if segments.is_empty() {
        return;
    }
    let appearance = flat(colour);
    let _ = write!(out, "            <Shape>{appearance}<LineSet vertexCount='");
    for i in 0..segments.len() {
        out.push_str(if i == 0 { "2" } else { " 2" });
    }
    out.push_str("'><Coordinate point='");
    list(segments.iter().flatten().map(|p| p.to_array().map(|c| number(c, frame.decimals))), out);
    out.push_str("'/></LineSet></Shape>\n");
}

/// Where triangles cross the plane, in the file's coordinates.
fn cut(mesh: &TriangleMesh, frame: &Frame) -> Vec<[DVec3; 2]> {
    let segments = segments(mesh, frame.centre, normal(frame)).into_iter();
    segments.map(|segment| segment.ends.map(|end| end - frame.centre)).collect()
}
