//! From the triangle that a ray meets, and from points of triangles, to the exact surface.

use super::scene::Surface;
use crate::feet::domain::Domain;
use crate::feet::foot::foot_points;
use crate::model::{Breaks, EvaluationError, Instance, Motion, Partials, SurfacePoint, Tessellation};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Steps of Newton's method at most. From a triangle that keeps to its chord three or four are enough.
const STEPS: usize = 12;
/// Largest distance between ray and surface that counts as none, as a fraction of the distance from the eye: rounding
/// leaves some 1e-16 of it.
const CONVERGED: f64 = 1e-13;
/// Points that one thread projects at a time.
const BATCH: usize = 1 << 12;

/// The surface of a model, of which triangles are an approximation.
#[derive(Clone, Copy)]
pub struct ExactSurface<'a> {
    /// Its triangles, after the motion.
    pub tessellation: &'a Tessellation,
    /// The model.
    pub instance: &'a dyn Instance,
    /// What moved the triangles.
    pub motion: Motion,
}

/// A point of the triangles that a ray from the eye meets.
#[derive(Clone, Copy)]
pub(super) struct TriangleHit {
    pub(super) direction: DVec3,
    pub(super) t: f64,
    pub(super) triangle: u32,
}

/// Where a ray meets the surface, with the unit normal.
#[derive(Clone, Copy)]
pub(super) struct SurfaceHit {
    pub(super) point: DVec3,
    pub(super) normal: DVec3,
    pub(super) surface: Surface,
}

/// A ray on its way to the exact surface.
struct Search {
    hit: TriangleHit,
    at: SurfacePoint,
    /// Bounds of u and of v: those of the triangle and as much again.
    bounds: [[f64; 2]; 2],
    found: Option<SurfaceHit>,
}

impl ExactSurface<'_> {
    /// Where rays from the eye meet the surface itself. A ray that passes it at a silhouette, having met a triangle,
    /// gets the point of the surface that the triangle stands for.
    pub(super) fn meet(&self, eye: DVec3, hits: &[TriangleHit]) -> Vec<Option<SurfaceHit>> {
        let mut searches: Vec<Search> = hits.iter().map(|hit| self.start(eye, *hit)).collect();
        let mut open: Vec<usize> = (0..searches.len()).collect();
        for step in 0..STEPS {
            open.sort_by_key(|i| searches[*i].at.patch);
            let evaluate = |run: &[usize]| self.partials(&searches, run).unwrap_or_default();
            let runs = open.chunk_by(|a, b| searches[*a].at.patch == searches[*b].at.patch);
            let evaluated: Vec<(Vec<usize>, Vec<Partials>)> = runs.map(|run| (run.to_vec(), evaluate(run))).collect();
            open.clear();
            for (run, partials) in evaluated {
                let advanced = run.into_iter().zip(partials);
                open.extend(advanced.filter_map(|(i, p)| (!searches[i].advance(eye, &p, step == 0)).then_some(i)));
            }
        }
        searches.into_iter().map(|search| search.found).collect()
    }

    /// The points of the surface next to points of its triangles, whose numbers come with them: what is in the plane of
    /// a facet stays where it is to about the tolerance, in millimetres, and the distance from the surface becomes 0.
    ///
    /// # Errors
    /// The model cannot be evaluated.
    pub(super) fn project(&self, points: &[(DVec3, u32)], tolerance: f64) -> Result<Vec<DVec3>, EvaluationError> {
        let starts: Vec<SurfacePoint> = points.par_iter().map(|(p, triangle)| self.place(*triangle, *p)).collect();
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by_key(|i| starts[*i].patch);
        let back = self.motion.inverse();
        let mut projected = vec![DVec3::ZERO; points.len()];
        for run in order.chunk_by(|a, b| starts[*a].patch == starts[*b].patch) {
            let patch = starts[run[0]].patch as usize;
            let domain = Domain::new(&Breaks::of_patch(self.instance, patch)?);
            let of_batch = |batch: &[usize]| {
                let q: Vec<DVec3> = batch.iter().map(|i| back.point(points[*i].0.to_array()).into()).collect();
                let uv: Vec<[f64; 2]> = batch.iter().map(|i| [starts[*i].u, starts[*i].v]).collect();
                let feet = foot_points(self.instance, patch, &domain, &q, &uv, tolerance)?;
                // A foot's own point may be that of a Taylor polynomial.
                let (u, v): (Vec<f64>, Vec<f64>) = feet.iter().map(|foot| (foot.uv[0], foot.uv[1])).unzip();
                let mut exact = vec![[0.0; 3]; batch.len()];
                self.instance.points(patch, &u, &v, &mut exact)?;
                Ok(exact)
            };
            let batches: Result<Vec<Vec<[f64; 3]>>, EvaluationError> = run.par_chunks(BATCH).map(of_batch).collect();
            for (i, p) in run.iter().zip(batches?.into_iter().flatten()) {
                projected[*i] = self.motion.point(p).into();
            }
        }
        Ok(projected)
    }

    fn start(&self, eye: DVec3, hit: TriangleHit) -> Search {
        let at = self.place(hit.triangle, eye + hit.t * hit.direction);
        let origins = self.tessellation.mesh.triangles[hit.triangle as usize];
        let origins = origins.map(|i| self.tessellation.origins[i as usize]);
        let range = |of: fn(&SurfacePoint) -> f64| {
            let low = origins.iter().map(of).fold(f64::INFINITY, f64::min);
            let high = origins.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
            let more = high - low;
            [(low - more).max(0.0), (high + more).min(1.0)]
        };
        Search { hit, at, bounds: [range(|o| o.u), range(|o| o.v)], found: None }
    }

    /// The place in (u, v) of a point of a triangle.
    fn place(&self, triangle: u32, p: DVec3) -> SurfacePoint {
        let mesh = &self.tessellation.mesh;
        let indices = mesh.triangles[triangle as usize];
        let [a, b, c] = mesh.corners(indices);
        let normal = (b - a).cross(c - a);
        let area = normal.length_squared();
        let weight = |q: DVec3, r: DVec3| ((r - q).cross(p - q).dot(normal) / area).clamp(0.0, 1.0);
        let weights = [weight(b, c), weight(c, a), weight(a, b)];
        let sum: f64 = weights.iter().sum();
        let origins = indices.map(|i| self.tessellation.origins[i as usize]);
        let mix = |of: fn(&SurfacePoint) -> f64| {
            if sum > 0.0 && sum.is_finite() {
                origins.iter().zip(weights).map(|(o, w)| w * of(o)).sum::<f64>() / sum
            } else {
                of(&origins[0])
            }
        };
        SurfacePoint { patch: origins[0].patch, u: mix(|o| o.u), v: mix(|o| o.v) }
    }

    fn partials(&self, searches: &[Search], run: &[usize]) -> Option<Vec<Partials>> {
        let (u, v): (Vec<f64>, Vec<f64>) = run.iter().map(|i| (searches[*i].at.u, searches[*i].at.v)).unzip();
        let mut partials = vec![Partials::default(); run.len()];
        self.instance.partials(searches[run[0]].at.patch as usize, &u, &v, &mut partials).ok()?;
        let moved = |p: &Partials| Partials {
            point: self.motion.point(p.point),
            du: self.motion.direction(p.du),
            dv: self.motion.direction(p.dv),
        };
        Some(partials.iter().map(moved).collect())
    }
}

impl Search {
    /// A step of Newton's method for S(u, v) = eye + t direction; whether it was the last one. The first point that is
    /// evaluated stands until the method has converged.
    fn advance(&mut self, eye: DVec3, p: &Partials, is_first: bool) -> bool {
        let [point, du, dv] = [p.point, p.du, p.dv].map(DVec3::from_array);
        let gap = eye + self.hit.t * self.hit.direction - point;
        let converged = gap.length() <= CONVERGED * self.hit.t;
        if is_first || converged {
            self.found = du
                .cross(dv)
                .try_normalize()
                .map(|normal| SurfaceHit { point, normal, surface: Surface::Object })
                .or(self.found);
        }
        let step = DMat3::from_cols(du, dv, -self.hit.direction).inverse() * gap;
        if converged || !step.is_finite() {
            return true;
        }
        self.at.u = (self.at.u + step.x).clamp(self.bounds[0][0], self.bounds[0][1]);
        self.at.v = (self.at.v + step.y).clamp(self.bounds[1][0], self.bounds[1][1]);
        self.hit.t += step.z;
        false
    }
}
