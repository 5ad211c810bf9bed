//! The division of the model's patches into facets: a grid of quadrilaterals per patch, in a tree of boxes that is
//! built once a level and refitted at every evaluation.

use super::facets::Facets;
use super::tree::Tree;
use crate::fit::tuning::{CELLS_OF_SIZE, CURVATURE_CELLS, MOST_CELLS};
use crate::mesh::Bounds;
use crate::model::{Instance, Model};
use glam::DVec3;
use std::ops::Range;

/// Vertices of the grids in (u, v), and the quadrilaterals between them. Does not depend on the parameters.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    /// One per patch.
    pub(super) grids: Vec<Grid>,
    /// (u, v) of every vertex.
    pub(super) uv: Vec<[f64; 2]>,
    pub(super) quads: Vec<Quad>,
    pub(super) tree: Tree,
    /// Largest distance of a facet from the exact surface, at the shape that the layout was made for; estimated from
    /// second differences. Millimetres.
    pub(crate) sagitta: f64,
}

/// The grid of one patch.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Its first vertex.
    pub(super) first: usize,
    /// u of the columns and v of the rows; none where the patch is left out.
    u: Vec<f64>,
    v: Vec<f64>,
    /// Whether the patch closes in u, and in v, so that a foot point may cross the seam.
    closed: [bool; 2],
    /// Quadrilaterals each way.
    cells: [usize; 2],
}

/// Vertices in the order (u, v), (u+, v), (u+, v+), (u, v+): counter-clockwise about dS/du x dS/dv.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quad {
    pub(super) patch: u32,
    pub(super) vertices: [u32; 4],
    /// The column and the row.
    place: [u16; 2],
}

impl Grid {
    pub(super) fn vertices(&self) -> Range<usize> {
        self.first..self.first + self.u.len() * self.v.len()
    }
}

impl Layout {
    /// Facets whose distance from the exact surface is about `tolerance`, at the model's current shape.
    pub(crate) fn new(model: &dyn Model, instance: &dyn Instance, tolerance: f64, size: f64) -> Self {
        Self::of_patches(model, instance, tolerance, size, |_| true)
    }

    /// As `new`, of the chosen patches; the others have no facets.
    pub(crate) fn of_patches(
        model: &dyn Model,
        instance: &dyn Instance,
        tolerance: f64,
        size: f64,
        chosen: impl Fn(usize) -> bool,
    ) -> Self {
        let mut layout = Self::default();
        for patch in 0..model.parts().len() {
            if chosen(patch) {
                let gauge = gauge(instance, patch, tolerance, size);
                layout.sagitta = layout.sagitta.max(gauge.sagitta);
                layout.push_grid(patch, gauge);
            } else {
                let first = layout.uv.len();
                layout.grids.push(Grid { first, u: Vec::new(), v: Vec::new(), closed: [false; 2], cells: [0; 2] });
            }
        }
        let mut positions = vec![[f64::NAN; 3]; layout.uv.len()];
        layout.place(instance, &mut positions);
        let centres: Vec<DVec3> = layout.quads.iter().map(|q| centre(q, &positions)).collect();
        let (tree, order) = Tree::build(&centres);
        layout.quads = order.iter().map(|i| layout.quads[*i as usize]).collect();
        layout.tree = tree;
        layout
    }

    fn push_grid(&mut self, patch: usize, gauge: Gauge) {
        let [nu, nv] = gauge.cells;
        let first = self.uv.len();
        let axis = |n: usize| (0..=n).map(|i| i as f64 / n as f64).collect::<Vec<f64>>();
        let (u, v) = (axis(nu), axis(nv));
        self.uv.extend(v.iter().flat_map(|v| u.iter().map(|u| [*u, *v])));
        for j in 0..nv {
            for i in 0..nu {
                let a = (first + j * (nu + 1) + i) as u32;
                let above = a + nu as u32 + 1;
                let vertices = [a, a + 1, above + 1, above];
                self.quads.push(Quad { patch: patch as u32, vertices, place: [i as u16, j as u16] });
            }
        }
        self.grids.push(Grid { first, u, v, closed: gauge.closed, cells: gauge.cells });
    }

    /// Evaluates every vertex; those of a patch that fails are NaN. Returns the number of patches that failed.
    fn place(&self, instance: &dyn Instance, positions: &mut [[f64; 3]]) -> usize {
        let mut absent = 0;
        for (patch, grid) in self.grids.iter().enumerate() {
            let out = &mut positions[grid.vertices()];
            if out.is_empty() {
                continue;
            }
            if instance.points_grid(patch, &grid.u, &grid.v, out).is_err() {
                out.fill([f64::NAN; 3]);
                absent += 1;
            }
        }
        absent
    }

    /// The facets where `instance` puts them.
    pub(crate) fn facets(&self, instance: &dyn Instance) -> Facets<'_> {
        let mut positions = vec![[f64::NAN; 3]; self.uv.len()];
        let absent = self.place(instance, &mut positions);
        let mut tree = self.tree.clone();
        self.refit(&mut tree, &positions);
        Facets { layout: self, positions, tree, absent }
    }

    pub(super) fn refit(&self, tree: &mut Tree, positions: &[[f64; 3]]) {
        let facet = |quad: usize| self.quads[quad].vertices.map(|v| DVec3::from_array(positions[v as usize]));
        tree.refit(bounds(positions), facet);
    }

    /// Whether two facets are the same or share a corner, within one patch.
    pub(super) fn beside(&self, a: u32, b: u32) -> bool {
        let [a, b] = [a, b].map(|quad| self.quads[quad as usize]);
        if a.patch != b.patch {
            return false;
        }
        let grid = &self.grids[a.patch as usize];
        (0..2).all(|k| {
            let apart = a.place[k].abs_diff(b.place[k]) as usize;
            apart <= 1 || (grid.closed[k] && apart + 1 >= grid.cells[k])
        })
    }

    /// Whether patch `patch` closes in u, and in v.
    pub(crate) fn closed(&self, patch: usize) -> [bool; 2] {
        self.grids[patch].closed
    }
}

/// The box around all positions that are finite.
pub(super) fn bounds(positions: &[[f64; 3]]) -> Bounds {
    positions.iter().map(|p| DVec3::from_array(*p)).filter(|p| p.is_finite()).collect()
}

fn centre(quad: &Quad, positions: &[[f64; 3]]) -> DVec3 {
    let sum: DVec3 = quad.vertices.iter().map(|v| DVec3::from_array(positions[*v as usize])).sum();
    sum / 4.0
}

/// The resolution that a patch needs, and whether it closes.
struct Gauge {
    cells: [usize; 2],
    closed: [bool; 2],
    /// The chord error of the cells, both directions together. Millimetres.
    sagitta: f64,
}

/// Chord error h^2 |S''| / 8 from second differences on a coarse grid; beside it no cell longer than a tenth of the
/// size, so that boxes stay small.
fn gauge(instance: &dyn Instance, patch: usize, tolerance: f64, size: f64) -> Gauge {
    let n = CURVATURE_CELLS + 1;
    let axis: Vec<f64> = (0..n).map(|i| i as f64 / CURVATURE_CELLS as f64).collect();
    let mut p = vec![[0.0; 3]; n * n];
    if instance.points_grid(patch, &axis, &axis, &mut p).is_err() {
        return Gauge { cells: [CURVATURE_CELLS; 2], closed: [false; 2], sagitta: 0.0 };
    }
    let at = |i: usize, j: usize, swap: bool| DVec3::from_array(if swap { p[i * n + j] } else { p[j * n + i] });
    let mut cells = [1; 2];
    let mut closed = [false; 2];
    let mut sagitta = 0.0;
    for (k, swap) in [(0, false), (1, true)] {
        let (mut bend, mut length, mut gap) = (0.0_f64, 0.0_f64, 0.0_f64);
        for j in 0..n {
            let mut line = 0.0;
            for i in 1..n {
                line += at(i, j, swap).distance(at(i - 1, j, swap));
                if i + 1 < n {
                    bend = bend.max((at(i + 1, j, swap) - 2.0 * at(i, j, swap) + at(i - 1, j, swap)).length());
                }
            }
            length = length.max(line);
            gap = gap.max(at(0, j, swap).distance(at(n - 1, j, swap)));
        }
        let by_bend = CURVATURE_CELLS as f64 * (bend / (8.0 * tolerance)).sqrt();
        let by_length = CELLS_OF_SIZE * length / size;
        cells[k] = by_bend.max(by_length).ceil().clamp(1.0, MOST_CELLS) as usize;
        sagitta += bend / 8.0 * (CURVATURE_CELLS as f64 / cells[k] as f64).powi(2);
        closed[k] = length > 0.0 && gap < 1e-9 * size && bend > 0.0;
    }
    Gauge { cells, closed, sagitta }
}
