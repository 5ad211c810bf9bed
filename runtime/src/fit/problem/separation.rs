//! A term of the objective that holds walls of the model apart which would pass through each other: the mean square
//! of the depths by which they do, over the model's surface.

use super::objective::{Evaluation, Objective, Order};
use super::parameterization::Estimate;
use super::walls::{Passage, Site, Walls};
use crate::fit::tuning::SEPARATION_WEIGHT;
use crate::model::{Instance, Model};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The term.
pub(crate) struct Separation {
    pub(crate) walls: Arc<Walls>,
    /// The depth that counts as a point at a distance of the loss's scale does. Millimetres.
    pub(crate) sigma: f64,
}

/// The derivatives of depths by the parameters, with what each counts.
struct Rows {
    /// A row for every passage.
    slopes: DMatrix<f64>,
    weights: DVector<f64>,
    depths: DVector<f64>,
}

impl Separation {
    /// The term, and its derivatives by the scaled local coordinates. None where the model cannot be evaluated.
    pub(crate) fn evaluate(
        &self,
        objective: &Objective,
        instance: &dyn Instance,
        at: &Estimate,
        order: Order,
    ) -> Option<Evaluation> {
        let rows = self.rows(objective.space.model, instance, order)?;
        let Rows { slopes, weights, depths } = &rows;
        let value = weights.dot(&depths.component_mul(depths));
        let (mut gradient, mut normal) = (DVector::zeros(0), DMatrix::zeros(0, 0));
        if order != Order::Value {
            let chain = objective.space.chain(at);
            let shape = chain.rows(0, slopes.ncols());
            let local = slopes * shape;
            gradient = 2.0 * local.tr_mul(&weights.component_mul(depths));
            normal = rows.square(&local);
        }
        Some(Evaluation { value, gradient, normal, patches: Vec::new(), absent: 0 })
    }

    /// The Hessian of the term by the scaled local coordinates, without what depends on the bending of walls. None
    /// where the model does not exist.
    pub(crate) fn hessian(&self, objective: &Objective, at: &Estimate) -> Option<DMatrix<f64>> {
        let placed = objective.place(at).ok()?;
        Some(self.evaluate(objective, &*placed.instance, at, Order::Normal)?.normal)
    }

    fn rows(&self, model: &dyn Model, instance: &dyn Instance, order: Order) -> Option<Rows> {
        let mut passages = self.walls.passages(instance)?;
        passages.retain(|passage| passage.through.is_some_and(|(_, normal)| normal.dot(passage.normal) < 0.0));
        let share = |passage: &Passage| SEPARATION_WEIGHT * passage.area / (self.walls.area * self.sigma.powi(2));
        let weights = DVector::from_iterator(passages.len(), passages.iter().map(share));
        let depths = DVector::from_iterator(passages.len(), passages.iter().map(|passage| passage.depth));
        let mut slopes = DMatrix::zeros(passages.len(), model.parameters().len());
        if order != Order::Value {
            add_slopes(model, instance, &passages, &mut slopes)?;
        }
        Some(Rows { slopes, weights, depths })
    }
}

impl Rows {
    /// The matrix of the Gauss-Newton method in coordinates in which the rows are `local`.
    fn square(&self, local: &DMatrix<f64>) -> DMatrix<f64> {
        let mut weighted = local.clone();
        weighted.row_iter_mut().zip(self.weights.iter()).for_each(|(mut row, weight)| row *= 2.0 * *weight);
        local.tr_mul(&weighted)
    }
}

/// Adds the derivatives of depths, which grow where a place moves out of the other wall, or that back. That the walls
/// turn counts only in second order.
fn add_slopes(
    model: &dyn Model,
    instance: &dyn Instance,
    passages: &[Passage],
    slopes: &mut DMatrix<f64>,
) -> Option<()> {
    let mut by_patch: BTreeMap<usize, Vec<(usize, [f64; 2], DVec3)>> = BTreeMap::new();
    for (row, passage) in passages.iter().enumerate() {
        let Some((through, normal)) = passage.through else { continue };
        for (Site { patch, uv }, direction) in [(passage.site, normal), (through, -normal)] {
            by_patch.entry(patch).or_default().push((row, uv, direction));
        }
    }
    for (patch, sites) in by_patch {
        let active = &model.parts()[patch].active;
        let (u, v): (Vec<f64>, Vec<f64>) = sites.iter().map(|(_, uv, _)| (uv[0], uv[1])).unzip();
        let mut jacobian = vec![0.0; sites.len() * active.len() * 3];
        instance.jacobian(patch, &u, &v, &mut jacobian).ok()?;
        for ((row, _, direction), of_site) in sites.iter().zip(jacobian.chunks_exact(3 * active.len().max(1))) {
            for (parameter, moved) in active.iter().zip(of_site.chunks_exact(3)) {
                slopes[(*row, *parameter as usize)] += direction.dot(DVec3::from_slice(moved));
            }
        }
    }
    Some(())
}
