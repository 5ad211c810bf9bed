//! Where the scanned object stands in the scanner's coordinates.

use glam::{DMat3, DQuat, DVec3, EulerRot};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use serde::{Deserialize, Serialize};

/// A rigid motion: p becomes `rotation` p + `translation`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Rows of the rotation matrix.
    pub rotation: [[f64; 3]; 3],
    /// Millimetres.
    pub translation: [f64; 3],
}

impl Default for Pose {
    fn default() -> Self {
        Self::identity()
    }
}

impl Pose {
    /// Nothing moves.
    #[must_use]
    pub fn identity() -> Self {
        Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] }
    }

    /// A rotation drawn evenly from all rotations (a normalised quaternion of four normal deviates), and a translation
    /// drawn evenly from a cube of half side `reach`.
    pub(super) fn random(random: &mut impl Rng, reach: f64) -> Self {
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let quaternion = DQuat::from_xyzw(normal(), normal(), normal(), normal());
        let quaternion = if quaternion.length() > 1e-6 { quaternion.normalize() } else { DQuat::IDENTITY };
        let translation = match Uniform::new_inclusive(-reach, reach) {
            Ok(range) => std::array::from_fn(|_| range.sample(random)),
            Err(_) => [0.0; 3],
        };
        Self { rotation: DMat3::from_quat(quaternion).transpose().to_cols_array_2d(), translation }
    }

    /// The moved point.
    #[must_use]
    pub fn apply(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.rotation.map(|row| DVec3::from(row).dot(DVec3::from(point)));
        (DVec3::new(x, y, z) + DVec3::from(self.translation)).into()
    }

    /// Angles (alpha, beta, gamma) in radians for which rotating by alpha about x, then by beta about y, then by gamma
    /// about z gives this rotation: the convention of the language's `euler`.
    #[must_use]
    pub fn euler(&self) -> [f64; 3] {
        let matrix = DMat3::from_cols_array_2d(&self.rotation).transpose();
        let (gamma, beta, alpha) = DQuat::from_mat3(&matrix).to_euler(EulerRot::ZYX);
        [alpha, beta, gamma]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn euler_angles_give_the_rotation_back() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        for _ in 0..100 {
            let pose = Pose::random(&mut random, 10.0);
            let [alpha, beta, gamma] = pose.euler();
            let matrix = DMat3::from_rotation_z(gamma) * DMat3::from_rotation_y(beta) * DMat3::from_rotation_x(alpha);
            let expected = matrix * DVec3::new(1.0, 2.0, 3.0) + DVec3::from(pose.translation);
            assert!(expected.distance(DVec3::from(pose.apply([1.0, 2.0, 3.0]))) < 1e-12);
            assert!((matrix.determinant() - 1.0).abs() < 1e-12);
            assert!(pose.translation.iter().all(|c| c.abs() <= 10.0));
        }
        assert_eq!(Pose::identity().apply([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
    }
}
