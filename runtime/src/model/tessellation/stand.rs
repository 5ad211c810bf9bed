//! How triangles of a trimmed patch stand to the edge of what is there.

use super::measure::PLACES;
use super::refine::{Refinement, mix};
use crate::model::EvaluationError;
use glam::DVec3;
use std::collections::HashMap;

/// Bisections of a zero on a side where it only says whether the edge is straight.
const ROUGH_BISECTIONS: usize = 30;
/// Where between the crossings of an edge its straightness is asked for.
const ALONG: [f64; 3] = [0.25, 0.5, 0.75];
/// The corners of a triangle in barycentric coordinates.
pub(super) const CORNERS: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// The part of the chord by which the edge of a trimmed patch may leave its segments.
const SHARE: f64 = 0.5;
/// Slopes of the function below this count as this: where it is flat it says little of distances.
const LEAST_SLOPE: f64 = 1e-3;

/// Values so near to zero are on the edge, in millimetres: a tenth of what `std.solid` looks beside a surface, where
/// another one may coincide with it.
pub(super) const ZERO: f64 = 1e-7;

/// What is level where solids coincide is below this, in millimetres, and its values are the same but for this part of
/// them.
const LEVEL_BELOW: f64 = 1e-5;
const LEVEL: f64 = 0.01;
/// Where the function is less than this part of what its slope says of the distance from an edge, another is near.
const NEARER: f64 = 0.5;
/// The least number of places in a triangle that show that the function is level.
const LEAST_LEVEL: usize = 2;

/// 1 where a surface is there, -1 where it is not, 0 on its edge.
pub(super) fn sign(value: f64) -> i8 {
    match value {
        value if value > ZERO => 1,
        value if value < -ZERO => -1,
        _ => 0,
    }
}

/// Whether several values are one that is next to zero, and the others lie beyond: where surfaces of two solids
/// coincide the function is level at a small value, and so has no zero there.
fn is_level(values: &[f64]) -> bool {
    let least = values.iter().map(|value| value.abs()).fold(f64::INFINITY, f64::min);
    let level = values.iter().filter(|value| value.abs() < least * (1.0 + LEVEL)).count();
    least > ZERO && least < LEVEL_BELOW && level >= LEAST_LEVEL
}

/// The corner that is on another side than both others; of two on different sides and one on the edge, either.
fn lone(signs: [i8; 3]) -> usize {
    let is_lone = |k: &usize| signs[*k] != 0 && signs[*k] != signs[(k + 1) % 3] && signs[*k] != signs[(k + 2) % 3];
    (0..3).find(is_lone).unwrap_or(0)
}

/// Where the edge crosses two sides of a triangle, in barycentric coordinates.
pub(super) type Crossings = [[f64; 3]; 2];

/// How a triangle stands to the edge of what is there.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Stand {
    /// No change of sign, and none that could be missed.
    Clear,
    /// The edge passes through it, and is straight there.
    Crossed,
    /// It must be divided to tell.
    Unclear,
}

impl Refinement<'_> {
    /// How triangles stand, and by the place in the list where the edge crosses those in which it is bent.
    pub(super) fn stands(
        &self,
        triangles: &[usize],
        keeps: &[Option<usize>],
    ) -> Result<(Vec<Stand>, HashMap<usize, Crossings>), EvaluationError> {
        let places: Vec<[f64; 3]> = CORNERS.into_iter().chain(PLACES).collect();
        let values = self.values(triangles, &places, keeps)?;
        let mut crossed = Vec::new();
        let mut stands = Vec::with_capacity(triangles.len());
        for (k, values) in values.chunks_exact(places.len()).enumerate() {
            let stand = self.stand(triangles[k], values, &places);
            if stand == Stand::Crossed {
                crossed.push((k, [0, 1, 2].map(|c| sign(values[c]))));
            }
            stands.push(stand);
        }
        let sides: Vec<(usize, [i8; 3])> = crossed.iter().map(|(k, signs)| (triangles[*k], *signs)).collect();
        let mut bent = HashMap::new();
        for ((k, _), (straight, crossings)) in crossed.iter().zip(self.are_straight(&sides, keeps)?) {
            if self.longest_side(triangles[*k]) <= self.chord {
                continue;
            }
            let values = &values[k * places.len()..][..places.len()];
            if !straight {
                stands[*k] = Stand::Unclear;
                bent.insert(*k, crossings);
            } else if !self.is_all(triangles[*k], crossings, values, &places) {
                stands[*k] = Stand::Unclear;
            }
        }
        Ok((stands, bent))
    }

    /// How a triangle seems to stand by the values at its corners and at other places.
    fn stand(&self, triangle: usize, values: &[f64], places: &[[f64; 3]]) -> Stand {
        let has = |values: &[f64], wanted: i8| values.iter().any(|v| sign(*v) == wanted);
        if has(&values[..3], 1) && has(&values[..3], -1) {
            return Stand::Crossed;
        }
        if self.longest_side(triangle) <= self.chord {
            return Stand::Clear;
        }
        if has(values, 1) && has(values, -1) {
            return Stand::Unclear;
        }
        if is_level(values) {
            return Stand::Clear;
        }
        let slope = self.slope(triangle, values);
        let linear = |w: &[f64; 3]| (0..3).map(|k| w[k] * values[k]).sum::<f64>();
        let bend = places.iter().zip(values).map(|(w, value)| (value - linear(w)).abs()).fold(0.0, f64::max) / slope;
        let near = values.iter().map(|value| value.abs()).fold(f64::INFINITY, f64::min) / slope;
        if bend > SHARE * self.chord && near < 2.0 * bend { Stand::Unclear } else { Stand::Clear }
    }

    /// The largest slope of the function along the sides of a triangle.
    fn slope(&self, triangle: usize, values: &[f64]) -> f64 {
        let positions = self.mesh.corners(self.mesh.triangles[triangle]);
        let slope = (0..3).map(|k| {
            let next = (k + 1) % 3;
            (values[k] - values[next]).abs() / positions[k].distance(positions[next])
        });
        slope.filter(|s| s.is_finite()).fold(LEAST_SLOPE, f64::max)
    }

    /// Whether the line between its crossings is all that a triangle has of the edge, by what the function says of
    /// other places: on the side that it is, and of no edge that is nearer than the line.
    fn is_all(&self, triangle: usize, line: [[f64; 3]; 2], values: &[f64], places: &[[f64; 3]]) -> bool {
        let corners = self.mesh.corners(self.mesh.triangles[triangle]);
        let position = |w: &[f64; 3]| (0..3).map(|k| w[k] * corners[k]).sum::<DVec3>();
        let [p, q] = line.each_ref().map(position);
        let direction = (q - p).normalize_or_zero();
        let signs = [0, 1, 2].map(|k| sign(values[k]));
        let lone = lone(signs);
        let across = corners[lone] - p - direction * (corners[lone] - p).dot(direction);
        let across = across.normalize_or_zero() * f64::from(signs[lone]);
        let slope = self.slope(triangle, values);
        places.iter().zip(values).all(|(place, value)| {
            let distance = (position(place) - p).dot(across);
            let is_level = value.abs() < LEVEL_BELOW;
            distance.abs() <= self.chord
                || sign(*value) == 0
                || (value * distance > 0.0 && (is_level || value.abs() > NEARER * distance.abs() * slope))
        })
    }

    /// Whether the edge of what is there is straight in triangles with one corner on the other side than both others:
    /// by the sides of places beside the line between its two crossings. What is there at the corners is given.
    fn are_straight(
        &self,
        triangles: &[(usize, [i8; 3])],
        keeps: &[Option<usize>],
    ) -> Result<Vec<(bool, Crossings)>, EvaluationError> {
        let numbers: Vec<usize> = triangles.iter().map(|(t, _)| *t).collect();
        let lone: Vec<usize> = triangles.iter().map(|(_, signs)| lone(*signs)).collect();
        let is_there = |k: usize| triangles[k].1[lone[k]] > 0;
        let crossings = [1, 2].map(|turn| -> Result<Vec<[f64; 3]>, EvaluationError> {
            let on_edge = |k: usize| triangles[k].1[(lone[k] + turn) % 3] == 0;
            let mut range: Vec<(f64, f64)> =
                (0..triangles.len()).map(|k| if on_edge(k) { (1.0, 1.0) } else { (0.0, 1.0) }).collect();
            let place = |k: usize, s: f64| {
                let (from, to) = (CORNERS[lone[k]], CORNERS[(lone[k] + turn) % 3]);
                [0, 1, 2].map(|c| mix(from[c], to[c], s))
            };
            for _ in 0..ROUGH_BISECTIONS {
                let places: Vec<_> = range.iter().enumerate().map(|(k, (a, b))| place(k, 0.5 * (a + b))).collect();
                for (k, value) in self.values_at(&numbers, &places, keeps)?.into_iter().enumerate() {
                    let (low, high) = &mut range[k];
                    let middle = 0.5 * (*low + *high);
                    *if (value > 0.0) == is_there(k) { low } else { high } = middle;
                }
            }
            Ok(range.iter().enumerate().map(|(k, (a, b))| place(k, 0.5 * (a + b))).collect())
        });
        let [first, second] = crossings;
        let (first, second) = (first?, second?);
        let mut straight = vec![true; triangles.len()];
        for along in ALONG {
            for (towards, is_lone) in [(1.0, true), (-1.0, false)] {
                let beside = |k: usize| self.beside(numbers[k], lone[k], [first[k], second[k]], along, towards);
                let places: Vec<_> = (0..numbers.len()).map(beside).collect();
                for (k, value) in self.values_at(&numbers, &places, keeps)?.into_iter().enumerate() {
                    straight[k] &= ((value > 0.0) == is_there(k)) == is_lone;
                }
            }
        }
        Ok(straight.into_iter().zip(first.into_iter().zip(second).map(|(p, q)| [p, q])).collect())
    }

    /// A place beside the line between two places of a triangle, towards a corner of it or away, as far as the edge may
    /// leave that line.
    fn beside(&self, triangle: usize, corner: usize, line: [[f64; 3]; 2], along: f64, towards: f64) -> [f64; 3] {
        let corners = self.mesh.corners(self.mesh.triangles[triangle]);
        let position = |w: [f64; 3]| (0..3).map(|k| w[k] * corners[k]).sum::<DVec3>();
        let middle = [0, 1, 2].map(|c| mix(line[0][c], line[1][c], along));
        let [p, q, m] = [line[0], line[1], middle].map(position);
        let direction = (q - p).normalize_or_zero();
        let across = corners[corner] - m;
        let height = (across - direction * across.dot(direction)).length();
        // A step towards the corner whose height over the line is what is allowed, and not more than the corner's.
        let step = (SHARE * self.chord / height.max(f64::MIN_POSITIVE)).min(0.5) * towards;
        [0, 1, 2].map(|c| middle[c] + step * (CORNERS[corner][c] - middle[c]))
    }

    /// The value of the function at one place of each triangle.
    fn values_at(
        &self,
        triangles: &[usize],
        places: &[[f64; 3]],
        keeps: &[Option<usize>],
    ) -> Result<Vec<f64>, EvaluationError> {
        let mut values = Vec::with_capacity(triangles.len());
        let mut first = 0;
        for run in triangles.chunk_by(|a, b| self.patches[*a] == self.patches[*b]) {
            let at = run.iter().zip(&places[first..]).map(|(triangle, weights)| self.uv(*triangle)(*weights));
            let (u, v): (Vec<f64>, Vec<f64>) = at.map(|(u, v)| (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0))).unzip();
            first += run.len();
            let Some(keep) = keeps[self.patches[run[0]] as usize] else { continue };
            values.extend(self.keep_at(keep, &u, &v)?);
        }
        Ok(values)
    }
}
