//! What of the movement by a parameter is a motion of the whole model, which an alignment takes back.

use crate::model::{EvaluationError, Motion};
use crate::variance::Reach;
use glam::DVec3;
use nalgebra::{Matrix6, Vector6};

/// Segments of a patch each way whose corners are the places that an alignment brings together.
pub(super) const SEGMENTS: u32 = 24;

/// The rigid motions that are nearest to the movements by parameters, per unit of each.
pub(super) struct RigidParts {
    centre: DVec3,
    /// By parameter: shift and turn. Millimetres and radians.
    motions: Vec<[DVec3; 2]>,
    /// By parameter whether it moves the model as a whole and nothing else.
    pub(super) of_whole: Vec<bool>,
}

/// A movement is that of the whole if the square of what a rigid motion leaves of it is at most this share.
const RIGID: f64 = 1e-10;

impl RigidParts {
    /// None where the places are on a line, so that no motion is the nearest.
    pub(super) fn of(reach: &Reach<'_>, motion: &Motion) -> Result<Option<Self>, EvaluationError> {
        let at = |k: u32| f64::from(k) / f64::from(SEGMENTS);
        let (u, v): (Vec<f64>, Vec<f64>) =
            (0..=SEGMENTS).flat_map(|j| (0..=SEGMENTS).map(move |i| (at(i), at(j)))).unzip();
        let mut places: Vec<DVec3> = Vec::new();
        let mut jacobians = Vec::new();
        for (patch, part) in reach.model.parts().iter().enumerate() {
            let mut points = vec![[0.0; 3]; u.len()];
            reach.instance.points(patch, &u, &v, &mut points)?;
            places.extend(points.into_iter().map(|p| DVec3::from(motion.point(p))));
            let mut jacobian = vec![0.0; 3 * part.active.len() * u.len()];
            reach.instance.jacobian(patch, &u, &v, &mut jacobian)?;
            jacobians.push(jacobian);
        }
        let centre = places.iter().sum::<DVec3>() / places.len().max(1) as f64;
        let mut normal = Matrix6::zeros();
        for place in &places {
            for axis in DVec3::AXES {
                let row = row(*place - centre, axis);
                normal += row * row.transpose();
            }
        }
        let Some(cholesky) = normal.cholesky() else { return Ok(None) };
        let mut sides = vec![Vector6::zeros(); reach.x.len()];
        let mut squares = vec![0.0; reach.x.len()];
        for (patch, part) in reach.model.parts().iter().enumerate() {
            let active = part.active.len();
            let derivatives = jacobians[patch].as_chunks::<3>().0.iter().enumerate();
            for (k, derivative) in derivatives {
                let place = places[patch * u.len() + k / active] - centre;
                let moved = DVec3::from(motion.direction(*derivative));
                let parameter = part.active[k % active] as usize;
                squares[parameter] += moved.length_squared();
                for axis in DVec3::AXES {
                    sides[parameter] += row(place, axis) * moved.dot(axis);
                }
            }
        }
        let solved: Vec<Vector6<f64>> = sides.iter().map(|side| cholesky.solve(side)).collect();
        let left = solved.iter().zip(&sides).zip(&squares).map(|((motion, side), square)| square - motion.dot(side));
        let of_whole = left.zip(&squares).map(|(left, square)| *square > 0.0 && left <= RIGID * square).collect();
        let motion = |solved: &Vector6<f64>| {
            let [x, y, z, a, b, c] = (*solved).into();
            [DVec3::new(x, y, z), DVec3::new(a, b, c)]
        };
        Ok(Some(Self { centre, motions: solved.iter().map(motion).collect(), of_whole }))
    }

    /// The movement of a place by the motion of a parameter. Millimetres per unit.
    pub(super) fn movement(&self, parameter: usize, place: DVec3) -> DVec3 {
        let [shift, turn] = self.motions[parameter];
        shift + turn.cross(place - self.centre)
    }
}

/// The movement along an axis of a place beside the centre, by shifts and turns.
fn row(place: DVec3, axis: DVec3) -> Vector6<f64> {
    let turned = place.cross(axis);
    Vector6::new(axis.x, axis.y, axis.z, turned.x, turned.y, turned.z)
}
