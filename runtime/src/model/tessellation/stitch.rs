//! Edges of trimmed patches that are the same curve: both get the vertices of either.

use super::refine::Refinement;
use super::{SurfacePoint, unit_normals};
use crate::model::{EvaluationError, Partials};
use glam::DVec3;
use std::collections::HashMap;

/// Vertices so near to each other are one, as a part of the chord: edges are found to rounding, and neither is longer
/// than a fraction of a step then.
const SAME: f64 = 1e-3;
/// Vertices so near to an edge lie on it, in chords: either side may leave the curve by one.
const ON_EDGE: f64 = 2.5;
/// Rounds of dividing edges at the vertices on them.
const ROUNDS: usize = 12;
/// Steps that find a vertex on the other patch.
const STEPS: usize = 12;

/// An edge of a triangle that no other triangle has.
#[derive(Clone, Copy)]
struct Open {
    triangle: usize,
    side: usize,
}

/// Gives open edges the vertices of other open edges that lie on them.
pub(super) fn stitch(mesh: &mut Refinement<'_>) -> Result<(), EvaluationError> {
    merge(mesh);
    for _ in 0..ROUNDS {
        if !divide(mesh)? {
            break;
        }
    }
    Ok(())
}

/// The edges without a neighbour, by the positions of their ends.
fn open_edges(mesh: &Refinement<'_>) -> Vec<Open> {
    let number = mesh.mesh.position_numbers();
    let mut count: HashMap<(u32, u32), (usize, Open)> = HashMap::new();
    for (triangle, corners) in mesh.mesh.triangles.iter().enumerate() {
        for side in 0..3 {
            let [a, b] = [corners[side], corners[(side + 1) % 3]].map(|i| number[i as usize]);
            if a != b {
                count.entry((a.min(b), a.max(b))).or_insert((0, Open { triangle, side })).0 += 1;
            }
        }
    }
    let mut open: Vec<Open> = count.into_values().filter(|(n, _)| *n == 1).map(|(_, open)| open).collect();
    open.sort_unstable_by_key(|o| (o.triangle, o.side));
    open
}

/// The vertices at open edges, each once, and all of them by cells of a grid.
struct Rim {
    vertices: Vec<u32>,
    cells: HashMap<[i64; 3], Vec<u32>>,
    cell: f64,
}

impl Rim {
    fn new(mesh: &Refinement<'_>, open: &[Open], cell: f64) -> Self {
        let mut vertices: Vec<u32> = open.iter().flat_map(|o| mesh.side(o.triangle, o.side).0).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for vertex in &vertices {
            cells.entry(key(position(mesh, *vertex), cell)).or_default().push(*vertex);
        }
        Self { vertices, cells, cell }
    }

    /// Vertices whose cells the box of two points touches, widened.
    fn near(&self, a: DVec3, b: DVec3, margin: f64) -> Vec<u32> {
        let low = key(a.min(b) - margin, self.cell);
        let high = key(a.max(b) + margin, self.cell);
        let spans = [0, 1, 2].map(|k| high[k] - low[k] + 1);
        let cells = spans.iter().map(|n| *n as f64).product::<f64>();
        if cells > self.vertices.len() as f64 {
            return self.vertices.clone();
        }
        let mut near = Vec::new();
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    near.extend(self.cells.get(&[x, y, z]).into_iter().flatten());
                }
            }
        }
        near.sort_unstable();
        near
    }
}

fn key(p: DVec3, cell: f64) -> [i64; 3] {
    (p / cell).floor().to_array().map(|c| c as i64)
}

fn position(mesh: &Refinement<'_>, vertex: u32) -> DVec3 {
    DVec3::from_array(mesh.mesh.positions[vertex as usize])
}

/// Puts vertices at open edges that are next to each other in one place.
fn merge(mesh: &mut Refinement<'_>) {
    let open = open_edges(mesh);
    let reach = SAME * mesh.chord;
    let rim = Rim::new(mesh, &open, 4.0 * reach);
    let mut moved: HashMap<u32, [f64; 3]> = HashMap::new();
    for vertex in &rim.vertices {
        let here = position(mesh, *vertex);
        let first = rim.near(here, here, reach).into_iter().find(|other| {
            *other < *vertex && !moved.contains_key(other) && position(mesh, *other).distance(here) <= reach
        });
        if let Some(first) = first {
            moved.insert(*vertex, mesh.mesh.positions[first as usize]);
        }
    }
    moved.into_iter().for_each(|(vertex, place)| mesh.mesh.positions[vertex as usize] = place);
}

/// Divides open edges at vertices of others that lie on them; whether there were any.
fn divide(mesh: &mut Refinement<'_>) -> Result<bool, EvaluationError> {
    let open = open_edges(mesh);
    let longest = open.iter().map(|o| mesh.side(o.triangle, o.side).1).map(|[a, b]| a.distance(b)).fold(0.0, f64::max);
    let mean = longest.max(mesh.chord) / 8.0;
    let rim = Rim::new(mesh, &open, mean.max(mesh.chord));
    let mut taken: HashMap<usize, ()> = HashMap::new();
    let mut cuts = Vec::new();
    for edge in &open {
        let (ends, [a, b]) = mesh.side(edge.triangle, edge.side);
        let length = b - a;
        let on_edge = |vertex: &u32| {
            let p = position(mesh, *vertex);
            let s = (p - a).dot(length) / length.length_squared();
            let aside = p.distance(a + s * length);
            let allowed = (ON_EDGE * mesh.chord).min(0.25 * length.length());
            (!ends.contains(vertex) && s > 0.0 && s < 1.0 && aside <= allowed && p != a && p != b)
                .then_some((s, *vertex))
        };
        let near = rim.near(a, b, ON_EDGE * mesh.chord);
        // The one nearest to the middle: both halves are looked at again.
        let best = near.iter().filter_map(on_edge).min_by(|x, y| (x.0 - 0.5).abs().total_cmp(&(y.0 - 0.5).abs()));
        if let Some((s, vertex)) = best
            && taken.insert(edge.triangle, ()).is_none()
        {
            cuts.push((*edge, s, vertex));
        }
    }
    for (edge, s, vertex) in &cuts {
        split(mesh, *edge, *s, *vertex)?;
    }
    Ok(!cuts.is_empty())
}

/// Divides a triangle at a vertex of another patch that lies on one of its edges.
fn split(mesh: &mut Refinement<'_>, edge: Open, s: f64, vertex: u32) -> Result<(), EvaluationError> {
    let ([a, b], _) = mesh.side(edge.triangle, edge.side);
    let target = position(mesh, vertex);
    let [first, last] = mesh.ends_of(a, b);
    let mut at = SurfacePoint {
        patch: first.patch,
        u: super::refine::mix(first.u, last.u, s),
        v: super::refine::mix(first.v, last.v, s),
    };
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
    let new = mesh.mesh.positions.len() as u32;
    mesh.mesh.positions.push(target.to_array());
    mesh.mesh.normals.push(normal[0].unwrap_or(DVec3::Z).to_array());
    mesh.origins.push(at);
    let corners = mesh.mesh.triangles[edge.triangle];
    let tip = corners[(edge.side + 2) % 3];
    mesh.mesh.triangles[edge.triangle] = [a, new, tip];
    mesh.mesh.triangles.push([new, b, tip]);
    mesh.patches.push(mesh.patches[edge.triangle]);
    Ok(())
}

/// The step in u and v towards the foot of a point.
fn step(p: &Partials, target: DVec3) -> Option<(f64, f64)> {
    let [point, du, dv] = [p.point, p.du, p.dv].map(DVec3::from_array);
    let (gap, e, f, g) = (target - point, du.dot(du), du.dot(dv), dv.dot(dv));
    let (x, y, det) = (gap.dot(du), gap.dot(dv), e * g - f * f);
    let step = ((g * x - f * y) / det, (e * y - f * x) / det);
    (step.0.is_finite() && step.1.is_finite()).then_some(step)
}
