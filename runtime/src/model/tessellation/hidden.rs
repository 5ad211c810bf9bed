//! What the places that are asked of a triangle do not show: a hole in a face whose function of what is there is capped
//! by something nearer everywhere, as by the depth of the plate below it.
//!
//! The function changes hardly faster than distances do. So a value says of what is within it in every direction that
//! it is on one side of zero; where that does not reach, a triangle is looked at more closely.

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
/// The most cells at a time of a batch of triangles (`trim`): 400 for each. A thread takes 20 megabytes for them.
const MOST_CELLS: usize = 200_000;

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

/// A part of a triangle, by its corners in barycentric coordinates.
struct Cell {
    /// The triangle's place in the list.
    of: usize,
    corners: [[f64; 3]; 3],
}

impl Cell {
    fn middle(&self) -> [f64; 3] {
        [0, 1, 2].map(|c| self.corners.iter().map(|w| w[c]).sum::<f64>() / 3.0)
    }

    /// How far its corners are from its middle.
    fn reach(&self, position: &impl Fn([f64; 3]) -> DVec3) -> f64 {
        let middle = position(self.middle());
        self.corners.iter().map(|w| position(*w).distance(middle)).fold(0.0, f64::max)
    }

    /// Both halves, from the middle of its longest side.
    fn halves(&self, position: &impl Fn([f64; 3]) -> DVec3) -> [Self; 2] {
        let side = |k: usize| position(self.corners[k]).distance_squared(position(self.corners[(k + 1) % 3]));
        let first = (1..3).fold(0, |best, k| if side(k) > side(best) { k } else { best });
        let [a, b, c] = [0, 1, 2].map(|k| self.corners[(first + k) % 3]);
        let middle = between(a, b, 0.5);
        [[a, middle, c], [middle, b, c]].map(|corners| Self { of: self.of, corners })
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
        let ways: Vec<_> = triangles.iter().map(|t| (self.uv(t.triangle), self.position(t.triangle))).collect();
        let mut cells = self.near_zero(triangles, keeps)?;
        // The parts become finer than what is looked for, so that there is an end.
        while !cells.is_empty() && cells.len() <= MOST_CELLS {
            let numbers: Vec<usize> = cells.iter().map(|cell| triangles[cell.of].triangle).collect();
            let middle = |cell: &Cell| {
                let (u, v) = ways[cell.of].0(cell.middle());
                [u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)]
            };
            let middles: Vec<[f64; 2]> = cells.iter().map(middle).collect();
            let values = self.keeps_at(&numbers, &middles, keeps)?;
            let mut next = Vec::new();
            for (cell, value) in cells.iter().zip(values) {
                let (seen, position) = (&triangles[cell.of], &ways[cell.of].1);
                let expected = seen.expected(position(cell.middle()), self.chord);
                hide[cell.of] |= sign(value) * expected < 0;
                let reach = cell.reach(position);
                if !hide[cell.of] && reach > finest[cell.of] && value.abs() < STEEPEST * reach {
                    next.extend(cell.halves(position));
                }
            }
            next.retain(|cell| !hide[cell.of]);
            cells = next;
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
        let mut cells = Vec::new();
        for ((group, value), place) in groups.iter().zip(values).zip(places) {
            let place = DVec3::from_array(place.point);
            let distance = |i: u32| DVec3::from_array(self.mesh.positions[i as usize]).distance(place);
            let reach = group.iter().flat_map(corners).map(distance).fold(self.chord, f64::max);
            let is_clear = |k: &usize| {
                matches!(triangles[*k].side, Side::Whole(side) if side == sign(value)) && value.abs() > STEEPEST * reach
            };
            cells.extend(group.iter().filter(|k| !is_clear(k)).map(|k| Cell { of: *k, corners: CORNERS }));
        }
        Ok(cells)
    }
}
