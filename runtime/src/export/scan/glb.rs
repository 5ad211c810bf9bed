//! Binary glTF 2.0: positions in metres and single precision about the middle of the scan, whose place is in double
//! precision in a node. Coordinates are not turned: y is what it is in the scan.

use super::{Out, Recorded};
use crate::export::gltf::{Buffer, FLOAT, METRE, UNSIGNED_INT};
use crate::mesh::renumber_used;
use glam::DVec3;
use serde_json::{Value, json};
use std::io;

/// The ways in which vertices are connected, as glTF numbers them.
const POINTS: u32 = 0;
const TRIANGLES: u32 = 4;

/// Writes triangles, or points where there are none; groups become nodes.
pub(super) fn write(out: &mut dyn Out, scan: &Recorded<'_>) -> io::Result<()> {
    let mesh = scan.mesh;
    let centre = mesh.bounds().centre();
    let mut buffer = Buffer::default();
    let mut meshes: Vec<Value> = Vec::new();
    if mesh.groups.is_empty() {
        let all: Vec<u32> = (0..mesh.positions.len() as u32).collect();
        meshes.push(
            json!({ "name": "scan", "primitives": [primitive(&mut buffer, scan, &all, &mesh.triangles, centre)] }),
        );
    }
    for group in &mesh.groups {
        let (vertices, triangles) = used(&mesh.triangles[group.start..group.end], mesh.positions.len());
        let primitive = primitive(&mut buffer, scan, &vertices, &triangles, centre);
        meshes.push(json!({ "name": group.name, "primitives": [primitive] }));
    }
    let child = |(index, mesh): (usize, &Value)| json!({ "name": mesh["name"], "mesh": index });
    let children: Vec<usize> = (1..=meshes.len()).collect();
    let root = json!({ "name": "scan", "translation": (METRE * centre).to_array(), "children": children });
    let nodes: Vec<Value> = std::iter::once(root).chain(meshes.iter().enumerate().map(child)).collect();
    buffer.write(out, &nodes, &meshes, "scan")
}

/// The vertices that some triangles use, and the triangles of their places among these.
fn used(triangles: &[[u32; 3]], count: usize) -> (Vec<u32>, Vec<[u32; 3]>) {
    let mut triangles = triangles.to_vec();
    let used = renumber_used(&mut triangles, count);
    ((0..).zip(used).filter(|(_, used)| *used).map(|(vertex, _)| vertex).collect(), triangles)
}

/// Triangles of some vertices, by their places among them, or the vertices as points.
fn primitive(
    buffer: &mut Buffer,
    scan: &Recorded<'_>,
    vertices: &[u32],
    triangles: &[[u32; 3]],
    centre: DVec3,
) -> Value {
    fn of<'a, T: Copy>(list: &'a [T], vertices: &'a [u32]) -> impl Iterator<Item = T> + 'a {
        vertices.iter().map(|vertex| list[*vertex as usize])
    }
    let place = |p: [f64; 3]| (METRE * (DVec3::from_array(p) - centre)).as_vec3().to_array();
    let positions: Vec<[f32; 3]> = of(&scan.mesh.positions, vertices).map(place).collect();
    let mut attributes = json!({ "POSITION": buffer.add_positions(&positions) });
    if !scan.mesh.normals.is_empty() {
        let normals: Vec<[f32; 3]> = of(&scan.mesh.normals, vertices).map(|n| n.map(|c| c as f32)).collect();
        attributes["NORMAL"] = buffer.add(normals.as_flattened(), f32::to_le_bytes, FLOAT, "VEC3", json!({})).into();
    }
    if !scan.attributes.colours.is_empty() {
        attributes["COLOR_0"] = buffer.add_colours(of(&scan.attributes.colours, vertices)).into();
    }
    if triangles.is_empty() {
        return json!({ "attributes": attributes, "mode": POINTS, "material": 0 });
    }
    let indices = buffer.add(triangles.as_flattened(), u32::to_le_bytes, UNSIGNED_INT, "SCALAR", json!({}));
    json!({ "attributes": attributes, "indices": indices, "mode": TRIANGLES, "material": 0 })
}
