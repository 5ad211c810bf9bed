//! The objective f = mean psi(d(M(x), s_i)) ([VA] eq. 1) with its gradient or its weighted normal equations.

use super::distance::{Foot, refine};
use super::facets::{Facets, Facing, Layout};
use super::loss::Loss;
use super::memory::{Memory, NOWHERE, Part};
use super::motion::Motion;
use super::points::Points;
use super::space::{Estimate, Space};
use super::trace::Log;
use crate::model::{EvaluationError, Instance};
use crate::progress::Progress;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// The objective over some points with a certain loss.
pub(crate) struct Objective<'s> {
    pub(crate) space: &'s Space<'s>,
    pub(crate) points: &'s Points,
    pub(crate) layout: &'s Layout,
    pub(crate) loss: Loss,
    /// Per patch, which way is out (see `Facing`); None where normals are not to be used.
    pub(crate) signs: Option<&'s [i8]>,
    /// Foot points are exact to this. Millimetres.
    pub(crate) tolerance: f64,
    /// Counts evaluations.
    pub(crate) evaluations: &'s AtomicU64,
    /// By point, the facet that was the nearest one the last time.
    pub(crate) hints: Arc<Vec<AtomicU32>>,
    /// What is known of the points' feet, where that is worth its time: in evaluations close to one another.
    pub(crate) memory: Option<Arc<Memory>>,
    /// The matrix of `Order::Normal` is nearer to the Hessian: psi'' takes the place of the weights where it is positive.
    pub(crate) curved: bool,
    /// Where steps are written down, if anywhere.
    pub(crate) log: Option<Log<'s>>,
    /// Says when nobody waits for the result any longer: there is none then, and whoever minimises ends soon.
    pub(crate) progress: &'s dyn Progress,
}

/// How much is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// The value and the patches' sums.
    Value,
    /// And the gradient, by pullbacks.
    Gradient,
    /// And the gradient with the Gauss-Newton matrix, by Jacobians.
    Normal,
}

/// The objective at one estimate. Derivatives are by scaled local coordinates.
#[derive(Clone, Debug)]
pub(crate) struct Evaluation {
    /// Mean psi.
    pub(crate) value: f64,
    /// Its gradient.
    pub(crate) gradient: DVector<f64>,
    /// Sum of weight * J^T J, times 2 / (sigma^2 N): the Hessian without the terms that make it indefinite (see `curved`).
    pub(crate) normal: DMatrix<f64>,
    /// Sums by patch.
    pub(crate) patches: Vec<PatchSum>,
    /// Patches that could not be evaluated.
    pub(crate) absent: usize,
}

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

impl Evaluation {
    /// Points with psi below 1/2.
    pub(crate) fn inliers(&self) -> f64 {
        self.patches.iter().map(|p| p.inliers).sum()
    }
}

/// Hints for points of which nothing is known yet.
pub(crate) fn no_hints(points: &Points) -> Arc<Vec<AtomicU32>> {
    Arc::new((0..points.len()).map(|_| AtomicU32::new(u32::MAX)).collect())
}

/// A model at certain parameters with its facets.
pub(crate) struct Placed<'s> {
    pub(crate) instance: Box<dyn Instance + 's>,
    pub(crate) facets: Facets<'s>,
}

/// Points a chunk: sums do not depend on the number of threads because chunks do not.
pub(crate) const CHUNK: usize = 512;

/// Sums over a chunk; derivatives by (x, shift, turn).
struct Sums {
    psi: f64,
    gradient: Vec<f64>,
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

impl Objective<'_> {
    /// The model at an estimate.
    ///
    /// # Errors
    /// A `require` that does not hold or bounds without room.
    pub(crate) fn place(&self, at: &Estimate) -> Result<Placed<'_>, EvaluationError> {
        let Some(x) = self.space.x(&at.z) else {
            return Err(EvaluationError { message: "the bounds of the parameters leave no room".into() });
        };
        let instance = self.space.model.instantiate(&x)?;
        let facets = self.layout.facets(&*instance);
        Ok(Placed { instance, facets })
    }

    /// The objective at an estimate; None where the model does not exist (the caller treats it as infinite).
    pub(crate) fn evaluate(&self, at: &Estimate, order: Order) -> Option<Evaluation> {
        let placed = self.place(at).ok()?;
        self.evaluate_placed(&placed, at, order)
    }

    /// As `evaluate`, for a model that is already placed at these parameters: only the motion may differ.
    pub(crate) fn evaluate_placed(&self, placed: &Placed, at: &Estimate, order: Order) -> Option<Evaluation> {
        if self.progress.cancelled() {
            return None;
        }
        self.evaluations.fetch_add(1, Ordering::Relaxed);
        let count = self.points.len();
        let chunks: Vec<Range<usize>> =
            (0..count).step_by(CHUNK).map(|start| start..(start + CHUNK).min(count)).collect();
        let mut memory = self.memory.as_ref().and_then(|m| m.follow(&placed.facets, &at.motion));
        let sums: Vec<Sums> = match &mut memory {
            Some(memory) => chunks
                .into_par_iter()
                .zip(memory.parts(CHUNK))
                .map(|(range, mut part)| self.chunk(placed, &at.motion, range, Some(&mut part), order))
                .collect(),
            None => chunks.into_par_iter().map(|range| self.chunk(placed, &at.motion, range, None, order)).collect(),
        };
        let evaluation = self.total(&sums, at, order, placed.facets.absent);
        (evaluation.value.is_finite() && evaluation.gradient.iter().all(|g| g.is_finite())).then_some(evaluation)
    }

    /// The foot points of the points within the cut-off, with the points' indices; patch by patch.
    pub(crate) fn feet(&self, placed: &Placed, motion: &Motion) -> Vec<(usize, Foot)> {
        let found = self.search(placed, motion, 0..self.points.len(), None);
        let mut all = Vec::with_capacity(found.len());
        for these in found.chunk_by(|a, b| a.patch == b.patch) {
            let patch = these[0].patch as usize;
            let (q, uv): (Vec<DVec3>, Vec<[f64; 2]>) = these.iter().map(|f| (f.q, f.uv)).unzip();
            if let Ok(feet) = refine(&*placed.instance, patch, self.layout.closed(patch), &q, &uv, self.tolerance) {
                all.extend(these.iter().map(|f| f.index).zip(feet));
            }
        }
        all
    }

    fn total(&self, sums: &[Sums], at: &Estimate, order: Order, absent: usize) -> Evaluation {
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

    fn chunk(
        &self,
        placed: &Placed,
        motion: &Motion,
        range: Range<usize>,
        mut memory: Option<&mut Part>,
        order: Order,
    ) -> Sums {
        let n = self.space.model.parameters().len() + 6;
        let patches = self.space.model.parts().len();
        let mut sums = Sums {
            psi: range.len() as f64,
            gradient: if order == Order::Value { Vec::new() } else { vec![0.0; n] },
            normal: if order == Order::Normal { vec![0.0; n * n] } else { Vec::new() },
            patches: vec![PatchSum::default(); patches],
        };
        let start = range.start;
        let found = self.search(placed, motion, range, memory.as_deref_mut());
        for these in found.chunk_by(|a, b| a.patch == b.patch) {
            let feet = self.patch(placed, these, order, &mut sums);
            remember(memory.as_deref_mut(), start, these, &feet);
        }
        sums
    }

    /// The points of a chunk that have a facet within the cut-off, by patch.
    pub(crate) fn search(
        &self,
        placed: &Placed,
        motion: &Motion,
        range: Range<usize>,
        mut memory: Option<&mut Part>,
    ) -> Vec<Found> {
        let inverse = motion.rotation.inverse();
        let cutoff = self.loss.cutoff();
        let mut found = Vec::with_capacity(range.len());
        for (k, i) in range.enumerate() {
            let q = inverse * (self.points.position[i] - motion.translation);
            let normal = self.points.normal.get(i).map(|n| inverse * *n);
            let at = |patch, uv| Found { index: i, patch, uv, q, normal: normal.unwrap_or(DVec3::ZERO) };
            if let Some(part) = &memory
                && part.travelled < part.known[k].until
            {
                if part.known[k].patch != NOWHERE {
                    found.push(at(part.known[k].patch, part.known[k].uv));
                }
                continue;
            }
            let facing = match (self.signs, normal) {
                (Some(signs), Some(normal)) => Some(Facing { normal, signs }),
                _ => None,
            };
            let hint = self.hints[i].load(Ordering::Relaxed);
            let nearest = match &mut memory {
                Some(part) => {
                    let (nearest, slack) = placed.facets.nearest_and_slack(q, cutoff, facing, hint, part.reach);
                    part.known[k].patch = nearest.map_or(NOWHERE, |n| n.patch);
                    part.known[k].until = part.travelled + slack;
                    nearest
                }
                None => placed.facets.nearest(q, cutoff, facing, hint),
            };
            if let Some(nearest) = nearest {
                self.hints[i].store(nearest.quad, Ordering::Relaxed);
                found.push(at(nearest.patch, nearest.uv));
            }
        }
        found.sort_by_key(|f| f.patch);
        found
    }

    /// Adds the points of one patch. A patch that fails here counts as absent: its points keep psi = 1.
    /// Returns the feet; none where the patch fails.
    fn patch(&self, placed: &Placed, found: &[Found], order: Order, sums: &mut Sums) -> Vec<Foot> {
        let patch = found[0].patch as usize;
        let instance = &*placed.instance;
        let (q, uv): (Vec<DVec3>, Vec<[f64; 2]>) = found.iter().map(|f| (f.q, f.uv)).unzip();
        let Ok(feet) = refine(instance, patch, self.layout.closed(patch), &q, &uv, self.tolerance) else {
            return Vec::new();
        };
        let half2 = self.loss.half().powi(2);
        let residuals: Vec<Residual> = feet
            .iter()
            .zip(&q)
            .map(|(foot, q)| Residual { e: foot.point - *q, weight: self.loss.weight(foot.d2), foot: *foot })
            .collect();
        for (residual, found) in residuals.iter().zip(found) {
            sums.psi += self.loss.psi(residual.foot.d2) - 1.0;
            let part = &mut sums.patches[patch];
            if residual.foot.d2 < half2 {
                part.inliers += 1.0;
                part.d2 += residual.foot.d2;
            }
            part.weight += residual.weight;
            part.weighted_d2 += residual.weight * residual.foot.d2;
            part.facing += residual.weight * residual.foot.normal.normalize_or_zero().dot(found.normal);
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
        let columns: Vec<usize> = active.iter().map(|a| *a as usize).chain(n..n + 6).collect();
        let total = n + 6;
        let mut row = vec![0.0; columns.len()];
        for (i, r) in residuals.iter().enumerate() {
            let (direction, distance) = self.direction(r);
            for (a, entry) in row.iter_mut().take(active.len()).enumerate() {
                *entry = direction.dot(DVec3::from_slice(&jacobian[(i * active.len() + a) * 3..]));
            }
            let torque = (r.foot.point - self.space.centre).cross(direction);
            row[active.len()..].copy_from_slice(&[direction.x, direction.y, direction.z, torque.x, torque.y, torque.z]);
            // Never so small that a step would run away.
            let bend = if self.curved { self.loss.curvature(r.foot.d2).max(0.3 * r.weight) } else { r.weight };
            for (a, ra) in row.iter().enumerate() {
                let weighted = bend * ra;
                sums.gradient[columns[a]] += r.weight * ra * distance;
                let line = &mut sums.normal[columns[a] * total..][..total];
                for (b, rb) in row.iter().enumerate().skip(a) {
                    line[columns[b]] += weighted * rb;
                }
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

/// Writes feet down for the next evaluation.
pub(crate) fn remember(memory: Option<&mut Part>, start: usize, found: &[Found], feet: &[Foot]) {
    let Some(part) = memory else { return };
    for (found, foot) in found.iter().zip(feet) {
        part.known[found.index - start].uv = foot.uv;
    }
}

/// A point with the facet that it is nearest to.
pub(crate) struct Found {
    pub(crate) index: usize,
    pub(crate) patch: u32,
    pub(crate) uv: [f64; 2],
    /// The point in the model's frame.
    pub(crate) q: DVec3,
    normal: DVec3,
}

fn arguments(residuals: &[Residual]) -> (Vec<f64>, Vec<f64>) {
    (residuals.iter().map(|r| r.foot.uv[0]).collect(), residuals.iter().map(|r| r.foot.uv[1]).collect())
}
