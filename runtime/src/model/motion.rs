//! Rigid motions of a model.

use super::{Tessellation, Texels};
use glam::DVec3;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// A rigid motion p -> rotation p + translation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Row-major rotation matrix.
    pub rotation: [[f64; 3]; 3],
    /// Millimetres.
    pub translation: [f64; 3],
}

impl Motion {
    /// The motion that moves nothing.
    pub const IDENTITY: Self =
        Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };

    /// The rigid motion that brings points nearest to others, one by one, in the sense of least squares (Kabsch, 'A
    /// solution for the best rotation to relate two sets of vectors', 1976). Both slices have one length; the identity
    /// where they are empty or not finite.
    #[must_use]
    pub fn between(from: &[[f64; 3]], to: &[[f64; 3]]) -> Self {
        let mean = |points: &[[f64; 3]]| {
            points.iter().map(|p| Vector3::from(*p)).sum::<Vector3<f64>>() / points.len().max(1) as f64
        };
        let (a, b) = (mean(from), mean(to));
        let covariance: Matrix3<f64> =
            from.iter().zip(to).map(|(p, q)| (Vector3::from(*q) - b) * (Vector3::from(*p) - a).transpose()).sum();
        if !covariance.iter().all(|c| c.is_finite()) {
            return Self::IDENTITY;
        }
        let svd = covariance.svd(true, true);
        let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Self::IDENTITY };
        // Singular values are sorted: the last axis turns where the two bases differ in handedness.
        let handedness = (u * v_t).determinant().signum();
        let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, handedness)) * v_t;
        let row = |i: usize| [rotation[(i, 0)], rotation[(i, 1)], rotation[(i, 2)]];
        Self { rotation: [row(0), row(1), row(2)], translation: (b - rotation * a).into() }
    }

    /// The image of a point.
    #[must_use]
    pub fn point(&self, p: [f64; 3]) -> [f64; 3] {
        (DVec3::from_array(self.direction(p)) + DVec3::from_array(self.translation)).to_array()
    }

    /// The image of a direction.
    #[must_use]
    pub fn direction(&self, d: [f64; 3]) -> [f64; 3] {
        self.rotation.map(|row| DVec3::from_array(row).dot(DVec3::from_array(d)))
    }

    /// The motion back.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = [0, 1, 2].map(|i| self.rotation.map(|row| row[i]));
        let back = Self { rotation, translation: [0.0; 3] };
        Self { translation: back.direction(self.translation).map(|c| -c), ..back }
    }

    /// This motion after another one.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        let columns = first.inverse().rotation.map(|column| self.direction(column));
        let rotation = [0, 1, 2].map(|i| columns.map(|column| column[i]));
        Self { rotation, translation: self.point(first.translation) }
    }

    /// Moves a tessellation: positions and normals.
    pub fn move_tessellation(&self, tessellation: &mut Tessellation) {
        for p in &mut tessellation.mesh.positions {
            *p = self.point(*p);
        }
        for n in &mut tessellation.mesh.normals {
            *n = self.direction(*n);
        }
    }

    /// Moves texels: positions and normals.
    pub fn move_texels(&self, texels: &mut Texels) {
        for p in &mut texels.position {
            *p = self.point(*p);
        }
        for n in &mut texels.normal {
            *n = self.direction(n.map(f64::from)).map(|c| c as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Motion;

    #[test]
    fn motions_follow_each_other_and_go_back() {
        let turn = |angle: f64, translation| {
            let (sin, cos) = angle.sin_cos();
            Motion { rotation: [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]], translation }
        };
        let tilt =
            Motion { rotation: [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], translation: [1.0, 2.0, 3.0] };
        let (first, p) = (turn(0.4, [5.0, -6.0, 7.0]), [0.3, -0.2, 11.0]);
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-13);
        assert!(near(tilt.after(&first).point(p), tilt.point(first.point(p))));
        assert!(near(first.inverse().point(first.point(p)), p) && near(tilt.inverse().point(tilt.point(p)), p));
    }

    #[test]
    fn the_motion_between_moved_points_is_found() {
        let (sin, cos) = 2.3f64.sin_cos();
        let truth =
            Motion { rotation: [[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]], translation: [3.0, -4.0, 100.0] };
        let from: Vec<[f64; 3]> =
            (0..20).map(f64::from).map(|i| [i, (i * 1.7).sin() * 9.0, (i * 0.9).cos() * 5.0]).collect();
        let to: Vec<[f64; 3]> = from.iter().map(|p| truth.point(*p)).collect();
        let found = Motion::between(&from, &to);
        for (p, q) in from.iter().zip(&to) {
            let r = found.point(*p);
            assert!((0..3).all(|k| (q[k] - r[k]).abs() < 1e-10), "{q:?} {r:?}");
        }
    }

    #[test]
    fn nothing_moves_nothing() {
        assert_eq!(Motion::between(&[], &[]).translation, [0.0; 3]);
    }
}
