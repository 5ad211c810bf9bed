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

/// Facets that a search with slack remembers; where there are more within reach, nothing is said of the slack.
const SEEN: usize = 48;
/// The cosine between normals within which a facet may turn from looking one way to looking the other.
const ACROSS: f64 = 0.1;
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
        self.tree.visit(q, limit, |quad, _, limit| {
            if quad as u32 == hint { limit } else { self.try_quad(q, quad as u32, facing, limit, &mut best) }
        });
        best.map(|best| self.on(&best))
    }

    /// As `nearest`, of all patches but one.
    pub(crate) fn nearest_but(&self, q: DVec3, cutoff: f64, facing: Option<Facing>, patch: u32) -> Option<Nearest> {
        let mut best: Option<Best> = None;
        self.tree.visit(q, cutoff * cutoff, |quad, _, limit| {
            let own = self.layout.quads[quad].patch == patch;
            if own { limit } else { self.try_quad(q, quad as u32, facing, limit, &mut best) }
        });
        best.map(|best| self.on(&best))
    }

    /// As `nearest`, and how far the model may move until the answer can be another one. For that, facets are looked at that
    /// are up to `reach` farther away; those beside the nearest one do not count as another answer.
    pub(crate) fn nearest_and_slack(
        &self,
        q: DVec3,
        cutoff: f64,
        facing: Option<Facing>,
        hint: u32,
        reach: f64,
    ) -> (Option<Nearest>, f64) {
        let mut best: Option<Best> = None;
        let mut least = f64::INFINITY;
        let mut seen = [(0_u32, 0.0_f64); SEEN];
        let mut count = 0;
        let mut look = |quad: u32, lower: f64, limit: f64| {
            let before = least;
            let any = self.look(q, quad, facing, (lower, limit), &mut least, &mut best);
            if any <= limit {
                if let Some(slot) = seen.get_mut(count) {
                    *slot = (quad, any);
                }
                count += 1;
            }
            if least < before { limit.min((least.sqrt().min(cutoff) + reach).powi(2)) } else { limit }
        };
        let mut limit = (cutoff + reach).powi(2);
        if (hint as usize) < self.layout.quads.len() {
            limit = look(hint, 0.0, limit);
        }
        self.tree.visit(
            q,
            limit,
            |quad, lower, limit| {
                if quad as u32 == hint { limit } else { look(quad as u32, lower, limit) }
            },
        );
        let seen = if count > SEEN { None } else { Some(&seen[..count]) };
        let Some(best) = best.filter(|_| least < cutoff * cutoff) else {
            let nearest = seen.map(|seen| seen.iter().map(|s| s.1).fold(f64::INFINITY, f64::min).sqrt());
            return (None, nearest.map_or(f64::NEG_INFINITY, |d| d.min(cutoff + reach) - cutoff));
        };
        let rival = |seen: &[(u32, f64)]| {
            let others = seen.iter().filter(|s| !self.layout.beside(s.0, best.quad));
            others.map(|s| s.1).fold(f64::INFINITY, f64::min).sqrt()
        };
        let distance = least.sqrt();
        let slack = seen.map_or(f64::NEG_INFINITY, |seen| 0.5 * (rival(seen) - distance).min(reach));
        let nearest = self.on(&best);
        // What looks nearly across the point's normal may soon look away from it.
        let turning = facing.is_some_and(|f| self.turns_away(&best, f));
        (Some(nearest), if turning { f64::NEG_INFINITY } else { slack })
    }

    /// Puts a facet into `best` if it is nearer than `least` (squared); returns its squared distance whichever way it looks,
    /// unless that is clearly the wrong one or beyond `limit`. That is `lower`, which it is not below, where the facet is not the
    /// nearest one.
    fn look(
        &self,
        q: DVec3,
        quad: u32,
        facing: Option<Facing>,
        (lower, limit): (f64, f64),
        least: &mut f64,
        best: &mut Option<Best>,
    ) -> f64 {
        let Quad { patch, vertices } = self.layout.quads[quad as usize];
        let corner = vertices.map(|v| DVec3::from_array(self.positions[v as usize]));
        let mut any = f64::INFINITY;
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let [a, b, c] = corners.map(|k: usize| corner[k]);
            if lower >= *least {
                if facing.is_none_or(|f| f.cosine(patch, a, b, c) >= -ACROSS) {
                    any = any.min(lower);
                }
                continue;
            }
            let (weights, d2) = triangle_closest(q, a, b, c);
            // Which way it looks matters only where it is near.
            if d2 > limit.min(any) && d2 >= *least {
                continue;
            }
            let cosine = facing.map_or(0.0, |f| f.cosine(patch, a, b, c));
            if cosine < -ACROSS {
                continue;
            }
            any = any.min(d2);
            if cosine >= 0.0 && d2 < *least {
                *least = d2;
                *best = Some(Best { quad, corners, weights });
            }
        }
        any
    }

    fn turns_away(&self, best: &Best, facing: Facing) -> bool {
        let Quad { patch, vertices } = self.layout.quads[best.quad as usize];
        let [a, b, c] = best.corners.map(|k| DVec3::from_array(self.positions[vertices[k] as usize]));
        facing.signs[patch as usize] != 0 && facing.cosine(patch, a, b, c) < ACROSS
    }

    fn on(&self, best: &Best) -> Nearest {
        let Quad { patch, vertices } = self.layout.quads[best.quad as usize];
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
        let Quad { patch, vertices } = self.layout.quads[quad as usize];
        let corner = vertices.map(|v| DVec3::from_array(self.positions[v as usize]));
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let [a, b, c] = corners.map(|k| corner[k]);
            if facing.is_some_and(|f| f.rejects(patch, a, b, c)) {
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
        self.tree.visit(q, best, |quad, _, limit| {
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
    /// Between the point's normal and the outward one of a triangle of a patch; 0 where that is not known.
    fn cosine(&self, patch: u32, a: DVec3, b: DVec3, c: DVec3) -> f64 {
        f64::from(self.signs[patch as usize]) * (b - a).cross(c - a).normalize_or_zero().dot(self.normal)
    }

    fn rejects(&self, patch: u32, a: DVec3, b: DVec3, c: DVec3) -> bool {
        let sign = f64::from(self.signs[patch as usize]);
        sign * (b - a).cross(c - a).dot(self.normal) < 0.0
    }
}

/// The nearest facet so far.
struct Best {
    quad: u32,
    /// Which of its corners.
    corners: [usize; 3],
    weights: [f64; 3],
}
