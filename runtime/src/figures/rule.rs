//! Quadrature: places of a patch and weights in (u, v).

use super::edges::{self, Edge};
use super::integrals::Sums;
use super::places::partials_at;
use crate::model::{Breaks, EvaluationError, Instance, Partials, Tessellation, spans};
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Abscissae and weights of Gauss and Legendre's rule of four points on [-1, 1].
const GAUSS: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// Cells each way of every smooth stretch of a patch: at first and at most; they are doubled until area and volume
/// change by less than this, relative to the area and to the area times its root.
const FIRST_CELLS: usize = 4;
const MOST_CELLS: usize = 128;
const SETTLED: f64 = 1e-9;

/// Barycentric coordinates and weights of Strang and Fix's rule of six points on triangles, exact to the fourth degree
/// (Dunavant 1985, table II): each for the three places where another coordinate is the odd one.
const TRIANGLE: [(f64, f64, f64); 2] = [
    (0.108_103_018_168_070, 0.445_948_490_915_965, 0.223_381_589_678_011),
    (0.816_847_572_980_459, 0.091_576_213_509_771, 0.109_951_743_655_322),
];

/// Steps for differences of motions, as a part of a cell or triangle, within which the motion is smooth: differences
/// are then exact to some 1e-9.
const STEP: f64 = 2e-5;

/// Places and weights for integrals over (u, v).
#[derive(Debug, Default)]
pub(super) struct Rule {
    pub(super) u: Vec<f64>,
    pub(super) v: Vec<f64>,
    pub(super) weights: Vec<f64>,
    /// For each place steps in u and in v within which the patch is smooth.
    pub(super) steps: Vec<[f64; 2]>,
    /// Whether it was made of triangles.
    pub(super) is_by_triangles: bool,
    /// The edges of a trimmed patch.
    pub(super) edges: Vec<Edge>,
}

impl Rule {
    /// The partials at its places.
    pub(super) fn partials(&self, instance: &dyn Instance, patch: usize) -> Result<Vec<Partials>, EvaluationError> {
        let mut partials = vec![Partials::default(); self.u.len()];
        instance.partials(patch, &self.u, &self.v, &mut partials)?;
        Ok(partials)
    }

    pub(super) fn sums(&self, instance: &dyn Instance, patch: usize, origin: DVec3) -> Result<Sums, EvaluationError> {
        let mut sums = Sums::default();
        for (p, weight) in self.partials(instance, patch)?.iter().zip(&self.weights) {
            sums.add(*weight, p, origin);
        }
        Ok(sums)
    }

    fn push(&mut self, at: DVec2, weight: f64, steps: [f64; 2]) {
        self.u.push(at.x);
        self.v.push(at.y);
        self.weights.push(weight);
        self.steps.push(steps);
    }

    /// For the whole of a patch: cells as small as it needs. None where the smallest are not enough, as where corners
    /// run obliquely to u and v.
    pub(super) fn of_patch(instance: &dyn Instance, patch: usize) -> Result<Option<Self>, EvaluationError> {
        let breaks = Breaks::of_patch(instance, patch)?;
        let stretches = [&breaks.u, &breaks.v]
            .map(|breaks| spans(breaks.iter().map(|b| (b.before, b.after))).collect::<Vec<(f64, f64)>>());
        let most = MOST_CELLS / stretches[0].len().max(stretches[1].len()).clamp(1, MOST_CELLS / FIRST_CELLS);
        let mut middle = [[0.0; 3]];
        instance.points(patch, &[0.5], &[0.5], &mut middle)?;
        let origin = DVec3::from(middle[0]);
        let mut cells = FIRST_CELLS;
        let mut rule = Self::on_grid(&stretches, cells);
        let mut last = rule.sums(instance, patch, origin)?;
        while 2 * cells <= most {
            cells *= 2;
            rule = Self::on_grid(&stretches, cells);
            let next = rule.sums(instance, patch, origin)?;
            let settled = (next.area - last.area).abs() <= SETTLED * next.area
                && (next.volume - last.volume).abs() <= SETTLED * next.area * next.area.sqrt();
            last = next;
            if settled {
                return Ok(Some(rule));
            }
        }
        Ok(None)
    }

    fn on_grid(stretches: &[Vec<(f64, f64)>; 2], cells: usize) -> Self {
        let nodes = |stretches: &Vec<(f64, f64)>| -> Vec<(f64, f64, f64)> {
            let node = |(start, end): (f64, f64), cell: usize, (x, weight): (f64, f64)| {
                let half = 0.5 * (end - start) / cells as f64;
                (start + half * ((2 * cell + 1) as f64 + x), half * weight, STEP * half)
            };
            let all = stretches.iter().flat_map(|stretch| {
                (0..cells).flat_map(move |cell| GAUSS.into_iter().map(move |gauss| node(*stretch, cell, gauss)))
            });
            all.collect()
        };
        let [along, across] = [nodes(&stretches[0]), nodes(&stretches[1])];
        let mut rule = Self::default();
        for (v, weight, step_v) in across {
            for (u, other, step_u) in &along {
                rule.push(DVec2::new(*u, v), weight * other, [*step_u, step_v]);
            }
        }
        rule
    }

    /// For what is there of a patch: its triangles, and what is between their chords and the edges of a trimmed one.
    /// `numbers` are those of the vertices' places.
    pub(super) fn of_triangles(
        instance: &dyn Instance,
        fine: &Tessellation,
        patch: usize,
        keep: Option<usize>,
        numbers: &[u32],
    ) -> Result<Self, EvaluationError> {
        let mut rule = Self { is_by_triangles: true, ..Self::default() };
        let group = &fine.mesh.groups[patch];
        let triangles = &fine.mesh.triangles[group.start..group.end];
        let place = |vertex: u32| {
            let origin = &fine.origins[vertex as usize];
            DVec2::new(origin.u, origin.v)
        };
        // Vertices may be several at one place, along lines within the patch, too.
        let mut net: HashMap<[u32; 2], i32> = HashMap::new();
        let side = |a: u32, b: u32| {
            let [a, b] = [a, b].map(|vertex| numbers[vertex as usize]);
            ([a.min(b), a.max(b)], if a < b { 1 } else { -1 })
        };
        let poles = poles(instance, patch, triangles.as_flattened(), place)?;
        for triangle in triangles {
            let at_pole: Vec<usize> = (0..3).filter(|k| poles.contains_key(&triangle[*k])).collect();
            match at_pole[..] {
                [] => rule.add_triangle(triangle.map(place)),
                [k] => {
                    let corners = [triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]];
                    rule.add_triangle_at_pole(corners.map(place), poles[&corners[0]]);
                }
                // A side that is a point: what is between its parameters belongs to the triangle beside it.
                _ => {}
            }
            for k in 0..3 {
                let (edge, direction) = side(triangle[k], triangle[(k + 1) % 3]);
                *net.entry(edge).or_default() += direction;
            }
        }
        let Some(keep) = keep else { return Ok(rule) };
        // At a pole an edge has the parameter of its other end.
        let beside = |vertex: u32, other: u32| {
            let mut at = place(vertex);
            if let Some(free) = poles.get(&vertex) {
                at[*free] = place(other)[*free];
            }
            at
        };
        let mut is_border = |a: u32, b: u32| {
            let (edge, direction) = side(a, b);
            let left = net.get_mut(&edge).filter(|net| **net * direction > 0);
            left.map(|net| *net -= direction).is_some()
        };
        let borders = triangles.iter().flat_map(|t| (0..3).map(|k| [t[k], t[(k + 1) % 3]]));
        let borders = borders.filter(|[a, b]| is_border(*a, *b)).map(|[a, b]| [beside(a, b), beside(b, a)]);
        let borders: Vec<[DVec2; 2]> = borders.collect();
        rule.add_edges(edges::along(instance, [patch, keep], &borders)?);
        Ok(rule)
    }

    fn add_triangle(&mut self, [a, b, c]: [DVec2; 3]) {
        let area = 0.5 * (b - a).perp_dot(c - a);
        let extent = a.max(b).max(c) - a.min(b).min(c);
        let steps = [STEP * extent.x.max(f64::EPSILON.sqrt()), STEP * extent.y.max(f64::EPSILON.sqrt())];
        for (odd, even, weight) in TRIANGLE {
            for [p, q, r] in [[a, b, c], [b, c, a], [c, a, b]] {
                self.push(odd * p + even * (q + r), weight * area, steps);
            }
        }
    }

    /// Adds a triangle whose first corner is at a pole, where the parameter of that axis says nothing: it is all
    /// between its other two corners.
    fn add_triangle_at_pole(&mut self, [pole, a, b]: [DVec2; 3], free: usize) {
        let other = 1 - free;
        let unit = |(x, weight): (f64, f64)| (0.5 * (1.0 + x), 0.5 * weight);
        let length = (b - a)[free];
        let sign = if free == 0 { 1.0 } else { -1.0 };
        for (s, weight_s) in GAUSS.map(unit) {
            let side = a[other] + s * (b - a)[other];
            for (t, weight_t) in GAUSS.map(unit) {
                let mut at = DVec2::ZERO;
                at[free] = a[free] + s * length;
                at[other] = side + t * (pole[other] - side);
                let steps = [0, 1].map(|axis| STEP * (pole - a)[axis].abs().max((b - a)[axis].abs()).max(1e-6));
                self.push(at, sign * weight_s * weight_t * length * (pole[other] - side), steps);
            }
        }
    }

    /// Adds what is between the chords on edges and these.
    fn add_edges(&mut self, edges: Vec<Edge>) {
        for edge in &edges {
            if let Some((at, area)) = edge.segment() {
                let steps = edge.chord().to_array().map(|along| STEP * along.abs().max(f64::EPSILON.sqrt()));
                self.push(at, area, steps);
            }
        }
        self.edges = edges;
    }
}

/// How long the derivative along a border that is a point may be, as a part of the one across it; and how far from the
/// border in its parameter a vertex of it is: where an edge goes through a pole, vertices are some 1e-6 mm beside it.
const POLE: f64 = 1e-4;
const AT_BORDER: f64 = 1e-5;

/// The vertices of a patch at poles, with the axis of the parameter that says nothing there.
fn poles(
    instance: &dyn Instance,
    patch: usize,
    vertices: &[u32],
    place: impl Fn(u32) -> DVec2,
) -> Result<HashMap<u32, usize>, EvaluationError> {
    let on_border = |t: f64| !(AT_BORDER..=1.0 - AT_BORDER).contains(&t);
    let mut found: Vec<u32> = vertices.to_vec();
    found.sort_unstable();
    found.dedup();
    found.retain(|i| on_border(place(*i).x) || on_border(place(*i).y));
    let places: Vec<DVec2> = found.iter().map(|i| place(*i)).collect();
    let lengths = partials_at(instance, patch, &places)?;
    let mut poles = HashMap::new();
    for ((vertex, at), p) in found.into_iter().zip(places).zip(lengths) {
        let [du, dv] = [p.du, p.dv].map(|d| DVec3::from(d).length());
        if on_border(at.y) && du <= POLE * dv {
            poles.insert(vertex, 0);
        } else if on_border(at.x) && dv <= POLE * du {
            poles.insert(vertex, 1);
        }
    }
    Ok(poles)
}
