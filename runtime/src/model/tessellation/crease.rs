//! Creases that no line of u or v follows: where edges cross them, and the normals on either side.

use super::refine::{Edge, Points, Refinement, mix};
use super::{SurfacePoint, unit_normals};
use crate::model::EvaluationError;
use crate::model::breaks::oblique_signatures;
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Normals whose cosine is above this are one: a degree.
const ALIKE: f64 = 0.99985;
/// A crease that passes an end of an edge within this fraction of its length passes through it.
const ON_CREASE: f64 = 1e-6;

/// A triangle, and which of its edges cross a crease.
pub(super) type Crossing = (usize, [bool; 3]);

impl Refinement<'_> {
    /// Triangles with an edge that crosses a crease, those edges, and where they cross it. Vertices that lie on a crease
    /// are marked: no edge crosses it there.
    pub(super) fn crossed(
        &mut self,
        points: &Points,
        triangles: &[usize],
    ) -> Result<(Vec<Crossing>, HashMap<Edge, f64>), EvaluationError> {
        loop {
            let crossing = self.crossing(triangles)?;
            let mut cuts = self.crease_points(points, &crossing)?;
            let on: HashSet<u32> = cuts
                .iter()
                .filter(|(_, s)| !(ON_CREASE..=1.0 - ON_CREASE).contains(*s))
                .map(|(edge, s)| if *s < 0.5 { edge.0 } else { edge.1 })
                .collect();
            if on.is_empty() {
                cuts.retain(|_, s| *s > 0.0);
                return Ok((crossing, cuts));
            }
            for (vertex, point) in points.of_vertex.iter().enumerate() {
                let oblique = self.oblique[self.origins[vertex].patch as usize];
                self.on_crease[vertex] |= oblique && on.contains(point);
            }
        }
    }

    /// Triangles with an edge whose ends lie on different sides of a crease, and those edges.
    fn crossing(&self, triangles: &[usize]) -> Result<Vec<Crossing>, EvaluationError> {
        let mut crossing = Vec::new();
        for run in triangles.chunk_by(|a, b| self.patches[*a] == self.patches[*b]) {
            let patch = self.patches[run[0]] as usize;
            if !self.oblique[patch] {
                continue;
            }
            let corners = run.iter().flat_map(|t| self.mesh.triangles[*t]);
            let (u, v): (Vec<f64>, Vec<f64>) =
                corners.map(|i| (self.origins[i as usize].u, self.origins[i as usize].v)).unzip();
            let signatures = oblique_signatures(self.instance, patch, &u, &v)?;
            for (triangle, s) in run.iter().zip(signatures.chunks_exact(3)) {
                let indices = self.mesh.triangles[*triangle];
                let free = |k: usize| !self.on_crease[indices[k] as usize];
                let crossed = [0, 1, 2].map(|k| {
                    let next = (k + 1) % 3;
                    free(k) && free(next) && s[k].to_bits() != s[next].to_bits()
                });
                if crossed.contains(&true) {
                    crossing.push((*triangle, crossed));
                }
            }
        }
        Ok(crossing)
    }

    /// Where edges cross a crease: their fractions from the point with the lower number on.
    fn crease_points(&self, points: &Points, crossing: &[Crossing]) -> Result<HashMap<Edge, f64>, EvaluationError> {
        let mut edges: Vec<(Edge, [SurfacePoint; 2])> = Vec::new();
        for (triangle, crossed) in crossing {
            let corners = self.mesh.triangles[*triangle];
            for k in (0..3).filter(|k| crossed[*k]) {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let (edge, swapped) = points.edge(a, b);
                let [a, b] = if swapped { [b, a] } else { [a, b] };
                edges.push((edge, [a, b].map(|i| self.origins[i as usize])));
            }
        }
        edges.sort_by_key(|(edge, ends)| (ends[0].patch, *edge));
        edges.dedup_by_key(|(edge, ends)| (ends[0].patch, *edge));
        let mut cuts = HashMap::new();
        for run in edges.chunk_by(|a, b| a.1[0].patch == b.1[0].patch) {
            let patch = run[0].1[0].patch as usize;
            let signature = |at: &[f64]| -> Result<Vec<f64>, EvaluationError> {
                let (u, v): (Vec<f64>, Vec<f64>) =
                    run.iter().zip(at).map(|((_, [a, b]), s)| (mix(a.u, b.u, *s), mix(a.v, b.v, *s))).unzip();
                oblique_signatures(self.instance, patch, &u, &v)
            };
            let first = signature(&vec![0.0; run.len()])?;
            let (mut low, mut high) = (vec![0.0; run.len()], vec![1.0; run.len()]);
            for _ in 0..48 {
                let middle: Vec<f64> = low.iter().zip(&high).map(|(l, h)| 0.5 * (l + h)).collect();
                for (k, s) in signature(&middle)?.into_iter().enumerate() {
                    *if s.to_bits() == first[k].to_bits() { &mut low[k] } else { &mut high[k] } = middle[k];
                }
            }
            cuts.extend(run.iter().zip(&low).map(|((edge, _), s)| (*edge, *s)));
        }
        Ok(cuts)
    }

    /// Gives vertices on creases a normal for each side: that of the surface a little inside of the triangle.
    pub(super) fn split_normals(&mut self) -> Result<(), EvaluationError> {
        const INSIDE: f64 = 1e-6;
        let mut copies: HashMap<u32, Vec<u32>> = HashMap::new();
        for t in 0..self.mesh.triangles.len() {
            let corners = self.mesh.triangles[t];
            let on_crease = corners.map(|i| self.on_crease[i as usize]);
            for k in (0..3).filter(|k| on_crease[*k]) {
                let [at, b, c] = [0, 1, 2].map(|n| self.origins[corners[(k + n) % 3] as usize]);
                let inside = |at: f64, b: f64, c: f64| at + INSIDE * ((b + c) / 2.0 - at);
                let inside = SurfacePoint { u: inside(at.u, b.u, c.u), v: inside(at.v, b.v, c.v), ..at };
                let partials = self.partials(inside)?;
                let normals = unit_normals(self.instance, at.patch as usize, &[inside.u], &[inside.v], &[partials])?;
                let Some(normal) = normals[0] else { continue };
                let known = copies.entry(corners[k]).or_default();
                let alike = |i: &u32| DVec3::from_array(self.mesh.normals[*i as usize]).dot(normal) > ALIKE;
                let vertex = match known.iter().copied().find(alike) {
                    Some(vertex) => vertex,
                    None if known.is_empty() => {
                        self.mesh.normals[corners[k] as usize] = normal.to_array();
                        corners[k]
                    }
                    None => {
                        self.mesh.positions.push(self.mesh.positions[corners[k] as usize]);
                        self.mesh.normals.push(normal.to_array());
                        self.origins.push(at);
                        self.on_crease.push(true);
                        self.origins.len() as u32 - 1
                    }
                };
                let known = copies.entry(corners[k]).or_default();
                if !known.contains(&vertex) {
                    known.push(vertex);
                }
                self.mesh.triangles[t][k] = vertex;
            }
        }
        Ok(())
    }
}
