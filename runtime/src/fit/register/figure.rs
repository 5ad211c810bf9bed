//! Where the parts of a model are, whatever their symmetry: candidates that differ by a turn of a can about its axis are one.

use crate::fit::problem::parameterization::{Estimate, Parameterization};
use glam::{DMat3, DVec3};
use std::collections::BTreeMap;

/// First and second moments of every group of parts, in the scan's frame.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    groups: Vec<Moments>,
}

/// Of points spread over a group of parts.
#[derive(Clone, Copy, Debug)]
struct Moments {
    mean: DVec3,
    covariance: DMat3,
}

/// Points each way on a patch. More than two: the moments of so many around a circle do not depend on where they begin.
const SAMPLES: usize = 6;
/// Figures are the same whose means differ by less than this fraction of a length, and covariances by less than this one of its
/// square.
const APART: f64 = 0.1;

impl Figure {
    /// The figure of an estimate in the model's frame, but for its motion. None where the model does not exist.
    pub(crate) fn of(space: &Parameterization, z: &[f64]) -> Option<Self> {
        let instance = space.model.instantiate(&space.x(z)?).ok()?;
        let axis: Vec<f64> = (0..SAMPLES).map(|i| (i as f64 + 0.5) / SAMPLES as f64).collect();
        let mut points = vec![[0.0; 3]; SAMPLES * SAMPLES];
        let mut groups: BTreeMap<&str, Vec<DVec3>> = BTreeMap::new();
        for (patch, part) in space.model.parts().iter().enumerate() {
            if instance.points_grid(patch, &axis, &axis, &mut points).is_ok() {
                groups.entry(&part.group).or_default().extend(points.iter().map(|p| DVec3::from_array(*p)));
            }
        }
        Some(Self { groups: groups.values().map(|points| Moments::of(points)).collect() })
    }

    /// The figure moved with an estimate's motion.
    pub(crate) fn moved(&self, at: &Estimate) -> Self {
        let turn = DMat3::from_quat(at.motion.rotation);
        let moved =
            |m: &Moments| Moments { mean: at.motion.apply(m.mean), covariance: turn * m.covariance * turn.transpose() };
        Self { groups: self.groups.iter().map(moved).collect() }
    }

    /// Whether two figures of one model are the same but for what a length (millimetres) does not show.
    pub(crate) fn same(&self, other: &Self, length: f64) -> bool {
        let near = |(a, b): (&Moments, &Moments)| {
            let turned = (a.covariance - b.covariance).to_cols_array().iter().map(|c| c * c).sum::<f64>().sqrt();
            a.mean.distance(b.mean) < APART * length && turned < APART * length * length
        };
        self.groups.len() == other.groups.len() && self.groups.iter().zip(&other.groups).all(near)
    }
}

impl Moments {
    fn of(points: &[DVec3]) -> Self {
        let count = points.len().max(1) as f64;
        let mean = points.iter().sum::<DVec3>() / count;
        let square = |p: &DVec3| {
            let d = *p - mean;
            DMat3::from_cols(d * d.x, d * d.y, d * d.z)
        };
        let covariance = points.iter().map(square).fold(DMat3::ZERO, |sum, s| sum + s) * (1.0 / count);
        Self { mean, covariance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::problem::isometry::Isometry;
    use crate::fit::tests::shapes::{Simple, cup, simple};
    use crate::model::Model;
    use glam::DQuat;

    fn figures(model: &dyn Model, x: &[f64], turns: [DQuat; 2]) -> [Figure; 2] {
        let space = Parameterization::new(model, x, (0..x.len()).collect(), true, &[]);
        let figure = Figure::of(&space, x).unwrap();
        turns.map(|turn| {
            let motion = Isometry::taking(turn, DVec3::ZERO, DVec3::new(3.0, 1.0, 2.0));
            figure.moved(&Estimate { z: x.to_vec(), motion })
        })
    }

    #[test]
    fn a_turn_about_an_axis_of_symmetry_changes_nothing_and_another_does() {
        let spin = DQuat::from_rotation_z(1.2);
        let lean = DQuat::from_rotation_x(0.4);
        let cone = simple(Simple::Cone, &[30.0, 60.0]);
        let [a, b] = figures(&cone, &[30.0, 60.0], [lean, lean * spin]);
        assert!(a.same(&b, 1.0));
        for other in [DQuat::from_rotation_x(0.4), DQuat::from_rotation_x(std::f64::consts::PI)] {
            let [a, b] = figures(&cone, &[30.0, 60.0], [DQuat::IDENTITY, other]);
            assert!(!a.same(&b, 30.0), "{other}");
        }
        // A handle shows the turn.
        let x: Vec<f64> = cup().parameters().iter().map(|p| p.default).collect();
        let [a, b] = figures(&cup(), &x, [DQuat::IDENTITY, spin]);
        assert!(!a.same(&b, 40.0));
    }
}
