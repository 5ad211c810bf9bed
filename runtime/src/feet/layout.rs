//! The division of the model's patches into facets: a grid of quadrilaterals per patch with lines at its breaks, which
//! move as these do, in a tree of boxes that is built once a level and refitted at every evaluation.

use super::domain::Domain;
use super::edge::Trimmed;
use super::facets::Facets;
use super::foot::{Foot, foot_points};
use super::gauge::{Gauge, Lines};
use super::tree::{Tree, triangle_closest};
use super::trim::{Keep, keeps_on_grid};
use super::tuning::{FARTHEST, MOST_STRETCHES};
use crate::mesh::Bounds;
use crate::model::{Breaks, EvaluationError, Instance, Model, Trail};
use glam::DVec3;
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

/// Vertices of the grids in (u, v), and the quadrilaterals between them, at the shape that they were made for.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    /// One per patch.
    pub(super) grids: Vec<Grid>,
    /// One per patch.
    trails: Vec<Trail>,
    /// (u, v) of every vertex.
    pub(super) uv: Vec<[f64; 2]>,
    pub(super) quads: Vec<Quad>,
    pub(super) tree: Tree,
    /// Largest distance of a facet from the exact surface, at the shape that the layout was made for; estimated from
    /// second differences, and of patches with breaks measured as well. Millimetres.
    pub(crate) sagitta: f64,
    /// How far the edge of a trimmed patch may be from that of its facets, about. Millimetres; 0 where none is trimmed.
    pub(crate) edge_error: f64,
}

/// The grid of one patch.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    /// Its first vertex.
    pub(super) first: usize,
    /// u of the columns and v of the rows; none where the patch is left out.
    u: Lines,
    v: Lines,
    /// What foot points may cross, and where they stop.
    domain: Domain,
    /// The patch of the function that is positive where this one is there, if it is trimmed.
    keep: Option<usize>,
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
        self.first..self.first + self.u.at.len() * self.v.at.len()
    }

    /// (u, v) of every vertex.
    fn sites(&self) -> impl Iterator<Item = [f64; 2]> {
        self.v.at.iter().flat_map(|v| self.u.at.iter().map(|u| [*u, *v]))
    }

    /// Moves the lines with the breaks of a patch between which they are.
    fn follow(&mut self, breaks: &Breaks) {
        let domain = self.domain.moved(breaks);
        for (k, lines) in [&mut self.u, &mut self.v].into_iter().enumerate() {
            let (from, to) = (self.domain.along(k), domain.along(k));
            if from.len() <= MOST_STRETCHES {
                *lines = lines.moved(from, to);
            }
        }
        self.domain = domain;
    }

    /// The points of the patch nearest to some others, from places near to them: of what is there of it. Those of which
    /// nothing is there are infinitely far.
    ///
    /// # Errors
    /// The patch cannot be evaluated.
    pub(crate) fn feet(
        &self,
        instance: &dyn Instance,
        patch: usize,
        q: &[DVec3],
        uv: &[[f64; 2]],
        tolerance: f64,
    ) -> Result<Vec<Foot>, EvaluationError> {
        let Self { domain, keep, u, v, .. } = self;
        let mut feet = foot_points(instance, patch, domain, q, uv, tolerance)?;
        if let Some(keep) = *keep {
            Trimmed { instance, patch, keep, domain, lines: [&u.at, &v.at], tolerance }
                .onto_what_is_there(q, uv, &mut feet)?;
        }
        Ok(feet)
    }

    /// Cells each way.
    fn cells(&self) -> [usize; 2] {
        [self.u.has_facets.len(), self.v.has_facets.len()]
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
        chosen: impl Fn(usize) -> bool + Sync,
    ) -> Self {
        let gauge =
            |patch: usize| chosen(patch).then(|| Gauge::of(instance, (patch, model.keep(patch)), tolerance, size));
        let gauges: Vec<Option<Gauge>> = (0..model.parts().len()).into_par_iter().map(gauge).collect();
        let mut layout = Self::default();
        let mut broken = Vec::new();
        for (patch, gauge) in gauges.into_iter().enumerate() {
            let gauge = gauge.unwrap_or_default();
            layout.sagitta = layout.sagitta.max(gauge.sagitta);
            broken.extend((*gauge.trail.breaks() != Breaks::default()).then_some(patch));
            let keep = model.keep(patch).filter(|_| chosen(patch));
            layout.edge_error = layout.edge_error.max(gauge.edge_error);
            layout.push_grid((patch, keep), gauge);
        }
        let mut positions = vec![[f64::NAN; 3]; layout.uv.len()];
        place(&layout.grids, instance, &mut positions);
        for patch in broken {
            layout.sagitta = layout.sagitta.max(layout.measured(instance, patch, &positions));
        }
        let centres: Vec<DVec3> = layout.quads.iter().map(|q| centre(q, &positions)).collect();
        let (tree, order) = Tree::build(&centres);
        layout.quads = order.iter().map(|i| layout.quads[*i as usize]).collect();
        layout.tree = tree;
        layout
    }

    fn push_grid(&mut self, (patch, keep): (usize, Option<usize>), gauge: Gauge) {
        let [u, v] = gauge.lines;
        let first = self.uv.len();
        for j in (0..v.has_facets.len()).filter(|j| v.has_facets[*j]) {
            for i in (0..u.has_facets.len()).filter(|i| u.has_facets[*i]) {
                let a = (first + j * u.at.len() + i) as u32;
                let above = a + u.at.len() as u32;
                let vertices = [a, a + 1, above + 1, above];
                self.quads.push(Quad { patch: patch as u32, vertices, place: [i as u16, j as u16] });
            }
        }
        let grid = Grid { first, u, v, domain: gauge.domain, keep };
        self.uv.extend(grid.sites());
        self.grids.push(grid);
        self.trails.push(gauge.trail);
    }

    /// The largest distance of a patch's surface from its facets, at their middles. Millimetres; 0 where it cannot be
    /// evaluated.
    fn measured(&self, instance: &dyn Instance, patch: usize, positions: &[[f64; 3]]) -> f64 {
        let grid = &self.grids[patch];
        let middles = |lines: &Lines| lines.at.windows(2).map(|w| (w[0] + w[1]) / 2.0).collect::<Vec<f64>>();
        let (u, v) = (middles(&grid.u), middles(&grid.v));
        let mut points = vec![[0.0; 3]; u.len() * v.len()];
        if instance.points_grid(patch, &u, &v, &mut points).is_err() {
            return 0.0;
        }
        let distance = |quad: &Quad| {
            let [i, j] = quad.place.map(usize::from);
            let middle = DVec3::from_array(points[j * u.len() + i]);
            let [a, b, c, d] = quad.vertices.map(|v| DVec3::from_array(positions[v as usize]));
            triangle_closest(middle, a, b, c).1.min(triangle_closest(middle, a, c, d).1)
        };
        let of_patch = self.quads.iter().filter(|q| q.patch as usize == patch);
        of_patch.map(distance).fold(0.0, f64::max).sqrt()
    }

    /// The facets where `instance` puts them, between its breaks.
    pub(crate) fn facets(&self, instance: &dyn Instance) -> Facets<'_> {
        let (grids, uv) = self.followed(instance);
        let mut positions = vec![[f64::NAN; 3]; uv.len()];
        let absent = place(&grids, instance, &mut positions);
        let keeps = keeps(&grids, uv.len(), instance);
        let mut facets = Facets { layout: self, grids, uv, positions, keeps, tree: self.tree.clone(), absent };
        facets.refit();
        facets
    }

    /// The grids and their vertices with lines where the breaks of `instance` are.
    fn followed(&self, instance: &dyn Instance) -> (Cow<'_, [Grid]>, Cow<'_, [[f64; 2]]>) {
        let (mut grids, mut uv) = (Cow::Borrowed(&self.grids[..]), Cow::Borrowed(&self.uv[..]));
        for (patch, trail) in self.trails.iter().enumerate() {
            // A patch that cannot be evaluated has no facets, and needs no lines that follow.
            if let Ok(Some(breaks)) = trail.followed(instance, patch) {
                let grid = &mut grids.to_mut()[patch];
                grid.follow(&breaks);
                for (vertex, at) in uv.to_mut()[grid.vertices()].iter_mut().zip(grid.sites()) {
                    *vertex = at;
                }
            }
        }
        (grids, uv)
    }

    /// The grid of a patch at the shape that the layout was made for.
    pub(crate) fn grid(&self, patch: usize) -> &Grid {
        &self.grids[patch]
    }

    /// Patches that are no more than this farther from a point than the nearest one by facets may be the nearest by
    /// their exact surfaces. Millimetres.
    pub(crate) fn rivalry(&self) -> f64 {
        2.0 * self.sagitta + self.edge_error
    }

    /// The patch of the function that is positive where a patch is there, if it is trimmed.
    pub(crate) fn keep(&self, patch: usize) -> Option<usize> {
        self.grids[patch].keep
    }

    /// Whether two facets are the same or share a corner, within one patch.
    pub(super) fn beside(&self, a: u32, b: u32) -> bool {
        let [a, b] = [a, b].map(|quad| self.quads[quad as usize]);
        if a.patch != b.patch {
            return false;
        }
        let grid = &self.grids[a.patch as usize];
        let cells = grid.cells();
        (0..2).all(|k| {
            let apart = a.place[k].abs_diff(b.place[k]) as usize;
            apart <= 1 || (grid.domain.closed[k] && apart + 1 >= cells[k])
        })
    }
}

/// Evaluates every vertex; those of a patch that fails, or that reaches beyond [`FARTHEST`], are NaN. Returns how many
/// patches do.
fn place(grids: &[Grid], instance: &dyn Instance, positions: &mut [[f64; 3]]) -> usize {
    let mut absent = 0;
    for (patch, grid) in grids.iter().enumerate() {
        let out = &mut positions[grid.vertices()];
        if out.is_empty() {
            continue;
        }
        let is_beyond = |point: &[f64; 3]| !point.iter().all(|c| c.abs() <= FARTHEST);
        if instance.points_grid(patch, &grid.u.at, &grid.v.at, out).is_err() || out.iter().any(is_beyond) {
            out.fill([f64::NAN; 3]);
            absent += 1;
        }
    }
    absent
}

/// By vertex, the function that is positive where a trimmed patch is there; empty if none is trimmed. Where it cannot
/// be evaluated nothing is there.
fn keeps(grids: &[Grid], vertices: usize, instance: &dyn Instance) -> Vec<Keep> {
    if grids.iter().all(|grid| grid.keep.is_none()) {
        return Vec::new();
    }
    let mut keeps = vec![Keep::EVERYWHERE; vertices];
    for grid in grids {
        let Some(keep) = grid.keep else { continue };
        let of_patch = &mut keeps[grid.vertices()];
        match keeps_on_grid(instance, keep, &grid.u.at, &grid.v.at) {
            Ok(found) => of_patch.copy_from_slice(&found),
            Err(_) => of_patch.fill(Keep::NOWHERE),
        }
    }
    keeps
}

/// The box around all positions that are finite.
pub(super) fn bounds(positions: &[[f64; 3]]) -> Bounds {
    positions.iter().map(|p| DVec3::from_array(*p)).filter(|p| p.is_finite()).collect()
}

fn centre(quad: &Quad, positions: &[[f64; 3]]) -> DVec3 {
    let sum: DVec3 = quad.vertices.iter().map(|v| DVec3::from_array(positions[*v as usize])).sum();
    sum / 4.0
}
