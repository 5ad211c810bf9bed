//! Searches of nearest facets that also say how far the model may move until the answer can be another one.

use super::facets::{ACROSS, Best, Facets, Facing, Nearest, Orientation};
use super::layout::Quad;
use super::tree::triangle_closest;
use glam::DVec3;

/// What a search is to find.
#[derive(Clone, Copy)]
pub(crate) struct Query<'q> {
    /// In the model's frame. Millimetres.
    pub(crate) q: DVec3,
    /// Facets farther away do not count. Millimetres.
    pub(crate) cutoff: f64,
    pub(crate) facing: Option<Facing<'q>>,
    /// A facet that may well be the nearest, or none of those that there are.
    pub(crate) hint: u32,
    /// How much farther away than the nearest one other facets are looked for. Millimetres.
    pub(crate) reach: f64,
}

/// Facets that a search remembers; where there are more within reach, nothing is said of the slack.
const SEEN: usize = 48;
impl Facets<'_> {
    /// As `nearest`, and how far the model may move until the answer can be another one; facets beside the nearest do not count as
    /// another answer.
    pub(crate) fn nearest_and_slack(&self, query: Query) -> (Option<Nearest>, f64) {
        let mut search = Search::new(self, query);
        let mut limit = search.limit();
        let hint = query.hint;
        if (hint as usize) < self.layout.quads.len() {
            limit = search.look(hint, 0.0, limit);
        }
        let asked = &self.tree.asked(query.q, query.facing, -ACROSS);
        self.tree.visit(
            asked,
            limit,
            |quad, lower, limit| {
                if quad as u32 == hint { limit } else { search.look(quad as u32, lower, limit) }
            },
        );
        search.answer()
    }
}

/// A search on its way.
struct Search<'s> {
    facets: &'s Facets<'s>,
    query: Query<'s>,
    /// Squared distance of the nearest facet that counts, and which that is.
    least: f64,
    best: Option<Best>,
    /// Facets within reach, and their squared distances.
    seen: [(u32, f64); SEEN],
    count: usize,
}

impl<'s> Search<'s> {
    fn new(facets: &'s Facets<'s>, query: Query<'s>) -> Self {
        Self { facets, query, least: f64::INFINITY, best: None, seen: [(0, 0.0); SEEN], count: 0 }
    }

    /// The squared distance beyond which nothing matters.
    fn limit(&self) -> f64 {
        (self.least.sqrt().min(self.query.cutoff) + self.query.reach).powi(2)
    }

    /// Takes a facet in whose squared distance is not below `lower`; returns the limit from then on.
    fn look(&mut self, quad: u32, lower: f64, limit: f64) -> f64 {
        let before = self.least;
        let any = self.distance(quad, lower, limit);
        if any <= limit {
            if let Some(slot) = self.seen.get_mut(self.count) {
                *slot = (quad, any);
            }
            self.count += 1;
        }
        if self.least < before { limit.min(self.limit()) } else { limit }
    }

    /// Puts a facet into `best` if it is nearer than `least`; returns its squared distance whichever way it looks, unless that is
    /// clearly the wrong one or beyond `limit`. That is `lower`, which it is not below, where the facet is not the nearest one.
    fn distance(&mut self, quad: u32, lower: f64, limit: f64) -> f64 {
        if lower >= self.least {
            return lower;
        }
        let Query { q, facing, .. } = self.query;
        let Quad { patch, vertices, .. } = self.facets.layout.quads[quad as usize];
        let corner = vertices.map(|v| DVec3::from_array(self.facets.positions[v as usize]));
        let mut any = f64::INFINITY;
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let [a, b, c] = corners.map(|k: usize| corner[k]);
            let (weights, d2) = triangle_closest(q, a, b, c);
            // Which way it looks matters only where it is near.
            if d2 > limit.min(any) && d2 >= self.least {
                continue;
            }
            let looks = facing.map_or(Orientation::FrontFacing, |f| f.looks(patch, a, b, c));
            if looks == Orientation::BackFacing {
                continue;
            }
            any = any.min(d2);
            if looks == Orientation::FrontFacing && d2 < self.least {
                self.least = d2;
                self.best = Some(Best { quad, corners, weights });
            }
        }
        any
    }

    /// The nearest facet and the slack.
    fn answer(&self) -> (Option<Nearest>, f64) {
        let Query { cutoff, reach, facing, .. } = self.query;
        let seen = self.seen.get(..self.count);
        let Some(best) = self.best.as_ref().filter(|_| self.least < cutoff * cutoff) else {
            let nearest = seen.map(|seen| seen.iter().map(|s| s.1).fold(f64::INFINITY, f64::min).sqrt());
            return (None, nearest.map_or(f64::NEG_INFINITY, |d| d.min(cutoff + reach) - cutoff));
        };
        let distance = self.least.sqrt();
        let rival = |seen: &[(u32, f64)]| {
            let others = seen.iter().filter(|s| !self.facets.layout.beside(s.0, best.quad));
            others.map(|s| s.1).fold(f64::INFINITY, f64::min).sqrt()
        };
        let slack = seen.map_or(f64::NEG_INFINITY, |seen| 0.5 * (rival(seen) - distance).min(reach));
        // What looks nearly across the point's normal may soon look away from it.
        let turning = facing.is_some_and(|f| self.facets.turns_away(best, f));
        (Some(self.facets.on(best)), if turning { f64::NEG_INFINITY } else { slack })
    }
}
