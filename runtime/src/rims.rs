//! The rims of holes: closed chains of edges that belong to a single triangle.

use crate::mesh::{BoundaryEdge, TriangleMesh};
use std::collections::HashMap;

/// A closed chain of boundary edges that meets no vertex twice. It runs against the triangles' edges, so that a
/// counter-clockwise filling is oriented as they are.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Rim {
    /// Its vertices.
    pub(crate) vertices: Vec<u32>,
    /// The triangle with the edge from each vertex to the next.
    pub(crate) triangles: Vec<u32>,
}

/// All rims of a mesh, in an order that depends on the mesh only. Rims that touch in a vertex are separated; edges of
/// more than two triangles, or of two triangles with opposite orientations, do not belong to a rim.
pub(crate) fn find(mesh: &TriangleMesh) -> Vec<Rim> {
    // From the end of each boundary edge back to its start.
    let mut back: HashMap<u32, Vec<(u32, u32)>> = HashMap::new();
    let mut starts = Vec::new();
    for BoundaryEdge { ends: [from, to], triangle } in mesh.boundary_edges() {
        back.entry(to).or_default().push((from, triangle));
        starts.push(to);
    }
    let mut rims = Vec::new();
    for start in starts {
        walk(start, &mut back, &mut rims);
    }
    rims
}

/// Follows boundary edges from a vertex until none are left; whenever the path meets itself, a loop is removed from it.
fn walk(start: u32, back: &mut HashMap<u32, Vec<(u32, u32)>>, rims: &mut Vec<Rim>) {
    let mut path: Vec<(u32, u32)> = Vec::new();
    let mut place: HashMap<u32, usize> = HashMap::from([(start, 0)]);
    let mut at = start;
    while let Some((to, triangle)) = back.get_mut(&at).and_then(Vec::pop) {
        path.push((at, triangle));
        at = to;
        if let Some(&first) = place.get(&to) {
            let (vertices, triangles): (Vec<u32>, Vec<u32>) = path.drain(first..).unzip();
            vertices[1..].iter().for_each(|v| {
                place.remove(v);
            });
            rims.push(Rim { vertices, triangles });
        } else {
            place.insert(to, path.len());
        }
    }
}
