//! The noise of a scan along the normals of the surface that it is compared with.
//!
//! A scan by itself shows its noise by how far points lie off smooth surfaces through their neighbours, and edges and
//! bends of the object between points pass for noise. Against a surface that has these the distances of neighbouring
//! points differ by noise only. A point's distance is predicted by the plane that fits those of its neighbours best,
//! up to the second ring of triangles about it. If all have independent noise of a standard deviation s, the error of
//! the prediction has the variance s^2 (1 + h), where h is its leverage, the first diagonal element of the inverse
//! normal matrix. Points in a row, as those of a scan in sections, are predicted by a line. The median of the errors'
//! sizes over sqrt(1 + h), times 1.4826, is the estimate.

use super::cloud::Cloud;
use crate::feet::signed::SignedFoot;
use crate::mesh::TriangleMesh;
use crate::robust::{MAD_TO_SD, median};
use glam::{DVec2, DVec3};
use nalgebra::{Cholesky, Matrix3, Vector3};
use rayon::prelude::*;

/// Points whose distances are predicted: the estimate's own error is then below one per cent.
const SAMPLES: usize = 20_000;
/// The fewest points whose errors are an estimate: its own error is then below a fifth.
const ENOUGH: usize = 50;
/// The fewest neighbours that predict a distance: their plane has three coefficients.
const FEWEST: usize = 8;
/// Neighbours that predict the distance of a point of a cloud: as many as two rings of triangles have.
const ABOUT: usize = 18;
/// Points are in a row whose variance across it is this part of that along it: places in a plane have a half, rows of
/// points that are five times as far apart as their points a tenth.
const ROW: f64 = 0.05;
/// Cosine of the largest angle between the surface's normals at neighbouring points of one face, 30 degrees: chamfers
/// turn by 45 degrees, and cylinders of two spacings by as much as this.
pub(super) const SMOOTH: f64 = 0.86;

/// The standard deviation of the noise in millimetres; none where too few points have neighbours on the same face.
/// `feet` are those of the scan's points.
pub(super) fn along_normals(mesh: &TriangleMesh, feet: &[Option<SignedFoot>]) -> Option<f64> {
    let samples = samples(feet);
    let first = rings(mesh, &samples);
    let mut about: Vec<u32> = first.iter().flatten().copied().collect();
    about.sort_unstable();
    about.dedup();
    let second = rings(mesh, &about);
    let error = |(i, ring): (&u32, &Vec<u32>)| {
        let beyond = ring.iter().filter_map(|j| Some(&second[about.binary_search(j).ok()?])).flatten();
        let mut near: Vec<u32> = ring.iter().chain(beyond).copied().filter(|j| j != i).collect();
        near.sort_unstable();
        near.dedup();
        let here = feet[*i as usize].as_ref()?;
        predicted(here, near.iter().filter_map(|j| feet[*j as usize].as_ref()))
    };
    deviation(samples.par_iter().zip(&first).filter_map(error).collect())
}

/// The same of a cloud, by the points whose feet are the nearest on the surface.
pub(super) fn of_cloud(cloud: &Cloud<'_>, feet: &[Option<SignedFoot>]) -> Option<f64> {
    let samples = samples(feet);
    let about = cloud.neighbours(&samples, ABOUT);
    let error = |(i, near): (&u32, &Vec<u32>)| {
        predicted(feet[*i as usize].as_ref()?, near.iter().filter_map(|j| feet[*j as usize].as_ref()))
    };
    deviation(samples.par_iter().zip(&about).filter_map(error).collect())
}

/// Some of the points that have feet.
fn samples(feet: &[Option<SignedFoot>]) -> Vec<u32> {
    let step = feet.len().div_ceil(SAMPLES).max(1);
    (0..feet.len() as u32).step_by(step).filter(|i| feet[*i as usize].is_some()).collect()
}

fn deviation(mut errors: Vec<f64>) -> Option<f64> {
    if errors.len() < ENOUGH {
        return None;
    }
    Some(MAD_TO_SD * median(&mut errors)?)
}

/// The corners of the triangles around each of some points, which are in ascending order; a corner may stand there
/// several times.
fn rings(mesh: &TriangleMesh, points: &[u32]) -> Vec<Vec<u32>> {
    let mut number = vec![u32::MAX; mesh.positions.len()];
    for (k, point) in points.iter().enumerate() {
        number[*point as usize] = k as u32;
    }
    let mut rings = vec![Vec::new(); points.len()];
    for triangle in &mesh.triangles {
        for corner in triangle {
            if let Some(ring) = rings.get_mut(number[*corner as usize] as usize) {
                ring.extend(triangle.iter().filter(|other| *other != corner));
            }
        }
    }
    rings
}

/// The size of the error of a point's distance, predicted by those of its neighbours, over the root of its variance for
/// unit noise. None where too few lie about it.
fn predicted<'f>(here: &SignedFoot, near: impl Iterator<Item = &'f SignedFoot>) -> Option<f64> {
    let (tangent, bitangent) = here.normal.any_orthonormal_pair();
    let near: Vec<(DVec3, f64)> = near
        .filter(|foot| foot.normal.dot(here.normal) >= SMOOTH)
        .map(|foot| (foot.point - here.point, foot.distance))
        .collect();
    if near.len() < FEWEST {
        return None;
    }
    let scale = near.iter().map(|(offset, _)| offset.length()).sum::<f64>() / near.len() as f64;
    if !(scale > 0.0) {
        return None;
    }
    let offsets: Vec<DVec2> =
        near.iter().map(|(offset, _)| DVec2::new(offset.dot(tangent), offset.dot(bitangent)) / scale).collect();
    let (along, is_row) = longest(&offsets);
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (offset, (_, distance)) in offsets.iter().zip(&near) {
        let across = if is_row { 0.0 } else { offset.perp_dot(along) };
        let row = Vector3::new(1.0, offset.dot(along), across);
        matrix += row * row.transpose();
        right += row * (distance - here.distance);
    }
    if is_row {
        matrix[(2, 2)] = 1.0;
    }
    let factors = Cholesky::new(matrix)?;
    let leverage = factors.solve(&Vector3::ith(0, 1.0))[0];
    // A prediction less certain than the point itself is an extrapolation.
    if !(leverage > 0.0 && leverage < 1.0) {
        return None;
    }
    Some(factors.solve(&right)[0].abs() / (1.0 + leverage).sqrt()).filter(|error| error.is_finite())
}

/// The direction in which some places vary most, and whether they are in a row along it, as those of a scan in sections
/// are: a row shows no slope across it.
fn longest(places: &[DVec2]) -> (DVec2, bool) {
    let mean = places.iter().sum::<DVec2>() / places.len() as f64;
    let [mut xx, mut yy, mut xy] = [0.0; 3];
    for d in places.iter().map(|place| *place - mean) {
        (xx, yy, xy) = (xx + d.x * d.x, yy + d.y * d.y, xy + d.x * d.y);
    }
    let (half, difference) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    (DVec2::from_angle(0.5 * (2.0 * xy).atan2(xx - yy)), half - difference < ROW * (half + difference))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    /// A face of which there are rows of points that are as far apart as twenty of them.
    #[test]
    fn the_noise_of_rows_is_that_about_lines() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let normal = Normal::new(0.0, 0.03).expect("a deviation");
        let foot = |i: i32| {
            let (x, y) = (f64::from(i % 200) * 0.25, f64::from(i / 200) * 5.0);
            let distance = 0.1 + 0.01 * x - 0.02 * y + normal.sample(&mut random);
            Some(SignedFoot { part: 0, point: DVec3::new(x, y, 0.0), normal: DVec3::Z, distance })
        };
        let feet: Vec<Option<SignedFoot>> = (0..2000).map(foot).collect();
        let near = |i: usize| (i.saturating_sub(9)..i + 10).filter(move |j| *j != i && j / 200 == i / 200);
        let error = |i: usize| predicted(feet[i].as_ref()?, near(i).filter_map(|j| feet.get(j)?.as_ref()));
        let found = deviation((0..feet.len()).filter_map(error).collect()).unwrap();
        assert!((found / 0.03 - 1.0).abs() < 0.1, "{found}");
    }

    /// Points of an L of two faces of 40 by 20 points, whose distances are a slope and noise.
    fn angled(noise: f64) -> (TriangleMesh, Vec<Option<SignedFoot>>) {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let normal = Normal::new(0.0, noise).expect("a deviation");
        let mut mesh = TriangleMesh::default();
        let mut feet = Vec::new();
        for i in 0..40_u32 {
            for j in 0..40_u32 {
                let (x, y) = (f64::from(i), f64::from(j) - 20.0);
                let (point, across) =
                    if y < 0.0 { (DVec3::new(x, y, 0.0), DVec3::Z) } else { (DVec3::new(x, 0.0, y), -DVec3::Y) };
                let distance = 0.3 + 0.05 * x - 0.02 * y + normal.sample(&mut random);
                mesh.positions.push((point + distance * across).into());
                feet.push(Some(SignedFoot { part: u32::from(y >= 0.0), point, normal: across, distance }));
                if i > 0 && j > 0 {
                    let [a, b, c, d] = [40 * (i - 1) + j - 1, 40 * i + j - 1, 40 * i + j, 40 * (i - 1) + j];
                    mesh.triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        (mesh, feet)
    }

    #[test]
    fn noise_is_known_across_slopes_and_beside_an_edge() {
        for noise in [0.01, 0.2] {
            let (mesh, feet) = angled(noise);
            let found = along_normals(&mesh, &feet).expect("enough points");
            // The estimate's own error is 1.2 / sqrt(1600) for independent errors.
            assert!((found / noise - 1.0).abs() < 0.09, "{found}, not {noise}");
        }
    }

    #[test]
    fn few_points_show_no_noise() {
        let (mut mesh, feet) = angled(0.1);
        mesh.triangles.truncate(20);
        assert_eq!(along_normals(&mesh, &feet), None);
        assert_eq!(along_normals(&TriangleMesh::default(), &[]), None);
    }
}
