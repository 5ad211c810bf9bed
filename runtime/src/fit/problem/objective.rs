//! The objective, the mean loss of the points' distances, with its gradient or its weighted normal equations.

use super::isometry::Isometry;
use super::loss::{Loss, PointLoss};
use super::parameterization::{Estimate, Parameterization};
use super::points::Points;
use super::sums::{PatchSum, Sums};
use crate::fit::correspond::cache::{CacheSlice, CacheState, CachedFoot, FootCache, NOWHERE};
use crate::fit::correspond::facets::{Facets, Facing};
use crate::fit::correspond::foot::Foot;
use crate::fit::correspond::layout::Layout;
use crate::fit::correspond::nearest::{NO_HINT, Query};
use crate::fit::monitor::{Monitor, TracePoint};
use crate::fit::problem::coverage::Coverage;
use crate::fit::problem::separation::Separation;
use crate::fit::tuning::{
    CHUNK_POINTS, FEW_CHUNKS, LEAST_CHUNK, REACH_LIMIT, REACH_SIGMAS, REACH_SPACINGS, ROUGH_TOLERANCE,
};
use crate::model::{EvaluationError, Instance};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, MutexGuard};

/// The objective over some points with a certain loss.
pub(crate) struct Objective<'s> {
    pub(crate) space: &'s Parameterization<'s>,
    pub(crate) points: &'s Points,
    pub(crate) layout: &'s Layout,
    pub(crate) loss: Loss,
    /// Per patch, which way is out (see `Facing`); None where normals are not to be used.
    pub(crate) signs: Option<&'s [i8]>,
    /// Foot points are exact to this. Millimetres.
    pub(crate) tolerance: f64,
    /// By point, the facet that was the nearest one the last time.
    pub(crate) hints: Arc<Vec<AtomicU32>>,
    /// The feet of the points at the last evaluation, where evaluations are close to one another.
    pub(crate) cache: Option<Arc<FootCache>>,
    /// The coverage term, if it takes part.
    pub(crate) coverage: Option<Arc<Coverage<'s>>>,
    /// The term that holds walls apart, if it takes part.
    pub(crate) separation: Option<Arc<Separation>>,
    /// The matrix of `Order::Normal` is nearer to the Hessian: the curvatures of the loss take the place of the weights
    /// where they are positive.
    pub(crate) curved: bool,
    /// The stage under whose name steps are traced, if they are. Several minimisations at a time trace nothing.
    pub(crate) stage: Option<&'static str>,
    /// Counts evaluations, takes down steps, and says when nobody waits for the result any longer.
    pub(crate) monitor: &'s Monitor<'s>,
    /// Evaluations fail once the fit is cancelled, so that minimisations end soon.
    pub(crate) cancellable: bool,
}

/// The derivatives that an evaluation computes.
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
    /// Mean loss, by the points' prior weights.
    pub(crate) value: f64,
    /// Its gradient.
    pub(crate) gradient: DVector<f64>,
    /// Sum of weight * J^T J, times 2 / sigma^2 over the sum of the prior weights: the Hessian without the terms that
    /// make it indefinite (see `curved`).
    pub(crate) normal: DMatrix<f64>,
    /// Sums by patch.
    pub(crate) patches: Vec<PatchSum>,
    /// Patches that could not be evaluated.
    pub(crate) absent: usize,
}

impl Evaluation {
    /// A stand-in for the evaluation of a model that does not exist.
    pub(crate) fn absent(space: &Parameterization) -> Self {
        let (dim, parts) = (space.dim(), space.model.parts().len());
        Self {
            value: 1.0,
            gradient: DVector::zeros(dim),
            normal: DMatrix::zeros(dim, dim),
            patches: vec![PatchSum::default(); parts],
            absent: parts,
        }
    }

    /// The decrease of the value that the quadratic model predicts for a step.
    pub(crate) fn predicted_gain(&self, step: &DVector<f64>) -> f64 {
        -(self.gradient.dot(step) + 0.5 * step.dot(&(&self.normal * step)))
    }

    /// The root mean square distance of the inliers. Millimetres.
    pub(crate) fn rms(&self) -> f64 {
        (self.patches.iter().map(|p| p.d2).sum::<f64>() / self.inliers().max(f64::MIN_POSITIVE)).sqrt()
    }

    /// The sum of the prior weights of points with a loss below 1/2.
    pub(crate) fn inliers(&self) -> f64 {
        self.patches.iter().map(|p| p.inliers).sum()
    }
}

/// An empty cache of the feet of some points, for a loss of scale `sigma` (millimetres).
pub(crate) fn foot_cache(points: &Points, sigma: f64) -> Arc<FootCache> {
    let near = REACH_SPACINGS * points.spacing();
    let reach = (REACH_SIGMAS * sigma).max(if near < REACH_LIMIT * points.gyration() { near } else { 0.0 });
    Arc::new(FootCache::new(points.len(), reach))
}

/// Hints for points of which nothing is known yet.
pub(crate) fn no_hints(points: &Points) -> Arc<Vec<AtomicU32>> {
    Arc::new((0..points.len()).map(|_| AtomicU32::new(NO_HINT)).collect())
}

/// A model at an estimate, with its facets.
pub(crate) struct Placed<'s> {
    pub(crate) instance: Box<dyn Instance + 's>,
    pub(crate) facets: Facets<'s>,
    pub(crate) motion: Isometry,
}

/// Some of an objective's points, with the cache of their feet where there is one.
pub(crate) struct Chunk<'c> {
    pub(crate) range: Range<usize>,
    pub(crate) cache: Option<CacheSlice<'c>>,
}

impl<'s> Objective<'s> {
    /// The objective over some points, without normals, coverage or anything known from earlier evaluations.
    pub(crate) fn new(
        space: &'s Parameterization<'s>,
        layout: &'s Layout,
        points: &'s Points,
        loss: Loss,
        monitor: &'s Monitor<'s>,
    ) -> Self {
        Self {
            space,
            points,
            layout,
            loss,
            signs: None,
            tolerance: ROUGH_TOLERANCE * loss.sigma,
            hints: no_hints(points),
            cache: None,
            coverage: None,
            separation: None,
            curved: false,
            stage: None,
            monitor,
            cancellable: true,
        }
    }
}

impl Objective<'_> {
    /// The same with another loss.
    pub(crate) fn with_loss(&self, loss: Loss) -> Objective<'_> {
        let (hints, cache) = (self.hints.clone(), self.cache.clone());
        let (coverage, separation) = (self.coverage.clone(), self.separation.clone());
        Objective { loss, hints, cache, coverage, separation, stage: None, ..*self }
    }

    /// The objective's cache with the model where it is placed now, if there is one and no other evaluation holds it.
    pub(crate) fn follow(&self, placed: &Placed) -> Option<MutexGuard<'_, CacheState>> {
        let cache = self.cache.as_ref()?;
        let vertices = placed.facets.vertices().map(|p| placed.motion.apply(p));
        cache.follow(vertices.chain(placed.facets.keeps().map(|keep| DVec3::X * keep)).collect())
    }

    fn cancelled(&self) -> bool {
        self.cancellable && self.monitor.cancelled()
    }

    /// Traces a step of an optimiser.
    pub(crate) fn note(&self, evaluation: &Evaluation) {
        let Some(stage) = self.stage else { return };
        self.monitor.note(TracePoint {
            stage,
            evaluations: self.monitor.evaluations(),
            points: self.points.len(),
            sigma: self.loss.sigma,
            objective: evaluation.value,
            inliers: evaluation.inliers() / self.points.weight(),
        });
    }

    /// All points, chunk by chunk. Chunks do not depend on the number of threads, so that sums over them do not.
    pub(crate) fn chunks<'c>(&self, cache: Option<&'c mut CacheState>) -> Vec<Chunk<'c>> {
        let count = self.points.len();
        let size = (count / FEW_CHUNKS).clamp(LEAST_CHUNK, CHUNK_POINTS);
        let mut slices = cache.map(|cache| cache.slices(size)).unwrap_or_default().into_iter();
        let starts = (0..count).step_by(size);
        starts.map(|start| Chunk { range: start..(start + size).min(count), cache: slices.next() }).collect()
    }

    /// The model at an estimate.
    ///
    /// # Errors
    /// A `require` that does not hold or bounds without room.
    pub(crate) fn place(&self, at: &Estimate) -> Result<Placed<'_>, EvaluationError> {
        let Some(x) = self.space.x(&at.z) else {
            return Err(EvaluationError::new("the bounds of the parameters leave no room"));
        };
        let instance = self.space.model.instantiate(&x)?;
        let facets = self.layout.facets(&*instance);
        Ok(Placed { instance, facets, motion: at.motion })
    }

    /// The objective at an estimate; None where the model does not exist (the caller treats it as infinite).
    pub(crate) fn evaluate(&self, at: &Estimate, order: Order) -> Option<Evaluation> {
        let placed = &self.place(at).ok()?;
        if self.cancelled() {
            return None;
        }
        self.monitor.evaluations.fetch_add(1, Ordering::Relaxed);
        let mut cache = self.follow(placed);
        let chunks = self.chunks(cache.as_deref_mut());
        let sums: Vec<Sums> = chunks.into_par_iter().map(|mut chunk| self.sums(placed, &mut chunk, order)).collect();
        // Chunks that came later are missing.
        if self.cancelled() {
            return None;
        }
        let mut evaluation = self.total(&sums, self.points.weight(), at, order, placed.facets.absent);
        let coverage = self.coverage.as_ref().map(|coverage| coverage.evaluate(self, placed, at, order));
        let separation = self.separation.as_ref();
        let separation = separation.and_then(|walls| walls.evaluate(self, &*placed.instance, at, order));
        for Evaluation { value, gradient, normal, .. } in coverage.into_iter().chain(separation) {
            evaluation.value += value;
            if order != Order::Value {
                evaluation.gradient += gradient;
            }
            if order == Order::Normal {
                evaluation.normal += normal;
            }
        }
        (evaluation.value.is_finite() && evaluation.gradient.iter().all(|g| g.is_finite())).then_some(evaluation)
    }

    /// The foot points of the points within the cut-off, with the points' indices.
    pub(crate) fn feet(&self, placed: &Placed) -> Vec<(usize, Foot)> {
        self.feet_on_patches(placed).into_iter().map(|(_, point, foot)| (point, foot)).collect()
    }

    /// The same after the patches on which they lie.
    pub(crate) fn feet_on_patches(&self, placed: &Placed) -> Vec<(usize, usize, Foot)> {
        let mut cache = self.follow(placed);
        let chunks = self.chunks(cache.as_deref_mut()).into_par_iter();
        let matched = chunks.flat_map_iter(|mut chunk| self.matched(placed, &mut chunk));
        let of_patch = |m: Matched| m.points.into_iter().zip(m.feet).map(move |(p, foot)| (m.patch, p.index, foot));
        matched.flat_map_iter(of_patch).collect()
    }

    /// The points that have a facet within the cut-off, with the patches to which they belong.
    pub(crate) fn patches(&self, placed: &Placed) -> Vec<(usize, usize)> {
        let chunks = self.chunks(None).into_par_iter();
        let found = chunks.flat_map_iter(|mut chunk| self.correspondences(placed, &mut chunk));
        found.map(|c| (c.index, c.patch as usize)).collect()
    }

    /// The loss of every point, whatever its prior weight: 1 for those without a foot.
    pub(crate) fn losses(&self, placed: &Placed) -> Vec<f64> {
        let mut losses = vec![1.0; self.points.len()];
        for (i, foot) in self.feet(placed) {
            losses[i] = self.loss.value(foot.d2);
        }
        losses
    }

    /// The mean loss of the distances to facets moved by `motion`: fast, and exact enough to rule out places that are
    /// much worse than others.
    pub(crate) fn rough_value(&self, facets: &Facets, motion: &Isometry) -> f64 {
        let losses = self.rough_losses(facets, motion);
        losses.into_iter().enumerate().map(|(i, loss)| self.points.prior(i) * loss).sum::<f64>() / self.points.weight()
    }

    /// The loss of every point's distance to facets moved by `motion`, whatever its prior weight.
    pub(crate) fn rough_losses(&self, facets: &Facets, motion: &Isometry) -> Vec<f64> {
        self.monitor.evaluations.fetch_add(1, Ordering::Relaxed);
        let inverse = motion.rotation.inverse();
        let cutoff = self.loss.cutoff();
        let loss = |p: &DVec3| {
            let d = facets.distance(inverse * (*p - motion.translation), cutoff);
            self.loss.value(d * d)
        };
        self.points.position.iter().map(loss).collect()
    }

    fn sums(&self, placed: &Placed, chunk: &mut Chunk, order: Order) -> Sums {
        let mut sums = Sums::none(self.space, self.points.weight_of(chunk.range.clone()), order);
        if self.cancelled() {
            return sums;
        }
        for matched in self.matched(placed, chunk) {
            self.add_patch(&*placed.instance, &matched, order, &mut sums);
        }
        sums
    }

    /// The points of a chunk that have a foot within the cut-off, patch by patch.
    pub(crate) fn matched(&self, placed: &Placed, chunk: &mut Chunk) -> Vec<Matched> {
        let correspondences = self.correspondences(placed, chunk);
        let mut matched = self.with_feet(placed, &correspondences);
        if let Some(cache) = &mut chunk.cache {
            self.decide_contested(placed, chunk.range.start, cache, &mut matched);
            for (point, foot) in matched.iter().flat_map(|m| m.points.iter().zip(&m.feet)) {
                cache.known[point.index - chunk.range.start].uv = foot.uv;
            }
        }
        matched
    }

    /// Correspondences, ordered by patch, with their exact feet. Patches that cannot be evaluated are left out.
    pub(crate) fn with_feet(&self, placed: &Placed, correspondences: &[Correspondence]) -> Vec<Matched> {
        let of_patch = |points: &[Correspondence]| {
            let patch = points[0].patch as usize;
            let (q, uv): (Vec<DVec3>, Vec<[f64; 2]>) = points.iter().map(|p| (p.q, p.uv)).unzip();
            let feet = placed.facets.grid(patch).feet(&*placed.instance, patch, &q, &uv, self.tolerance).ok()?;
            let loss =
                |(foot, point): (&Foot, &Correspondence)| self.loss.at(foot.d2).times(self.points.prior(point.index));
            let losses = feet.iter().zip(points).map(loss).collect();
            let mut matched = Matched { patch, points: points.to_vec(), feet, losses };
            // Of a trimmed patch nothing may be there any longer.
            matched.retain(|matched, k| matched.feet[k].d2.is_finite());
            Some(matched)
        };
        correspondences.chunk_by(|a, b| a.patch == b.patch).filter_map(of_patch).collect()
    }

    /// The points of a chunk that have a facet within the cut-off, by patch.
    pub(crate) fn correspondences(&self, placed: &Placed, chunk: &mut Chunk) -> Vec<Correspondence> {
        let Chunk { range, cache } = chunk;
        let Isometry { rotation, translation } = placed.motion;
        let inverse = rotation.inverse();
        // Facets lie off the surface, on either side of it.
        let cutoff = self.loss.cutoff() + self.layout.sagitta + self.layout.edge_error;
        let mut all = Vec::with_capacity(range.len());
        // Points stand beside their neighbours in space: the last one's facet is a good guess for one that has none.
        let mut last = NO_HINT;
        for (k, i) in range.clone().enumerate() {
            let q = inverse * (self.points.position[i] - translation);
            let normal = self.points.normal.get(i).map_or(DVec3::ZERO, |n| inverse * *n);
            let at = |patch, uv| Correspondence { index: i, patch, uv, q, normal };
            if let Some(slice) = cache
                && slice.travelled < slice.known[k].until
            {
                let CachedFoot { patch, uv, .. } = slice.known[k];
                all.extend((patch != NOWHERE).then(|| at(patch, uv)));
                continue;
            }
            let hint = match self.hints[i].load(Ordering::Relaxed) {
                NO_HINT => last,
                hint => hint,
            };
            let query = Query { facing: self.facing(normal), hint, ..Query::new(q, cutoff) };
            let nearest = match cache {
                Some(slice) => {
                    let (nearest, slack) = placed.facets.nearest_and_slack(Query { reach: slice.reach, ..query });
                    slice.known[k].patch = nearest.map_or(NOWHERE, |n| n.patch);
                    slice.known[k].until = slice.travelled + slack;
                    nearest
                }
                None => placed.facets.nearest(query),
            };
            if let Some(nearest) = nearest {
                self.hints[i].store(nearest.quad, Ordering::Relaxed);
                last = nearest.quad;
                all.push(at(nearest.patch, nearest.uv));
            }
        }
        by_patch(&all, self.space.model.parts().len())
    }

    /// The orientation of facets that may belong to a point with this normal; None where normals are not used.
    pub(super) fn facing(&self, normal: DVec3) -> Option<Facing<'_>> {
        let signs = self.signs.filter(|_| !self.points.normal.is_empty())?;
        Some(Facing { normal, signs })
    }

    /// The same point with the nearest other patch, if there is one within `limit`.
    pub(crate) fn elsewhere(&self, placed: &Placed, point: &Correspondence, limit: f64) -> Option<Correspondence> {
        let Correspondence { q, normal, patch, .. } = *point;
        let query = Query { facing: self.facing(normal), except: Some(patch), ..Query::new(q, limit) };
        let nearest = placed.facets.nearest(query)?;
        Some(Correspondence { patch: nearest.patch, uv: nearest.uv, ..*point })
    }
}

/// A point of the scan with the facet that it is nearest to.
#[derive(Clone, Copy)]
pub(crate) struct Correspondence {
    /// Index among the objective's points.
    pub(crate) index: usize,
    pub(crate) patch: u32,
    pub(crate) uv: [f64; 2],
    /// The point in the model's frame. Millimetres.
    pub(crate) q: DVec3,
    /// Its normal, likewise; zero where there is none.
    pub(crate) normal: DVec3,
}

/// Points of the scan that belong to one patch, with their feet on it and their losses.
pub(crate) struct Matched {
    pub(crate) patch: usize,
    pub(crate) points: Vec<Correspondence>,
    pub(crate) feet: Vec<Foot>,
    pub(crate) losses: Vec<PointLoss>,
}

impl Matched {
    /// No points of a patch.
    pub(crate) fn none(patch: usize) -> Self {
        Self { patch, points: Vec::new(), feet: Vec::new(), losses: Vec::new() }
    }
}

/// A counting sort by patch, stable.
fn by_patch(correspondences: &[Correspondence], patches: usize) -> Vec<Correspondence> {
    let mut next = vec![0; patches + 1];
    correspondences.iter().for_each(|c| next[c.patch as usize + 1] += 1);
    for patch in 1..=patches {
        next[patch] += next[patch - 1];
    }
    let mut sorted = correspondences.to_vec();
    for c in correspondences {
        let slot = &mut next[c.patch as usize];
        sorted[*slot] = *c;
        *slot += 1;
    }
    sorted
}
