//! How triangles of a trimmed patch stand to the edge of what is there.

use super::hidden::{Divided, Seen, Side};
use super::level::{LEVEL_BELOW, is_level};
use super::measure::PLACES;
use super::refine::{Refinement, between};
use super::stitch::step;
use crate::model::{Bracket, EvaluationError, Partials, narrow};
use glam::DVec3;
use std::collections::HashMap;

/// The width to which the zero on a side is narrowed where it only says whether the edge is straight, as a part of the
/// side.
const ROUGH: f64 = 1e-9;
/// Where between the crossings of an edge its straightness is asked for.
const ALONG: [f64; 3] = [0.5, 0.25, 0.75];
/// Newton's steps from where a place on the line between them is roughly in (u, v): that is off by the square of the
/// length of the triangle, and each step squares what is left.
const FOOT_STEPS: usize = 2;
/// The corners of a triangle in barycentric coordinates.
pub(super) const CORNERS: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// The part of the chord by which the edge of a trimmed patch may leave its segments.
const SHARE: f64 = 0.5;
/// Slopes of the function below this count as this: where it is flat it says little of distances.
const LEAST_SLOPE: f64 = 1e-3;

/// Values so near to zero are on the edge, in millimetres: a tenth of what `std.solid` looks beside a surface, where
/// another one may coincide with it.
pub(super) const ZERO: f64 = 1e-7;
/// Triangles whose longest side is so many chords hide nothing between the places that are asked of them, which are a
/// quarter of that apart.
const TINY: f64 = 4.0;
/// Where the function is less than this part of what its slope says of the distance from an edge, another is near.
const NEARER: f64 = 0.5;

/// 1 where a surface is there, -1 where it is not, 0 on its edge.
pub(super) fn sign(value: f64) -> i8 {
    match value {
        value if value > ZERO => 1,
        value if value < -ZERO => -1,
        _ => 0,
    }
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
    /// No change of sign at the places that were asked, some of which are where solids coincide.
    Level,
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
        let (mut crossed, mut level) = (Vec::new(), Vec::new());
        let mut stands = Vec::with_capacity(triangles.len());
        for (k, values) in values.chunks_exact(places.len()).enumerate() {
            let stand = self.stand(triangles[k], values, &places);
            if stand == Stand::Crossed {
                crossed.push((k, [values[0], values[1], values[2]]));
            }
            level.extend((stand == Stand::Level).then_some((k, (triangles[k], values))));
            stands.push(stand);
        }
        let with_level: Vec<(usize, &[f64])> = level.iter().map(|(_, triangle)| *triangle).collect();
        for ((k, _), ends) in level.iter().zip(self.end_beside_level(&with_level, &places, keeps)?) {
            stands[*k] = if ends { Stand::Unclear } else { Stand::Clear };
        }
        let sides: Vec<(usize, [f64; 3])> = crossed.iter().map(|(k, values)| (triangles[*k], *values)).collect();
        let mut bent = HashMap::new();
        let mut divided = HashMap::new();
        for ((k, at_corners), (straight, crossings)) in crossed.iter().zip(self.are_straight(&sides, keeps)?) {
            if self.longest_side(triangles[*k]) <= self.chord {
                continue;
            }
            let values = &values[k * places.len()..][..places.len()];
            let line = self.line(triangles[*k], at_corners.map(sign), crossings);
            if !straight {
                stands[*k] = Stand::Unclear;
                bent.insert(*k, crossings);
            } else if !self.is_all(triangles[*k], &line, values, &places) {
                stands[*k] = Stand::Unclear;
            } else {
                divided.insert(*k, line);
            }
        }
        let side = |k: usize| values[k * places.len()..][..places.len()].iter().map(|value| sign(*value));
        let (mut looked_at, mut seen) = (Vec::new(), Vec::new());
        for k in 0..stands.len() {
            let side = match (stands[k], divided.remove(&k)) {
                (Stand::Clear, _) => Side::Whole(side(k).find(|side| *side != 0).unwrap_or(0)),
                (_, Some(line)) => Side::Divided(line),
                _ => continue,
            };
            looked_at.push(k);
            seen.push(Seen { triangle: triangles[k], side });
        }
        for (k, _) in looked_at.iter().zip(self.hide(&seen, keeps)?).filter(|(_, hides)| *hides) {
            stands[*k] = Stand::Unclear;
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
            return Stand::Level;
        }
        if self.grows_from_corners(triangle, values, places) {
            return Stand::Clear;
        }
        // Beside an edge along which solids are tangent a function grows with the square of the distance, and by its
        // own slope no triangle would be small enough: in small ones its values are distances.
        let slope = self.slope(triangle, values);
        let slope = if self.is_large(triangle) { slope } else { slope.max(1.0) };
        let linear = |w: &[f64; 3]| (0..3).map(|k| w[k] * values[k]).sum::<f64>();
        let bend = places.iter().zip(values).map(|(w, value)| (value - linear(w)).abs()).fold(0.0, f64::max) / slope;
        let near = values.iter().map(|value| value.abs()).fold(f64::INFINITY, f64::min) / slope;
        if bend > SHARE * self.chord && near < 2.0 * bend { Stand::Unclear } else { Stand::Clear }
    }

    /// Whether the function is zero at one or two corners of a triangle only, and grows from there as it does along its
    /// sides: there is no edge but that on which these corners are. Beside the corner of a slot it has a crease.
    fn grows_from_corners(&self, triangle: usize, values: &[f64], places: &[[f64; 3]]) -> bool {
        let corners = self.mesh.corners(self.mesh.triangles[triangle]);
        let on_edge: Vec<DVec3> = (0..3).filter(|k| sign(values[*k]) == 0).map(|k| corners[k]).collect();
        let (from, to) = match on_edge[..] {
            [one] => (one, one),
            [one, other] => (one, other),
            _ => return false,
        };
        let position = self.position(triangle);
        let slope = self.slope(triangle, values);
        let along = to - from;
        places.iter().zip(values).all(|(place, value)| {
            let at = position(*place) - from;
            let s = (at.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            value.abs() >= NEARER * slope * at.distance(along * s) - ZERO
        })
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

    /// The line between the crossings of a triangle whose corners are on some sides of zero.
    fn line(&self, triangle: usize, signs: [i8; 3], crossings: Crossings) -> Divided {
        let corners = self.mesh.corners(self.mesh.triangles[triangle]);
        let [p, q] = crossings.map(self.position(triangle));
        let direction = (q - p).normalize_or_zero();
        let lone = lone(signs);
        let across = corners[lone] - p - direction * (corners[lone] - p).dot(direction);
        Divided { from: p, across: across.normalize_or_zero() * f64::from(signs[lone]) }
    }

    /// Whether the line between its crossings is all that a triangle has of the edge, by what the function says of
    /// other places: on the side that it is, and of no edge that is nearer than the line.
    fn is_all(&self, triangle: usize, line: &Divided, values: &[f64], places: &[[f64; 3]]) -> bool {
        let position = self.position(triangle);
        let slope = self.slope(triangle, values);
        let is_tiny = self.longest_side(triangle) <= TINY * self.chord;
        places.iter().zip(values).all(|(place, value)| {
            let distance = line.beyond(position(*place));
            let says_little = value.abs() < LEVEL_BELOW || is_tiny;
            distance.abs() <= self.chord
                || sign(*value) == 0
                || (value * distance > 0.0 && (says_little || value.abs() > NEARER * distance.abs() * slope))
        })
    }

    /// Whether the edge of what is there is straight in triangles with one corner on the other side than both others:
    /// by the sides of places beside the line between its two crossings. The values at the corners are given.
    fn are_straight(
        &self,
        triangles: &[(usize, [f64; 3])],
        keeps: &[Option<usize>],
    ) -> Result<Vec<(bool, Crossings)>, EvaluationError> {
        let numbers: Vec<usize> = triangles.iter().map(|(t, _)| *t).collect();
        let lone: Vec<usize> = triangles.iter().map(|(_, values)| lone(values.map(sign))).collect();
        let is_there = |k: usize| triangles[k].1[lone[k]] > 0.0;
        let crossings = [1, 2].map(|turn| -> Result<Vec<[f64; 3]>, EvaluationError> {
            let side = |(k, (_, values)): (usize, &(usize, [f64; 3]))| {
                let values = [values[lone[k]], values[(lone[k] + turn) % 3]];
                // From a corner that is on the edge there is nothing to go.
                Bracket { from: if sign(values[1]) == 0 { 1.0 } else { 0.0 }, to: 1.0, values }
            };
            let mut zeros: Vec<Bracket> = triangles.iter().enumerate().map(side).collect();
            let place = |k: usize, s: f64| between(CORNERS[lone[k]], CORNERS[(lone[k] + turn) % 3], s);
            narrow(&mut zeros, ROUGH, |which, at| {
                let of: Vec<usize> = which.iter().map(|k| numbers[*k]).collect();
                let places: Vec<_> = which.iter().zip(at).map(|(k, s)| place(*k, *s)).collect();
                self.values_at(&of, &places, keeps)
            })?;
            Ok(zeros.iter().enumerate().map(|(k, zero)| place(k, zero.middle())).collect())
        });
        let [first, second] = crossings;
        let (first, second) = (first?, second?);
        let ends = [self.points_at(&numbers, &first)?, self.points_at(&numbers, &second)?];
        let mut straight = vec![true; triangles.len()];
        for along in ALONG {
            for (towards, is_lone) in [(1.0, true), (-1.0, false)] {
                // Most that are bent are so in the middle.
                let left: Vec<usize> = (0..numbers.len()).filter(|k| straight[*k]).collect();
                let beside = |k: &usize| {
                    let ends = [ends[0][*k], ends[1][*k]];
                    self.beside(numbers[*k], lone[*k], [first[*k], second[*k]], ends, along, towards)
                };
                let (places, targets): (Vec<_>, Vec<_>) = left.iter().map(beside).unzip();
                let of_left: Vec<usize> = left.iter().map(|k| numbers[*k]).collect();
                let places = self.feet(&of_left, places, &targets)?;
                for (k, value) in left.into_iter().zip(self.keeps_at(&of_left, &places, keeps)?) {
                    straight[k] = ((value > 0.0) == is_there(k)) == is_lone;
                }
            }
        }
        Ok(straight.into_iter().zip(first.into_iter().zip(second).map(|(p, q)| [p, q])).collect())
    }

    /// A place beside the line in space between the ends of the edge in a triangle, towards a corner of it or away, as
    /// far as the edge may leave that line: roughly where it is in (u, v), and in space. In the polar coordinates of a
    /// disc what is straight in (u, v) is not so in space.
    fn beside(
        &self,
        triangle: usize,
        corner: usize,
        line: [[f64; 3]; 2],
        [p, q]: [DVec3; 2],
        along: f64,
        towards: f64,
    ) -> ([f64; 2], DVec3) {
        let middle = p.lerp(q, along);
        let direction = (q - p).normalize_or_zero();
        let to_corner = self.mesh.corners(self.mesh.triangles[triangle])[corner] - middle;
        let across = to_corner - direction * to_corner.dot(direction);
        // A step towards the corner whose height over the line is what is allowed, and not more than half the corner's.
        let step = (SHARE * self.chord / across.length().max(f64::MIN_POSITIVE)).min(0.5) * towards;
        let rough = between(between(line[0], line[1], along), CORNERS[corner], step);
        let (u, v) = self.uv(triangle)(rough);
        ([u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)], middle + to_corner * step)
    }

    /// The places in space of places in triangles.
    fn points_at(&self, triangles: &[usize], places: &[[f64; 3]]) -> Result<Vec<DVec3>, EvaluationError> {
        let partials = self.partials_at(triangles, &self.uvs(triangles, places))?;
        Ok(partials.iter().map(|p| DVec3::from_array(p.point)).collect())
    }

    /// The (u, v) of the patch of each triangle that is nearest to a place, from one that is near it.
    fn feet(
        &self,
        triangles: &[usize],
        mut at: Vec<[f64; 2]>,
        targets: &[DVec3],
    ) -> Result<Vec<[f64; 2]>, EvaluationError> {
        for _ in 0..FOOT_STEPS {
            let partials = self.partials_at(triangles, &at)?;
            for ((uv, p), target) in at.iter_mut().zip(&partials).zip(targets) {
                if let Some((du, dv)) = step(p, *target) {
                    *uv = [(uv[0] + du).clamp(0.0, 1.0), (uv[1] + dv).clamp(0.0, 1.0)];
                }
            }
        }
        Ok(at)
    }

    /// The surface at (u, v) of the patch of each triangle.
    pub(super) fn partials_at(&self, triangles: &[usize], at: &[[f64; 2]]) -> Result<Vec<Partials>, EvaluationError> {
        let mut partials = vec![Partials::default(); at.len()];
        let mut first = 0;
        for run in triangles.chunk_by(|a, b| self.patches[*a] == self.patches[*b]) {
            let next = first + run.len();
            let (u, v): (Vec<f64>, Vec<f64>) = at[first..next].iter().map(|[u, v]| (*u, *v)).unzip();
            self.instance.partials(self.patches[run[0]] as usize, &u, &v, &mut partials[first..next])?;
            first = next;
        }
        Ok(partials)
    }

    /// The value of the function at one place of each triangle.
    pub(super) fn values_at(
        &self,
        triangles: &[usize],
        places: &[[f64; 3]],
        keeps: &[Option<usize>],
    ) -> Result<Vec<f64>, EvaluationError> {
        self.keeps_at(triangles, &self.uvs(triangles, places), keeps)
    }

    /// (u, v) of one place of each triangle.
    fn uvs(&self, triangles: &[usize], places: &[[f64; 3]]) -> Vec<[f64; 2]> {
        let at = triangles.iter().zip(places).map(|(triangle, weights)| self.uv(*triangle)(*weights));
        at.map(|(u, v)| [u, v].map(|x| x.clamp(0.0, 1.0))).collect()
    }

    /// The value of the function at (u, v) of the patch of each triangle.
    pub(super) fn keeps_at(
        &self,
        triangles: &[usize],
        at: &[[f64; 2]],
        keeps: &[Option<usize>],
    ) -> Result<Vec<f64>, EvaluationError> {
        let mut values = Vec::with_capacity(triangles.len());
        let mut first = 0;
        for run in triangles.chunk_by(|a, b| self.patches[*a] == self.patches[*b]) {
            let next = first + run.len();
            let (u, v): (Vec<f64>, Vec<f64>) = at[first..next].iter().map(|[u, v]| (*u, *v)).unzip();
            first = next;
            let Some(keep) = keeps[self.patches[run[0]] as usize] else { continue };
            values.extend(self.instance.keeps(keep, &u, &v)?);
        }
        Ok(values)
    }
}
