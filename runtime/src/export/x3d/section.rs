//! Outlines of the model and of the scan in the plane of the front view through the model's middle.

use super::frame::Frame;
use super::numbers::{list, number};
use super::scan::simplified;
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
    let _ = write!(
        out,
        "            <Shape><Appearance><Material diffuseColor='0 0 0' emissiveColor='{colour}'/></Appearance>\
         <LineSet vertexCount='"
    );
    for i in 0..segments.len() {
        out.push_str(if i == 0 { "2" } else { " 2" });
    }
    out.push_str("'><Coordinate point='");
    list(segments.iter().flatten().map(|p| p.to_array().map(|c| number(c, frame.decimals))), out);
    out.push_str("'/></LineSet></Shape>\n");
}

/// Where triangles cross the plane. A corner in the plane counts as before it, so that an edge in it is met once.
fn cut(mesh: &TriangleMesh, frame: &Frame) -> Vec<[DVec3; 2]> {
    let normal = normal(frame);
    let crossing = |triangle: &[u32; 3]| {
        let corners = triangle.map(|v| frame.local(mesh.positions[v as usize]));
        let heights = corners.map(|p| normal.dot(p));
        let mut ends = [0, 1, 2].into_iter().filter_map(|k| {
            let (a, b) = (k, (k + 1) % 3);
            let crosses = (heights[a] >= 0.0) != (heights[b] >= 0.0);
            crosses.then(|| corners[a].lerp(corners[b], heights[a] / (heights[a] - heights[b])))
        });
        Some([ends.next()?, ends.next()?])
    };
    mesh.triangles.iter().filter_map(crossing).collect()
}
