//! The rotations that take the directions in which a shape has planes to one another: those of a box are its 24 poses
//! in itself, and one of them exchanges the legs of an angle bracket. Its principal axes need not be among theirs:
//! where two of the principal moments are about equal they lie anywhere.

use crate::fit::tuning::{FRAME_ANGLE, FRAME_DIRECTIONS, FRAME_PARALLEL, FRAME_SAME, FRAME_SHARE};
use glam::{DMat3, DQuat, DVec3};

/// The rotations, the first of which is none, that take two directions of planes to two such directions with the same
/// angle between them, whichever way they point. Empty where there are not two directions.
pub(super) fn rotations(normals: &[DVec3]) -> Vec<DQuat> {
    let directions = directions(normals);
    let [first, second, ..] = directions[..] else { return Vec::new() };
    let from = frame(first, second).transpose();
    let both_ways: Vec<DVec3> = directions.iter().flat_map(|d| [*d, -*d]).collect();
    let mut rotations = vec![DQuat::IDENTITY];
    for a in &both_ways {
        for b in both_ways.iter().filter(|b| (a.dot(**b) - first.dot(second)).abs() < FRAME_ANGLE) {
            let rotation = DQuat::from_mat3(&(frame(*a, *b) * from));
            if rotations.iter().all(|r| r.dot(rotation).abs() < FRAME_SAME) {
                rotations.push(rotation);
            }
        }
    }
    rotations
}

/// The directions, up to their sign, in which a share of the normals points, the greatest share first.
fn directions(normals: &[DVec3]) -> Vec<DVec3> {
    let along = |d: DVec3| normals.iter().filter(move |n| n.dot(d).abs() > FRAME_PARALLEL);
    let mut shares: Vec<(usize, DVec3)> = normals.iter().map(|n| (along(*n).count(), *n)).collect();
    shares.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    shares.retain(|(count, _)| *count as f64 >= FRAME_SHARE * normals.len() as f64);
    let mut found: Vec<DVec3> = Vec::new();
    for (_, near) in shares {
        let mean = along(near).map(|n| *n * n.dot(near).signum()).sum::<DVec3>().normalize_or_zero();
        // Of two directions that are nearly one the normals between them belong to both.
        if found.iter().all(|f| f.dot(mean).abs() < FRAME_PARALLEL - FRAME_ANGLE) {
            found.push(mean);
        }
        if found.len() == FRAME_DIRECTIONS {
            break;
        }
    }
    found
}

/// The right-handed axes of which the first is `a`, and the second lies in the plane of `a` and `b` towards `b`.
fn frame(a: DVec3, b: DVec3) -> DMat3 {
    let second = (b - a * a.dot(b)).normalize();
    DMat3::from_cols(a, second, a.cross(second))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_box_has_its_24_poses() {
        let unevenly = [(DVec3::X, 60), (DVec3::Y, 30), (DVec3::NEG_Z, 10)];
        let tilt = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.2, 0.1);
        let normals: Vec<DVec3> = unevenly.iter().flat_map(|(d, n)| std::iter::repeat_n(tilt * *d, *n)).collect();
        let found = rotations(&normals);
        assert_eq!(found.len(), 24);
        for rotation in found {
            for (d, _) in &unevenly {
                let there = tilt.inverse() * rotation * (tilt * *d);
                assert!(there.abs().max_element() > 1.0 - 1e-9, "{rotation}: {there}");
            }
        }
    }

    #[test]
    fn six_sides_have_twelve_poses_and_a_wedge_has_its_own() {
        let sides = |angles: &[f64]| -> Vec<DVec3> {
            let around = angles.iter().map(|a| DVec3::new(a.to_radians().cos(), a.to_radians().sin(), 0.0));
            around.chain([DVec3::Z]).flat_map(|d| std::iter::repeat_n(d, 20)).collect()
        };
        assert_eq!(rotations(&sides(&[0.0, 60.0, 120.0])).len(), 12);
        let wedge = rotations(&sides(&[0.0, 50.0]));
        // Two planes change places in two ways, and the third axis is turned about.
        let halves = wedge.iter().filter(|r| (r.angle_between(DQuat::IDENTITY) - PI).abs() < 1e-9).count();
        assert!(halves >= 3, "{wedge:?}");
    }

    #[test]
    fn a_round_shape_has_none() {
        let around = |k: u32| DVec3::new(f64::from(k).cos(), f64::from(k).sin(), 0.0);
        let pipe: Vec<DVec3> = (0..200).map(around).collect();
        assert!(rotations(&pipe).is_empty() && rotations(&[]).is_empty() && rotations(&[DVec3::ZERO; 9]).is_empty());
    }
}
