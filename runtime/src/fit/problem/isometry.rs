//! Rigid motions and their local coordinates.

use crate::model::Motion;
use glam::{DMat3, DQuat, DVec3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A rigid motion: p -> rotation * p + translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Isometry {
    /// A unit quaternion.
    pub(crate) rotation: DQuat,
    /// Millimetres.
    pub(crate) translation: DVec3,
}

impl Isometry {
    /// The motion that moves nothing.
    pub(crate) const IDENTITY: Self = Self { rotation: DQuat::IDENTITY, translation: DVec3::ZERO };

    /// The image of a point.
    pub(crate) fn apply(&self, p: DVec3) -> DVec3 {
        self.rotation * p + self.translation
    }

    /// The motion that first moves by (shift, turn) about `centre`, p -> exp(turn) (p - centre) + centre + shift, and
    /// then by `self`: local coordinates have no gimbal lock.
    pub(crate) fn after_local(&self, shift: DVec3, turn: DVec3, centre: DVec3) -> Self {
        let local = DQuat::from_scaled_axis(turn);
        Self {
            rotation: (self.rotation * local).normalize(),
            translation: self.translation + self.rotation * (centre + shift - local * centre),
        }
    }

    /// The motion with a given rotation that takes `from` to `to`.
    pub(crate) fn taking(rotation: DQuat, from: DVec3, to: DVec3) -> Self {
        Self { rotation, translation: to - rotation * from }
    }
}

impl From<Isometry> for Motion {
    fn from(isometry: Isometry) -> Self {
        let rotation = DMat3::from_quat(isometry.rotation).transpose().to_cols_array_2d();
        Self { rotation, translation: isometry.translation.to_array() }
    }
}

impl From<Motion> for Isometry {
    fn from(motion: Motion) -> Self {
        let rotation = DMat3::from_cols_array_2d(&motion.rotation).transpose();
        Self { rotation: DQuat::from_mat3(&rotation).normalize(), translation: DVec3::from_array(motion.translation) }
    }
}

/// The left Jacobian of the exponential map of rotations: exp(turn + e) = exp(J e) exp(turn) + O(e^2)
/// (Sola et al., "A micro Lie theory", eq. 145).
pub(crate) fn left_jacobian(turn: DVec3) -> DMat3 {
    let angle2 = turn.length_squared();
    let angle = angle2.sqrt();
    // (1 - cos)/a^2 and (a - sin)/a^3, by series where the quotients lose their digits.
    let (b, c) = if angle < 1e-3 {
        (0.5 - angle2 / 24.0, 1.0 / 6.0 - angle2 / 120.0)
    } else {
        ((1.0 - angle.cos()) / angle2, (angle - angle.sin()) / (angle2 * angle))
    };
    let cross = DMat3::from_cols(
        DVec3::new(0.0, turn.z, -turn.y),
        DVec3::new(-turn.z, 0.0, turn.x),
        DVec3::new(turn.y, -turn.x, 0.0),
    );
    DMat3::IDENTITY + cross * b + cross * cross * c
}

/// `count` rotations that cover SO(3) evenly: super-Fibonacci spirals (Alexa, CVPR 2022).
pub(crate) fn rotations(count: usize) -> Vec<DQuat> {
    const PSI: f64 = 1.533_751_168_755_204_3;
    let n = count as f64;
    (0..count)
        .map(|i| {
            let s = i as f64 + 0.5;
            let (t, d) = (s / n, std::f64::consts::TAU * s);
            let (r, big) = (t.sqrt(), (1.0 - t).sqrt());
            let (alpha, beta) = (d / std::f64::consts::SQRT_2, d / PSI);
            DQuat::from_xyzw(r * alpha.sin(), r * alpha.cos(), big * beta.sin(), big * beta.cos()).normalize()
        })
        .collect()
}

/// A rotation drawn evenly from all; none for seed 0.
pub(crate) fn random_rotation(seed: u64) -> DQuat {
    if seed == 0 {
        return DQuat::IDENTITY;
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    loop {
        let [x, y, z, w] = [(); 4].map(|()| random.random_range(-1.0..1.0));
        let q = DQuat::from_xyzw(x, y, z, w);
        if (0.01..1.0).contains(&q.length_squared()) {
            return q.normalize();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn local_coordinates_move_about_the_centre() {
        let motion = Isometry {
            rotation: DQuat::from_scaled_axis(DVec3::new(0.3, -1.0, 2.0)),
            translation: DVec3::new(5.0, 6.0, 7.0),
        };
        let (shift, turn, centre) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(-0.4, 0.2, 0.1), DVec3::new(1.0, 2.0, 3.0));
        let p = DVec3::new(-3.0, 4.0, 0.5);
        let expected = motion.apply(DQuat::from_scaled_axis(turn) * (p - centre) + centre + shift);
        assert!((motion.after_local(shift, turn, centre).apply(p) - expected).length() < 1e-13);
    }

    #[test]
    fn the_left_jacobian_agrees_with_differences() {
        for turn in [DVec3::new(0.7, -0.4, 1.9), DVec3::new(1e-5, 2e-5, -1e-5), DVec3::new(2e-3, 0.0, 1e-3)] {
            let inverse = DQuat::from_scaled_axis(turn).inverse();
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let h = 1e-6;
                let plus = (DQuat::from_scaled_axis(turn + axis * h) * inverse).to_scaled_axis();
                let minus = (DQuat::from_scaled_axis(turn - axis * h) * inverse).to_scaled_axis();
                let difference = (plus - minus) / (2.0 * h);
                assert!((difference - left_jacobian(turn) * axis).length() < 1e-8, "{turn} {axis}");
            }
        }
    }

    #[test]
    fn every_rotation_is_near_one_of_the_grid() {
        let grid = rotations(120);
        let worst = rotations(5000)
            .iter()
            .map(|q| grid.iter().map(|g| q.dot(*g).abs()).fold(0.0, f64::max))
            .fold(1.0, f64::min);
        let degrees = 2.0 * worst.acos().to_degrees();
        // 120 balls that cover SO(3) perfectly would have a radius of about 33 degrees.
        assert!(degrees < 50.0, "{degrees}");
    }
}
