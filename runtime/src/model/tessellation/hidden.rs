//! What the places that are asked of a triangle do not show: a hole in a face whose function of what is there is capped
//! by something nearer everywhere, as by the depth of the plate below it.
//!
//! The function changes hardly faster than distances do. So a value says of what is within it in every direction that
//! it is on one side of zero; where that does not reach, a triangle is looked at more closely.

use super::level::LEVEL_BELOW;
use super::refine::{Refinement, between};
use super::stand::{CORNERS, sign};
use crate::model::EvaluationError;
use glam::DVec3;

/// How much faster than distances the function may change: that of a cone is the distance along its radius.
const STEEPEST: f64 = 1.5;
/// A triangle is looked at down to this part of its longest side, which is halved at each step: of slender ones, as a
/// cylinder has, four parts of the same form would be as much finer across as they are along.
const FINEST: f64 = 1.0 / 64.0;
/// Triangles whose longest side is so many chords hide nothing that is larger than a few of them, and parts of larger
/// ones are not looked at more closely than that: along an edge that is known there is no end of them. (Down to a chord
/// the mesh of a window with 54 parts takes twice as long.)
const SMALL: f64 = 16.0;
/// How far the corners of a triangle of equal sides are from its middle, in sides.
const REACH: f64 = 0.58;
/// How many triangles that follow each other, and so are mostly neighbours, are looked at as one at first.
const GROUP: usize = 32;
/// The most cells that are looked at for each triangle of a batch (`trim`).
const MOST_CELLS: usize = 4000;
/// How many cells are looked at at a time: enough that evaluating many places at once pays, and few enough that they
/// stay in the processor's cache.
const AT_A_TIME: usize = 1024;

/// A triangle, and what the places that were asked say of it.
pub(super) struct Seen {
    pub(super) triangle: usize,
    pub(super) side: Side,
}

/// On which side of zero a triangle seems to be.
pub(super) enum Side {
    /// All of it on one.
    Whole(i8),
    /// On both, divided by a straight line.
    Divided(Divided),
}

/// A line between two sides of a triangle: how far a place is beyond it, on the positive side of the function.
pub(super) struct Divided {
    pub(super) from: DVec3,
    pub(super) across: DVec3,
}

impl Divided {
    pub(super) fn beyond(&self, at: DVec3) -> f64 {
        (at - self.from).dot(self.across)
    }
}

impl Seen {
    /// The side of zero at a place, 0 where it may be either: next to the line.
    fn expected(&self, at: DVec3, chord: f64) -> i8 {
        match &self.side {
            Side::Whole(side) => *side,
            Side::Divided(line) => match line.beyond(at) {
                beyond if beyond > chord => 1,
                beyond if beyond < -chord => -1,
                _ => 0,
            },
        }
    }
}

/// A part of a triangle.
struct Cell {
    /// The triangle's place in the list.
    of: usize,
    /// Its corners in barycentric coordinates of the triangle, and in space.
    weights: [[f64; 3]; 3],
    corners: [DVec3; 3],
}

impl Cell {
    /// Barycentric coordinates of its middle.
    fn middle(&self) -> [f64; 3] {
        let [a, b, c] = self.weights;
        [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
    }

    /// Its middle in space, and how far its corners are from there.
    fn ball(&self) -> (DVec3, f64) {
        let [a, b, c] = self.corners;
        let middle = (a + b + c) / 3.0;
        (middle, [a, b, c].map(|corner| corner.distance_squared(middle)).into_iter().fold(0.0, f64::max).sqrt())
    }

    /// Both halves, from the middle of its longest side.
    fn halves(&self) -> [Self; 2] {
        let side = |k: usize| self.corners[k].distance_squared(self.corners[(k + 1) % 3]);
        let first = (1..3).fold(0, |best, k| if side(k) > side(best) { k } else { best });
        let [i, j, k] = [first, (first + 1) % 3, (first + 2) % 3];
        let (w, p) = (self.weights, self.corners);
        let (weights, middle) = (between(w[i], w[j], 0.5), (p[i] + p[j]) * 0.5);
        [([w[i], weights, w[k]], [p[i], middle, p[k]]), ([weights, w[j], w[k]], [middle, p[j], p[k]])]
            .map(|(weights, corners)| Self { of: self.of, weights, corners })
    }
}

impl Refinement<'_> {
    /// Whether a triangle can hide something that is larger than a few chords.
    pub(super) fn is_large(&self, triangle: usize) -> bool {
        self.longest_side(triangle) > SMALL * self.chord
    }

    /// Which of some triangles have a place on the other side of zero than is said of each.
    pub(super) fn hide(&self, triangles: &[Seen], keeps: &[Option<usize>]) -> Result<Vec<bool>, EvaluationError> {
        let mut hide = vec![false; triangles.len()];
        let least = 0.5 * SMALL * self.chord;
        let finest = |seen: &Seen| least.max(REACH * FINEST * self.longest_side(seen.triangle));
        let finest: Vec<f64> = triangles.iter().map(finest).collect();
        let ways: Vec<_> = triangles.iter().map(|t| self.uv(t.triangle)).collect();
        let mut cells = self.near_zero(triangles, keeps)?;
        let mut looked_at = 0;
        // The parts become finer than what is looked for, so that there is an end.
        while !cells.is_empty() && looked_at < MOST_CELLS * triangles.len() {
            let mut batch = cells.split_off(cells.len().saturating_sub(AT_A_TIME));
            batch.retain(|cell| !hide[cell.of]);
            looked_at += batch.len();
            let numbers: Vec<usize> = batch.iter().map(|cell| triangles[cell.of].triangle).collect();
            let middle = |cell: &Cell| {
                let (u, v) = ways[cell.of](cell.middle());
                [u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)]
            };
            let middles: Vec<[f64; 2]> = batch.iter().map(middle).collect();
            let values = self.keeps_at(&numbers, &middles, keeps)?;
            for (cell, value) in batch.iter().zip(values) {
                if hide[cell.of] {
                    continue;
                }
                let (middle, reach) = cell.ball();
                hide[cell.of] = sign(value) * triangles[cell.of].expected(middle, self.chord) < 0;
                let finest =
                    if value.abs() < LEVEL_BELOW { finest[cell.of].max(self.finest_level) } else { finest[cell.of] };
                if !hide[cell.of] && reach > finest && value.abs() < STEEPEST * reach {
                    cells.extend(cell.halves());
                }
            }
        }
        Ok(hide)
    }

    /// The large ones of some triangles, without those of groups that are far from zero as a whole: most of a wall of
    /// which a small part is there are slender triangles, each of which alone is near it for its length.
    fn near_zero(&self, triangles: &[Seen], keeps: &[Option<usize>]) -> Result<Vec<Cell>, EvaluationError> {
        let large: Vec<usize> = (0..triangles.len()).filter(|k| self.is_large(triangles[*k].triangle)).collect();
        let patch = |k: &usize| self.patches[triangles[*k].triangle];
        let groups: Vec<&[usize]> =
            large.chunk_by(|a, b| patch(a) == patch(b)).flat_map(|of_patch| of_patch.chunks(GROUP)).collect();
        let corners = |k: &usize| self.mesh.triangles[triangles[*k].triangle];
        // A place of the patch among their corners.
        let middle = |group: &&[usize]| {
            let all = group.iter().flat_map(corners).map(|i| &self.origins[i as usize]);
            let [u, v] = all.fold([0.0; 2], |[u, v], at| [u + at.u, v + at.v]);
            [u, v].map(|sum| sum / (3 * group.len()) as f64)
        };
        let middles: Vec<[f64; 2]> = groups.iter().map(middle).collect();
        let numbers: Vec<usize> = groups.iter().map(|group| triangles[group[0]].triangle).collect();
        let values = self.keeps_at(&numbers, &middles, keeps)?;
        let places = self.partials_at(&numbers, &middles)?;
        let cell = |of: usize| Cell {
            of,
            weights: CORNERS,
            corners: self.mesh.corners(self.mesh.triangles[triangles[of].triangle]),
        };
        let mut cells = Vec::new();
        for ((group, value), place) in groups.iter().zip(values).zip(places) {
            let place = DVec3::from_array(place.point);
            let distance = |i: u32| DVec3::from_array(self.mesh.positions[i as usize]).distance(place);
            let reach = group.iter().flat_map(corners).map(distance).fold(self.chord, f64::max);
            let is_clear = |k: &usize| {
                matches!(triangles[*k].side, Side::Whole(side) if side == sign(value)) && value.abs() > STEEPEST * reach
            };
            cells.extend(group.iter().filter(|k| !is_clear(k)).map(|k| cell(*k)));
        }
        Ok(cells)
    }
}
