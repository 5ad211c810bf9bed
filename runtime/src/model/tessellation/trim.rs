//! Trimmed patches: triangles are divided along the edge of what is there, and the others go.
//!
//! A patch that is trimmed has a function of its (u, v), positive where the surface is there. Triangles are divided
//! until that function is as good as linear on them where it changes its sign, edges are cut where it is zero, and what
//! lies beyond is dropped. The edges of two patches that meet there are then the same curve with different vertices;
//! each is given those of the other, so that the mesh stays closed.

use super::refine::{Edge, Points, Refinement, mix};
use super::stand::{CORNERS, Stand, sign};
use super::stitch;
use crate::mesh::retain_marked;
use crate::model::EvaluationError;
use std::collections::HashMap;

/// The largest chord that edges keep to, whatever was asked for, as a part of the diagonal of the untrimmed model.
const COARSEST: f64 = 0.01;
/// Rounds of dividing at most.
const ROUNDS: usize = 40;
/// Bisections of a zero on an edge: to the rounding of u and v.
const BISECTIONS: usize = 50;
/// The least part of an edge that is cut off: nearer to a vertex the vertex itself counts as on the edge.
const LEAST_PART: f64 = 1e-6;

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
            self.add_longest_sides(&points, &mut cuts);
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
    pub(super) fn values(
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

    pub(super) fn keep_at(&self, keep: usize, u: &[f64], v: &[f64]) -> Result<Vec<f64>, EvaluationError> {
        let mut values = vec![[0.0; 3]; u.len()];
        self.instance.points(keep, u, v, &mut values)?;
        Ok(values.into_iter().map(|value| value[0]).collect())
    }

    /// Millimetres.
    pub(super) fn longest_side(&self, triangle: usize) -> f64 {
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

    /// Adds the longest sides of triangles that are divided at others: what is divided at shorter sides only becomes
    /// ever narrower (Rivara 1984).
    fn add_longest_sides(&self, points: &Points, cuts: &mut HashMap<Edge, f64>) {
        if cuts.is_empty() {
            return;
        }
        let mut of_edge: HashMap<Edge, Vec<usize>> = HashMap::new();
        for (triangle, corners) in self.mesh.triangles.iter().enumerate() {
            for k in 0..3 {
                of_edge.entry(points.edge(corners[k], corners[(k + 1) % 3]).0).or_default().push(triangle);
            }
        }
        let mut fresh: Vec<Edge> = cuts.keys().copied().collect();
        while let Some(edge) = fresh.pop() {
            for triangle in of_edge.get(&edge).into_iter().flatten() {
                let [a, b, _] = self.longest_side_first(*triangle);
                let longest = points.edge(a, b).0;
                if cuts.insert(longest, 0.5).is_none() {
                    fresh.push(longest);
                }
            }
        }
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
            let at = |edges: &[usize], fractions: &[f64]| -> Result<Vec<f64>, EvaluationError> {
                let place = |(k, s): (&usize, &f64)| {
                    let [a, b] = &ends[*k];
                    (mix(a.u, b.u, *s), mix(a.v, b.v, *s))
                };
                let (u, v): (Vec<f64>, Vec<f64>) = edges.iter().zip(fractions).map(place).unzip();
                self.keep_at(keep, &u, &v)
            };
            let all: Vec<usize> = (0..edges.len()).collect();
            let (first, last) = (at(&all, &vec![0.0; all.len()])?, at(&all, &vec![1.0; all.len()])?);
            let crossed: Vec<usize> = all.into_iter().filter(|k| sign(first[*k]) * sign(last[*k]) < 0).collect();
            let (mut low, mut high) = (vec![0.0; crossed.len()], vec![1.0; crossed.len()]);
            for _ in 0..BISECTIONS {
                let middles: Vec<f64> = low.iter().zip(&high).map(|(a, b)| 0.5 * (a + b)).collect();
                for (k, value) in at(&crossed, &middles)?.into_iter().enumerate() {
                    let as_first = (value > 0.0) == (first[crossed[k]] > 0.0);
                    *if as_first { &mut low[k] } else { &mut high[k] } = middles[k];
                }
            }
            for (k, s) in crossed.iter().zip(low).filter(|(_, s)| *s > LEAST_PART && *s < 1.0 - LEAST_PART) {
                cuts.entry(edges[*k].0).or_insert(s);
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
        retain_marked(&mut self.mesh.triangles, &there);
        retain_marked(&mut self.patches, &there);
        Ok(())
    }
}
