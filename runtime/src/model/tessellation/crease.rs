//! Creases that no line of u or v follows: where edges cross them, and the normals on either side.

use super::refine::{Edge, LEAST_CHORDS, Points, Refinement, mix};
use super::{SurfacePoint, unit_normals};
use crate::model::breaks::Patch;
use crate::model::{EvaluationError, Partials};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};

/// Normals whose cosine is above this are one: a degree.
const ALIKE: f64 = 0.99985;
/// Fractions of an edge at which decisions are asked for. Its ends may lie on creases themselves.
const ALONG: [f64; 9] = [1e-6, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0 - 1e-6];
/// How far aside of an edge they are asked for, as a fraction of its length in (u, v): the bisection of a crease is a
/// hundred thousand times better, and an edge that leaves a crease at an angle of a thousandth is still told from it.
const ASIDE: f64 = 1e-9;
/// Bisections of a crossing: to the rounding of u and v.
const BISECTIONS: usize = 48;
/// The least part of an edge that is cut off: where a crease passes so near to a vertex, cuts would never end.
const LEAST_PART: f64 = 1e-3;
/// Edges are asked for in batches of this many.
const BATCH: usize = 512;

/// An edge of a patch.
struct Line {
    edge: Edge,
    /// From the point with the lower number to the other.
    ends: [SurfacePoint; 2],
    positions: [DVec3; 2],
    /// The least and the greatest (u, v) of the smooth piece that it is on.
    bounds: [DVec2; 2],
}

impl Line {
    /// The place at a fraction of the edge, so far aside to its left as a part of its length.
    fn at(&self, fraction: f64, aside: f64) -> DVec2 {
        let [a, b] = self.ends.map(|end| DVec2::new(end.u, end.v));
        let place = DVec2::new(mix(a.x, b.x, fraction), mix(a.y, b.y, fraction));
        (place + aside * (b - a).perp()).clamp(self.bounds[0], self.bounds[1])
    }
}

impl Refinement<'_> {
    /// Triangles with an edge that crosses a crease, and where those edges cross it.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub(super) fn crossed(
        &mut self,
        points: &Points,
        triangles: &[usize],
    ) -> Result<(HashSet<usize>, HashMap<Edge, f64>), EvaluationError> {
        let (mut crossed, mut cuts) = (HashSet::new(), HashMap::new());
        for run in triangles.chunk_by(|a, b| self.patches[*a] == self.patches[*b]) {
            let patch = self.patches[run[0]] as usize;
            if !self.oblique[patch] {
                continue;
            }
            let (lines, of_triangles) = self.lines(points, patch, run);
            let found: Result<Vec<_>, EvaluationError> =
                lines.par_chunks(BATCH).map(|lines| self.crossings(patch, lines)).collect();
            let found: Vec<Option<Crossing>> = found?.into_iter().flatten().collect();
            for (triangle, lines) in run.iter().zip(of_triangles) {
                if lines.iter().any(|line| found[*line].is_some()) {
                    crossed.insert(*triangle);
                }
            }
            for (line, crossing) in lines.iter().zip(found) {
                if let Some(crossing) = crossing {
                    cuts.insert(line.edge, crossing.fraction);
                    if crossing.jump > self.chord {
                        self.jump = self.jump.max(crossing.jump);
                    }
                }
            }
        }
        Ok((crossed, cuts))
    }

    /// The edges of triangles of a patch, each once, and the three of every triangle.
    fn lines(&self, points: &Points, patch: usize, triangles: &[usize]) -> (Vec<Line>, Vec<[usize; 3]>) {
        let (mut lines, mut known) = (Vec::new(), HashMap::new());
        let of_triangle = |triangle: &usize| {
            let corners = self.mesh.triangles[*triangle];
            let (u, v) = self.uv(*triangle)([1.0 / 3.0; 3]);
            let [(low_u, high_u), (low_v, high_v)] = [(0, u), (1, v)].map(|(axis, t)| {
                let ends = &self.ends[patch][axis];
                let next = ends.partition_point(|end| *end <= t).clamp(1, ends.len() - 1);
                (ends[next - 1], ends[next])
            });
            [0, 1, 2].map(|k| {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let (edge, swapped) = points.edge(a, b);
                *known.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let [a, b] = if swapped { [b, a] } else { [a, b] };
                    let bounds = [DVec2::new(low_u, low_v), DVec2::new(high_u, high_v)];
                    let positions = [a, b].map(|i| DVec3::from_array(self.mesh.positions[i as usize]));
                    lines.push(Line { edge, ends: self.ends_of(a, b), positions, bounds });
                    lines.len() - 1
                })
            })
        };
        let of_triangles = triangles.iter().map(of_triangle).collect();
        (lines, of_triangles)
    }

    /// Where edges cross a crease, if they do: the crossing that is nearest to the middle. An edge along a crease, even
    /// one that bulges, has the same decisions all along on one of its sides; one that crosses it on none.
    fn crossings(&self, patch: usize, lines: &[Line]) -> Result<Vec<Option<Crossing>>, EvaluationError> {
        let crossing: Vec<bool> = {
            let left = self.along(patch, lines.iter(), ASIDE)?;
            let right = self.along(patch, lines.iter(), -ASIDE)?;
            left.into_iter().zip(right).map(|(left, right)| changes(&left) && changes(&right)).collect()
        };
        let chosen: Vec<usize> = (0..lines.len()).filter(|k| crossing[*k]).collect();
        let on = self.along(patch, chosen.iter().map(|k| &lines[*k]), 0.0)?;
        let open = chosen.into_iter().zip(&on).filter_map(|(k, signatures)| Some((k, Open::nearest(signatures)?)));
        let mut open: Vec<(usize, Open)> = open.collect();
        for _ in 0..BISECTIONS {
            let middles: Vec<DVec2> = open.iter().map(|(k, o)| lines[*k].at(0.5 * (o.low + o.high), 0.0)).collect();
            for ((_, o), signature) in open.iter_mut().zip(self.signatures(patch, &middles)?) {
                let middle = 0.5 * (o.low + o.high);
                *if signature == o.signature { &mut o.low } else { &mut o.high } = middle;
            }
        }
        let sides: Vec<DVec2> =
            open.iter().flat_map(|(k, o)| [o.low, o.high].map(|fraction| lines[*k].at(fraction, 0.0))).collect();
        let (u, v): (Vec<f64>, Vec<f64>) = sides.iter().map(|s| (s.x, s.y)).unzip();
        let mut positions = vec![[0.0; 3]; u.len()];
        self.instance.points(patch, &u, &v, &mut positions)?;
        let mut found: Vec<Option<Crossing>> = lines.iter().map(|_| None).collect();
        for ((k, o), sides) in open.iter().zip(positions.chunks_exact(2)) {
            let sides = [0, 1].map(|i| DVec3::from_array(sides[i]));
            let least = (0..2).map(|i| sides[i].distance(lines[*k].positions[i])).fold(f64::INFINITY, f64::min);
            let is_apart = o.low > LEAST_PART && o.low < 1.0 - LEAST_PART && least > LEAST_CHORDS * self.chord;
            if is_apart {
                found[*k] = Some(Crossing { fraction: o.low, jump: sides[0].distance(sides[1]) });
            }
        }
        Ok(found)
    }

    /// The signatures along edges, aside of them.
    fn along<'a>(
        &self,
        patch: usize,
        lines: impl Iterator<Item = &'a Line>,
        aside: f64,
    ) -> Result<Vec<[u64; ALONG.len()]>, EvaluationError> {
        let sites: Vec<DVec2> = lines.flat_map(|line| ALONG.map(|fraction| line.at(fraction, aside))).collect();
        let signatures = self.signatures(patch, &sites)?;
        Ok(signatures.as_chunks().0.to_vec())
    }

    fn signatures(&self, patch: usize, sites: &[DVec2]) -> Result<Vec<u64>, EvaluationError> {
        let (u, v): (Vec<f64>, Vec<f64>) = sites.iter().map(|s| (s.x, s.y)).unzip();
        let signatures = Patch { instance: self.instance, patch }.oblique_signatures(&u, &v)?;
        Ok(signatures.into_iter().map(f64::to_bits).collect())
    }

    /// Gives vertices on creases a normal for each side: that of the surface a little inside of the triangle.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub(super) fn split_normals(&mut self) -> Result<(), EvaluationError> {
        const INSIDE: f64 = 1e-6;
        let mut copies: HashMap<u32, Vec<u32>> = HashMap::new();
        for t in 0..self.mesh.triangles.len() {
            let patch = self.patches[t] as usize;
            if !self.oblique[patch] {
                continue;
            }
            let corners = self.mesh.triangles[t];
            let uv = self.uv(t);
            let inside =
                [0, 1, 2].map(|k: usize| uv([0, 1, 2].map(|i| if i == k { 1.0 - INSIDE } else { INSIDE / 2.0 })));
            let (u, v) = (inside.map(|s| s.0), inside.map(|s| s.1));
            let mut partials = [Partials::default(); 3];
            self.instance.partials(patch, &u, &v, &mut partials)?;
            let normals = unit_normals(self.instance, patch, &u, &v, &partials)?;
            for (k, normal) in normals.into_iter().enumerate() {
                let is_pole = self.pole(&self.origins[corners[k] as usize]).is_some();
                if let Some(normal) = normal.filter(|_| !is_pole) {
                    self.mesh.triangles[t][k] = self.with_normal(&mut copies, corners[k], normal);
                }
            }
        }
        Ok(())
    }

    /// The vertex at a vertex's place that has a certain normal, of those that are known there; if there is none, a new
    /// one.
    fn with_normal(&mut self, copies: &mut HashMap<u32, Vec<u32>>, vertex: u32, normal: DVec3) -> u32 {
        let alike = |i: &u32| DVec3::from_array(self.mesh.normals[*i as usize]).dot(normal) > ALIKE;
        match copies.entry(vertex) {
            Entry::Vacant(entry) => {
                if !alike(&vertex) {
                    self.mesh.normals[vertex as usize] = normal.to_array();
                }
                entry.insert(vec![vertex]);
                vertex
            }
            Entry::Occupied(mut entry) => {
                if let Some(known) = entry.get().iter().copied().find(alike) {
                    return known;
                }
                let copy = self.origins.len() as u32;
                entry.get_mut().push(copy);
                self.mesh.positions.push(self.mesh.positions[vertex as usize]);
                self.mesh.normals.push(normal.to_array());
                self.origins.push(self.origins[vertex as usize]);
                copy
            }
        }
    }
}

/// Whether not all of some signatures are equal.
fn changes(signatures: &[u64]) -> bool {
    signatures.iter().any(|s| *s != signatures[0])
}

/// A place on an edge at which it crosses a crease.
struct Crossing {
    /// From the point with the lower number on.
    fraction: f64,
    /// How far apart the surface is on both sides. Millimetres.
    jump: f64,
}

/// A part of an edge on which decisions change.
struct Open {
    low: f64,
    high: f64,
    /// The signature at the lower end.
    signature: u64,
}

impl Open {
    /// That between neighbours of [`ALONG`] which is nearest to the middle.
    fn nearest(signatures: &[u64; ALONG.len()]) -> Option<Self> {
        let changing = (0..ALONG.len() - 1).filter(|k| signatures[*k] != signatures[k + 1]);
        let off_middle = |k: &usize| (2 * k + 2).abs_diff(ALONG.len());
        changing.min_by_key(off_middle).map(|k| Self { low: ALONG[k], high: ALONG[k + 1], signature: signatures[k] })
    }
}
