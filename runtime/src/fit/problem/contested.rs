//! Points between patches: by facets alone a point would change its patch where the facets say so, and its distance,
//! which is that from the exact surface, would jump there. Minimisations end in front of such jumps. As a minimum of
//! exact distances the objective is continuous, and its kinks are no minima.

use super::objective::{Correspondence, Matched, Objective, Placed};
use crate::fit::correspond::cache::CacheSlice;
use crate::fit::correspond::nearest::Query;

/// A patch whose facets are about as near to a point as those of another one.
struct Rival {
    point: usize,
    patch: usize,
    /// Squared distance of the point from the exact surface.
    d2: f64,
}

impl Objective<'_> {
    /// Gives points of a chunk for which several patches are as near as the facets' error to the one whose exact
    /// surface is the nearest. `first` is the chunk's first point.
    pub(super) fn decide_contested(
        &self,
        placed: &Placed,
        first: usize,
        cache: &mut CacheSlice,
        matched: &mut Vec<Matched>,
    ) {
        let beyond = self.layout.rivalry();
        let is_contested =
            |point: &Correspondence| cache.known[point.index - first].until - cache.travelled < 0.5 * beyond;
        let (mut rivals, mut others) = (Vec::new(), Vec::new());
        for (point, foot) in matched.iter().flat_map(|m| m.points.iter().zip(&m.feet)).filter(|(p, _)| is_contested(p))
        {
            let Correspondence { q, normal, patch, .. } = *point;
            let query = Query { facing: self.facing(normal), ..Query::new(q, self.loss.cutoff() + beyond) };
            let near = placed.facets.nearest_of_patches(query, beyond).into_iter().filter(|near| near.patch != patch);
            let before = others.len();
            others.extend(near.map(|near| Correspondence { patch: near.patch, uv: near.uv, ..*point }));
            if others.len() > before {
                rivals.push(Rival { point: point.index, patch: patch as usize, d2: foot.d2 });
            }
        }
        if others.is_empty() {
            return;
        }
        others.sort_by_key(|other| other.patch);
        let mut elsewhere = self.with_feet(placed, &others);
        for Matched { patch, points, feet, .. } in &elsewhere {
            let rival = points.iter().zip(feet).map(|(point, foot)| (point.index, foot.d2));
            rivals.extend(rival.map(|(point, d2)| Rival { point, patch: *patch, d2 }));
        }
        rivals.sort_by_key(|rival| (rival.point, rival.patch));
        let rivals: Vec<&Rival> = rivals.chunk_by(|a, b| a.point == b.point).map(|all| self.nearest(all)).collect();
        let winner = |point: usize| {
            let at = rivals.binary_search_by_key(&point, |rival| rival.point).ok()?;
            Some(rivals[at].patch)
        };
        for Rival { point, patch, .. } in rivals.iter().copied() {
            cache.known[point - first].patch = *patch as u32;
        }
        let wins = |m: &Matched, k: usize| winner(m.points[k].index).is_none_or(|patch| patch == m.patch);
        matched.iter_mut().chain(&mut elsewhere).for_each(|m| m.retain(wins));
        matched.append(&mut elsewhere);
        matched.retain(|m| !m.points.is_empty());
        matched.sort_by_key(|m| m.patch);
        matched.dedup_by(|next, kept| {
            let same = next.patch == kept.patch;
            if same {
                kept.append(next);
            }
            same
        });
    }

    /// The nearest of a point's rivals; of those that are equally near to rounding, as beyond the edge that two patches
    /// share, the first.
    fn nearest<'r>(&self, rivals: &'r [Rival]) -> &'r Rival {
        let least = rivals.iter().map(|rival| rival.d2).fold(f64::INFINITY, f64::min);
        let tie = least * (1.0 + TIE) + TIE * self.loss.sigma * self.loss.sigma;
        rivals.iter().find(|rival| rival.d2 <= tie).unwrap_or(&rivals[0])
    }
}

/// Squared distances are equal that differ, relatively, by less.
const TIE: f64 = 1e-9;

impl Matched {
    /// Keeps only some of the points, by their positions.
    pub(super) fn retain(&mut self, keep: impl Fn(&Self, usize) -> bool) {
        let kept: Vec<usize> = (0..self.points.len()).filter(|k| keep(self, *k)).collect();
        if kept.len() < self.points.len() {
            self.points = kept.iter().map(|k| self.points[*k]).collect();
            self.feet = kept.iter().map(|k| self.feet[*k]).collect();
            self.losses = kept.iter().map(|k| self.losses[*k]).collect();
        }
    }

    /// Takes all points of another one on the same patch, in the points' order: sums over them do not depend on where
    /// the points were before.
    fn append(&mut self, other: &Self) {
        let both = [&*self, other];
        let mut order: Vec<(usize, usize)> =
            (0..2).flat_map(|m| (0..both[m].points.len()).map(move |k| (m, k))).collect();
        order.sort_by_key(|(m, k)| both[*m].points[*k].index);
        let points = order.iter().map(|(m, k)| both[*m].points[*k]).collect();
        let feet = order.iter().map(|(m, k)| both[*m].feet[*k]).collect();
        let losses = order.iter().map(|(m, k)| both[*m].losses[*k]).collect();
        *self = Self { patch: self.patch, points, feet, losses };
    }
}
