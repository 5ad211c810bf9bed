//! The search of the facet nearest to a point, and of how far the model may move until another one can be nearest.

use super::facets::{Facets, Facing, Orientation};
use super::layout::Quad;
use super::tuning::{GRAZING, LISTED};
use glam::DVec3;

/// The hint of a query that has none.
pub(crate) const NO_HINT: u32 = u32::MAX;

/// A point whose nearest facet is searched for.
#[derive(Clone, Copy)]
pub(crate) struct Query<'q> {
    /// In the model's frame. Millimetres.
    pub(crate) q: DVec3,
    /// Facets farther away do not count. Millimetres.
    pub(crate) cutoff: f64,
    /// If present, only facets count that face the way the point's normal does.
    pub(crate) facing: Option<Facing<'q>>,
    /// A facet that may well be the nearest, or `NO_HINT`. A good one prunes most boxes; the answer does not depend on
    /// it.
    pub(crate) hint: u32,
    /// A patch whose facets do not count.
    pub(crate) except: Option<u32>,
    /// Other facets are searched for up to so much beyond the nearest one, for the slack. Millimetres; 0 where the
    /// slack is not wanted.
    pub(crate) reach: f64,
}

impl Query<'_> {
    /// The facet nearest to `q` among all within `cutoff` (millimetres).
    pub(crate) fn new(q: DVec3, cutoff: f64) -> Self {
        Self { q, cutoff, facing: None, hint: NO_HINT, except: None, reach: 0.0 }
    }
}

/// The point of the facets nearest to another one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub(crate) patch: u32,
    pub(crate) uv: [f64; 2],
    /// The facet: a hint for the next search from about here.
    pub(crate) quad: u32,
}

/// The triangle of a facet that is nearest so far.
struct Best {
    quad: u32,
    /// The facet's corners that are the triangle's.
    corners: [usize; 3],
    weights: [f64; 3],
}

impl Facets<'_> {
    /// The nearest point; None where no facet counts.
    pub(crate) fn nearest(&self, query: Query) -> Option<Nearest> {
        NearestSearch::run(self, query).nearest()
    }

    /// The nearest point, and how far the model may move (millimetres) until another one can be the answer. Facets
    /// beside the nearest one are not another answer. The slack is not positive where nothing is known of it.
    pub(crate) fn nearest_and_slack(&self, query: Query) -> (Option<Nearest>, f64) {
        let search = NearestSearch::run(self, query);
        (search.nearest(), search.slack())
    }

    /// The nearest point of every patch that has one no more than `beyond` millimetres farther off than the nearest of
    /// all; the latter's patch is the first.
    pub(crate) fn nearest_of_patches(&self, query: Query, beyond: f64) -> Vec<Nearest> {
        let first = NearestSearch::run(self, query);
        let Some(nearest) = first.nearest() else { return Vec::new() };
        let limit = (first.least.sqrt() + beyond).powi(2);
        let mut others: Vec<(u32, NearestSearch)> = Vec::new();
        self.tree.visit(query.q, limit, |quad, limit| {
            let patch = self.layout.quads[quad].patch;
            if patch != nearest.patch && query.except != Some(patch) {
                let known = others.iter().position(|(other, _)| *other == patch).unwrap_or_else(|| {
                    others.push((patch, NearestSearch::new(self, query)));
                    others.len() - 1
                });
                others[known].1.distance(quad as u32, limit);
            }
            limit
        });
        let others = others.iter().filter(|(_, search)| search.least <= limit).filter_map(|(_, s)| s.nearest());
        std::iter::once(nearest).chain(others).collect()
    }
}

struct NearestSearch<'s> {
    facets: &'s Facets<'s>,
    query: Query<'s>,
    /// Squared distance of the nearest facet that counts, and which that is.
    least: f64,
    best: Option<Best>,
    /// Facets within reach with their squared distances, and how many there were.
    listed: [(u32, f64); LISTED],
    count: usize,
}

impl<'s> NearestSearch<'s> {
    /// A search that has seen nothing.
    fn new(facets: &'s Facets<'s>, query: Query<'s>) -> Self {
        Self { facets, query, least: f64::INFINITY, best: None, listed: [(0, 0.0); LISTED], count: 0 }
    }

    fn run(facets: &'s Facets<'s>, query: Query<'s>) -> Self {
        let Query { q, hint, except, .. } = query;
        let mut search = Self::new(facets, query);
        let mut limit = search.limit();
        if (hint as usize) < facets.layout.quads.len() {
            limit = search.visit(hint, limit);
        }
        facets.tree.visit(q, limit, |quad, limit| {
            let skipped = quad as u32 == hint || except == Some(facets.layout.quads[quad].patch);
            if skipped { limit } else { search.visit(quad as u32, limit) }
        });
        search
    }

    /// The squared distance beyond which nothing matters.
    fn limit(&self) -> f64 {
        let Query { cutoff, reach, .. } = self.query;
        if reach > 0.0 { (self.least.sqrt().min(cutoff) + reach).powi(2) } else { self.least.min(cutoff * cutoff) }
    }

    /// Takes in a facet; returns the limit from then on.
    fn visit(&mut self, quad: u32, limit: f64) -> f64 {
        let before = self.least;
        let distance = self.distance(quad, limit);
        if self.query.reach > 0.0 && distance <= limit {
            if let Some(slot) = self.listed.get_mut(self.count) {
                *slot = (quad, distance);
            }
            self.count += 1;
        }
        if self.least < before { limit.min(self.limit()) } else { limit }
    }

    /// Puts a facet into `best` if it is nearer than `least` and counts. Returns its squared distance, also where it is
    /// grazing (it may turn to the point as the model moves); infinity where it is back-facing or beyond `limit`.
    fn distance(&mut self, quad: u32, limit: f64) -> f64 {
        let Query { q, facing, .. } = self.query;
        let Quad { patch, .. } = self.facets.layout.quads[quad as usize];
        let corner = self.facets.quad(quad);
        let mut least = f64::INFINITY;
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let [a, b, c] = corners.map(|k: usize| corner[k]);
            // Half of the facets near a thin wall face away, and their distances cost more than their orientation.
            let orientation = facing.map_or(Orientation::FrontFacing, |f| f.orientation(patch, a, b, c));
            if orientation == Orientation::BackFacing {
                continue;
            }
            let Some((weights, d2)) = self.facets.closest(q, quad, corners, [a, b, c]) else { continue };
            if d2 > limit.min(least) && d2 > self.least {
                continue;
            }
            least = least.min(d2);
            // The first one of equally near facets is the answer, whatever the order of visits.
            let first = d2 == self.least && self.best.as_ref().is_some_and(|best| quad < best.quad);
            if orientation == Orientation::FrontFacing && (d2 < self.least || first) {
                self.least = d2;
                self.best = Some(Best { quad, corners, weights });
            }
        }
        least
    }

    /// The nearest facet within the cut-off.
    fn best(&self) -> Option<&Best> {
        self.best.as_ref().filter(|_| self.least < self.query.cutoff * self.query.cutoff)
    }

    fn nearest(&self) -> Option<Nearest> {
        let Best { quad, corners, weights } = self.best()?;
        let Quad { patch, vertices, .. } = self.facets.layout.quads[*quad as usize];
        let uv = [0, 1].map(|k| {
            let parts = corners.iter().zip(weights);
            parts.map(|(c, w)| w * self.facets.uv[vertices[*c] as usize][k]).sum()
        });
        Some(Nearest { patch, uv, quad: *quad })
    }

    fn slack(&self) -> f64 {
        let Query { cutoff, reach, .. } = self.query;
        let Some(listed) = self.listed.get(..self.count) else { return f64::NEG_INFINITY };
        let least = |facets: &mut dyn Iterator<Item = &(u32, f64)>| {
            facets.map(|(_, d2)| *d2).fold(f64::INFINITY, f64::min).sqrt()
        };
        let Some(best) = self.best() else { return least(&mut listed.iter()).min(cutoff + reach) - cutoff };
        // A facet nearly across the point's normal may soon face away from it.
        if self.grazes(best) {
            return f64::NEG_INFINITY;
        }
        let rival = least(&mut listed.iter().filter(|(quad, _)| !self.facets.layout.beside(*quad, best.quad)));
        0.5 * (rival - self.least.sqrt()).min(reach)
    }

    /// Whether a triangle is nearly across the point's normal, on either side.
    fn grazes(&self, best: &Best) -> bool {
        let Some(facing) = self.query.facing else { return false };
        let patch = self.facets.layout.quads[best.quad as usize].patch;
        let corner = self.facets.quad(best.quad);
        let [a, b, c] = best.corners.map(|k| corner[k]);
        let cosine = (b - a).cross(c - a).normalize_or_zero().dot(facing.normal);
        facing.signs[patch as usize] != 0 && cosine.abs() < GRAZING
    }
}
