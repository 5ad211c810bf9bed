//! Deviations as binary glTF 2.0: a node and a mesh for every part, with colours at the vertices.

use super::distances;
use super::surface::{MeasuredSurface, PartOfSurface};
use crate::export::gltf::{Buffer, FLOAT, METRE, UNSIGNED_INT};
use glam::DVec3;
use serde_json::{Value, json};
use std::f64::consts::FRAC_1_SQRT_2;
use std::io::{self, Write};

/// The quaternion (x, y, z, w) of the turn by -90 degrees about x, which takes z to y: glTF's y points up.
const Z_TO_Y: [f64; 4] = [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];

/// Writes the surface. `parts` are the names of its parts.
///
/// # Errors
/// Whatever `out` fails with; or the file would be larger than 4 GiB, which glTF cannot say.
pub(super) fn write(out: &mut dyn Write, surface: &MeasuredSurface, parts: &[String]) -> io::Result<()> {
    // Single precision keeps micrometres of an object, not those of its distance from the origin of a scan.
    let centre = middle(&surface.positions);
    let mut buffer = Buffer::default();
    let (mut meshes, mut nodes) = (Vec::new(), Vec::new());
    // glTF has no mesh without triangles.
    for (part, name) in surface.parts.iter().zip(parts).filter(|(part, _)| !part.triangles.is_empty()) {
        nodes.push(json!({ "name": name, "mesh": meshes.len() }));
        meshes.push(json!({ "name": name, "primitives": [primitive(&mut buffer, surface, part, centre)] }));
    }
    let placed = METRE * DVec3::new(centre.x, centre.z, -centre.y);
    let children: Vec<usize> = (1..=nodes.len()).collect();
    let root = json!({
        "name": "model", "rotation": Z_TO_Y, "translation": placed.to_array(), "children": children,
        "extras": {
            "unit": "m", "unit_of_distances": "mm", "distances": distances(), "colour_range_mm": surface.scale.end,
            "neutral_mm": surface.scale.tolerance.map(|t| [t.lower, t.upper]),
            "frame": "below this node x, y and z are those of the scan's frame, less its translation; z of the scan is up",
        },
    });
    nodes.insert(0, root);
    buffer.write(out, &nodes, &meshes, "deviations")
}

/// The middle of the box about some positions.
fn middle(positions: &[[f64; 3]]) -> DVec3 {
    let bounds: crate::mesh::Bounds = positions.iter().map(|p| DVec3::from_array(*p)).collect();
    bounds.centre()
}

/// A part's triangles, with its vertices in metres from `centre`.
fn primitive(buffer: &mut Buffer, surface: &MeasuredSurface, part: &PartOfSurface, centre: DVec3) -> Value {
    let vertices = part.vertices.clone();
    let place = |p: &[f64; 3]| (METRE * (DVec3::from_array(*p) - centre)).as_vec3().to_array();
    let positions: Vec<[f32; 3]> = surface.positions[vertices.clone()].iter().map(place).collect();
    let normal = |n: &[f64; 3]| DVec3::from_array(*n).as_vec3().to_array();
    let normals: Vec<[f32; 3]> = surface.normals[vertices.clone()].iter().map(normal).collect();
    let first = vertices.start as u32;
    let corners: Vec<u32> =
        surface.triangles[part.triangles.clone()].iter().flatten().map(|vertex| vertex - first).collect();
    let places = buffer.add_positions(&positions);
    let normals = buffer.add(normals.as_flattened(), f32::to_le_bytes, FLOAT, "VEC3", json!({}));
    let colours = buffer.add_colours(surface.colours[vertices].iter().copied());
    let indices = buffer.add(&corners, u32::to_le_bytes, UNSIGNED_INT, "SCALAR", json!({}));
    json!({
        "attributes": { "POSITION": places, "NORMAL": normals, "COLOR_0": colours }, "indices": indices, "material": 0,
    })
}
