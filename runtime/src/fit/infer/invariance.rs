//! Whether motions move the model within itself, whatever the scan shows of it.

use crate::eigen;
use crate::fit::problem::coverage::{across, all_places};
use crate::fit::refine::schedule::Solution;
use crate::fit::tuning::STAYS;
use crate::model::Partials;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// How the model's surface moves along its normals by motions: by patch, the mean of m m^T over its area, where m . d
/// is the movement by the scaled local coordinates d of a motion.
pub(crate) struct Invariance {
    movement: Vec<DMatrix<f64>>,
    /// The movement of the whole surface.
    whole: DMatrix<f64>,
}

impl Invariance {
    /// Of a solution's model. None where that does not exist.
    pub(crate) fn of(solution: &Solution) -> Option<Self> {
        let space = &solution.level.space;
        let model = solution.level.problem.model;
        let instance = model.instantiate(&space.x(&solution.estimate.z)?).ok()?;
        let mut movement = vec![DMatrix::zeros(6, 6); model.parts().len()];
        let (mut whole, mut area) = (DMatrix::zeros(6, 6), 0.0);
        for places in all_places(model, &*instance) {
            let mut partials = vec![Partials::default(); places.u.len()];
            instance.partials(places.patch, &places.u, &places.v, &mut partials).ok()?;
            let mut sum = DMatrix::zeros(6, 6);
            for (p, area) in partials.iter().zip(&places.area) {
                let normal = across(p).normalize_or_zero();
                let torque = (DVec3::from_array(p.point) - space.centre).cross(normal) / space.radius;
                let m = DVector::from_iterator(6, normal.to_array().into_iter().chain(torque.to_array()));
                sum += *area * &m * m.transpose();
            }
            let of_patch: f64 = places.area.iter().sum();
            whole += &sum;
            area += of_patch;
            movement[places.patch] = sum / of_patch.max(f64::MIN_POSITIVE);
        }
        Some(Self { movement, whole: whole / f64::max(area, f64::MIN_POSITIVE) })
    }

    /// Orthonormal motions that span the same as others, those that move the least of the model first.
    pub(crate) fn separated(&self, motions: &[DVector<f64>]) -> Vec<DVector<f64>> {
        if motions.is_empty() {
            return Vec::new();
        }
        let basis = DMatrix::from_columns(motions);
        let eigen = eigen::symmetric(basis.transpose() * &self.whole * &basis);
        let mut order: Vec<usize> = (0..motions.len()).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
        order.into_iter().map(|k| &basis * eigen.eigenvectors.column(k)).collect()
    }

    /// The patches whose surface a motion moves.
    pub(crate) fn moved(&self, motion: &DVector<f64>) -> Vec<usize> {
        let rms = |of_patch: &DMatrix<f64>| motion.dot(&(of_patch * motion)).max(0.0).sqrt();
        (0..self.movement.len()).filter(|patch| rms(&self.movement[*patch]) > STAYS * motion.norm()).collect()
    }
}
