//! Vertices that triangles connect: those about a vertex on its own sheet, however near the other side of a wall is.

use crate::mesh::TriangleMesh;

/// The triangles at each vertex of a mesh.
pub(super) struct Connected<'m> {
    mesh: &'m TriangleMesh,
    /// By vertex, where its triangles begin in `triangles`; one more for the end.
    first: Vec<u32>,
    triangles: Vec<u32>,
}

impl<'m> Connected<'m> {
    pub(super) fn new(mesh: &'m TriangleMesh) -> Self {
        let mut first = vec![0_u32; mesh.positions.len() + 1];
        for vertex in mesh.triangles.iter().flatten() {
            first[*vertex as usize + 1] += 1;
        }
        for k in 1..first.len() {
            first[k] += first[k - 1];
        }
        let mut next = first.clone();
        let mut triangles = vec![0; 3 * mesh.triangles.len()];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            for vertex in triangle {
                let place = &mut next[*vertex as usize];
                triangles[*place as usize] = t as u32;
                *place += 1;
            }
        }
        Self { mesh, first, triangles }
    }

    /// The triangles at a vertex.
    pub(super) fn triangles_at(&self, vertex: usize) -> &[u32] {
        &self.triangles[self.first[vertex] as usize..self.first[vertex + 1] as usize]
    }

    /// A vertex and others about it, ring by ring, up to `count`.
    pub(super) fn about(&self, vertex: u32, count: usize) -> Vec<u32> {
        let mut found = vec![vertex];
        let mut looked = 0;
        while looked < found.len() && found.len() < count {
            let vertex = found[looked] as usize;
            looked += 1;
            for t in self.triangles_at(vertex) {
                for other in self.mesh.triangles[*t as usize] {
                    if found.len() < count && !found.contains(&other) {
                        found.push(other);
                    }
                }
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_do_not_leap_over_to_another_sheet() {
        // Two strips of triangles, 0, 2, 4, ... and 100, 102, ..., that touch nowhere.
        let strip = |from: u32| (0..20).map(move |k| [from + k, from + k + 1, from + k + 2]);
        let mesh = TriangleMesh {
            positions: vec![[0.0; 3]; 122],
            triangles: strip(0).chain(strip(100)).collect(),
            ..TriangleMesh::default()
        };
        let connected = Connected::new(&mesh);
        let mut found = connected.about(110, 9);
        found.sort_unstable();
        assert_eq!(found, (106..=114).collect::<Vec<u32>>());
        assert_eq!(connected.about(0, 100).len(), 22);
        // A vertex without triangles is alone.
        assert_eq!(connected.about(50, 9), [50]);
    }
}
