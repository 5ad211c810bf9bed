//! The model's surface as facets.

use super::layout::{Grid, Layout, bounds};
use super::tree::{Tree, triangle_closest};
use super::trim::{Crossed, Keep};
use super::tuning::GRAZING;
use crate::mesh::Bounds;
use glam::DVec3;
use std::borrow::Cow;

/// The facets of a layout where certain parameters put them.
#[derive(Clone, Debug)]
pub(crate) struct Facets<'a> {
    pub(super) layout: &'a Layout,
    /// The layout's, with lines where the breaks are.
    pub(super) grids: Cow<'a, [Grid]>,
    /// (u, v) of every vertex.
    pub(super) uv: Cow<'a, [[f64; 2]]>,
    pub(super) positions: Vec<[f64; 3]>,
    /// By vertex, positive where a trimmed patch is there; empty if none is trimmed.
    pub(super) keeps: Vec<Keep>,
    pub(super) tree: Tree,
    /// Patches that could not be evaluated here; they are never found.
    pub(crate) absent: usize,
}

/// How facets must face to belong to a point of the scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing<'a> {
    /// Unit normal of the point, in the model's frame.
    pub(crate) normal: DVec3,
    /// Per patch: +1 where dS/du x dS/dv points out of the material, -1 where it points into it, 0 where unknown.
    pub(crate) signs: &'a [i8],
}

/// The orientation of a triangle's outward normal, seen along a point's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Orientation {
    FrontFacing,
    /// Away, but by less than `GRAZING`.
    Grazing,
    BackFacing,
}

impl Facets<'_> {
    /// The grid of a patch, with lines where its breaks are.
    pub(crate) fn grid(&self, patch: usize) -> &Grid {
        &self.grids[patch]
    }

    /// Takes patches out, so that they are no longer found.
    pub(crate) fn remove(&mut self, patch: impl Fn(usize) -> bool) {
        for (i, grid) in self.grids.iter().enumerate() {
            if patch(i) {
                self.positions[grid.vertices()].fill([f64::NAN; 3]);
            }
        }
        self.refit();
    }

    /// Fits the tree to what is there.
    pub(super) fn refit(&mut self) {
        let mut tree = std::mem::take(&mut self.tree);
        tree.refit(bounds(&self.positions), |quad| {
            let absent = !self.keeps.is_empty() && self.keeps_of(quad as u32).iter().all(|keep| !keep.is_there());
            if absent { [DVec3::NAN; 4] } else { self.quad(quad as u32) }
        });
        self.tree = tree;
    }

    fn keeps_of(&self, quad: u32) -> [Keep; 4] {
        self.layout.quads[quad as usize].vertices.map(|v| self.keeps[v as usize])
    }

    /// A triangle of a facet whose corners are given, if the edge of a trimmed patch crosses it, or it is not there.
    fn crossed(&self, quad: u32, corners: [usize; 3]) -> Option<Crossed> {
        if self.keeps.is_empty() {
            return None;
        }
        let vertices = corners.map(|k| self.layout.quads[quad as usize].vertices[k] as usize);
        let keep = vertices.map(|v| self.keeps[v]);
        let whole = keep.iter().all(Keep::is_there);
        (!whole).then(|| Crossed { keep, uv: vertices.map(|v| self.uv[v]) })
    }

    /// The point nearest to q of what is there of a triangle of a facet, whose corners are given: as their weights, and
    /// its squared distance. None where nothing of it is there.
    pub(super) fn closest(
        &self,
        q: DVec3,
        quad: u32,
        corners: [usize; 3],
        [a, b, c]: [DVec3; 3],
    ) -> Option<([f64; 3], f64)> {
        match self.crossed(quad, corners) {
            None => Some(triangle_closest(q, a, b, c)),
            Some(crossed) => crossed.closest(q, [a, b, c]),
        }
    }

    /// The corners of a facet.
    pub(super) fn quad(&self, quad: u32) -> [DVec3; 4] {
        self.layout.quads[quad as usize].vertices.map(|v| DVec3::from_array(self.positions[v as usize]))
    }

    /// All vertices; those of patches that do not exist are not finite.
    pub(crate) fn vertices(&self) -> impl Iterator<Item = DVec3> {
        self.positions.iter().map(|p| DVec3::from_array(*p))
    }

    /// The function of what is there of trimmed patches at their vertices: in the library's solids it changes by no
    /// more than the surfaces that cut them move.
    pub(crate) fn keeps(&self) -> impl Iterator<Item = f64> {
        self.keeps.iter().map(|keep| keep.value).filter(|value| value.is_finite())
    }

    /// The corners of all facets that exist, and of what is there of those that are trimmed: of a triangle the last one
    /// twice.
    pub(crate) fn quads(&self) -> impl Iterator<Item = [DVec3; 4]> {
        let of_quad = |quad: u32| -> Vec<[DVec3; 4]> {
            let corners = self.quad(quad);
            let triangles = [[0, 1, 2], [0, 2, 3]].map(|k| (k, self.crossed(quad, k)));
            if triangles.iter().all(|(_, crossed)| crossed.is_none()) {
                return vec![corners];
            }
            let mut quads = Vec::new();
            for (k, crossed) in triangles {
                let position = |w: [f64; 3]| (0..3).map(|c| corners[k[c]] * w[c]).sum::<DVec3>();
                match crossed {
                    None => quads.push([corners[k[0]], corners[k[1]], corners[k[2]], corners[k[2]]]),
                    Some(crossed) => {
                        let pieces = crossed.pieces().into_iter().flatten();
                        quads.extend(pieces.map(|piece| piece.map(position)).map(|[a, b, c]| [a, b, c, c]));
                    }
                }
            }
            quads
        };
        let quads = (0..self.layout.quads.len() as u32).flat_map(of_quad);
        quads.filter(|quad| quad.iter().all(|corner| corner.is_finite()))
    }

    /// The distance from `q` to the nearest facet, which is below `limit`; `limit` if there is none.
    pub(crate) fn distance(&self, q: DVec3, limit: f64) -> f64 {
        let mut least = limit * limit;
        self.tree.visit(q, least, |quad, limit| {
            let c = self.quad(quad as u32);
            least = limit;
            for corners in [[0, 1, 2], [0, 2, 3]] {
                let nearest = self.closest(q, quad as u32, corners, corners.map(|k| c[k]));
                least = nearest.map_or(least, |(_, d2)| least.min(d2));
            }
            least
        });
        least.sqrt()
    }

    /// The box around all vertices, if there are any.
    pub(crate) fn bounds(&self) -> Option<Bounds> {
        Some(bounds(&self.positions)).filter(|bounds| bounds.size().max_element() > 0.0)
    }

    /// Area-weighted centre of the facets, and the radius of gyration about it. Millimetres.
    pub(crate) fn moments(&self) -> (DVec3, f64) {
        let (mut sum, mut area, mut second) = (DVec3::ZERO, 0.0, 0.0);
        for c in self.quads() {
            let a = 0.5 * ((c[2] - c[0]).cross(c[3] - c[1])).length();
            let m = (c[0] + c[1] + c[2] + c[3]) / 4.0;
            sum += m * a;
            area += a;
            second += a * m.length_squared();
        }
        let centre = sum / area.max(f64::MIN_POSITIVE);
        (centre, (second / area.max(f64::MIN_POSITIVE) - centre.length_squared()).max(0.0).sqrt())
    }
}

impl Facing<'_> {
    /// The orientation of a triangle of a patch; front-facing where the patch's sides are not known.
    pub(super) fn orientation(&self, patch: u32, a: DVec3, b: DVec3, c: DVec3) -> Orientation {
        let area = (b - a).cross(c - a);
        let along = f64::from(self.signs[patch as usize]) * area.dot(self.normal);
        // By squares: roots cost more than all the rest.
        if along >= 0.0 {
            Orientation::FrontFacing
        } else if along * along <= GRAZING * GRAZING * area.length_squared() {
            Orientation::Grazing
        } else {
            Orientation::BackFacing
        }
    }
}
