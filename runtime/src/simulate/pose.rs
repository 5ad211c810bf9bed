//! The pose of the scanned object in the scanner's coordinates.

use crate::model::Motion;
use glam::{DMat3, DQuat, EulerRot};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal, Uniform};

/// A rotation drawn evenly from all rotations (a normalised quaternion of four normal deviates), and a translation
/// drawn evenly from a cube of half side `reach`.
pub(super) fn random(random: &mut impl Rng, reach: f64) -> Motion {
    let mut normal = || -> f64 { StandardNormal.sample(random) };
    let quaternion = DQuat::from_xyzw(normal(), normal(), normal(), normal());
    let quaternion = if quaternion.length() > 1e-6 { quaternion.normalize() } else { DQuat::IDENTITY };
    let translation = match Uniform::new_inclusive(-reach, reach) {
        Ok(range) => std::array::from_fn(|_| range.sample(random)),
        Err(_) => [0.0; 3],
    };
    Motion { rotation: DMat3::from_quat(quaternion).transpose().to_cols_array_2d(), translation }
}

/// Angles (alpha, beta, gamma) in radians for which rotating by alpha about x, then by beta about y, then by gamma
/// about z gives this rotation: the convention of the language's `euler`.
pub(super) fn euler(pose: &Motion) -> [f64; 3] {
    let matrix = DMat3::from_cols_array_2d(&pose.rotation).transpose();
    let (gamma, beta, alpha) = DQuat::from_mat3(&matrix).to_euler(EulerRot::ZYX);
    [alpha, beta, gamma]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use rand::SeedableRng;

    #[test]
    fn euler_angles_give_the_rotation_back() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        for _ in 0..100 {
            let pose = super::random(&mut random, 10.0);
            let [alpha, beta, gamma] = euler(&pose);
            let matrix = DMat3::from_rotation_z(gamma) * DMat3::from_rotation_y(beta) * DMat3::from_rotation_x(alpha);
            let expected = matrix * DVec3::new(1.0, 2.0, 3.0) + DVec3::from(pose.translation);
            assert!(expected.distance(DVec3::from(pose.point([1.0, 2.0, 3.0]))) < 1e-12);
            assert!((matrix.determinant() - 1.0).abs() < 1e-12);
            assert!(pose.translation.iter().all(|c| c.abs() <= 10.0));
        }
    }
}
