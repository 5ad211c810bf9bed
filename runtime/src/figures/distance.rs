//! The least distance between parts, and its derivatives.
//!
//! Between two surfaces the nearest two places are each the foot of the other: from a vertex of fine triangles and the
//! facet nearest to it, feet are looked for to and fro (von Neumann's alternating projections, 1933, on what is convex)
//! until the distance settles. The places need not be followed for derivatives (envelope theorem): only how surfaces,
//! and the edges that hold a foot, move towards each other.

use super::{Taken, largest_triangle, motions};
use crate::feet::facets::Facets;
use crate::feet::foot::{self, Foot};
use crate::feet::layout::Layout;
use crate::feet::nearest::{Nearest, Query};
use crate::model::{EvaluationError, Instance, Model, Tessellation};
use glam::{DVec2, DVec3};

/// The chord of the facets of the first search, as a part of the model's size.
const CHORD: f64 = 1e-3;
/// Feet are exact to this part of the size.
const FOOT: f64 = 1e-9;
/// Parts that are nearer to each other than this part of the size meet: shared edges are that near.
const MEETS: f64 = 1e-7;
/// Rounds to and fro at most. Each takes two feet, some microseconds; between surfaces at a right angle to what joins
/// them few are needed, between two that are nearly parallel many.
const ROUNDS: usize = 4000;
/// The distance has settled where all further rounds, by the last two, would change it by less than this part of the
/// size.
const SETTLED: f64 = 1e-12;
/// Places stand still that move by less than this part of the size in a round: a hundred times what feet are exact to.
const STILL: f64 = 1e-7;
/// Changes below this part of the size, and of the distance from the origin, are rounding.
const ROUNDING: f64 = 1e-15;
/// Pairs of places farther apart than this part of the size are looked at both; so many in each pair of patches.
const APART: f64 = 0.02;
const MOST_PAIRS: usize = 8;
/// Pairs whose distances differ by less than this part of the size are as near.
const TIED: f64 = 1e-8;
/// By how much derivatives of pairs that are as near may differ: relative to the largest.
const SAME_SLOPES: f64 = 1e-5;
/// The largest part of the pull across an edge that may be left where the edge holds a foot: more is a corner, which
/// two edges hold.
const CORNER: f64 = 1e-3;
/// From a corner of a trimmed patch the function of what is there says no way: its feet are also looked for from beside
/// there, this part of the way towards the middle of a triangle.
const BESIDE: f64 = 1e-4;

/// Two places, the second of the other parts.
#[derive(Clone, Copy)]
struct Pair {
    places: [Place; 2],
    distance: f64,
    /// By how much further rounds would lower it.
    rest: f64,
}

/// The patches and (u, v) of two places to start from.
type Start = [(usize, [f64; 2]); 2];

/// A place on a patch.
#[derive(Clone, Copy)]
struct Place {
    patch: usize,
    foot: Foot,
}

/// The model, and the facets of both among which the nearest places are searched.
struct Search<'a> {
    model: &'a dyn Model,
    instance: &'a dyn Instance,
    layouts: [Layout; 2],
    /// By patch the middle of the largest triangle that is there, in (u, v).
    middles: Vec<Option<[f64; 2]>>,
    /// Diagonal of the model. Millimetres.
    size: f64,
}

/// The part of a distance by which the rounds to come may still shorten it: where surfaces touch it falls with the
/// number of rounds, and never settles.
const UNKNOWN: f64 = 0.05;

/// The least distance between parts, and its derivatives by every parameter, or why there are none.
///
/// # Errors
/// A sentence on why it has no value: nothing is left of parts, or they meet.
pub(super) fn least(
    model: &dyn Model,
    instance: &dyn Instance,
    fine: &Tessellation,
    parts: [&[usize]; 2],
) -> Result<Taken, String> {
    let size = fine.mesh.bounds().diagonal();
    let middles: Vec<Option<[f64; 2]>> = (0..model.parts().len()).map(|patch| middle(fine, patch)).collect();
    // Of parts of which nothing is left, facets at their borders may still seem to be there.
    let is_left = |patch: &usize| middles[*patch].is_some();
    let left = parts.map(|of| of.iter().copied().filter(is_left).collect::<Vec<usize>>());
    let layouts =
        left.each_ref().map(|of| Layout::of_patches(model, instance, CHORD * size, size, |p| of.contains(&p)));
    let search = Search { model, instance, layouts, middles, size };
    search.least(fine, parts).map_err(|error| error.message)?
}

impl Search<'_> {
    fn least(&self, fine: &Tessellation, parts: [&[usize]; 2]) -> Result<Result<Taken, String>, EvaluationError> {
        let mut pairs = Vec::new();
        for start in self.starts(fine, parts) {
            pairs.extend(self.settled(start)?);
        }
        pairs.sort_by(|a: &Pair, b| a.distance.total_cmp(&b.distance));
        let Some(nearest) = pairs.first() else {
            return Ok(Err("nothing is left of one of its parts".to_owned()));
        };
        let names = nearest.places.map(|place| &self.model.parts()[place.patch].name);
        let [x, y, z] = nearest.places[0].foot.point.to_array();
        let [a, b] = names;
        if nearest.distance < MEETS * self.size {
            return Ok(Err(format!("'{a}' and '{b}' meet near ({x:.3}, {y:.3}, {z:.3}) mm: they have no distance")));
        }
        if nearest.rest > UNKNOWN * nearest.distance {
            return Ok(Err(format!(
                "'{a}' and '{b}' touch near ({x:.3}, {y:.3}, {z:.3}) mm, or all but: their distance is not known there"
            )));
        }
        let tied = pairs.iter().take_while(|pair| pair.distance < nearest.distance + TIED * self.size);
        Ok(Ok((nearest.distance, self.slopes(&tied.copied().collect::<Vec<_>>())?)))
    }

    /// Places to start from.
    fn starts(&self, fine: &Tessellation, parts: [&[usize]; 2]) -> Vec<Start> {
        let mut found: Vec<(f64, DVec3, Start)> = Vec::new();
        let mut least = f64::INFINITY;
        // Either side may be off by a chord, and facets by theirs.
        let margin = 2.0 * fine.chord + self.layouts.iter().map(Layout::rivalry).fold(0.0, f64::max);
        for side in 0..2 {
            let facets = self.layouts[1 - side].facets(self.instance);
            for (vertex, origin) in fine.mesh.positions.iter().zip(&fine.origins) {
                let patch = origin.patch as usize;
                if !parts[side].contains(&patch) {
                    continue;
                }
                let q = DVec3::from_array(*vertex);
                let Some((distance, nearest)) = nearest(&facets, q, least + margin) else { continue };
                least = least.min(distance);
                let mut pair = [(patch, [origin.u, origin.v]), (nearest.patch as usize, nearest.uv)];
                if side == 1 {
                    pair.reverse();
                }
                found.push((distance, q, pair));
            }
        }
        found.retain(|(distance, ..)| *distance <= least + margin);
        found.sort_by(|(a, ..), (b, ..)| a.total_cmp(b));
        let mut chosen: Vec<(DVec3, Start)> = Vec::new();
        for (_, q, pair) in found {
            let patches = |pair: &Start| pair.map(|(patch, _)| patch);
            let same = || chosen.iter().filter(|(_, other)| patches(other) == patches(&pair));
            if same().count() < MOST_PAIRS && same().all(|(other, _)| other.distance(q) > APART * self.size) {
                chosen.push((q, pair));
            }
        }
        chosen.into_iter().map(|(_, pair)| pair).collect()
    }

    /// The nearest two places about others; none where nothing is there.
    fn settled(&self, start: Start) -> Result<Option<Pair>, EvaluationError> {
        let foot = |side: usize, q: DVec3, uv: [f64; 2]| self.foot(side, start[side].0, q, uv);
        let mut first = Foot { uv: start[0].1, ..Foot::default() };
        let mut point = [[0.0; 3]];
        self.instance.points(start[0].0, &[first.uv[0]], &[first.uv[1]], &mut point)?;
        first.point = DVec3::from_array(point[0]);
        let mut second = foot(1, first.point, start[1].1)?;
        let (mut distance, mut change, mut rest) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
        for _ in 0..ROUNDS {
            let before = first.point;
            first = foot(0, second.point, first.uv)?;
            second = foot(1, first.point, second.uv)?;
            let now = second.d2.sqrt();
            if !(first.d2.is_finite() && now.is_finite()) {
                return Ok(None);
            }
            let (last, step, grew) = (change, (distance - now).abs(), now > distance);
            (distance, change) = (now, step);
            // Feet to and fro never grow apart: by so much they are exact. On what is nearly parallel they still move.
            if grew && step <= FOOT * self.size && before.distance(first.point) <= STILL * self.size {
                rest = step;
                break;
            }
            // Steps shrink by a factor, which gives the sum of those to come.
            let ratio = if last.is_finite() { (step / last).min(1.0) } else { 1.0 };
            rest =
                if step <= ROUNDING * (self.size + second.point.length()) { 0.0 } else { step * ratio / (1.0 - ratio) };
            if rest <= SETTLED * self.size {
                break;
            }
        }
        // The first is the foot of the second, and holds as it does there.
        first = foot(0, second.point, first.uv)?;
        let [a, b] = [start[0].0, start[1].0];
        let places = [Place { patch: a, foot: first }, Place { patch: b, foot: second }];
        Ok(Some(Pair { places, distance: first.point.distance(second.point), rest }))
    }

    /// The foot of a point on what is there of a patch, from near a place.
    fn foot(&self, side: usize, patch: usize, q: DVec3, uv: [f64; 2]) -> Result<Foot, EvaluationError> {
        let feet = |from: &[[f64; 2]]| {
            self.layouts[side].grid(patch).feet(self.instance, patch, &vec![q; from.len()], from, FOOT * self.size)
        };
        let Some(middle) = self.middles[patch].filter(|_| self.model.keep(patch).is_some()) else {
            return Ok(feet(&[uv])?[0]);
        };
        let beside = [0, 1].map(|k| uv[k] + BESIDE * (middle[k] - uv[k]));
        let feet = feet(&[uv, beside])?;
        Ok(if feet[1].d2 < feet[0].d2 { feet[1] } else { feet[0] })
    }

    /// The derivatives of the distance by every parameter, which must be the same for all pairs that are as near.
    fn slopes(&self, tied: &[Pair]) -> Result<Result<Vec<f64>, String>, EvaluationError> {
        let mut all: Option<Vec<f64>> = None;
        for pair in tied {
            if pair.rest > TIED * self.size {
                let why = "the nearest places are not known well enough: both surfaces are nearly parallel there";
                return Ok(Err(why.to_owned()));
            }
            let slopes = match self.of_pair(pair)? {
                Ok(slopes) => slopes,
                Err(why) => return Ok(Err(why)),
            };
            if let Some(first) = &all {
                let largest = first.iter().chain(&slopes).fold(0.0_f64, |most, slope| most.max(slope.abs()));
                if first.iter().zip(&slopes).any(|(a, b)| (a - b).abs() > SAME_SLOPES * largest) {
                    let why = "several places are as near, so that the least distance has a corner here";
                    return Ok(Err(why.to_owned()));
                }
            }
            all.get_or_insert(slopes);
        }
        Ok(Ok(all.unwrap_or_default()))
    }

    fn of_pair(&self, pair: &Pair) -> Result<Result<Vec<f64>, String>, EvaluationError> {
        let mut slopes = vec![0.0; self.model.parameters().len()];
        let [a, b] = pair.places;
        let towards = (b.foot.point - a.foot.point) / pair.distance;
        for (place, away) in [(a, towards), (b, -towards)] {
            let Place { patch, foot } = place;
            let active = &self.model.parts()[patch].active;
            let of_feet = foot::motions(self.instance, patch, &[foot], active.len())?;
            for (parameter, motion) in active.iter().zip(of_feet.chunks_exact(3)) {
                slopes[*parameter as usize] -= away.dot(DVec3::from_slice(motion));
            }
            let Some(keep) = self.model.keep(patch).filter(|_| foot.hold != 0.0) else { continue };
            if self.is_at_corner(&place, keep, away * pair.distance)? {
                let name = &self.model.parts()[patch].name;
                return Ok(Err(format!("the nearest place of '{name}' is a corner that several edges make")));
            }
            let active = self.model.keep_active(patch);
            for (parameter, motion) in active.iter().zip(motions(self.instance, keep, active.len(), foot.uv)?) {
                slopes[*parameter as usize] -= foot.hold / pair.distance * motion.x;
            }
        }
        Ok(Ok(slopes))
    }

    /// Whether more than the edge that the function of what is there makes holds a foot: what pulls it along that edge.
    fn is_at_corner(&self, place: &Place, keep: usize, pull: DVec3) -> Result<bool, EvaluationError> {
        let ([u, v], mut at) = (place.foot.uv, [Default::default()]);
        self.instance.partials(place.patch, &[u], &[v], &mut at)?;
        let (du, dv) = (DVec3::from_array(at[0].du), DVec3::from_array(at[0].dv));
        self.instance.partials(keep, &[u], &[v], &mut at)?;
        let slope = DVec2::new(at[0].du[0], at[0].dv[0]);
        // Along the edge the function does not change.
        let along = slope.perp();
        let along = (du * along.x + dv * along.y).normalize_or_zero();
        let normal = place.foot.normal.normalize_or_zero();
        let within = pull - normal * pull.dot(normal);
        Ok(within.dot(along).abs() > CORNER * pull.length())
    }
}

/// The middle of the largest triangle of a patch, in (u, v).
fn middle(fine: &Tessellation, patch: usize) -> Option<[f64; 2]> {
    let corners = largest_triangle(fine, patch)?.map(|i| fine.origins[i as usize]);
    Some([corners.iter().map(|c| c.u).sum::<f64>() / 3.0, corners.iter().map(|c| c.v).sum::<f64>() / 3.0])
}

/// The nearest point of facets within a distance, with its own.
fn nearest(facets: &Facets<'_>, q: DVec3, within: f64) -> Option<(f64, Nearest)> {
    let nearest = facets.nearest(Query::new(q, within))?;
    Some((facets.distance(q, within), nearest))
}
