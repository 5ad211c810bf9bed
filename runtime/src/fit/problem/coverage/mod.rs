//! The coverage term: from the model to the scan. The objective looks from the scan to the model, so that nothing pulls
//! back an end of the model that has grown beyond what was scanned. This term counts the loss of e for places spread
//! evenly over what could be seen of the model; e is how far a place lies beyond the scan along the model's own
//! surface. Where the scan passes by a place e is zero: what both terms could speak of is left to the other one.

mod scanned;
mod visible;

use crate::fit::correspond::foot::Foot;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Correspondence, Evaluation, Matched, Objective, Order, Placed};
use crate::fit::problem::parameterization::Estimate;
use crate::fit::problem::sums::{Sums, add_scaled};
use crate::fit::tuning::CHUNK_POINTS;
use crate::model::{Instance, Partials};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use scanned::{Beyond, Place};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

pub(crate) use scanned::Scanned;
pub(crate) use visible::{Places, across, all_places, patch_area, places};

/// The term with its scale.
pub(crate) struct Coverage<'a> {
    scanned: Arc<Scanned<'a>>,
    places: Arc<[Places]>,
    /// Per patch, which way is out (see `Facing`).
    signs: Vec<i8>,
    loss: Loss,
    /// Places in all, and the mean area that one stands for.
    count: f64,
    mean_area: f64,
}

/// The term's part of the sandwich, in the units of the sums over points (see `sandwich`), by the parameters, shift and
/// turn.
pub(crate) struct Information {
    /// Sum of curvature J J^T.
    pub(crate) bread: DMatrix<f64>,
    /// Sum of weight J J^T.
    pub(crate) weighted: DMatrix<f64>,
    /// Sum over the scan's elements of (sum of score contributions) (sum of score contributions)^T: places beside the
    /// same element depend on each other.
    pub(crate) meat: DMatrix<f64>,
    /// Sum of weight J over the places: how the sum of scores changes where the scan's border as a whole lies a
    /// millimetre farther out.
    pub(crate) pull: DVector<f64>,
}

/// Some places of one patch that lie beyond the scan, as feet of points that they ought to be at.
struct Stretch {
    /// Indices of the points are those among the patch's places.
    matched: Matched,
    elements: Vec<u32>,
    /// Places of this chunk that nothing of the scan is near.
    lost: f64,
}

impl<'a> Coverage<'a> {
    pub(crate) fn new(scanned: Scanned<'a>, places: Vec<Places>, signs: Vec<i8>, loss: Loss) -> Self {
        let count = places.iter().map(|p| p.u.len()).sum::<usize>().max(1) as f64;
        let mean_area = places.iter().flat_map(|p| &p.area).sum::<f64>() / count;
        Self { scanned: Arc::new(scanned), places: places.into(), signs, loss, count, mean_area }
    }

    /// The scale of the loss. Millimetres.
    pub(crate) fn sigma(&self) -> f64 {
        self.loss.sigma
    }

    /// The same at another scale. Millimetres.
    pub(crate) fn at_scale(&self, sigma: f64) -> Self {
        let (scanned, places) = (self.scanned.clone(), self.places.clone());
        Self { scanned, places, signs: self.signs.clone(), loss: Loss { sigma, ..self.loss }, ..*self }
    }

    /// The term and its derivatives by the scaled local coordinates.
    pub(crate) fn evaluate(&self, objective: &Objective, placed: &Placed, at: &Estimate, order: Order) -> Evaluation {
        let objective = &objective.with_loss(self.loss);
        let sums: Vec<Sums> = self
            .chunks()
            .into_par_iter()
            .map(|(places, range)| {
                let mut sums = Sums::none(objective.space, 0.0, order);
                match self.stretch(&*placed.instance, &at.motion, places, range.clone()) {
                    Some(stretch) => {
                        sums.loss += stretch.lost + stretch.matched.losses.iter().map(|l| l.value).sum::<f64>();
                        if !stretch.matched.points.is_empty() {
                            objective.add_derivatives(&*placed.instance, &stretch.matched, order, &mut sums);
                        }
                    }
                    None => sums.loss += places.area[range].iter().sum::<f64>() / self.mean_area,
                }
                sums
            })
            .collect();
        objective.total(&sums, self.count, at, order, 0)
    }

    /// The term's part of the sandwich. None where the model does not exist.
    pub(crate) fn information(&self, objective: &Objective, at: &Estimate) -> Option<Information> {
        let placed = objective.place(at).ok()?;
        let total = objective.space.model.parameters().len() + 6;
        // A point's share in the objective is 2 / sigma^2 over the sum of the prior weights.
        let ratio = (objective.loss.sigma / self.loss.sigma).powi(2) * objective.points.weight() / self.count;
        let objective = objective.with_loss(self.loss);
        let zero = || DMatrix::zeros(total, total);
        let mut information =
            Information { bread: zero(), weighted: zero(), meat: zero(), pull: DVector::zeros(total) };
        let mut pulls: BTreeMap<u32, DVector<f64>> = BTreeMap::new();
        for (places, range) in self.chunks() {
            let stretch = self.stretch(&*placed.instance, &at.motion, places, range)?;
            if stretch.matched.points.is_empty() {
                continue;
            }
            let rows = objective.rows(&*placed.instance, &stretch.matched)?;
            for ((point, row), element) in rows.iter().zip(&stretch.elements) {
                let mut whole = DVector::zeros(total);
                rows.columns.iter().zip(row).for_each(|(i, r)| whole[*i] += r);
                information.bread.ger(ratio * point.curvature, &whole, &whole, 1.0);
                information.weighted.ger(ratio * point.weight, &whole, &whole, 1.0);
                information.pull.axpy(ratio * point.weight * point.distance.signum(), &whole, 1.0);
                let sum = pulls.entry(*element).or_insert_with(|| DVector::zeros(total));
                add_scaled(sum.as_mut_slice(), ratio * point.weight * point.distance, whole.as_slice());
            }
        }
        for sum in pulls.values() {
            information.meat.ger(1.0, sum, sum, 1.0);
        }
        Some(information)
    }

    /// The share of the area that was scanned. None where the model does not exist.
    pub(crate) fn share(&self, instance: &dyn Instance, motion: &Isometry) -> Option<f64> {
        let mut beyond = 0.0;
        for (places, range) in self.chunks() {
            let area = &places.area[range.clone()];
            let stretch = self.stretch(instance, motion, places, range)?;
            beyond += stretch.lost * self.mean_area + stretch.matched.points.iter().map(|p| area[p.index]).sum::<f64>();
        }
        Some(1.0 - beyond / (self.mean_area * self.count))
    }

    fn chunks(&self) -> Vec<(&Places, Range<usize>)> {
        let of_patch = |places| {
            let Places { u, .. }: &Places = places;
            let ends = move |start: usize| start..(start + CHUNK_POINTS).min(u.len());
            (0..u.len()).step_by(CHUNK_POINTS).map(move |start| (places, ends(start)))
        };
        self.places.iter().flat_map(of_patch).collect()
    }

    /// The places of a chunk that lie beyond the scan. None where the patch cannot be evaluated.
    fn stretch(
        &self,
        instance: &dyn Instance,
        motion: &Isometry,
        places: &Places,
        range: Range<usize>,
    ) -> Option<Stretch> {
        let (u, v, area) = (&places.u[range.clone()], &places.v[range.clone()], &places.area[range]);
        let mut partials = vec![Partials::default(); u.len()];
        instance.partials(places.patch, u, v, &mut partials).ok()?;
        let there = instance.is_there(places.keep, u, v).ok()?;
        let mut matched = Matched::none(places.patch);
        let mut elements = Vec::new();
        let mut lost = 0.0;
        let side = if self.signs[places.patch] < 0 { -1.0 } else { 1.0 };
        for (i, p) in partials.iter().enumerate().filter(|(i, _)| there[*i]) {
            let point = DVec3::from_array(p.point);
            let normal = across(p);
            let share = area[i] / self.mean_area;
            let (there, outward) = (motion.apply(point), motion.rotation * normal.normalize_or_zero() * side);
            let Beyond { distance, direction, element } = match self.scanned.place(there, outward, self.loss.cutoff()) {
                Place::Scanned => continue,
                Place::Nowhere => {
                    lost += share;
                    continue;
                }
                Place::Beyond(beyond) => beyond,
            };
            let back = motion.rotation.inverse() * direction * distance;
            let uv = [u[i], v[i]];
            matched.points.push(Correspondence { index: i, patch: places.patch as u32, uv, q: point - back, normal });
            matched.feet.push(Foot { uv, point, normal, d2: distance * distance, ..Foot::default() });
            matched.losses.push(self.loss.at(distance * distance).times(share));
            elements.push(element);
        }
        Some(Stretch { matched, elements, lost })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::FitOptions;
    use crate::fit::monitor::Monitor;
    use crate::fit::problem::Problem;
    use crate::fit::tests::shapes::{Simple, simple};
    use crate::mesh::TriangleMesh;
    use crate::model::Model;
    use crate::scan::from_mesh;
    use glam::DQuat;

    #[test]
    fn its_gradient_agrees_with_differences() {
        // A square of 20 x 20 was scanned, the model's is 26 x 26 and lies a little askew.
        let corners = [[-10.0, -10.0, 0.0], [10.0, -10.0, 0.0], [10.0, 10.0, 0.0], [-10.0, 10.0, 0.0]];
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        let mesh = TriangleMesh { positions: corners.to_vec(), triangles, ..TriangleMesh::default() };
        let scan = from_mesh(mesh, "square").unwrap();
        let (model, options, monitor) = (simple(Simple::Plane, &[26.0]), FitOptions::default(), Monitor::default());
        let problem = Problem::new(&model, &scan, &options, &monitor).unwrap();
        let level = problem.start_level().unwrap();
        let motion = Isometry { rotation: DQuat::from_rotation_z(0.1), translation: DVec3::new(1.0, -0.5, 0.0) };
        let at = level.space.estimate(&[26.0], motion);
        let instance = model.instantiate(&[26.0]).unwrap();
        let places = places(&model, &*instance, problem.radius).unwrap();
        let coverage =
            Coverage::new(Scanned::new(&scan, true, problem.radius).unwrap(), places, vec![1], Loss::welsch(5.0));
        let objective = level.objective(&problem.points, Loss::welsch(1.0));
        let evaluate = |at: &Estimate, order| coverage.evaluate(&objective, &objective.place(at).unwrap(), at, order);
        let [gradient, normal] = [Order::Gradient, Order::Normal].map(|order| evaluate(&at, order).gradient);
        let largest = gradient.amax();
        assert!(largest > 1e-4 && (&gradient - &normal).amax() < 1e-9 * largest);
        for k in 0..level.space.dim() {
            let value = |h: f64| {
                let mut y = vec![0.0; level.space.dim()];
                y[k] = h;
                evaluate(&level.space.retract(&at, &y), Order::Value).value
            };
            let difference = (value(1e-4) - value(-1e-4)) / 2e-4;
            assert!((difference - gradient[k]).abs() < 1e-4 * largest, "{k}: {difference} and {}", gradient[k]);
        }
        // 400 of 676 square millimetres are over the scan, but for the model's turn and shift none beyond.
        let share = coverage.share(&*instance, &motion).unwrap();
        assert!((share - 400.0 / 676.0).abs() < 0.01, "{share}");
    }
}
