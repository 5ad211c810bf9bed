//! The model's surface as facets for the search of nearest points: a grid of quadrilaterals a patch, in a tree of boxes
//! that is built once a level and refitted at every evaluation.

use super::tree::{Tree, triangle_closest};
use crate::model::{Instance, Model};
use glam::DVec3;

/// Vertices of the grids in (u, v), and the quadrilaterals between them. Does not depend on the parameters.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    /// One a patch.
    grids: Vec<Grid>,
    /// (u, v) of every vertex.
    uv: Vec<[f64; 2]>,
    quads: Vec<Quad>,
    tree: Tree,
}

/// The grid of one patch.
#[derive(Clone, Debug)]
struct Grid {
    first: usize,
    u: Vec<f64>,
    v: Vec<f64>,
    /// Whether the patch closes in u, and in v, so that a foot point may cross the seam.
    closed: [bool; 2],
    /// Quadrilaterals each way.
    cells: [usize; 2],
}

/// Vertices in the order (u, v), (u+, v), (u+, v+), (u, v+): counter-clockwise about dS/du x dS/dv.
#[derive(Clone, Copy, Debug)]
struct Quad {
    patch: u32,
    vertices: [u32; 4],
}

/// The facets at certain parameters.
#[derive(Clone, Debug)]
pub(crate) struct Facets<'a> {
    layout: &'a Layout,
    positions: Vec<[f64; 3]>,
    tree: Tree,
    /// Patches that could not be evaluated here; they are never found.
    pub(crate) absent: usize,
}

/// The nearest point of the facets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub(crate) patch: u32,
    pub(crate) uv: [f64; 2],
    /// The facet: a hint for the next search from about here.
    pub(crate) quad: u32,
}

/// What a point's own normal demands of the surface that it may belong to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing<'a> {
    /// Unit normal of the point, in the model's frame.
    pub(crate) normal: DVec3,
    /// Per patch: +1 where dS/du x dS/dv points out of the material, -1 where it points into it, 0 where unknown.
    pub(crate) signs: &'a [i8],
}

/// Facets that a search with slack remembers; where there are more within reach, nothing is said of the slack.
const SEEN: usize = 48;
/// The cosine between normals within which a facet may turn from looking one way to looking the other.
const ACROSS: f64 = 0.1;
/// Samples each way when a patch is gauged.
const GAUGE: usize = 12;
/// Limits of a grid's cells each way.
const CELLS: (usize, usize) = (1, 48);

impl Layout {
    /// Facets whose distance from the exact surface is about `tolerance`, at the model's current shape.
    pub(crate) fn new(model: &dyn Model, instance: &dyn Instance, tolerance: f64, size: f64) -> Self {
        Self::of_patches(model, instance, tolerance, size, |_| true)
    }

    /// As `new`, of some patches; the others are never found.
    pub(crate) fn of_patches(
        model: &dyn Model,
        instance: &dyn Instance,
        tolerance: f64,
        size: f64,
        chosen: impl Fn(usize) -> bool,
    ) -> Self {
        let mut layout = Self::default();
        for patch in 0..model.parts().len() {
            if chosen(patch) {
                let gauge = gauge(instance, patch, tolerance, size);
                layout.push_grid(patch, gauge);
            } else {
                let first = layout.uv.len();
                layout.grids.push(Grid { first, u: Vec::new(), v: Vec::new(), closed: [false; 2], cells: [0; 2] });
            }
        }
        let mut positions = vec![[f64::NAN; 3]; layout.uv.len()];
        layout.place(instance, &mut positions);
        let centres: Vec<DVec3> = layout.quads.iter().map(|q| centre(q, &positions)).collect();
        let (tree, order) = Tree::build(&centres);
        layout.quads = order.iter().map(|i| layout.quads[*i as usize]).collect();
        layout.tree = tree;
        layout
    }

    fn push_grid(&mut self, patch: usize, gauge: Gauge) {
        let [nu, nv] = gauge.cells;
        let first = self.uv.len();
        let (mut us, mut vs) = (Vec::new(), Vec::new());
        for j in 0..=nv {
            for i in 0..=nu {
                us.push(i as f64 / nu as f64);
                vs.push(j as f64 / nv as f64);
            }
        }
        self.uv.extend(us.iter().zip(&vs).map(|(u, v)| [*u, *v]));
        for j in 0..nv {
            for i in 0..nu {
                let a = (first + j * (nu + 1) + i) as u32;
                let above = a + nu as u32 + 1;
                self.quads.push(Quad { patch: patch as u32, vertices: [a, a + 1, above + 1, above] });
            }
        }
        self.grids.push(Grid { first, u: us, v: vs, closed: gauge.closed, cells: gauge.cells });
    }

    /// Evaluates every vertex; a patch that fails is left NaN. Returns how many failed.
    fn place(&self, instance: &dyn Instance, positions: &mut [[f64; 3]]) -> usize {
        let mut absent = 0;
        for (patch, grid) in self.grids.iter().enumerate() {
            let out = &mut positions[grid.first..grid.first + grid.u.len()];
            if out.is_empty() {
                continue;
            }
            if instance.points(patch, &grid.u, &grid.v, out).is_err() {
                out.fill([f64::NAN; 3]);
                absent += 1;
            }
        }
        absent
    }

    /// The facets where `instance` puts them.
    pub(crate) fn facets(&self, instance: &dyn Instance) -> Facets<'_> {
        let mut positions = vec![[f64::NAN; 3]; self.uv.len()];
        let absent = self.place(instance, &mut positions);
        let mut tree = self.tree.clone();
        self.refit(&mut tree, &positions);
        Facets { layout: self, positions, tree, absent }
    }

    fn refit(&self, tree: &mut Tree, positions: &[[f64; 3]]) {
        tree.refit(bounds(positions), |quad| self.quads[quad].vertices.map(|v| positions[v as usize]));
    }

    /// Whether two facets are the same or share a corner, within one patch.
    fn beside(&self, a: u32, b: u32) -> bool {
        let [a, b] = [a, b].map(|quad| self.quads[quad as usize]);
        if a.patch != b.patch {
            return false;
        }
        let grid = &self.grids[a.patch as usize];
        let place = |quad: Quad| {
            let first = quad.vertices[0] as usize - grid.first;
            [first % (grid.cells[0] + 1), first / (grid.cells[0] + 1)]
        };
        let (a, b) = (place(a), place(b));
        (0..2).all(|k| {
            let apart = a[k].abs_diff(b[k]);
            apart <= 1 || (grid.closed[k] && apart + 1 >= grid.cells[k])
        })
    }

    /// Whether patch `patch` closes in u, and in v.
    pub(crate) fn closed(&self, patch: usize) -> [bool; 2] {
        self.grids[patch].closed
    }
}

impl Facets<'_> {
    /// Takes patches out, so that they are no longer found.
    pub(crate) fn remove(&mut self, patch: impl Fn(usize) -> bool) {
        for (i, grid) in self.layout.grids.iter().enumerate() {
            if patch(i) {
                self.positions[grid.first..grid.first + grid.u.len()].fill([f64::NAN; 3]);
            }
        }
        self.layout.refit(&mut self.tree, &self.positions);
    }

    /// The nearest facet within `cutoff` of `q`, and where on it; None where there is none. With `facing`, only facets
    /// that look the way the point's normal does. `hint` is a facet that may well be the nearest, or none of those that there
    /// are: with a good one most boxes need no look, and the answer is the same.
    pub(crate) fn nearest(&self, q: DVec3, cutoff: f64, facing: Option<Facing>, hint: u32) -> Option<Nearest> {
        let mut best: Option<Best> = None;
        let mut limit = cutoff * cutoff;
        if (hint as usize) < self.layout.quads.len() {
            limit = self.try_quad(q, hint, facing, limit, &mut best);
        }
        self.tree.visit(q, limit, |quad, limit| {
            if quad as u32 == hint { limit } else { self.try_quad(q, quad as u32, facing, limit, &mut best) }
        });
        best.map(|best| self.on(&best))
    }

    /// As `nearest`, and how far the model may move until the answer can be another one. For that, facets are looked at that
    /// are up to `reach` farther away; those beside the nearest one do not count as another answer.
    pub(crate) fn nearest_and_slack(
        &self,
        q: DVec3,
        cutoff: f64,
        facing: Option<Facing>,
        hint: u32,
        reach: f64,
    ) -> (Option<Nearest>, f64) {
        let mut best: Option<Best> = None;
        let mut least = f64::INFINITY;
        let mut seen = [(0_u32, 0.0_f64); SEEN];
        let mut count = 0;
        let mut look = |quad: u32, limit: f64| {
            let before = least;
            let any = self.look(q, quad, facing, &mut least, &mut best);
            if any <= limit {
                if let Some(slot) = seen.get_mut(count) {
                    *slot = (quad, any);
                }
                count += 1;
            }
            if least < before { limit.min((least.sqrt().min(cutoff) + reach).powi(2)) } else { limit }
        };
        let mut limit = (cutoff + reach).powi(2);
        if (hint as usize) < self.layout.quads.len() {
            limit = look(hint, limit);
        }
        self.tree.visit(q, limit, |quad, limit| if quad as u32 == hint { limit } else { look(quad as u32, limit) });
        let seen = if count > SEEN { None } else { Some(&seen[..count]) };
        let Some(best) = best.filter(|_| least < cutoff * cutoff) else {
            let nearest = seen.map(|seen| seen.iter().map(|s| s.1).fold(f64::INFINITY, f64::min).sqrt());
            return (None, nearest.map_or(f64::NEG_INFINITY, |d| d.min(cutoff + reach) - cutoff));
        };
        let rival = |seen: &[(u32, f64)]| {
            let others = seen.iter().filter(|s| !self.layout.beside(s.0, best.quad));
            others.map(|s| s.1).fold(f64::INFINITY, f64::min).sqrt()
        };
        let distance = least.sqrt();
        let slack = seen.map_or(f64::NEG_INFINITY, |seen| 0.5 * (rival(seen) - distance).min(reach));
        let nearest = self.on(&best);
        // What looks nearly across the point's normal may soon look away from it.
        let turning = facing.is_some_and(|f| self.turns_away(&best, f));
        (Some(nearest), if turning { f64::NEG_INFINITY } else { slack })
    }

    /// Puts a facet into `best` if it is nearer than `least` (squared); returns its squared distance whichever way it looks,
    /// unless that is clearly the wrong one.
    fn look(&self, q: DVec3, quad: u32, facing: Option<Facing>, least: &mut f64, best: &mut Option<Best>) -> f64 {
        let Quad { patch, vertices } = self.layout.quads[quad as usize];
        let corner = vertices.map(|v| DVec3::from_array(self.positions[v as usize]));
        let mut any = f64::INFINITY;
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let [a, b, c] = corners.map(|k: usize| corner[k]);
            let cosine = facing.map_or(0.0, |f| f.cosine(patch, a, b, c));
            if cosine < -ACROSS {
                continue;
            }
            let (weights, d2) = triangle_closest(q, a, b, c);
            any = any.min(d2);
            if cosine >= 0.0 && d2 < *least {
                *least = d2;
                *best = Some(Best { quad, corners, weights });
            }
        }
        any
    }

    fn turns_away(&self, best: &Best, facing: Facing) -> bool {
        let Quad { patch, vertices } = self.layout.quads[best.quad as usize];
        let [a, b, c] = best.corners.map(|k| DVec3::from_array(self.positions[vertices[k] as usize]));
        facing.signs[patch as usize] != 0 && facing.cosine(patch, a, b, c) < ACROSS
    }

    fn on(&self, best: &Best) -> Nearest {
        let Quad { patch, vertices } = self.layout.quads[best.quad as usize];
        let uv = |k: usize| {
            let parts = best.corners.iter().zip(best.weights);
            parts.map(|(c, w)| w * self.layout.uv[vertices[*c] as usize][k]).sum()
        };
        Nearest { patch, uv: [uv(0), uv(1)], quad: best.quad }
    }

    /// The facets' corners; those of patches that do not exist are not finite.
    pub(crate) fn corners(&self) -> impl Iterator<Item = DVec3> {
        self.positions.iter().map(|p| DVec3::from_array(*p))
    }

    /// Puts a facet into `best` if it is nearer than `limit` (squared); returns what is to be beaten from then on.
    fn try_quad(&self, q: DVec3, quad: u32, facing: Option<Facing>, mut limit: f64, best: &mut Option<Best>) -> f64 {
        let Quad { patch, vertices } = self.layout.quads[quad as usize];
        let corner = vertices.map(|v| DVec3::from_array(self.positions[v as usize]));
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let [a, b, c] = corners.map(|k| corner[k]);
            if facing.is_some_and(|f| f.rejects(patch, a, b, c)) {
                continue;
            }
            let (weights, d2) = triangle_closest(q, a, b, c);
            if d2 < limit {
                limit = d2;
                *best = Some(Best { quad, corners, weights });
            }
        }
        limit
    }

    /// The distance from `q` to the nearest facet; infinite if there is none.
    pub(crate) fn distance(&self, q: DVec3) -> f64 {
        let mut best = f64::INFINITY;
        self.tree.visit(q, best, |quad, limit| {
            let c = self.layout.quads[quad].vertices.map(|v| DVec3::from_array(self.positions[v as usize]));
            let (_, first) = triangle_closest(q, c[0], c[1], c[2]);
            let (_, second) = triangle_closest(q, c[0], c[2], c[3]);
            best = limit.min(first).min(second);
            best
        });
        best.sqrt()
    }

    /// The box around all facets, if there are any.
    pub(crate) fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let (low, high) = bounds(&self.positions);
        (low.cmple(high).all() && (high - low).max_element() > 0.0).then_some((low, high))
    }

    /// Area-weighted centre and total area of the facets, and the radius of gyration about the centre.
    pub(crate) fn moments(&self) -> (DVec3, f64, f64) {
        let (mut sum, mut area, mut second) = (DVec3::ZERO, 0.0, 0.0);
        for quad in &self.layout.quads {
            let c = quad.vertices.map(|v| DVec3::from_array(self.positions[v as usize]));
            let a = 0.5 * ((c[2] - c[0]).cross(c[3] - c[1])).length();
            let m = (c[0] + c[1] + c[2] + c[3]) / 4.0;
            if a.is_finite() {
                sum += m * a;
                area += a;
                second += a * m.length_squared();
            }
        }
        let centre = sum / area.max(f64::MIN_POSITIVE);
        (centre, area, (second / area.max(f64::MIN_POSITIVE) - centre.length_squared()).max(0.0).sqrt())
    }
}

impl Facing<'_> {
    /// Between the point's normal and the outward one of a triangle of a patch; 0 where that is not known.
    fn cosine(&self, patch: u32, a: DVec3, b: DVec3, c: DVec3) -> f64 {
        f64::from(self.signs[patch as usize]) * (b - a).cross(c - a).normalize_or_zero().dot(self.normal)
    }

    fn rejects(&self, patch: u32, a: DVec3, b: DVec3, c: DVec3) -> bool {
        let sign = f64::from(self.signs[patch as usize]);
        sign * (b - a).cross(c - a).dot(self.normal) < 0.0
    }
}

/// The box around all positions that are finite.
fn bounds(positions: &[[f64; 3]]) -> (DVec3, DVec3) {
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let finite = positions.iter().map(|p| DVec3::from_array(*p)).filter(|p| p.is_finite());
    finite.fold(start, |(low, high), p| (low.min(p), high.max(p)))
}

fn centre(quad: &Quad, positions: &[[f64; 3]]) -> DVec3 {
    let sum: DVec3 = quad.vertices.iter().map(|v| DVec3::from_array(positions[*v as usize])).sum();
    sum / 4.0
}

/// The nearest facet so far.
struct Best {
    quad: u32,
    /// Which of its corners.
    corners: [usize; 3],
    weights: [f64; 3],
}

/// How finely a patch must be divided, and whether it closes.
struct Gauge {
    cells: [usize; 2],
    closed: [bool; 2],
}

/// Chord error h^2 |S''| / 8 from second differences on a coarse grid; beside it no cell longer than a tenth of the
/// size, so that boxes stay small.
fn gauge(instance: &dyn Instance, patch: usize, tolerance: f64, size: f64) -> Gauge {
    let n = GAUGE + 1;
    let (mut u, mut v) = (Vec::new(), Vec::new());
    for j in 0..n {
        for i in 0..n {
            u.push(i as f64 / GAUGE as f64);
            v.push(j as f64 / GAUGE as f64);
        }
    }
    let mut p = vec![[0.0; 3]; n * n];
    if instance.points(patch, &u, &v, &mut p).is_err() {
        return Gauge { cells: [GAUGE; 2], closed: [false; 2] };
    }
    let at = |i: usize, j: usize, swap: bool| DVec3::from_array(if swap { p[i * n + j] } else { p[j * n + i] });
    let mut cells = [1; 2];
    let mut closed = [false; 2];
    for (k, swap) in [(0, false), (1, true)] {
        let (mut bend, mut length, mut gap) = (0.0_f64, 0.0_f64, 0.0_f64);
        for j in 0..n {
            let mut line = 0.0;
            for i in 1..n {
                line += at(i, j, swap).distance(at(i - 1, j, swap));
                if i + 1 < n {
                    bend = bend.max((at(i + 1, j, swap) - 2.0 * at(i, j, swap) + at(i - 1, j, swap)).length());
                }
            }
            length = length.max(line);
            gap = gap.max(at(0, j, swap).distance(at(n - 1, j, swap)));
        }
        let by_bend = GAUGE as f64 * (bend / (8.0 * tolerance)).sqrt();
        let by_length = 10.0 * length / size;
        cells[k] = by_bend.max(by_length).ceil().clamp(CELLS.0 as f64, CELLS.1 as f64) as usize;
        closed[k] = length > 0.0 && gap < 1e-9 * size && bend > 0.0;
    }
    Gauge { cells, closed }
}
