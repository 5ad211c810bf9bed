//! The places of a model's parts, whatever their symmetry: candidates that differ by a turn of a can about its axis are
//! one.

use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::parameterization::Parameterization;
use crate::fit::problem::points::moments;
use crate::fit::tuning::{MOMENT_SAMPLES, SAME_MOMENTS};
use glam::{DMat3, DVec3};
use std::collections::BTreeMap;

/// Mean and covariance of points spread over every group of parts.
#[derive(Clone, Debug)]
pub(crate) struct PartMoments(Vec<(DVec3, DMat3)>);

impl PartMoments {
    /// The moments at free parameters `z`, in the model's frame. None where the model does not exist.
    pub(crate) fn of(space: &Parameterization, z: &[f64]) -> Option<Self> {
        let instance = space.model.instantiate(&space.x(z)?).ok()?;
        let axis: Vec<f64> = (0..MOMENT_SAMPLES).map(|i| (i as f64 + 0.5) / MOMENT_SAMPLES as f64).collect();
        let mut points = vec![[0.0; 3]; MOMENT_SAMPLES * MOMENT_SAMPLES];
        let mut groups: BTreeMap<&str, Vec<DVec3>> = BTreeMap::new();
        for (patch, part) in space.model.parts().iter().enumerate() {
            if instance.points_grid(patch, &axis, &axis, &mut points).is_ok() {
                groups.entry(&part.group).or_default().extend(points.iter().map(|p| DVec3::from_array(*p)));
            }
        }
        Some(Self(groups.values().map(|points| moments(points)).collect()))
    }

    /// The moments of the parts moved rigidly.
    pub(crate) fn moved(&self, motion: &Isometry) -> Self {
        let turn = DMat3::from_quat(motion.rotation);
        let moved = |(mean, covariance): &(DVec3, DMat3)| (motion.apply(*mean), turn * *covariance * turn.transpose());
        Self(self.0.iter().map(moved).collect())
    }

    /// Whether the parts are at the same places, but for a small fraction of `length` (millimetres).
    pub(crate) fn same(&self, other: &Self, length: f64) -> bool {
        let near = |(a, b): (&(DVec3, DMat3), &(DVec3, DMat3))| {
            let turned = (a.1 - b.1).to_cols_array().iter().map(|c| c * c).sum::<f64>().sqrt();
            a.0.distance(b.0) < SAME_MOMENTS * length && turned < SAME_MOMENTS * length * length
        };
        self.0.len() == other.0.len() && self.0.iter().zip(&other.0).all(near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::tests::shapes::{Simple, cup, simple};
    use crate::model::Model;
    use glam::DQuat;

    fn moved(model: &dyn Model, x: &[f64], turns: [DQuat; 2]) -> [PartMoments; 2] {
        let space = Parameterization::new(model, x, (0..x.len()).collect(), true, &[]);
        let moments = PartMoments::of(&space, x).unwrap();
        turns.map(|turn| moments.moved(&Isometry::taking(turn, DVec3::ZERO, DVec3::new(3.0, 1.0, 2.0))))
    }

    #[test]
    fn a_turn_about_an_axis_of_symmetry_changes_nothing_and_another_does() {
        let spin = DQuat::from_rotation_z(1.2);
        let lean = DQuat::from_rotation_x(0.4);
        let cone = simple(Simple::Cone, &[30.0, 60.0]);
        let [a, b] = moved(&cone, &[30.0, 60.0], [lean, lean * spin]);
        assert!(a.same(&b, 1.0));
        for other in [DQuat::from_rotation_x(0.4), DQuat::from_rotation_x(std::f64::consts::PI)] {
            let [a, b] = moved(&cone, &[30.0, 60.0], [DQuat::IDENTITY, other]);
            assert!(!a.same(&b, 30.0), "{other}");
        }
        // A handle shows the turn.
        let x: Vec<f64> = cup().parameters().iter().map(|p| p.default).collect();
        let [a, b] = moved(&cup(), &x, [DQuat::IDENTITY, spin]);
        assert!(!a.same(&b, 40.0));
    }
}
