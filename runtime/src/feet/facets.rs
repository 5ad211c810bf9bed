//! The model's surface as facets.

use super::layout::{Layout, bounds};
use super::tree::{Tree, triangle_closest};
use super::tuning::GRAZING;
use crate::mesh::Bounds;
use glam::DVec3;

/// The facets of a layout where certain parameters put them.
#[derive(Clone, Debug)]
pub(crate) struct Facets<'a> {
    pub(super) layout: &'a Layout,
    pub(super) positions: Vec<[f64; 3]>,
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
    /// Takes patches out, so that they are no longer found.
    pub(crate) fn remove(&mut self, patch: impl Fn(usize) -> bool) {
        for (i, grid) in self.layout.grids.iter().enumerate() {
            if patch(i) {
                self.positions[grid.vertices()].fill([f64::NAN; 3]);
            }
        }
        self.layout.refit(&mut self.tree, &self.positions);
    }

    /// The corners of a facet.
    pub(super) fn quad(&self, quad: u32) -> [DVec3; 4] {
        self.layout.quads[quad as usize].vertices.map(|v| DVec3::from_array(self.positions[v as usize]))
    }

    /// All vertices; those of patches that do not exist are not finite.
    pub(crate) fn vertices(&self) -> impl Iterator<Item = DVec3> {
        self.positions.iter().map(|p| DVec3::from_array(*p))
    }

    /// The corners of all facets that exist.
    pub(crate) fn quads(&self) -> impl Iterator<Item = [DVec3; 4]> {
        let quads = (0..self.layout.quads.len() as u32).map(|quad| self.quad(quad));
        quads.filter(|quad| quad.iter().all(|corner| corner.is_finite()))
    }

    /// The distance from `q` to the nearest facet, which is below `limit`; `limit` if there is none.
    pub(crate) fn distance(&self, q: DVec3, limit: f64) -> f64 {
        let mut least = limit * limit;
        self.tree.visit(q, least, |quad, limit| {
            let c = self.quad(quad as u32);
            let (_, first) = triangle_closest(q, c[0], c[1], c[2]);
            let (_, second) = triangle_closest(q, c[0], c[2], c[3]);
            least = limit.min(first).min(second);
            least
        });
        least.sqrt()
    }

    /// The box around all facets, if there are any.
    pub(crate) fn bounds(&self) -> Option<Bounds> {
        Some(bounds(&self.positions)).filter(|bounds| bounds.size().max_element() > 0.0)
    }

    /// Area-weighted centre of the facets, and the radius of gyration about it. Millimetres.
    pub(crate) fn moments(&self) -> (DVec3, f64) {
        let (mut sum, mut area, mut second) = (DVec3::ZERO, 0.0, 0.0);
        for quad in 0..self.layout.quads.len() {
            let c = self.quad(quad as u32);
            let a = 0.5 * ((c[2] - c[0]).cross(c[3] - c[1])).length();
            let m = (c[0] + c[1] + c[2] + c[3]) / 4.0;
            if a.is_finite() {
                sum += m * a;
                area += a;
                second += a * m.length_squared();
            }
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
