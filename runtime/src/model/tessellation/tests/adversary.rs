//! A search for the largest distance between triangles and surface, by other means than those of meshing.

use super::*;
use crate::bvh::Bvh;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The largest distance between triangles and surface that a search finds, both ways: from random places of triangles
/// uphill, to the nearest point of the other.
pub(super) struct Adversary<'a> {
    instance: &'a dyn Instance,
    tessellation: &'a Tessellation,
    bvh: Bvh,
    /// Numbers of the vertices' positions, and the triangles around each of these.
    number: Vec<u32>,
    around: Vec<Vec<usize>>,
}

impl Adversary<'_> {
    pub(super) fn farthest(&self, random: &mut ChaCha8Rng, triangles: usize) -> f64 {
        let count = self.tessellation.mesh.triangles.len();
        let chosen: Vec<usize> = if count <= triangles {
            (0..count).collect()
        } else {
            (0..triangles).map(|_| random.random_range(0..count)).collect()
        };
        let mut farthest = 0.0_f64;
        for triangle in chosen {
            for _ in 0..2 {
                let (s, t): (f64, f64) = (random.random(), random.random());
                let start = if s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] };
                farthest = farthest.max(climb(start, |w| self.surface_to_triangles(triangle, w)));
                farthest = farthest.max(climb(start, |w| self.triangle_to_surface(triangle, w)));
            }
        }
        farthest
    }

    fn uv(&self, triangle: usize, w: [f64; 3]) -> (usize, f64, f64) {
        let origins = self.tessellation.mesh.triangles[triangle].map(|i| self.tessellation.origins[i as usize]);
        let mix = |of: fn(&SurfacePoint) -> f64| origins.iter().zip(w).map(|(o, w)| w * of(o)).sum::<f64>();
        (origins[0].patch as usize, mix(|o| o.u), mix(|o| o.v))
    }

    /// From the surface's point that belongs to a place of a triangle to the nearest of all triangles.
    fn surface_to_triangles(&self, triangle: usize, w: [f64; 3]) -> f64 {
        let (patch, u, v) = self.uv(triangle, w);
        let mut point = [[0.0; 3]];
        self.instance.points(patch, &[u], &[v], &mut point).expect("it can be evaluated");
        let point = DVec3::from_array(point[0]);
        // The tree searches in single precision, which is poor beside slivers.
        let near = self.bvh.closest_point(point, f64::INFINITY).map_or(triangle, |c| c.triangle as usize);
        let mesh = &self.tessellation.mesh;
        let vertices = [near, triangle].into_iter().flat_map(|t| mesh.triangles[t]);
        let beside = vertices.flat_map(|i| &self.around[self.number[i as usize] as usize]);
        beside.map(|t| to_triangle(point, mesh.corners(mesh.triangles[*t]))).fold(f64::INFINITY, f64::min)
    }

    /// From a place of a triangle to the nearest point of the surface within twice the triangle's range of u and v.
    fn triangle_to_surface(&self, triangle: usize, w: [f64; 3]) -> f64 {
        let (patch, u, v) = self.uv(triangle, w);
        let corners = self.tessellation.mesh.corners(self.tessellation.mesh.triangles[triangle]);
        let origins = self.tessellation.mesh.triangles[triangle].map(|i| self.tessellation.origins[i as usize]);
        let clamp = |t: f64, of: fn(&SurfacePoint) -> f64| {
            let all = origins.each_ref().map(of);
            let (low, high) = (all.into_iter().fold(1.0, f64::min), all.into_iter().fold(0.0, f64::max));
            // The nearest point may belong to a neighbour.
            let aside = 0.5 * (high - low);
            t.clamp((low - aside).max(0.0), (high + aside).min(1.0))
        };
        let p: DVec3 = corners.iter().zip(w).map(|(c, w)| *c * w).sum();
        let evaluate = |u: f64, v: f64| {
            let mut partials = [Partials::default()];
            self.instance.partials(patch, &[u], &[v], &mut partials).ok()?;
            Some([partials[0].point, partials[0].du, partials[0].dv].map(DVec3::from_array))
        };
        // Gauss and Newton, with smaller steps where they do not come nearer.
        let approach = |u: f64, v: f64| {
            let Some(mut here) = evaluate(u, v) else { return 0.0 };
            let (mut at, mut damping) = ([u, v], 1.0);
            for _ in 0..20 {
                let [point, du, dv] = here;
                let gap = p - point;
                let (a, b, c) = (du.dot(du), du.dot(dv), dv.dot(dv));
                let determinant = a * c - b * b;
                let (x, y) = (gap.dot(du), gap.dot(dv));
                let (su, sv) = ((c * x - b * y) / determinant, (a * y - b * x) / determinant);
                if !(su.is_finite() && sv.is_finite()) {
                    break;
                }
                let next = [clamp(at[0] + damping * su, |o| o.u), clamp(at[1] + damping * sv, |o| o.v)];
                match evaluate(next[0], next[1]) {
                    Some(there) if p.distance(there[0]) < gap.length() => (at, here) = (next, there),
                    _ => damping /= 4.0,
                }
            }
            p.distance(here[0])
        };
        let found = approach(u, v);
        if found <= self.tessellation.chord {
            return found;
        }
        // It may have stopped at a crease or a pole: from everywhere else, too.
        let mix = |k: u32, of: fn(&SurfacePoint) -> f64| {
            let (low, high) = (clamp(0.0, of), clamp(1.0, of));
            low + (high - low) * f64::from(k) / 8.0
        };
        let starts = (0..9).flat_map(|i| (0..9).map(move |j| (i, j)));
        starts.map(|(i, j)| approach(mix(i, |o| o.u), mix(j, |o| o.v))).fold(found, f64::min)
    }
}

/// The distance from a point to a triangle: to its plane over its inside, to its edges elsewhere.
pub(super) fn to_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let edge = |p: DVec3, q: DVec3, r: DVec3| {
        let s = (p - q).dot(r - q) / (r - q).length_squared();
        p.distance(q + s.clamp(0.0, 1.0) * (r - q))
    };
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(q, r)| (*r - *q).cross(p - *q).dot(normal) >= 0.0);
    let to_edges = edge(p, a, b).min(edge(p, b, c)).min(edge(p, c, a));
    if inside { (p - a).dot(normal.normalize_or_zero()).abs().min(to_edges) } else { to_edges }
}

/// The largest value near a place of a triangle: a search along the axes, with steps that are halved.
fn climb([mut s, mut t]: [f64; 2], f: impl Fn([f64; 3]) -> f64) -> f64 {
    let at = |s: f64, t: f64| f([1.0 - s - t, s, t]);
    let (mut best, mut step) = (at(s, t), 0.2);
    while step > 0.01 {
        let moves = [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step), (step, -step), (-step, step)];
        let inside = |(x, y): &(f64, f64)| s + x >= 0.0 && t + y >= 0.0 && s + x + t + y <= 1.0;
        let found = moves.into_iter().filter(inside).map(|(x, y)| (at(s + x, t + y), s + x, t + y));
        match found.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((value, x, y)) if value > best => (best, s, t) = (value, x, y),
            _ => step /= 2.0,
        }
    }
    best
}

pub(super) fn adversary<'a>(instance: &'a dyn Instance, tessellation: &'a Tessellation) -> Adversary<'a> {
    let mesh = &tessellation.mesh;
    let number = mesh.position_numbers();
    let mut around = vec![Vec::new(); mesh.positions.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        corners.iter().for_each(|i| around[number[*i as usize] as usize].push(t));
    }
    Adversary { instance, tessellation, bvh: Bvh::build(mesh).expect("it has triangles"), number, around }
}
