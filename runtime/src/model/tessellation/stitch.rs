//! Edges of trimmed patches that are the same curve: both get the vertices of either.
//!
//! Where two patches meet along a curve on which each has vertices of its own, a narrow gap is open between their
//! edges. It is closed from its ends: of two edges that leave one vertex side by side, the longer one is divided at the
//! end of the shorter one, which moves the end of the gap there. So a vertex is only ever put on the edge beside its
//! own, and not on one that happens to pass near it.

use super::folds;
use super::refine::{Refinement, mix};
use super::rim::Rim;
use super::{SurfacePoint, unit_normals};
use crate::mesh::retain_marked;
use crate::model::{EvaluationError, Partials};
use glam::DVec3;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

/// Vertices so near to each other are one, as a part of the chord: edges are found to rounding, and neither is longer
/// than a fraction of a step then.
const SAME: f64 = 1e-3;
/// The widest gap, in chords: either side may leave the curve by one.
const WIDEST: f64 = 2.5;
/// The largest ratio of width and length at the end of a gap.
const STEEPEST: f64 = 0.35;
/// The least cosine between two edges for which a gap between them begins in their middle.
const ALONG: f64 = 0.8;
/// Rounds of looking for gaps without an end.
const ROUNDS: usize = 12;
/// Holes so short, in chords, are closed whatever their shape: triangles as small as the chord are not divided, and
/// where several edges meet they may leave a hole of their size.
const SMALL_HOLE: f64 = 16.0;
/// Mean width, in chords, of holes within one patch that are closed as well, as where it ends in a point between two
/// others. What is open by more may be meant to be so.
const SLIT: f64 = 0.25;
/// The most open border of a patch, in chords, at which holes are closed in this way and more than once: where a fillet
/// runs out over another face it was 50 at most, of all patches together, and of two cylinders that touch 720.
const LONG: f64 = 100.0;
/// Rounds of closing such holes: where three edges run into each other, closing one may leave a smaller one.
const ROUNDS_OF_HOLES: usize = 4;
/// Steps that find a vertex on the other patch.
const STEPS: usize = 12;

/// Closes the gaps between patches of which one at least is trimmed, as is said of each by its number. Borders of two
/// others that run near each other are not one curve.
///
/// # Errors
/// The surface cannot be evaluated.
pub(super) fn stitch(mesh: &mut Refinement<'_>, is_trimmed: &[bool]) -> Result<(), EvaluationError> {
    if mesh.bodies.iter().any(|body| *body != 0) {
        stitch_among(mesh, is_trimmed, Among::EachBody)?;
    }
    stitch_among(mesh, is_trimmed, Among::All)
}

/// Which patches are joined to each other.
#[derive(Clone, Copy, PartialEq)]
enum Among {
    /// Those of one part. Where parts have a wall in common, as a dovetail and its groove, four surfaces meet in its
    /// edges, which are not the same to the last bit: joined by nearness alone they were joined across.
    EachBody,
    /// All, for the borders that parts leave open by themselves.
    All,
}

fn stitch_among(mesh: &mut Refinement<'_>, is_trimmed: &[bool], among: Among) -> Result<(), EvaluationError> {
    merge(mesh, among);
    drop_flat(mesh);
    let mut gaps = Gaps::of(mesh, is_trimmed, among);
    gaps.close()?;
    for _ in 0..ROUNDS {
        if !gaps.begin()? {
            break;
        }
    }
    let is_long = gaps.patches_with_long_borders();
    for round in 0..ROUNDS_OF_HOLES {
        let mut gaps = Gaps::of(mesh, is_trimmed, among);
        gaps.turns = round > 0;
        let any = gaps.mark_small_holes(&is_long);
        gaps.close()?;
        drop_flat(mesh);
        folds::drop(mesh, is_trimmed);
        if !any {
            break;
        }
    }
    folds::turn(mesh, is_trimmed);
    Ok(())
}

/// An edge of a triangle that no other triangle has.
#[derive(Clone, Copy)]
struct Open {
    triangle: usize,
    /// Its vertices in the triangle's order.
    ends: [u32; 2],
    /// Whether it belongs to a hole that is closed whatever its shape.
    in_small_hole: bool,
}

/// The edges without a neighbour, by the positions of their ends. Where those of several parts are at one place, as of
/// a peg in a hole, the one that its own part has no neighbour for.
fn open_edges(mesh: &Refinement<'_>, number: &[u32]) -> Vec<Open> {
    let mut of_edge: HashMap<(u32, u32), Vec<(Open, bool)>> = HashMap::new();
    for (triangle, corners) in mesh.mesh.triangles.iter().enumerate() {
        for side in 0..3 {
            let ends = [corners[side], corners[(side + 1) % 3]];
            let [a, b] = ends.map(|i| number[i as usize]);
            if a != b {
                let open = Open { triangle, ends, in_small_hole: false };
                of_edge.entry((a.min(b), a.max(b))).or_default().push((open, a < b));
            }
        }
    }
    let alone = |edges: Vec<(Open, bool)>| {
        let forth = edges.iter().filter(|(_, forth)| *forth).count();
        let more = 2 * forth > edges.len();
        if edges.len().is_multiple_of(2) {
            return None;
        }
        let body = |(open, _): &(Open, bool)| mesh.bodies[mesh.patches[open.triangle] as usize];
        let is_alone = |edge: &&(Open, bool)| edges.iter().filter(|other| body(other) == body(edge)).count() % 2 == 1;
        let mut wanted = edges.iter().filter(|(_, forth)| *forth == more);
        wanted.clone().find(is_alone).or_else(|| wanted.next()).copied()
    };
    let mut open: Vec<Open> = of_edge.into_values().filter_map(alone).map(|(open, _)| open).collect();
    open.sort_unstable_by_key(|o| (o.triangle, o.ends));
    open
}

/// By vertex, the number of its position; where bodies are looked at one by one, of its position and its body.
fn numbers(mesh: &Refinement<'_>, among: Among) -> Vec<u32> {
    let numbers = mesh.mesh.position_numbers();
    if among == Among::All {
        return numbers;
    }
    let mut known: HashMap<(u32, usize), u32> = HashMap::with_capacity(numbers.len());
    let number = |(vertex, number): (usize, u32)| {
        let next = known.len() as u32;
        *known.entry((number, body(mesh, vertex as u32))).or_insert(next)
    };
    numbers.into_iter().enumerate().map(number).collect()
}

/// The number of the part of a vertex.
fn body(mesh: &Refinement<'_>, vertex: u32) -> usize {
    mesh.bodies[mesh.origins[vertex as usize].patch as usize]
}

pub(super) fn position(mesh: &Refinement<'_>, vertex: u32) -> DVec3 {
    DVec3::from_array(mesh.mesh.positions[vertex as usize])
}

/// Puts vertices at open edges that are next to each other in one place.
fn merge(mesh: &mut Refinement<'_>, among: Among) {
    let open = open_edges(mesh, &numbers(mesh, among));
    let reach = SAME * mesh.chord;
    let rim = Rim::new(mesh, open.iter().flat_map(|o| o.ends).collect(), 4.0 * reach);
    let mut moved: HashMap<u32, [f64; 3]> = HashMap::new();
    for vertex in rim.vertices() {
        let here = position(mesh, *vertex);
        let first = rim.near(here, here, reach).into_iter().find(|other| {
            let may_be_one = among == Among::All || body(mesh, *other) == body(mesh, *vertex);
            may_be_one
                && *other < *vertex
                && !moved.contains_key(other)
                && position(mesh, *other).distance(here) <= reach
        });
        if let Some(first) = first {
            moved.insert(*vertex, mesh.mesh.positions[first as usize]);
        }
    }
    moved.into_iter().for_each(|(vertex, place)| mesh.mesh.positions[vertex as usize] = place);
}

/// Drops triangles two of whose corners are in one place.
fn drop_flat(mesh: &mut Refinement<'_>) {
    let number = mesh.mesh.position_numbers();
    let has_area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| number[i as usize]);
        a != b && b != c && c != a
    };
    let kept: Vec<bool> = mesh.mesh.triangles.iter().map(has_area).collect();
    retain_marked(&mut mesh.mesh.triangles, &kept);
    retain_marked(&mut mesh.patches, &kept);
}

/// The open edges of a mesh while they are closed.
struct Gaps<'m, 'a> {
    mesh: &'m mut Refinement<'a>,
    /// By patch.
    is_trimmed: &'m [bool],
    among: Among,
    /// Numbers of vertices: those at one position, or of one body there, have one.
    number: Vec<u32>,
    /// `None` where it was closed or divided.
    edges: Vec<Option<Open>>,
    /// The edges at a number, and those of a triangle; closed ones too.
    at: HashMap<u32, Vec<usize>>,
    of_triangle: HashMap<usize, Vec<usize>>,
    /// Ends of gaps: their widths as bits, which have the order of positive numbers, and the shorter and the longer
    /// edge.
    ends: BinaryHeap<Reverse<(u64, usize, usize)>>,
    /// Whether the edges of a small hole may run either way about it: beside a fold, narrower than the chord, they do.
    turns: bool,
}

impl<'m, 'a> Gaps<'m, 'a> {
    fn of(mesh: &'m mut Refinement<'a>, is_trimmed: &'m [bool], among: Among) -> Self {
        let number = numbers(mesh, among);
        let open = open_edges(mesh, &number);
        let (at, of_triangle, ends) = (HashMap::new(), HashMap::new(), BinaryHeap::new());
        let mut gaps = Self { mesh, is_trimmed, among, number, edges: Vec::new(), at, of_triangle, ends, turns: false };
        open.into_iter().for_each(|edge| gaps.add(edge));
        (0..gaps.edges.len()).for_each(|edge| gaps.look(edge));
        gaps
    }

    fn numbers(&self, edge: &Open) -> [u32; 2] {
        edge.ends.map(|i| self.number[i as usize])
    }

    fn patch(&self, edge: &Open) -> u32 {
        self.mesh.patches[edge.triangle]
    }

    /// Whether two edges are of different patches that may meet along a curve on which each has its own vertices.
    fn may_meet(&self, a: &Open, b: &Open) -> bool {
        let [a, b] = [a, b].map(|edge| self.patch(edge));
        let bodies = [a, b].map(|patch| self.mesh.bodies[patch as usize]);
        if self.among == Among::EachBody && bodies[0] != bodies[1] {
            return false;
        }
        a != b && (self.is_trimmed[a as usize] || self.is_trimmed[b as usize])
    }

    fn length(&self, edge: &Open) -> f64 {
        let [a, b] = edge.ends.map(|i| position(self.mesh, i));
        a.distance(b)
    }

    /// The open edges at a number.
    fn open_at(&self, number: u32) -> impl Iterator<Item = usize> {
        self.at.get(&number).into_iter().flatten().copied().filter(|edge| self.edges[*edge].is_some())
    }

    /// Adds an open edge, or closes the one between the same ends.
    fn add(&mut self, edge: Open) {
        let [a, b] = self.numbers(&edge);
        let same = |other: &usize| self.edges[*other].is_some_and(|other| self.numbers(&other).contains(&b));
        let same = self.open_at(a).find(same);
        if let Some(other) = same {
            self.edges[other] = None;
            return;
        }
        let number = self.edges.len();
        self.edges.push(Some(edge));
        [a, b].into_iter().for_each(|end| self.at.entry(end).or_default().push(number));
        self.of_triangle.entry(edge.triangle).or_default().push(number);
    }

    /// Notes the ends of gaps that an edge has with others.
    fn look(&mut self, edge: usize) {
        let Some(open) = self.edges[edge] else { return };
        for number in self.numbers(&open) {
            for other in self.open_at(number).filter(|other| *other != edge).collect::<Vec<_>>() {
                self.ends.extend(self.end(edge, other, number).map(Reverse));
            }
        }
    }

    /// The end of the gap between two edges that leave one vertex, if there is one.
    fn end(&self, first: usize, second: usize, number: u32) -> Option<(u64, usize, usize)> {
        let edges = [self.edges[first]?, self.edges[second]?];
        let outwards = edges.map(|edge| {
            let [a, b] = edge.ends.map(|i| position(self.mesh, i));
            if self.numbers(&edge)[0] == number { b - a } else { a - b }
        });
        let lengths = outwards.map(DVec3::length);
        let ([short, long], [shorter, longer]) = if lengths[0] <= lengths[1] {
            ([first, second], outwards)
        } else {
            ([second, first], [outwards[1], outwards[0]])
        };
        let along = (shorter.dot(longer) / longer.length_squared()).max(0.0);
        let width = (shorter - along * longer).length();
        let leaves = edges.iter().filter(|edge| self.numbers(edge)[0] == number).count() == 1;
        let is_gap = if edges.iter().all(|edge| edge.in_small_hole) {
            leaves || self.turns
        } else {
            self.may_meet(&edges[0], &edges[1]) && width <= (WIDEST * self.mesh.chord).min(STEEPEST * shorter.length())
        };
        is_gap.then_some((width.to_bits(), short, long))
    }

    /// Closes gaps from their ends, the narrowest first.
    fn close(&mut self) -> Result<(), EvaluationError> {
        while let Some(Reverse((_, short, long))) = self.ends.pop() {
            let (Some(shorter), Some(longer)) = (self.edges[short], self.edges[long]) else { continue };
            let common = self.numbers(&longer);
            let [a, b] = self.numbers(&shorter);
            let vertex = shorter.ends[usize::from(common.contains(&a))];
            if common.contains(&a) != common.contains(&b) {
                self.divide(long, vertex)?;
            }
        }
        Ok(())
    }

    /// Divides an edge at a vertex of another patch, and its triangle.
    fn divide(&mut self, edge: usize, vertex: u32) -> Result<(), EvaluationError> {
        let Some(open) = self.edges[edge].take() else { return Ok(()) };
        let [a, b] = open.ends;
        let corners = self.mesh.mesh.triangles[open.triangle];
        let Some(tip) = corners.into_iter().find(|i| ![a, b].contains(i)) else { return Ok(()) };
        let new = add_at(self.mesh, open.ends, vertex)?;
        self.number.push(self.number[vertex as usize]);
        let second = self.mesh.mesh.triangles.len();
        self.mesh.mesh.triangles[open.triangle] = [a, new, tip];
        self.mesh.mesh.triangles.push([new, b, tip]);
        self.mesh.patches.push(self.mesh.patches[open.triangle]);
        for other in self.of_triangle.get(&open.triangle).cloned().unwrap_or_default() {
            if let Some(moved) = self.edges[other].as_mut().filter(|o| o.triangle == open.triangle && o.ends[0] == b) {
                moved.triangle = second;
                self.of_triangle.entry(second).or_default().push(other);
            }
        }
        let first = self.edges.len();
        self.add(Open { ends: [a, new], ..open });
        self.add(Open { ends: [new, b], triangle: second, ..open });
        (first..self.edges.len()).for_each(|edge| self.look(edge));
        Ok(())
    }

    /// Begins gaps that have no end, as between two circles without a common vertex, where they are narrowest: divides
    /// edges at vertices on them, and closes the gaps from there. Whether there were any.
    fn begin(&mut self) -> Result<bool, EvaluationError> {
        let widest = WIDEST * self.mesh.chord;
        let open: Vec<(usize, Open)> = self.edges.iter().enumerate().filter_map(|(k, e)| Some((k, (*e)?))).collect();
        let mean = open.iter().map(|(_, o)| self.length(o)).sum::<f64>() / open.len().max(1) as f64;
        let rim = Rim::new(self.mesh, open.iter().flat_map(|(_, o)| o.ends).collect(), mean.max(widest));
        let mut found = Vec::new();
        for (k, edge) in &open {
            let [a, b] = edge.ends.map(|i| position(self.mesh, i));
            let width = |vertex: &u32| self.width(edge, *vertex).map(|width| (width.to_bits(), *k, *vertex));
            found.extend(rim.near(a, b, widest).iter().filter_map(width));
        }
        found.sort_unstable();
        let mut any = false;
        for (_, edge, vertex) in found {
            if self.edges[edge].is_some() && self.open_at(self.number[vertex as usize]).next().is_some() {
                any = true;
                self.divide(edge, vertex)?;
                self.close()?;
            }
        }
        Ok(any)
    }

    /// The distance of a vertex from an edge of another patch, if an open edge of the vertex runs along it.
    fn width(&self, edge: &Open, vertex: u32) -> Option<f64> {
        let [a, b] = edge.ends.map(|i| position(self.mesh, i));
        let (p, length) = (position(self.mesh, vertex), b - a);
        let s = (p - a).dot(length) / length.length_squared();
        let width = p.distance(a + s * length);
        let number = self.number[vertex as usize];
        let runs_along = |other: usize| {
            let Some(other) = self.edges[other].filter(|o| self.may_meet(o, edge)) else { return false };
            let [c, d] = other.ends.map(|i| position(self.mesh, i));
            (d - c).normalize_or_zero().dot(length.normalize_or_zero()).abs() > ALONG
        };
        let is_beside =
            s > 0.0 && s < 1.0 && width <= WIDEST * self.mesh.chord && !self.numbers(edge).contains(&number);
        (is_beside && self.open_at(number).any(runs_along)).then_some(width)
    }

    /// By patch, whether so much of its border is open that it may touch another one along a line: there holes are
    /// closed once and between patches only, as rounding decides what is there.
    fn patches_with_long_borders(&self) -> Vec<bool> {
        let mut lengths = vec![0.0; self.is_trimmed.len()];
        self.edges.iter().flatten().for_each(|open| lengths[self.patch(open) as usize] += self.length(open));
        lengths.into_iter().map(|length| length > LONG * self.mesh.chord).collect()
    }

    /// Marks the edges of small holes between patches, and notes where they can be closed. Whether there are any.
    fn mark_small_holes(&mut self, is_long: &[bool]) -> bool {
        let mut seen = vec![false; self.edges.len()];
        for first in 0..self.edges.len() {
            let mut way: Vec<usize> = Vec::new();
            let mut next = Some(first).filter(|k| self.edges[*k].is_some() && !seen[*k]);
            // Where the way has been: the beginning of each of its edges.
            let mut starts: Vec<u32> = Vec::new();
            let mut at = next.and_then(|k| self.edges[k]).map(|open| self.numbers(&open)[0]);
            while let (Some(edge), Some(start)) = (next, at) {
                seen[edge] = true;
                way.push(edge);
                starts.push(start);
                let Some([a, b]) = self.edges[edge].map(|open| self.numbers(&open)) else { break };
                let end = if a == start { b } else { a };
                // Back where the way has been, the hole is what lies between.
                if let Some(from) = starts.iter().position(|start| *start == end) {
                    self.mark(&way[from..], is_long);
                    break;
                }
                let leaves = |k: &usize| self.edges[*k].is_some_and(|open| self.numbers(&open)[0] == end);
                next = self.open_at(end).find(|k| !seen[*k] && (leaves(k) || self.turns));
                at = Some(end);
            }
        }
        let marked = |k: &usize| self.edges[*k].is_some_and(|open| open.in_small_hole);
        let marked: Vec<usize> = (0..seen.len()).filter(marked).collect();
        marked.iter().for_each(|edge| self.look(*edge));
        !marked.is_empty()
    }

    /// Marks the edges of a hole if it is small, and between several patches or but a slit.
    fn mark(&mut self, hole: &[usize], is_long: &[bool]) {
        let edges: Vec<Open> = hole.iter().filter_map(|k| self.edges[*k]).collect();
        let Some(first) = edges.first() else { return };
        let length: f64 = edges.iter().map(|open| self.length(open)).sum();
        let from = position(self.mesh, first.ends[0]);
        let spanned = |open: &Open| {
            let [a, b] = open.ends.map(|i| position(self.mesh, i) - from);
            a.cross(b)
        };
        let area = 0.5 * edges.iter().map(spanned).sum::<DVec3>().length();
        let is_slit = self.is_trimmed[self.patch(first) as usize] && area <= SLIT * length * self.mesh.chord;
        let is_mixed = edges.iter().any(|open| self.patch(open) != self.patch(first));
        let at_a_point = edges.iter().all(|open| !is_long[self.patch(open) as usize]);
        let may_close = (is_mixed && !self.turns) || (at_a_point && (is_mixed || is_slit));
        if length <= SMALL_HOLE * self.mesh.chord && may_close {
            hole.iter().filter_map(|k| self.edges[*k].as_mut().map(|open| open.in_small_hole = true)).for_each(drop);
        }
    }
}

/// A vertex of a patch where a vertex of another one is, next to the edge between two of its own.
fn add_at(mesh: &mut Refinement<'_>, [a, b]: [u32; 2], vertex: u32) -> Result<u32, EvaluationError> {
    let target = position(mesh, vertex);
    let [from, to] = [a, b].map(|i| position(mesh, i));
    let s = (target - from).dot(to - from) / (to - from).length_squared();
    let [first, last] = mesh.ends_of(a, b);
    let mut at = SurfacePoint { patch: first.patch, u: mix(first.u, last.u, s), v: mix(first.v, last.v, s) };
    let mut partials = mesh.partials(at)?;
    for _ in 0..STEPS {
        let Some((du, dv)) = step(&partials, target) else { break };
        let next = SurfacePoint { u: (at.u + du).clamp(0.0, 1.0), v: (at.v + dv).clamp(0.0, 1.0), ..at };
        let there = mesh.partials(next)?;
        let distance = |p: &Partials| DVec3::from_array(p.point).distance(target);
        if !(distance(&there) < distance(&partials)) {
            break;
        }
        (at, partials) = (next, there);
    }
    let normal = unit_normals(mesh.instance, at.patch as usize, &[at.u], &[at.v], &[partials])?;
    mesh.stretch = mesh.stretch.max(DVec3::from_array(partials.point).distance(target));
    let new = mesh.mesh.positions.len() as u32;
    mesh.mesh.positions.push(target.to_array());
    mesh.mesh.normals.push(normal[0].unwrap_or(DVec3::Z).to_array());
    mesh.origins.push(at);
    Ok(new)
}

/// The step in u and v towards the foot of a point.
pub(super) fn step(p: &Partials, target: DVec3) -> Option<(f64, f64)> {
    let [point, du, dv] = [p.point, p.du, p.dv].map(DVec3::from_array);
    let (gap, e, f, g) = (target - point, du.dot(du), du.dot(dv), dv.dot(dv));
    let (x, y, det) = (gap.dot(du), gap.dot(dv), e * g - f * f);
    let step = ((g * x - f * y) / det, (e * y - f * x) / det);
    (step.0.is_finite() && step.1.is_finite()).then_some(step)
}
