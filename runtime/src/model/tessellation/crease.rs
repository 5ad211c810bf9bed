//! Creases that no line of u or v follows: where edges cross them, and the normals on either side.

use super::refine::{Cut, Edge, Points, Refinement, mix};
use super::{SurfacePoint, unit_normals};
use crate::model::EvaluationError;
use crate::model::breaks::Patch;
use glam::DVec3;
use std::collections::HashMap;

/// Normals whose cosine is above this are one: a degree.
const ALIKE: f64 = 0.99985;
/// How far inside of an edge the decisions at its ends are asked for, as a fraction: the ends may lie on creases.
const INSET: f64 = 1e-6;

/// A triangle, and which of its edges cross a crease.
pub(super) type Crossing = (usize, [bool; 3]);

impl Refinement<'_> {
    /// Triangles with an edge that crosses a crease, those edges, and where they cross it. Vertices on a crease are
    /// marked.
    pub(super) fn crossed(
        &mut self,
        points: &Points,
        triangles: &[usize],
    ) -> Result<(Vec<Crossing>, HashMap<Edge, Cut>), EvaluationError> {
        let crossing = self.crossing(triangles)?;
        let cuts = self.crease_points(points, &crossing)?;
        Ok((crossing, cuts))
    }

    /// Triangles with an edge on whose ends, seen from a little inside of it, the decisions differ; and those edges.
    fn crossing(&mut self, triangles: &[usize]) -> Result<Vec<Crossing>, EvaluationError> {
        let mut crossing = Vec::new();
        for run in triangles.chunk_by(|a, b| self.patches[*a] == self.patches[*b]) {
            let patch = self.patches[run[0]] as usize;
            if !self.oblique[patch] {
                continue;
            }
            let (mut u, mut v) = (Vec::new(), Vec::new());
            for t in run {
                let corners = self.mesh.triangles[*t];
                for k in 0..3 {
                    let [a, b] = self.ends_of(corners[k], corners[(k + 1) % 3]);
                    for s in [0.0, INSET, 1.0 - INSET] {
                        u.push(mix(a.u, b.u, s));
                        v.push(mix(a.v, b.v, s));
                    }
                }
            }
            let signatures = Patch { instance: self.instance, patch }.oblique_signatures(&u, &v)?;
            for (triangle, s) in run.iter().zip(signatures.chunks_exact(9)) {
                let differ = |a: usize, b: usize| s[a].to_bits() != s[b].to_bits();
                let indices = self.mesh.triangles[*triangle];
                for k in 0..3 {
                    // The edge that leads here ends with the place 2 of its three.
                    let last = 3 * ((k + 2) % 3) + 2;
                    self.on_crease[indices[k] as usize] |= differ(3 * k, 3 * k + 1) && differ(3 * k, last);
                }
                let on = |k: usize| self.on_crease[indices[k % 3] as usize];
                let crossed = [0, 1, 2].map(|k| !(on(k) && on(k + 1)) && differ(3 * k + 1, 3 * k + 2));
                if crossed.contains(&true) {
                    crossing.push((*triangle, crossed));
                }
            }
        }
        Ok(crossing)
    }

    /// Where edges cross a crease.
    fn crease_points(&mut self, points: &Points, crossing: &[Crossing]) -> Result<HashMap<Edge, Cut>, EvaluationError> {
        let mut edges: Vec<(Edge, [SurfacePoint; 2])> = Vec::new();
        for (triangle, crossed) in crossing {
            let corners = self.mesh.triangles[*triangle];
            for k in (0..3).filter(|k| crossed[*k]) {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let (edge, swapped) = points.edge(a, b);
                let [a, b] = if swapped { [b, a] } else { [a, b] };
                edges.push((edge, self.ends_of(a, b)));
            }
        }
        edges.sort_by_key(|(edge, ends)| (ends[0].patch, *edge));
        edges.dedup_by_key(|(edge, ends)| (ends[0].patch, *edge));
        let (mut cuts, mut jumps) = (HashMap::new(), self.jump);
        for run in edges.chunk_by(|a, b| a.1[0].patch == b.1[0].patch) {
            let patch = run[0].1[0].patch as usize;
            let sites = |at: &[f64]| -> (Vec<f64>, Vec<f64>) {
                run.iter().zip(at).map(|((_, [a, b]), s)| (mix(a.u, b.u, *s), mix(a.v, b.v, *s))).unzip()
            };
            let signatures = |at: &[f64]| {
                let (u, v) = sites(at);
                Patch { instance: self.instance, patch }.oblique_signatures(&u, &v)
            };
            let (mut low, mut high) = (vec![INSET; run.len()], vec![1.0 - INSET; run.len()]);
            let first = signatures(&low)?;
            for _ in 0..48 {
                let middle: Vec<f64> = low.iter().zip(&high).map(|(l, h)| 0.5 * (l + h)).collect();
                for (k, s) in signatures(&middle)?.into_iter().enumerate() {
                    *if s.to_bits() == first[k].to_bits() { &mut low[k] } else { &mut high[k] } = middle[k];
                }
            }
            let place = |at: &[f64]| -> Result<Vec<[f64; 3]>, EvaluationError> {
                let (u, v) = sites(at);
                let mut points = vec![[0.0; 3]; u.len()];
                self.instance.points(patch, &u, &v, &mut points)?;
                Ok(points)
            };
            for (p, q) in place(&low)?.into_iter().zip(place(&high)?) {
                let jump = DVec3::from_array(p).distance(DVec3::from_array(q));
                if jump > self.chord {
                    jumps = jumps.max(jump);
                }
            }
            cuts.extend(run.iter().zip(low).map(|((edge, _), at)| (*edge, Cut { at, on_crease: true })));
        }
        self.jump = jumps;
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
