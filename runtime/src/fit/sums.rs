//! What a chunk of points adds to the objective, its gradient and its Gauss-Newton matrix.

use super::distance::{Foot, refine};
use super::objective::{Evaluation, Found, Objective, Order, Placed};
use super::space::{Estimate, Space};
use crate::model::Instance;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// What belongs to one patch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PatchSum {
    /// Points with psi below 1/2.
    pub(crate) inliers: f64,
    /// Sum of their squared distances.
    pub(crate) d2: f64,
    /// Sum of weights.
    pub(crate) weight: f64,
    /// Sum of weight times squared distance.
    pub(crate) weighted_d2: f64,
    /// Sum of weight times the cosine between the scan's normal and dS/du x dS/dv.
    pub(crate) facing: f64,
}

/// Sums over a chunk; derivatives by (x, shift, turn).
pub(crate) struct Sums {
    psi: f64,
    gradient: Vec<f64>,
    /// The upper triangle, row by row.
    normal: Vec<f64>,
    patches: Vec<PatchSum>,
}

/// A point of the chunk with its foot.
struct Residual {
    /// S - q. Millimetres.
    e: DVec3,
    foot: Foot,
    weight: f64,
}

impl Sums {
    /// Those of `points` points that are far from everything.
    pub(crate) fn none(space: &Space, points: usize, order: Order) -> Self {
        let n = space.model.parameters().len() + 6;
        Self {
            psi: points as f64,
            gradient: if order == Order::Value { Vec::new() } else { vec![0.0; n] },
            normal: if order == Order::Normal { vec![0.0; n * n] } else { Vec::new() },
            patches: vec![PatchSum::default(); space.model.parts().len()],
        }
    }
}

impl Objective<'_> {
    /// The evaluation that follows from the sums of all chunks.
    pub(crate) fn total(&self, sums: &[Sums], at: &Estimate, order: Order, absent: usize) -> Evaluation {
        let n = self.space.model.parameters().len() + 6;
        let mut gradient = DVector::zeros(n);
        let mut normal = DMatrix::zeros(n, n);
        let mut patches = vec![PatchSum::default(); self.space.model.parts().len()];
        let mut psi = 0.0;
        for sum in sums {
            psi += sum.psi;
            for (g, s) in gradient.iter_mut().zip(&sum.gradient) {
                *g += s;
            }
            for (h, s) in normal.iter_mut().zip(&sum.normal) {
                *h += s;
            }
            for (p, s) in patches.iter_mut().zip(&sum.patches) {
                p.inliers += s.inliers;
                p.d2 += s.d2;
                p.weight += s.weight;
                p.weighted_d2 += s.weighted_d2;
                p.facing += s.facing;
            }
        }
        let points = self.points.len().max(1) as f64;
        let scale = 2.0 / (self.loss.sigma * self.loss.sigma * points);
        let value = psi / points;
        if order == Order::Value {
            let (gradient, normal) = (DVector::zeros(0), DMatrix::zeros(0, 0));
            return Evaluation { value, gradient, normal, patches, absent };
        }
        let chain = self.space.chain(at);
        let gradient = chain.tr_mul(&gradient) * scale;
        let normal = if order == Order::Normal {
            // Only one triangle was summed.
            normal.fill_upper_triangle_with_lower_triangle();
            chain.tr_mul(&(normal * &chain)) * scale
        } else {
            DMatrix::zeros(0, 0)
        };
        Evaluation { value, gradient, normal, patches, absent }
    }

    /// Adds the points of one patch. A patch that fails here counts as absent: its points keep psi = 1.
    /// Returns the feet; none where the patch fails.
    pub(crate) fn add_patch(&self, placed: &Placed, found: &[Found], order: Order, sums: &mut Sums) -> Vec<Foot> {
        let patch = found[0].patch as usize;
        let instance = &*placed.instance;
        let (q, uv): (Vec<DVec3>, Vec<[f64; 2]>) = found.iter().map(|f| (f.q, f.uv)).unzip();
        let Ok(feet) = refine(instance, patch, self.layout.closed(patch), &q, &uv, self.tolerance) else {
            return Vec::new();
        };
        let half2 = self.loss.half().powi(2);
        let part = &mut sums.patches[patch];
        let mut residuals = Vec::with_capacity(feet.len());
        for (foot, found) in feet.iter().zip(found) {
            let (psi, weight) = self.loss.psi_and_weight(foot.d2);
            sums.psi += psi - 1.0;
            if foot.d2 < half2 {
                part.inliers += 1.0;
                part.d2 += foot.d2;
            }
            part.weight += weight;
            part.weighted_d2 += weight * foot.d2;
            part.facing += weight * foot.normal.normalize_or_zero().dot(found.normal);
            residuals.push(Residual { e: foot.point - found.q, weight, foot: *foot });
        }
        match order {
            Order::Value => {}
            Order::Gradient => self.add_gradient(instance, patch, &residuals, sums),
            Order::Normal => self.add_normal(instance, patch, &residuals, sums),
        }
        feet
    }

    fn add_gradient(&self, instance: &dyn Instance, patch: usize, residuals: &[Residual], sums: &mut Sums) {
        let n = self.space.model.parameters().len();
        let (u, v) = arguments(residuals);
        let w: Vec<[f64; 3]> = residuals.iter().map(|r| (r.e * r.weight).to_array()).collect();
        if instance.pullback(patch, &u, &v, &w, &mut sums.gradient[..n]).is_err() {
            sums.gradient.fill(f64::NAN);
            return;
        }
        if !self.space.moving {
            return;
        }
        for r in residuals {
            let force = r.e * r.weight;
            let torque = (r.foot.point - self.space.centre).cross(force);
            for k in 0..3 {
                sums.gradient[n + k] += force[k];
                sums.gradient[n + 3 + k] += torque[k];
            }
        }
    }

    fn add_normal(&self, instance: &dyn Instance, patch: usize, residuals: &[Residual], sums: &mut Sums) {
        let n = self.space.model.parameters().len();
        let active = &self.space.model.parts()[patch].active;
        let (u, v) = arguments(residuals);
        let mut jacobian = vec![0.0; residuals.len() * active.len() * 3];
        if instance.jacobian(patch, &u, &v, &mut jacobian).is_err() {
            sums.gradient.fill(f64::NAN);
            return;
        }
        // Columns that nothing varies by would be summed in vain.
        let varied: Vec<(usize, usize)> =
            active.iter().map(|a| *a as usize).enumerate().filter(|(_, i)| self.space.varies(*i)).collect();
        let motion = if self.space.moving { n..n + 6 } else { n..n };
        let columns: Vec<usize> = varied.iter().map(|(_, i)| *i).chain(motion).collect();
        let count = columns.len();
        let (mut row, mut gradient, mut normal) = (vec![0.0; count], vec![0.0; count], vec![0.0; count * count]);
        for (r, slopes) in residuals.iter().zip(jacobian.chunks_exact(3 * active.len().max(1))) {
            let (direction, distance) = self.direction(r);
            for ((a, _), entry) in varied.iter().zip(&mut row) {
                *entry = direction.dot(DVec3::from_slice(&slopes[3 * a..]));
            }
            if self.space.moving {
                let torque = (r.foot.point - self.space.centre).cross(direction);
                let motion = [direction.x, direction.y, direction.z, torque.x, torque.y, torque.z];
                row[varied.len()..].copy_from_slice(&motion);
            }
            // Never so small that a step would run away.
            let bend = if self.curved { self.loss.curvature(r.foot.d2).max(0.3 * r.weight) } else { r.weight };
            let pull = r.weight * distance;
            for (g, ra) in gradient.iter_mut().zip(&row) {
                *g += pull * ra;
            }
            for (a, ra) in row.iter().enumerate() {
                let bent = bend * ra;
                for (h, rb) in normal[a * count + a..(a + 1) * count].iter_mut().zip(&row[a..]) {
                    *h += bent * rb;
                }
            }
        }
        for (a, i) in columns.iter().enumerate() {
            sums.gradient[*i] += gradient[a];
            for (b, j) in columns.iter().enumerate().skip(a) {
                sums.normal[i * (n + 6) + j] += normal[a * count + b];
            }
        }
    }

    /// The direction in which the distance is measured, and the distance along it. Near zero the direction of S - q is
    /// noise, and the surface's normal takes its place.
    fn direction(&self, r: &Residual) -> (DVec3, f64) {
        let d = r.foot.d2.sqrt();
        if d > 1e-6 * self.loss.sigma {
            return (r.e / d, d);
        }
        let normal = r.foot.normal.normalize_or_zero();
        (normal, normal.dot(r.e))
    }
}

fn arguments(residuals: &[Residual]) -> (Vec<f64>, Vec<f64>) {
    residuals.iter().map(|r| (r.foot.uv[0], r.foot.uv[1])).unzip()
}
