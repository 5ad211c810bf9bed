//! Trimmed patches: triangles are divided along the edge of what is there, and the others go.
//!
//! A patch that is trimmed has a function of its (u, v), positive where the surface is there. Triangles are divided
//! until that function is as good as linear on them where it changes its sign, edges are cut where it is zero, and what
//! lies beyond is dropped. The edges of two patches that meet there are then the same curve with different vertices;
//! each is given those of the other, so that the mesh stays closed.

use super::measure::PLACES;
use super::refine::{Edge, Points, Refinement, mix};
use super::stitch;
use crate::model::EvaluationError;
use glam::DVec3;
use std::collections::HashMap;

/// The largest chord that edges keep to, whatever was asked for, as a part of the diagonal of the untrimmed model.
const COARSEST: f64 = 0.01;
/// Rounds of dividing at most.
const ROUNDS: usize = 40;
/// Bisections of a zero on an edge: to the rounding of u and v.
const BISECTIONS: usize = 50;
/// The least part of an edge that is cut off: nearer to a vertex the vertex itself counts as on the edge.
const LEAST_PART: f64 = 1e-6;
/// The same where it only says whether the edge is straight.
const ROUGH_BISECTIONS: usize = 30;
/// Where between the crossings of an edge its straightness is asked for.
const ALONG: [f64; 3] = [0.25, 0.5, 0.75];
/// The corners of a triangle in barycentric coordinates.
const CORNERS: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
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
fn sign(value: f64) -> i8 {
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

/// How a triangle stands to the edge of what is there.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stand {
    /// No change of sign, and none that could be missed.
    Clear,
    /// The edge passes through it, and is straight there.
    Crossed,
    /// It must be divided to tell.
    Unclear,
}

impl Refinement<'_> {
    /// Takes away what is not there of patches that are trimmed: `keeps` has, by patch, the patch of the function.
    ///
    /// # Errors
    /// The surface, or where it is there, cannot be evaluated.
    pub(super) fn trim(&mut self, keeps: &[Option<usize>]) -> Result<(), EvaluationError> {
        if keeps.iter().all(Option::is_none) {
            return Ok(());
        }
        self.chord = self.chord.min(COARSEST * self.mesh.bounds().diagonal());
        let mut points = Points::of(self.mesh);
        let trimmed = |r: &Self, t: &usize| keeps[r.patches[*t] as usize].is_some();
        let mut open: Vec<usize> = (0..self.mesh.triangles.len()).filter(|t| trimmed(self, t)).collect();
        for _ in 0..ROUNDS {
            let mut cuts: HashMap<Edge, f64> = HashMap::new();
            let (stands, bent) = self.stands(&open, keeps)?;
            let mut fresh = Vec::new();
            for (k, triangle) in open.iter().enumerate().filter(|(k, _)| stands[*k] == Stand::Unclear) {
                let keep = keeps[self.patches[*triangle] as usize];
                let corner = match (keep, bent.get(&k)) {
                    (Some(keep), Some(crossings)) => self.corner(*triangle, keep, *crossings)?,
                    _ => None,
                };
                match corner {
                    Some(corner) => fresh.push((*triangle, corner)),
                    None => {
                        let [a, b, _] = self.longest_side_first(*triangle);
                        cuts.insert(points.edge(a, b).0, 0.5);
                    }
                }
            }
            let added = 2 * (cuts.len() + fresh.len());
            if added == 0 || self.mesh.triangles.len() + added > self.most_triangles {
                break;
            }
            let mut next = Vec::new();
            for (triangle, corner) in fresh {
                next.extend(self.insert(&mut points, triangle, corner)?);
            }
            next.extend(self.divide(&mut points, &cuts)?.into_iter().filter(|t| trimmed(self, t)));
            next.sort_by_key(|t| (self.patches[*t], *t));
            next.dedup();
            open = next;
        }
        self.cut(&mut points, keeps)?;
        self.drop_absent(keeps)?;
        stitch::stitch(self)
    }

    /// The values of the function at places of triangles of trimmed patches, `places` for each.
    fn values(
        &self,
        triangles: &[usize],
        places: &[[f64; 3]],
        keeps: &[Option<usize>],
    ) -> Result<Vec<f64>, EvaluationError> {
        let mut values = Vec::with_capacity(triangles.len() * places.len());
        for run in triangles.chunk_by(|a, b| self.patches[*a] == self.patches[*b]) {
            let (mut u, mut v) = (Vec::new(), Vec::new());
            for triangle in run {
                let uv = self.uv(*triangle);
                for weights in places {
                    let at = uv(*weights);
                    u.push(at.0);
                    v.push(at.1);
                }
            }
            let Some(keep) = keeps[self.patches[run[0]] as usize] else { continue };
            values.extend(self.keep_at(keep, &u, &v)?);
        }
        Ok(values)
    }

    fn keep_at(&self, keep: usize, u: &[f64], v: &[f64]) -> Result<Vec<f64>, EvaluationError> {
        let mut values = vec![[0.0; 3]; u.len()];
        self.instance.points(keep, u, v, &mut values)?;
        Ok(values.into_iter().map(|value| value[0]).collect())
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

    /// How triangles stand, and by the place in the list where the edge crosses those in which it is bent.
    fn stands(
        &self,
        triangles: &[usize],
        keeps: &[Option<usize>],
    ) -> Result<(Vec<Stand>, HashMap<usize, [[f64; 3]; 2]>), EvaluationError> {
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

    /// Whether the line between its crossings is all that a triangle has of the edge, by what the function says of other
    /// places: on the side that it is, and of no edge that is nearer than the line.
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
    ) -> Result<Vec<(bool, [[f64; 3]; 2])>, EvaluationError> {
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

    /// Millimetres.
    fn longest_side(&self, triangle: usize) -> f64 {
        let corners = self.mesh.corners(self.mesh.triangles[triangle]);
        (0..3).map(|k| corners[k].distance(corners[(k + 1) % 3])).fold(0.0, f64::max)
    }

    /// The corners of a triangle, those of its longest side in space first.
    fn longest_side_first(&self, triangle: usize) -> [u32; 3] {
        let corners = self.mesh.triangles[triangle];
        let positions = self.mesh.corners(corners);
        let length = |k: &usize| positions[*k].distance_squared(positions[(*k + 1) % 3]);
        let k = (0..3).max_by(|a, b| length(a).total_cmp(&length(b))).unwrap_or(0);
        [corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]]
    }

    /// Cuts edges where the function is zero.
    fn cut(&mut self, points: &mut Points, keeps: &[Option<usize>]) -> Result<(), EvaluationError> {
        let mut cuts: HashMap<Edge, f64> = HashMap::new();
        for (patch, keep) in keeps.iter().enumerate().filter_map(|(patch, keep)| Some((patch, (*keep)?))) {
            let mut edges: HashMap<Edge, [u32; 2]> = HashMap::new();
            for (corners, _) in self.mesh.triangles.iter().zip(&self.patches).filter(|(_, p)| **p as usize == patch) {
                for k in 0..3 {
                    let (a, b) = (corners[k], corners[(k + 1) % 3]);
                    let (edge, swapped) = points.edge(a, b);
                    edges.entry(edge).or_insert(if swapped { [b, a] } else { [a, b] });
                }
            }
            let mut edges: Vec<(Edge, [u32; 2])> = edges.into_iter().collect();
            edges.sort_unstable();
            let ends: Vec<_> = edges.iter().map(|(_, [a, b])| self.ends_of(*a, *b)).collect();
            let at = |fractions: &[f64]| -> Result<Vec<f64>, EvaluationError> {
                let uv = ends.iter().zip(fractions).map(|([a, b], s)| (mix(a.u, b.u, *s), mix(a.v, b.v, *s)));
                let (u, v): (Vec<f64>, Vec<f64>) = uv.unzip();
                self.keep_at(keep, &u, &v)
            };
            let (mut low, mut high) = (vec![0.0; edges.len()], vec![1.0; edges.len()]);
            let (first, last) = (at(&low)?, at(&high)?);
            for _ in 0..BISECTIONS {
                let middles: Vec<f64> = low.iter().zip(&high).map(|(a, b)| 0.5 * (a + b)).collect();
                for (k, value) in at(&middles)?.into_iter().enumerate() {
                    *if (value > 0.0) == (first[k] > 0.0) { &mut low[k] } else { &mut high[k] } = middles[k];
                }
            }
            for (k, (edge, _)) in edges.iter().enumerate() {
                let inside = low[k] > LEAST_PART && low[k] < 1.0 - LEAST_PART;
                if sign(first[k]) * sign(last[k]) < 0 && inside {
                    cuts.entry(*edge).or_insert(low[k]);
                }
            }
        }
        self.divide(points, &cuts)?;
        Ok(())
    }

    /// Drops the triangles that are not there: by their corners, all on the edge or on one side of it now.
    fn drop_absent(&mut self, keeps: &[Option<usize>]) -> Result<(), EvaluationError> {
        let trimmed = |t: &usize| keeps[self.patches[*t] as usize].is_some();
        let mut triangles: Vec<usize> = (0..self.mesh.triangles.len()).filter(trimmed).collect();
        triangles.sort_by_key(|t| self.patches[*t]);
        let places: Vec<[f64; 3]> = CORNERS.into_iter().chain([[1.0 / 3.0; 3]]).collect();
        let values = self.values(&triangles, &places, keeps)?;
        let mut there = vec![true; self.mesh.triangles.len()];
        for (triangle, values) in triangles.iter().zip(values.chunks_exact(places.len())) {
            let has = |wanted: i8| values[..3].iter().any(|value| sign(*value) == wanted);
            // Narrow triangles beside a curve may have their middle beyond it.
            there[*triangle] = if has(1) == has(-1) { values[3] > 0.0 } else { has(1) };
        }
        let mut kept = there.iter();
        self.mesh.triangles.retain(|_| kept.next().copied().unwrap_or(true));
        let mut kept = there.iter();
        self.patches.retain(|_| kept.next().copied().unwrap_or(true));
        Ok(())
    }
}
