//! The chord that was asked for, kept: triangles are measured against the surface, and divided where they leave it.
//!
//! Edges are divided, not triangles, so that neighbours stay neighbours, those across a common border too. Where the
//! decisions of u and v differ between the ends of an edge (a crease that no line of u or v follows), it is divided at
//! the crease.

use super::piece::Side;
use super::{SurfacePoint, unit_normals};
use crate::mesh::TriangleMesh;
use crate::model::{EvaluationError, Instance, Partials};
use crate::progress::Progress;
use glam::DVec3;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// Rounds of measuring and dividing at most.
const ROUNDS: usize = 24;
/// Rounds in which triangles that creases cross are divided at these only.
const CREASES_FIRST: usize = 6;
/// The least length that is cut off an edge at a crease, and the least height of a triangle that is divided, in chords:
/// what is narrower does not count, and cuts of cuts would end at vertices that coincide.
pub(super) const LEAST_CHORDS: f64 = 1e-3;

/// A mesh that is being refined.
pub(super) struct Refinement<'a> {
    pub(super) instance: &'a dyn Instance,
    pub(super) mesh: &'a mut TriangleMesh,
    pub(super) origins: &'a mut Vec<SurfacePoint>,
    /// The patch of each triangle.
    pub(super) patches: Vec<u32>,
    /// By patch the values of u and of v at which intervals end.
    pub(super) ends: Vec<[Vec<f64>; 2]>,
    /// By patch the sides that are points: the parameter along them says nothing there.
    pub(super) poles: Vec<Vec<Side>>,
    /// By patch the number of its part: the surfaces of one close it.
    pub(super) bodies: &'a [usize],
    /// Patches with conditions of both u and v.
    pub(super) oblique: Vec<bool>,
    pub(super) chord: f64,
    /// The size down to which triangles are looked at where solids coincide. Millimetres.
    pub(super) finest_level: f64,
    pub(super) most_triangles: usize,
    /// The largest jump of the surface that edges cross. Millimetres.
    pub(super) jump: f64,
    /// The largest distance between a patch and vertices of others that were put on its edge, to close the gap between
    /// them. Millimetres.
    pub(super) stretch: f64,
}

/// An edge by the numbers of its points, lower first; points at one position have one number.
pub(super) type Edge = (u32, u32);

impl Refinement<'_> {
    /// Divides triangles until all keep to the chord, as far as they can be divided. Returns the largest distance that
    /// was measured last. Millimetres.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub(super) fn run(&mut self, progress: &dyn Progress) -> Result<f64, EvaluationError> {
        // No triangle leaves the surface by more.
        if self.chord == f64::INFINITY {
            return Ok(self.chord);
        }
        let mut points = Points::of(self.mesh);
        let mut unmeasured: Vec<usize> = (0..self.mesh.triangles.len()).collect();
        let mut largest = 0.0_f64;
        for round in 1.. {
            progress.report("meshing", f64::NAN, &format!("{} triangles", self.mesh.triangles.len()));
            let (findings, good) = self.measure(&unmeasured)?;
            largest = largest.max(good);
            let beside: Vec<usize> = findings.iter().map(|f| f.triangle).collect();
            let (crossed, mut cuts) = self.crossed(&points, &beside)?;
            // With the creases most of what such a triangle leaves is gone.
            let waits = |triangle| round <= CREASES_FIRST && crossed.contains(triangle);
            for finding in findings.iter().filter(|f| !waits(&f.triangle)) {
                let corners = self.mesh.triangles[finding.triangle];
                for k in (0..3).filter(|k| finding.divide[*k]) {
                    let (edge, _) = points.edge(corners[k], corners[(k + 1) % 3]);
                    cuts.entry(edge).or_insert(0.5);
                }
            }
            // A cut divides two triangles.
            let too_many = self.mesh.triangles.len() + 2 * cuts.len() > self.most_triangles;
            if cuts.is_empty() || round == ROUNDS || too_many {
                largest = findings.iter().map(|f| f.distance).fold(largest, f64::max);
                break;
            }
            unmeasured = self.divide(&mut points, &cuts)?;
        }
        self.split_normals()?;
        Ok(largest.max(self.jump))
    }

    /// Divides edges at fractions from the point with the lower number on, and the triangles at them. Returns the
    /// triangles that are to be measured: new ones.
    pub(super) fn divide(
        &mut self,
        points: &mut Points,
        cuts: &HashMap<Edge, f64>,
    ) -> Result<Vec<usize>, EvaluationError> {
        let all = 0..self.mesh.triangles.len();
        self.divide_some(points, cuts, all)
    }

    /// The same where all triangles at these edges are among those that are given.
    pub(super) fn divide_some(
        &mut self,
        points: &mut Points,
        cuts: &HashMap<Edge, f64>,
        triangles: impl IntoIterator<Item = usize>,
    ) -> Result<Vec<usize>, EvaluationError> {
        let mut new_vertices: HashMap<Edge, u32> = HashMap::new();
        let mut wanted: Vec<(Edge, Edge, f64)> = Vec::new();
        let mut touched = Vec::new();
        for t in triangles {
            let corners = self.mesh.triangles[t];
            let mut touches = false;
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let (edge, swapped) = points.edge(a, b);
                let Some(cut) = cuts.get(&edge) else { continue };
                touches = true;
                let raw = (a.min(b), a.max(b));
                if let Entry::Vacant(entry) = new_vertices.entry(raw) {
                    entry.insert((self.mesh.positions.len() + wanted.len()) as u32);
                    wanted.push((raw, edge, if (a < b) == swapped { 1.0 - cut } else { *cut }));
                }
            }
            if touches {
                touched.push(t);
            }
        }
        self.add_vertices(points, &wanted)?;
        let mut fresh = Vec::new();
        for t in touched {
            let corners = self.mesh.triangles[t];
            let middle = [0, 1, 2].map(|k| {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                new_vertices.get(&(a.min(b), a.max(b))).copied()
            });
            let pieces = self.pieces(corners, middle);
            for (n, piece) in pieces.into_iter().enumerate() {
                if n == 0 {
                    self.mesh.triangles[t] = piece;
                    fresh.push(t);
                } else {
                    fresh.push(self.mesh.triangles.len());
                    self.mesh.triangles.push(piece);
                    self.patches.push(self.patches[t]);
                }
            }
        }
        fresh.sort_by_key(|t| (self.patches[*t], *t));
        Ok(fresh)
    }

    /// Evaluates new vertices on edges; those on one edge of several patches have the position of the first.
    fn add_vertices(&mut self, points: &mut Points, wanted: &[(Edge, Edge, f64)]) -> Result<(), EvaluationError> {
        let mut common: HashMap<Edge, (DVec3, u32)> = HashMap::new();
        for (raw, edge, cut) in wanted {
            let [a, b] = self.ends_of(raw.0, raw.1);
            let mut origin = SurfacePoint { patch: a.patch, u: mix(a.u, b.u, *cut), v: mix(a.v, b.v, *cut) };
            let mut partials = self.partials(origin)?;
            let number = if let Some((position, number)) = common.get(edge) {
                // The other patch may run along the edge with another speed.
                for _ in 0..8 {
                    let gap = *position - DVec3::from_array(partials.point);
                    let along =
                        DVec3::from_array(partials.du) * (b.u - a.u) + DVec3::from_array(partials.dv) * (b.v - a.v);
                    let step = gap.dot(along) / along.length_squared();
                    if !step.is_finite() || step.abs() < 1e-15 {
                        break;
                    }
                    let moved = SurfacePoint {
                        u: (origin.u + step * (b.u - a.u)).clamp(a.u.min(b.u), a.u.max(b.u)),
                        v: (origin.v + step * (b.v - a.v)).clamp(a.v.min(b.v), a.v.max(b.v)),
                        ..origin
                    };
                    let there = self.partials(moved)?;
                    if DVec3::from_array(there.point).distance(*position) >= gap.length() {
                        break;
                    }
                    (origin, partials) = (moved, there);
                }
                partials.point = position.to_array();
                *number
            } else {
                let number = points.add();
                common.insert(*edge, (DVec3::from_array(partials.point), number));
                number
            };
            let normal = unit_normals(self.instance, origin.patch as usize, &[origin.u], &[origin.v], &[partials])?;
            self.mesh.positions.push(partials.point);
            self.mesh.normals.push(normal[0].unwrap_or(DVec3::Z).to_array());
            self.origins.push(origin);
            points.of_vertex.push(number);
        }
        Ok(())
    }

    /// The ends of an edge; one at a pole has the parameter of the other.
    pub(super) fn ends_of(&self, a: u32, b: u32) -> [SurfacePoint; 2] {
        let ends = [a, b].map(|i| self.origins[i as usize]);
        let mut found = ends;
        for k in 0..2 {
            match self.pole(&ends[k]) {
                Some(0) => found[k].u = ends[1 - k].u,
                Some(_) => found[k].v = ends[1 - k].v,
                None => {}
            }
        }
        found
    }

    /// The parameter that says nothing at a vertex, if it is a pole: 0 for u, 1 for v.
    pub(super) fn pole(&self, at: &SurfacePoint) -> Option<usize> {
        let poles = &self.poles[at.patch as usize];
        poles.iter().find(|side| side.has(at.u, at.v)).map(|side| side.along)
    }

    /// (u, v) of barycentric coordinates of a triangle. A corner at a pole has no part in the parameter that says
    /// nothing there.
    pub(super) fn uv(&self, triangle: usize) -> impl Fn([f64; 3]) -> (f64, f64) + use<> {
        let corners = self.mesh.triangles[triangle].map(|i| self.origins[i as usize]);
        let poles = corners.map(|c| self.pole(&c));
        let is_plain = poles.iter().all(Option::is_none);
        let mean = move |axis: usize, [a, b, c]: [f64; 3]| {
            let values = corners.map(|corner| if axis == 0 { corner.u } else { corner.v });
            let sum = |[a, b, c]: [f64; 3]| a * values[0] + b * values[1] + c * values[2];
            if is_plain {
                return sum([a, b, c]);
            }
            let counts = [0, 1, 2].map(|k| f64::from(u8::from(poles[k] != Some(axis))));
            let counted = [a * counts[0], b * counts[1], c * counts[2]];
            let all: f64 = counted.iter().sum();
            if all > 0.0 && all < 1.0 { sum(counted) / all } else { sum([a, b, c]) }
        };
        move |weights| (mean(0, weights), mean(1, weights))
    }

    /// The place in space, on the flat triangle, of barycentric coordinates.
    pub(super) fn position(&self, triangle: usize) -> impl Fn([f64; 3]) -> DVec3 + use<> {
        let corners = self.mesh.corners(self.mesh.triangles[triangle]);
        move |weights| (0..3).map(|k| weights[k] * corners[k]).sum()
    }

    pub(super) fn partials(&self, at: SurfacePoint) -> Result<Partials, EvaluationError> {
        let mut partials = [Partials::default()];
        self.instance.partials(at.patch as usize, &[at.u], &[at.v], &mut partials)?;
        Ok(partials[0])
    }

    /// The triangles of a triangle some of whose edges are divided.
    fn pieces(&self, [a, b, c]: [u32; 3], [ab, bc, ca]: [Option<u32>; 3]) -> Vec<[u32; 3]> {
        match (ab, bc, ca) {
            (None, None, None) => vec![[a, b, c]],
            (Some(m), None, None) => vec![[a, m, c], [m, b, c]],
            (None, Some(m), None) => vec![[b, m, a], [m, c, a]],
            (None, None, Some(m)) => vec![[c, m, b], [m, a, b]],
            (Some(m), Some(n), None) => self.two([a, b, c], m, n),
            (None, Some(m), Some(n)) => self.two([b, c, a], m, n),
            (Some(n), None, Some(m)) => self.two([c, a, b], m, n),
            (Some(m), Some(n), Some(o)) => vec![[a, m, o], [m, b, n], [o, n, c], [m, n, o]],
        }
    }

    /// Three triangles of one whose edges ab and bc are divided at m and n: the corner at b, and the rest over its
    /// shorter diagonal.
    fn two(&self, [a, b, c]: [u32; 3], m: u32, n: u32) -> Vec<[u32; 3]> {
        let distance = |i: u32, j: u32| {
            let [p, q] = [i, j].map(|i| DVec3::from_array(self.mesh.positions[i as usize]));
            p.distance_squared(q)
        };
        let corner = [m, b, n];
        if distance(a, n) <= distance(m, c) {
            vec![corner, [a, m, n], [a, n, c]]
        } else {
            vec![corner, [a, m, c], [m, n, c]]
        }
    }
}

/// Numbers of points: vertices at one position have one.
pub(super) struct Points {
    pub(super) of_vertex: Vec<u32>,
    count: u32,
}

impl Points {
    pub(super) fn of(mesh: &TriangleMesh) -> Self {
        let of_vertex = mesh.position_numbers();
        let count = of_vertex.iter().max().map_or(0, |last| last + 1);
        Self { of_vertex, count }
    }

    pub(super) fn add(&mut self) -> u32 {
        self.count += 1;
        self.count - 1
    }

    /// The edge between two vertices, and whether it runs the other way.
    pub(super) fn edge(&self, a: u32, b: u32) -> (Edge, bool) {
        let [a, b] = [a, b].map(|i| self.of_vertex[i as usize]);
        ((a.min(b), a.max(b)), a > b)
    }
}

pub(super) fn mix(a: f64, b: f64, s: f64) -> f64 {
    a + s * (b - a)
}

/// The same of barycentric coordinates.
pub(super) fn between(a: [f64; 3], b: [f64; 3], s: f64) -> [f64; 3] {
    [0, 1, 2].map(|k| mix(a[k], b[k], s))
}
