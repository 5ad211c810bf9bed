//! The scan in few triangles.

use super::frame::Frame;
use super::numbers::{list, number};
use crate::mesh::TriangleMesh;
use glam::DVec3;
use std::borrow::Cow;
use std::collections::HashMap;

/// Triangles up to which a scan is shown as it is, and the number that others are brought near to.
pub(crate) const TRIANGLES: usize = 16_000;

/// Triangles of clustered vertices to a cell that the surface passes through: two to a vertex, and a surface that lies
/// obliquely passes through half as many cells again as its area has of their faces.
const TO_A_CELL: f64 = 3.0;

/// The scan, if it has too many triangles with vertices that are the means of those of a cell each (Rossignac and
/// Borrel, 'Multi-resolution 3D approximations for rendering complex scenes', 1993).
pub(super) fn simplified(scan: &TriangleMesh) -> Cow<'_, TriangleMesh> {
    if scan.triangles.len() <= TRIANGLES {
        return Cow::Borrowed(scan);
    }
    let cell = (TO_A_CELL * scan.area() / TRIANGLES as f64).sqrt();
    if !(cell > 0.0 && cell.is_finite()) {
        return Cow::Borrowed(scan);
    }
    Cow::Owned(clustered(scan, cell))
}

/// A mesh with one vertex for all vertices of a cube of a grid.
fn clustered(mesh: &TriangleMesh, cell: f64) -> TriangleMesh {
    let corner = mesh.bounds().low;
    let mut numbers: HashMap<[u32; 3], u32> = HashMap::new();
    let mut sums: Vec<(DVec3, f64)> = Vec::new();
    let numbered = |p: &[f64; 3]| {
        let p = DVec3::from_array(*p);
        let key = ((p - corner) / cell).to_array().map(|c| c as u32);
        let number = *numbers.entry(key).or_insert_with(|| {
            sums.push((DVec3::ZERO, 0.0));
            sums.len() as u32 - 1
        });
        sums[number as usize].0 += p;
        sums[number as usize].1 += 1.0;
        number
    };
    let cells: Vec<u32> = mesh.positions.iter().map(numbered).collect();
    let mut normals = vec![DVec3::ZERO; sums.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = mesh.corners(*triangle);
        triangle.iter().for_each(|v| normals[cells[*v as usize] as usize] += (b - a).cross(c - a));
    }
    let between = |t: &[u32; 3]| t.map(|v| cells[v as usize]);
    let has_corners = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    let mut clustered = TriangleMesh {
        positions: sums.iter().map(|(sum, count)| (*sum / *count).to_array()).collect(),
        triangles: mesh.triangles.iter().map(between).filter(has_corners).collect(),
        ..TriangleMesh::default()
    };
    // Means of vertices may turn a small triangle over.
    for i in 0..clustered.triangles.len() {
        let triangle = &mut clustered.triangles[i];
        let [a, b, c] = triangle.map(|v| DVec3::from_array(clustered.positions[v as usize]));
        let facing: DVec3 = triangle.iter().map(|v| normals[*v as usize]).sum();
        if (b - a).cross(c - a).dot(facing) < 0.0 {
            triangle.swap(1, 2);
        }
    }
    clustered.drop_repeated();
    clustered
}

/// The geometry of the scan.
pub(super) fn write(scan: &TriangleMesh, frame: &Frame, out: &mut String) {
    let mesh = simplified(scan);
    out.push_str("<IndexedTriangleSet DEF='ScanMesh' solid='false' index='");
    list(mesh.triangles.iter().map(|t| t.map(|v| v.to_string())), out);
    out.push_str("'><Coordinate point='");
    list(mesh.positions.iter().map(|p| frame.local(*p).to_array().map(|c| number(c, frame.decimals))), out);
    out.push_str("'/></IndexedTriangleSet>");
}
