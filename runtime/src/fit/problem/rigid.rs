//! Parameters of a script that move the whole model rigidly, and how they are recognised.

use super::points::{Points, gyration, mean};
use super::weights::Weights;
use crate::fit::tuning::{OTHER_PLACE_REACH, OTHER_PLACES, RIGID, VELOCITY_SAMPLES};
use crate::model::{EvaluationError, Instance, Model};
use crate::sampling::scattered;
use crate::scan::Scan;
use glam::DVec3;
use gml_compiler::program::Quantity;
use nalgebra::{DMatrix, Matrix6, Vector6};

/// The parameters whose derivative is a rigid-motion field, dM/dx_i = a + w x p over the whole model, at `x` and at two
/// other places within the bounds. Ascending.
///
/// # Errors
/// The model cannot be evaluated at `x`.
pub(crate) fn recognise(model: &dyn Model, x: &[f64], size: f64) -> Result<RigidParameters, EvaluationError> {
    let mut rigid = vec![true; x.len()];
    let mut still = vec![true; x.len()];
    let mut rank = 0;
    for (place, x) in std::iter::once(x.to_vec()).chain(OTHER_PLACES.map(|f| moved(model, x, size, f))).enumerate() {
        let field = match model.instantiate(&x).and_then(|instance| VelocityField::sample(model, &*instance)) {
            Ok(field) => field,
            // Elsewhere the model may be impossible; the start decides then.
            Err(_) if place > 0 => continue,
            Err(error) => return Err(error),
        };
        let motions = field.rigid_motions();
        for (i, motion) in motions.iter().enumerate() {
            still[i] &= field.size(i) == 0.0;
            rigid[i] &= motion.is_some();
        }
        if place == 0 {
            let columns: Vec<Vector6<f64>> =
                motions.iter().zip(&rigid).filter(|(_, r)| **r).filter_map(|(m, _)| *m).collect();
            rank = rank_of(&columns);
        }
    }
    let of = |mask: &[bool]| (0..x.len()).filter(|i| mask[*i]).collect();
    Ok(RigidParameters { indices: of(&rigid), rank, without_influence: of(&still) })
}

/// The names of the parameters that move the whole model rigidly: the pose that the script has of its own.
#[must_use]
pub(crate) fn pose_parameters(model: &dyn Model, scan: &Scan) -> Vec<String> {
    let x: Vec<f64> = model.parameters().iter().map(|p| p.default).collect();
    let size = Points::of(scan, Weights::default()).gyration().max(f64::MIN_POSITIVE);
    // A model that does not exist at its defaults is taken to have none; a fit of it fails with the reason.
    let indices = recognise(model, &x, size).map(|rigid| rigid.indices).unwrap_or_default();
    indices.into_iter().map(|i| model.parameters()[i].name.clone()).collect()
}

/// The names of the parameters that only place a model: they move the whole of it rigidly. `x` are values at which it
/// exists, and `size` is its length, in millimetres.
///
/// # Errors
/// The model cannot be evaluated at `x`.
pub fn placing_parameters(model: &dyn Model, x: &[f64], size: f64) -> Result<Vec<String>, EvaluationError> {
    let rigid = recognise(model, x, size.max(f64::MIN_POSITIVE))?;
    Ok(rigid.indices.into_iter().map(|i| model.parameters()[i].name.clone()).collect())
}

/// The parameters that move the whole model rigidly.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct RigidParameters {
    /// Parameters that move the whole model rigidly.
    pub(crate) indices: Vec<usize>,
    /// Dimension of the space of rigid motions that they span, at most 6.
    pub(crate) rank: usize,
    /// Parameters on which nothing depends here.
    pub(crate) without_influence: Vec<usize>,
}

/// Another place within the bounds.
fn moved(model: &dyn Model, x: &[f64], size: f64, fraction: f64) -> Vec<f64> {
    let mut x = x.to_vec();
    for i in 0..x.len() {
        let (low, high) = model.bounds(&x)[i];
        let reach = if low.is_finite() && high.is_finite() {
            OTHER_PLACE_REACH * (high - low)
        } else if model.parameters()[i].quantity == Quantity::Length {
            size
        } else {
            1.0
        };
        let step = fraction * reach * (1.0 + 0.1 * i as f64 / x.len() as f64);
        let there = x[i] + step;
        x[i] = if there < low || there > high { (x[i] - step).min(high).max(low) } else { there };
    }
    x
}

/// dM/dx at points spread over the model.
pub(crate) struct VelocityField {
    pub(crate) points: Vec<DVec3>,
    /// By parameter, then by point.
    pub(crate) velocity: Vec<Vec<DVec3>>,
}

impl VelocityField {
    /// Samples every patch at places spread over its inside. Points that are not finite are left out.
    pub(crate) fn sample(model: &dyn Model, instance: &dyn Instance) -> Result<Self, EvaluationError> {
        let [u, v] = scattered([VELOCITY_SAMPLES; 2]);
        let count = model.parameters().len();
        let mut field = Self { points: Vec::new(), velocity: vec![Vec::new(); count] };
        for (patch, part) in model.parts().iter().enumerate() {
            let mut points = vec![[0.0; 3]; u.len()];
            instance.points(patch, &u, &v, &mut points)?;
            let active = part.active.len();
            let mut jacobian = vec![0.0; u.len() * active * 3];
            instance.jacobian(patch, &u, &v, &mut jacobian)?;
            for (i, p) in points.iter().enumerate() {
                let rows = &jacobian[i * active * 3..(i + 1) * active * 3];
                if !p.iter().chain(rows).all(|x| x.is_finite()) {
                    continue;
                }
                field.points.push(DVec3::from_array(*p));
                for velocity in &mut field.velocity {
                    velocity.push(DVec3::ZERO);
                }
                for (a, k) in part.active.iter().enumerate() {
                    if let Some(last) = field.velocity[*k as usize].last_mut() {
                        *last = DVec3::from_slice(&rows[a * 3..]);
                    }
                }
            }
        }
        Ok(field)
    }

    /// Root mean square velocity by parameter i, over the points that it moves.
    pub(crate) fn size(&self, i: usize) -> f64 {
        let squares: Vec<f64> = self.velocity[i].iter().map(|v| v.length_squared()).filter(|s| *s > 0.0).collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    }

    /// Per parameter the rigid motion (a, w) whose field it is, if it is one.
    fn rigid_motions(&self) -> Vec<Option<Vector6<f64>>> {
        let (centre, radius) = (mean(&self.points), gyration(&self.points).max(f64::MIN_POSITIVE));
        let rows = |p: &DVec3| {
            let p = (*p - centre) / radius;
            // The field of shift a and turn w: a + w x p.
            [
                Vector6::new(1.0, 0.0, 0.0, 0.0, p.z, -p.y),
                Vector6::new(0.0, 1.0, 0.0, -p.z, 0.0, p.x),
                Vector6::new(0.0, 0.0, 1.0, p.y, -p.x, 0.0),
            ]
        };
        let mut gram = Matrix6::zeros();
        for p in &self.points {
            for row in rows(p) {
                gram += row * row.transpose();
            }
        }
        let inverse = gram.pseudo_inverse(1e-12 * self.points.len() as f64).unwrap_or_else(|_| Matrix6::zeros());
        (0..self.velocity.len())
            .map(|i| {
                let mut rhs = Vector6::zeros();
                for (p, v) in self.points.iter().zip(&self.velocity[i]) {
                    for (k, row) in rows(p).iter().enumerate() {
                        rhs += row * v[k];
                    }
                }
                let motion = inverse * rhs;
                let off: f64 = self
                    .points
                    .iter()
                    .zip(&self.velocity[i])
                    .map(|(p, v)| {
                        rows(p).iter().enumerate().map(|(k, row)| (row.dot(&motion) - v[k]).powi(2)).sum::<f64>()
                    })
                    .sum();
                let total: f64 = self.velocity[i].iter().map(|v| v.length_squared()).sum();
                (total > 0.0 && off <= RIGID * RIGID * total).then_some(motion)
            })
            .collect()
    }
}

fn rank_of(columns: &[Vector6<f64>]) -> usize {
    if columns.is_empty() {
        return 0;
    }
    let matrix = DMatrix::from_fn(6, columns.len(), |r, c| columns[c][r] / columns[c].norm().max(f64::MIN_POSITIVE));
    matrix.svd(false, false).singular_values.iter().filter(|s| **s > 1e-6).count()
}
