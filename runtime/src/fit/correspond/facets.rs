//! The model's surface as facets, for the search of nearest points.

use super::layout::{Layout, Quad, bounds};
use super::tree::{Tree, triangle_closest};
use glam::DVec3;

/// The facets at certain parameters.
#[derive(Clone, Debug)]
pub(crate) struct Facets<'a> {
    pub(super) layout: &'a Layout,
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) tree: Tree,
    /// Patches that could not be evaluated here; they are never found.
    pub(crate) absent: usize,
}

/// The nearest point of the facets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub(crate) patch: u32,
    pub(crate) uv: [f64; 2],
    /// The facet: a hint for the next search from about here.
    pub(crate) quad: u32,
}

/// What a point's own normal demands of the surface that it may belong to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing<'a> {
    /// Unit normal of the point, in the model's frame.
    pub(crate) normal: DVec3,
    /// Per patch: +1 where dS/du x dS/dv points out of the material, -1 where it points into it, 0 where unknown.
    pub(crate) signs: &'a [i8],
}

/// The cosine between normals within which a facet may turn from looking one way to looking the other.
pub(super) const ACROSS: f64 = 0.1;

impl Facets<'_> {
    /// Takes patches out, so that they are no longer found.
    pub(crate) fn remove(&mut self, patch: impl Fn(usize) -> bool) {
        for (i, grid) in self.layout.grids.iter().enumerate() {
            if patch(i) {
                self.positions[grid.vertices()].fill([f64::NAN; 3]);
            }
        }
        self.layout.refit(&mut self.tree, &self.positions);
    }

    /// The nearest facet within `cutoff` of `q`, and where on it; None where there is none. With `facing`, only facets
    /// that look the way the point's normal does. `hint` is a facet that may well be the nearest, or none of those that there
    /// are: with a good one most boxes need no look, and the answer is the same.
    pub(crate) fn nearest(&self, q: DVec3, cutoff: f64, facing: Option<Facing>, hint: u32) -> Option<Nearest> {
        let mut best: Option<Best> = None;
        let mut limit = cutoff * cutoff;
        if (hint as usize) < self.layout.quads.len() {
            limit = self.try_quad(q, hint, facing, limit, &mut best);
        }
        self.tree.visit(&self.tree.asked(q, facing, 0.0), limit, |quad, _, limit| {
            if quad as u32 == hint { limit } else { self.try_quad(q, quad as u32, facing, limit, &mut best) }
        });
        best.map(|best| self.on(&best))
    }

    /// As `nearest`, of all patches but one.
    pub(crate) fn nearest_but(&self, q: DVec3, cutoff: f64, facing: Option<Facing>, patch: u32) -> Option<Nearest> {
        let mut best: Option<Best> = None;
        self.tree.visit(&self.tree.asked(q, facing, 0.0), cutoff * cutoff, |quad, _, limit| {
            let own = self.layout.quads[quad].patch == patch;
            if own { limit } else { self.try_quad(q, quad as u32, facing, limit, &mut best) }
        });
        best.map(|best| self.on(&best))
    }

    /// Whether a facet looks nearly across a point's normal.
    pub(super) fn turns_away(&self, best: &Best, facing: Facing) -> bool {
        let Quad { patch, vertices, .. } = self.layout.quads[best.quad as usize];
        let [a, b, c] = best.corners.map(|k| DVec3::from_array(self.positions[vertices[k] as usize]));
        let cosine = (b - a).cross(c - a).normalize_or_zero().dot(facing.normal);
        facing.signs[patch as usize] != 0 && cosine.abs() < ACROSS
    }

    pub(super) fn on(&self, best: &Best) -> Nearest {
        let Quad { patch, vertices, .. } = self.layout.quads[best.quad as usize];
        let uv = |k: usize| {
            let parts = best.corners.iter().zip(best.weights);
            parts.map(|(c, w)| w * self.layout.uv[vertices[*c] as usize][k]).sum()
        };
        Nearest { patch, uv: [uv(0), uv(1)], quad: best.quad }
    }

    /// The facets' corners; those of patches that do not exist are not finite.
    pub(crate) fn corners(&self) -> impl Iterator<Item = DVec3> {
        self.positions.iter().map(|p| DVec3::from_array(*p))
    }

    /// Puts a facet into `best` if it is nearer than `limit` (squared); returns what is to be beaten from then on.
    fn try_quad(&self, q: DVec3, quad: u32, facing: Option<Facing>, mut limit: f64, best: &mut Option<Best>) -> f64 {
        let Quad { patch, vertices, .. } = self.layout.quads[quad as usize];
        let corner = vertices.map(|v| DVec3::from_array(self.positions[v as usize]));
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let [a, b, c] = corners.map(|k| corner[k]);
            if facing.is_some_and(|f| f.looks(patch, a, b, c) != Orientation::FrontFacing) {
                continue;
            }
            let (weights, d2) = triangle_closest(q, a, b, c);
            if d2 < limit {
                limit = d2;
                *best = Some(Best { quad, corners, weights });
            }
        }
        limit
    }

    /// The distance from `q` to the nearest facet, which is below `limit`; `limit` if there is none.
    pub(crate) fn distance(&self, q: DVec3, limit: f64) -> f64 {
        let mut best = limit * limit;
        self.tree.visit(&self.tree.asked(q, None, 0.0), best, |quad, _, limit| {
            let c = self.layout.quads[quad].vertices.map(|v| DVec3::from_array(self.positions[v as usize]));
            let (_, first) = triangle_closest(q, c[0], c[1], c[2]);
            let (_, second) = triangle_closest(q, c[0], c[2], c[3]);
            best = limit.min(first).min(second);
            best
        });
        best.sqrt()
    }

    /// The box around all facets, if there are any.
    pub(crate) fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let (low, high) = bounds(&self.positions);
        (low.cmple(high).all() && (high - low).max_element() > 0.0).then_some((low, high))
    }

    /// Area-weighted centre and total area of the facets, and the radius of gyration about the centre.
    pub(crate) fn moments(&self) -> (DVec3, f64, f64) {
        let (mut sum, mut area, mut second) = (DVec3::ZERO, 0.0, 0.0);
        for quad in &self.layout.quads {
            let c = quad.vertices.map(|v| DVec3::from_array(self.positions[v as usize]));
            let a = 0.5 * ((c[2] - c[0]).cross(c[3] - c[1])).length();
            let m = (c[0] + c[1] + c[2] + c[3]) / 4.0;
            if a.is_finite() {
                sum += m * a;
                area += a;
                second += a * m.length_squared();
            }
        }
        let centre = sum / area.max(f64::MIN_POSITIVE);
        (centre, area, (second / area.max(f64::MIN_POSITIVE) - centre.length_squared()).max(0.0).sqrt())
    }
}

impl Facing<'_> {
    /// Which way a triangle of a patch looks; towards where that is not known.
    pub(super) fn looks(&self, patch: u32, a: DVec3, b: DVec3, c: DVec3) -> Orientation {
        let area = (b - a).cross(c - a);
        let along = f64::from(self.signs[patch as usize]) * area.dot(self.normal);
        // By squares: roots cost more than all the rest.
        if along >= 0.0 {
            Orientation::FrontFacing
        } else if along * along <= ACROSS * ACROSS * area.length_squared() {
            Orientation::Grazing
        } else {
            Orientation::BackFacing
        }
    }
}

/// Which way the outward normal of a triangle looks, seen along a point's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Orientation {
    FrontFacing,
    /// Away, but hardly.
    Grazing,
    BackFacing,
}

/// The nearest facet so far.
pub(super) struct Best {
    pub(super) quad: u32,
    /// Which of its corners.
    pub(super) corners: [usize; 3],
    pub(super) weights: [f64; 3],
}
