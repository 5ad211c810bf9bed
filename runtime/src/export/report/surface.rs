//! The input of the interactive view: the mesh in few bytes, and figures.

use super::Report;
use crate::mesh::TriangleMesh;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::json;

/// The mesh as viewer.js reads it, in base64: for each vertex four 16-bit positions within the bounding box (the last
/// is unused), four 8-bit normals, two 16-bit texture coordinates, one kind after the other; then 32-bit indices.
/// Triangles with vertices that do not exist are left out.
pub(super) fn mesh(mesh: &TriangleMesh) -> String {
    let (centre, half) = (mesh.bounds().centre(), mesh.bounds().size() / 2.0);
    let n = mesh.positions.len();
    let share = |x: f64| (x.clamp(0.0, 1.0) * 65535.0).round() as u16;
    let mut bytes = Vec::with_capacity(16 * n + 12 * mesh.triangles.len());
    for p in &mesh.positions {
        for k in 0..3 {
            let place = if half[k] > 0.0 { 0.5 + 0.5 * (p[k] - centre[k]) / half[k] } else { 0.5 };
            bytes.extend(share(place).to_le_bytes());
        }
        bytes.extend([0, 0]);
    }
    for i in 0..n {
        let normal = mesh.normals.get(i).copied().unwrap_or([0.0, 0.0, 1.0]);
        bytes.extend(normal.map(|c| ((c * 127.0).round() as i8).to_le_bytes()[0]));
        bytes.push(0);
    }
    for i in 0..n {
        for c in mesh.texcoords.get(i).copied().unwrap_or([0.0; 2]) {
            bytes.extend(share(c).to_le_bytes());
        }
    }
    for v in drawn(mesh).flatten() {
        bytes.extend(v.to_le_bytes());
    }
    STANDARD.encode(bytes)
}

fn drawn(mesh: &TriangleMesh) -> impl Iterator<Item = &[u32; 3]> {
    mesh.triangles.iter().filter(|t| t.iter().all(|&v| (v as usize) < mesh.positions.len()))
}

/// Figures for the view, as JSON that holds no text from users.
pub(super) fn scene(report: &Report<'_>) -> String {
    let mesh = &report.tessellation.mesh;
    json!({
        "vertices": mesh.positions.len(),
        "indices": 3 * drawn(mesh).count(),
        "halfSize": (mesh.bounds().size() / 2.0).to_array(),
        "maxDistance": report.variance.max_distance,
        "colourRange": report.colour_range,
        "frame": report.turned,
    })
    .to_string()
}
