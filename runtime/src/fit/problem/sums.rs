//! Sums over a chunk of points: the objective, its gradient and its Gauss-Newton matrix.

use super::loss::PointLoss;
use super::objective::{Correspondence, Evaluation, Matched, Objective, Order};
use super::parameterization::{Estimate, Parameterization};
use super::rows::Rows;
use crate::fit::correspond::foot::Foot;
use crate::fit::tuning::{HARDLY_ANY_POINTS, LEAST_CURVATURE};
use crate::model::Instance;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// Sums over the points of one patch. Weights are the loss's times the points' prior ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PatchSum {
    /// Number of points with a loss below 1/2, and the sum of their weights without the loss's.
    pub(crate) points: f64,
    pub(crate) inliers: f64,
    /// Sum of their squared distances, by the same weights.
    pub(crate) d2: f64,
    /// Sum of the loss's weights alone: about the number of points near the patch.
    pub(crate) near: f64,
    /// Sum of weights.
    pub(crate) weight: f64,
    /// Sum of weight times squared distance.
    pub(crate) weighted_d2: f64,
    /// Sum of weight times the cosine between the scan's normal and dS/du x dS/dv.
    pub(crate) facing: f64,
    /// Of the points whose normals are along dS/du x dS/dv, and of those whose normals are against it.
    pub(crate) faces: [FaceSum; 2],
}

impl PatchSum {
    /// Whether the scan shows nothing of the patch: hardly any points lie close to it.
    pub(crate) fn is_hidden(&self) -> bool {
        self.points < HARDLY_ANY_POINTS
    }
}

/// Sums over the points that show one face of a patch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FaceSum {
    /// Sum of the loss's weights alone: about the number of points.
    pub(crate) near: f64,
    /// Sum of weights.
    pub(crate) weight: f64,
    /// Sum of weight times the distance along dS/du x dS/dv. Millimetres.
    pub(crate) displacement: f64,
}

/// Sums over a chunk; derivatives by (x, shift, turn).
pub(crate) struct Sums {
    pub(crate) loss: f64,
    gradient: Vec<f64>,
    /// The upper triangle, row by row.
    normal: Vec<f64>,
    patches: Vec<PatchSum>,
}

impl Sums {
    /// The sums of points beyond the cut-off whose prior weights sum up to `weight`.
    pub(crate) fn none(space: &Parameterization, weight: f64, order: Order) -> Self {
        let n = space.model.parameters().len() + 6;
        Self {
            loss: weight,
            gradient: if order == Order::Value { Vec::new() } else { vec![0.0; n] },
            normal: if order == Order::Normal { vec![0.0; n * n] } else { Vec::new() },
            patches: vec![PatchSum::default(); space.model.parts().len()],
        }
    }
}

impl Objective<'_> {
    /// The evaluation from the sums of all chunks, whose points have prior weights of `weight` in all.
    pub(crate) fn total(&self, sums: &[Sums], weight: f64, at: &Estimate, order: Order, absent: usize) -> Evaluation {
        let n = self.space.model.parameters().len() + 6;
        let mut gradient = DVector::zeros(n);
        let mut normal = DMatrix::zeros(n, n);
        let mut patches = vec![PatchSum::default(); self.space.model.parts().len()];
        let mut loss = 0.0;
        for sum in sums {
            loss += sum.loss;
            for (g, s) in gradient.iter_mut().zip(&sum.gradient) {
                *g += s;
            }
            for (h, s) in normal.iter_mut().zip(&sum.normal) {
                *h += s;
            }
            for (p, s) in patches.iter_mut().zip(&sum.patches) {
                p.points += s.points;
                p.inliers += s.inliers;
                p.d2 += s.d2;
                p.near += s.near;
                p.weight += s.weight;
                p.weighted_d2 += s.weighted_d2;
                p.facing += s.facing;
                for (p, s) in p.faces.iter_mut().zip(&s.faces) {
                    p.near += s.near;
                    p.weight += s.weight;
                    p.displacement += s.displacement;
                }
            }
        }
        let scale = 2.0 / (self.loss.sigma * self.loss.sigma * weight);
        let value = loss / weight;
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

    /// Adds the points of one patch.
    pub(crate) fn add_patch(&self, instance: &dyn Instance, matched: &Matched, order: Order, sums: &mut Sums) {
        let half2 = self.loss.half().powi(2);
        let part = &mut sums.patches[matched.patch];
        for ((foot, point), PointLoss { prior, value, weight, .. }) in
            matched.feet.iter().zip(&matched.points).zip(&matched.losses)
        {
            sums.loss += value - prior;
            if foot.d2 < half2 {
                part.points += 1.0;
                part.inliers += prior;
                part.d2 += prior * foot.d2;
            }
            let near = weight / prior.max(f64::MIN_POSITIVE);
            part.near += near;
            part.weight += weight;
            part.weighted_d2 += weight * foot.d2;
            let normal = foot.normal.normalize_or_zero();
            let cosine = normal.dot(point.normal);
            part.facing += weight * cosine;
            let face = &mut part.faces[usize::from(cosine < 0.0)];
            face.near += near;
            face.weight += weight;
            face.displacement += weight * normal.dot(point.q - foot.point);
        }
        self.add_derivatives(instance, matched, order, sums);
    }

    /// Adds the derivatives of the loss of points of one patch.
    pub(crate) fn add_derivatives(&self, instance: &dyn Instance, matched: &Matched, order: Order, sums: &mut Sums) {
        let added = match order {
            Order::Value => Some(()),
            Order::Gradient => self.add_gradient(instance, matched, sums),
            Order::Normal => self.rows(instance, matched).map(|rows| self.add_normal(&rows, sums)),
        };
        if added.is_none() {
            sums.gradient.fill(f64::NAN);
        }
    }

    fn add_gradient(&self, instance: &dyn Instance, matched: &Matched, sums: &mut Sums) -> Option<()> {
        let Matched { patch, points, feet, losses } = matched;
        let n = self.space.model.parameters().len();
        let force =
            |((foot, point), loss): ((&Foot, &Correspondence), &PointLoss)| (foot.point - point.q) * loss.weight;
        let forces: Vec<DVec3> = feet.iter().zip(points).zip(losses).map(force).collect();
        let (mut u, mut v): (Vec<f64>, Vec<f64>) = feet.iter().map(|f| (f.uv[0], f.uv[1])).unzip();
        let mut w: Vec<[f64; 3]> = forces.iter().map(|f| f.to_array()).collect();
        // Both sides of a corner have a share in the force on a foot on it.
        for (i, Foot { beyond, share, .. }) in feet.iter().enumerate().filter(|(_, foot)| foot.share > 0.0) {
            u.push(beyond[0]);
            v.push(beyond[1]);
            w[i] = (forces[i] * (1.0 - share)).to_array();
            w.push((forces[i] * *share).to_array());
        }
        instance.pullback(*patch, &u, &v, &w, &mut sums.gradient[..n]).ok()?;
        let [u, v] = [&u[..feet.len()], &v[..feet.len()]];
        if let Some(keep) = self.edge(*patch, feet) {
            let held = feet.iter().zip(losses).map(|(foot, loss)| [-foot.hold * loss.weight, 0.0, 0.0]);
            let w: Vec<[f64; 3]> = held.collect();
            instance.pullback(keep, u, v, &w, &mut sums.gradient[..n]).ok()?;
        }
        if self.space.moving {
            for (foot, force) in feet.iter().zip(&forces) {
                let torque = (foot.point - self.space.centre).cross(*force);
                for k in 0..3 {
                    sums.gradient[n + k] += force[k];
                    sums.gradient[n + 3 + k] += torque[k];
                }
            }
        }
        Some(())
    }

    fn add_normal(&self, rows: &Rows, sums: &mut Sums) {
        let total = self.space.model.parameters().len() + 6;
        let count = rows.columns.len();
        let (mut gradient, mut normal) = (vec![0.0; count], vec![0.0; count * count]);
        for (point, row) in rows.iter() {
            // Never so small that a step would run away.
            let bend = if self.curved { point.curvature.max(LEAST_CURVATURE * point.weight) } else { point.weight };
            add_scaled(&mut gradient, point.weight * point.distance, row);
            add_square(&mut normal, bend, row);
        }
        for (a, i) in rows.columns.iter().enumerate() {
            sums.gradient[*i] += gradient[a];
            for (b, j) in rows.columns.iter().enumerate().skip(a) {
                sums.normal[i * total + j] += normal[a * count + b];
            }
        }
    }
}

/// Adds `factor` times a row to a sum.
pub(crate) fn add_scaled(sum: &mut [f64], factor: f64, row: &[f64]) {
    sum.iter_mut().zip(row).for_each(|(sum, r)| *sum += factor * r);
}

/// Adds `factor` times a row's square, row^T row, to the upper triangle of a square matrix that is stored row by row.
pub(crate) fn add_square(sum: &mut [f64], factor: f64, row: &[f64]) {
    let count = row.len();
    for (a, ra) in row.iter().enumerate() {
        add_scaled(&mut sum[a * count + a..(a + 1) * count], factor * ra, &row[a..]);
    }
}
