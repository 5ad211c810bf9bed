//! Vertices at the edges of trimmed patches, found by their places.

use super::refine::Refinement;
use super::stitch::position;
use glam::DVec3;
use std::collections::HashMap;

/// Some vertices, each once, and by cells of a grid.
pub(super) struct Rim {
    vertices: Vec<u32>,
    cells: HashMap<[i64; 3], Vec<u32>>,
    cell: f64,
}

impl Rim {
    pub(super) fn new(mesh: &Refinement<'_>, mut vertices: Vec<u32>, cell: f64) -> Self {
        vertices.sort_unstable();
        vertices.dedup();
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for vertex in &vertices {
            cells.entry(key(position(mesh, *vertex), cell)).or_default().push(*vertex);
        }
        Self { vertices, cells, cell }
    }

    pub(super) fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Vertices whose cells the box of two points touches, widened.
    pub(super) fn near(&self, a: DVec3, b: DVec3, margin: f64) -> Vec<u32> {
        let low = key(a.min(b) - margin, self.cell);
        let high = key(a.max(b) + margin, self.cell);
        let spans = [0, 1, 2].map(|k| high[k] - low[k] + 1);
        let cells = spans.iter().map(|n| *n as f64).product::<f64>();
        if cells > self.vertices.len() as f64 {
            return self.vertices.clone();
        }
        let mut near = Vec::new();
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    near.extend(self.cells.get(&[x, y, z]).into_iter().flatten());
                }
            }
        }
        near.sort_unstable();
        near
    }
}

fn key(p: DVec3, cell: f64) -> [i64; 3] {
    (p / cell).floor().to_array().map(|c| c as i64)
}
