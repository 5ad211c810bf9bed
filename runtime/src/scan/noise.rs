//! How noisy a scan is: the spread of its vertices about a smooth surface through their neighbours.
//!
//! A vertex is predicted from its neighbours alone: they are seen from the plane that fits them best, and a quadric
//! z = c0 + c1 u + c2 v + c3 u^2 + c4 u v + c5 v^2 is fitted by least squares. If all have independent noise of SD s
//! along the normal, the vertex's distance from the quadric has the variance s^2 (1 + h), where h is the prediction's
//! leverage, the first diagonal element of the inverse normal matrix. Divided by sqrt(1 + h) every vertex is therefore
//! a sample of s, whatever its neighbourhood; no calibration is needed. The median of their sizes, times 1.4826, is the
//! estimate: edges, outliers and holes do not pull it. Noise that a scanner's software has smoothed is no longer
//! independent from vertex to vertex, and is underestimated.

use super::neighbours::Neighbours;
use super::normals::least_variation;
use super::outliers::outliers;
use crate::mesh::TriangleMesh;
use crate::robust::{MAD_TO_SD, median};
use glam::DVec3;
use nalgebra::{Cholesky, Matrix6, Vector6};
use rayon::prelude::*;

/// The number of vertices that are sampled: the estimate's own error is then below one per cent.
const SAMPLES: usize = 20_000;
/// The number of neighbours of a point of a cloud.
const NEAREST: usize = 20;
/// The fewest neighbours that determine a quadric and leave something over to judge it by: it has six coefficients.
const FEWEST: usize = 8;
/// The most neighbours; where there are more, the mesh does not sample the surface evenly.
const MOST: usize = 64;
/// The fewest predicted vertices whose median is an estimate.
const ENOUGH: usize = 20;

/// The noise's standard deviation along the normal, in millimetres; 0 where there are too few vertices to tell.
///
/// `oriented` says whether the normals tell the sides of a thin wall from each other: without them a cloud's neighbours
/// may lie on both sides, and the wall's thickness passes for noise.
pub(super) fn estimate(mesh: &TriangleMesh, oriented: bool) -> f64 {
    let mut deviations = if mesh.triangles.is_empty() { of_cloud(mesh, oriented) } else { of_mesh(mesh) };
    if deviations.len() < ENOUGH {
        return 0.0;
    }
    median(&mut deviations).unwrap_or(0.0) * MAD_TO_SD
}

/// The sampled vertices, evenly from all.
fn samples(mesh: &TriangleMesh) -> Vec<u32> {
    let count = mesh.positions.len();
    (0..count as u32).step_by(count.div_ceil(SAMPLES).max(1)).collect()
}

fn of_mesh(mesh: &TriangleMesh) -> Vec<f64> {
    let rings = Rings::new(mesh);
    let of_vertex = |vertex: u32| deviation(&offsets(mesh, vertex, rings.two_rings(vertex as usize)?.into_iter()));
    samples(mesh).into_par_iter().filter_map(of_vertex).collect()
}

fn of_cloud(mesh: &TriangleMesh, oriented: bool) -> Vec<f64> {
    let tree = Neighbours::new(&mesh.positions);
    let samples = samples(mesh);
    let outliers = outliers(&tree, &mesh.positions, &samples);
    let of_vertex = |(vertex, outlier): (u32, bool)| {
        if outlier {
            return None;
        }
        let at = mesh.positions[vertex as usize];
        if !oriented {
            return deviation(&offsets(mesh, vertex, tree.nearest(at, NEAREST + 1).into_iter()));
        }
        let normal = |i: u32| DVec3::from(mesh.normals[i as usize]);
        let alike = |i: &u32| normal(*i).dot(normal(vertex)) > 0.0;
        let near = tree.nearest(at, 2 * NEAREST + 1).into_iter().filter(alike).take(NEAREST + 1);
        deviation(&offsets(mesh, vertex, near))
    };
    samples.into_par_iter().zip(outliers).filter_map(of_vertex).collect()
}

/// The vectors from a vertex to others.
fn offsets(mesh: &TriangleMesh, vertex: u32, others: impl Iterator<Item = u32>) -> Vec<DVec3> {
    let centre = DVec3::from(mesh.positions[vertex as usize]);
    others.filter(|i| *i != vertex).map(|i| DVec3::from(mesh.positions[i as usize]) - centre).collect()
}

/// Distance of the origin from a quadric through `offsets`, over the square root of its variance for unit noise.
fn deviation(offsets: &[DVec3]) -> Option<f64> {
    if !(FEWEST..=MOST).contains(&offsets.len()) {
        return None;
    }
    let normal = least_variation(offsets)?;
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let scale = offsets.iter().map(|d| d.length()).sum::<f64>() / offsets.len() as f64;
    let (mut matrix, mut right) = (Matrix6::zeros(), Vector6::zeros());
    for offset in offsets {
        let (u, v, z) = (offset.dot(tangent) / scale, offset.dot(bitangent) / scale, offset.dot(normal) / scale);
        let row = Vector6::new(1.0, u, v, u * u, u * v, v * v);
        matrix += row * row.transpose();
        right += row * z;
    }
    let factors = Cholesky::new(matrix)?;
    let quadric = factors.solve(&right);
    let leverage = factors.solve(&Vector6::ith(0, 1.0))[0];
    // A prediction less certain than the vertex itself is an extrapolation, from a border or a thin strip.
    if !(leverage > 0.0 && leverage < 1.0) {
        return None;
    }
    // The height at the origin, made a distance by the quadric's slope there.
    let slope = 1.0 + quadric[1].powi(2) + quadric[2].powi(2);
    let distance = scale * quadric[0].abs() / slope.sqrt();
    Some(distance / (1.0 + leverage).sqrt()).filter(|d| d.is_finite())
}

/// The triangles around every vertex.
struct Rings<'a> {
    triangles: &'a [[u32; 3]],
    /// Those of vertex i are `around[start[i]..start[i + 1]]`.
    start: Vec<usize>,
    around: Vec<u32>,
}

impl<'a> Rings<'a> {
    fn new(mesh: &'a TriangleMesh) -> Self {
        let mut start = vec![0; mesh.positions.len() + 1];
        for &vertex in mesh.triangles.iter().flatten() {
            start[vertex as usize + 1] += 1;
        }
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mut next = start.clone();
        let mut around = vec![0; 3 * mesh.triangles.len()];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            for &vertex in triangle {
                around[next[vertex as usize]] = t as u32;
                next[vertex as usize] += 1;
            }
        }
        Self { triangles: &mesh.triangles, start, around }
    }

    /// Vertices at most two edges away; none where there are too many.
    fn two_rings(&self, vertex: usize) -> Option<Vec<u32>> {
        let mut found = self.one_ring(vertex)?;
        for i in 0..found.len() {
            found.extend(self.one_ring(found[i] as usize)?);
        }
        found.sort_unstable();
        found.dedup();
        Some(found)
    }

    fn one_ring(&self, vertex: usize) -> Option<Vec<u32>> {
        let triangles = &self.around[self.start[vertex]..self.start[vertex + 1]];
        if triangles.len() > MOST {
            return None;
        }
        let mut ring: Vec<u32> = triangles.iter().flat_map(|&t| self.triangles[t as usize]).collect();
        ring.sort_unstable();
        ring.dedup();
        Some(ring)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    /// A torus of radii 40 and 15, vertices about 0.8 apart, moved along its normals by noise.
    fn noisy_torus(noise: f64) -> TriangleMesh {
        let (m, n) = (320_usize, 120_usize);
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let distribution = Normal::new(0.0, noise).unwrap();
        let mut mesh = TriangleMesh::default();
        for i in 0..m {
            for j in 0..n {
                let angle = |k: usize, of: usize| std::f64::consts::TAU * k as f64 / of as f64;
                let ((sin_a, cos_a), (sin_b, cos_b)) = (angle(i, m).sin_cos(), angle(j, n).sin_cos());
                let normal = DVec3::new(cos_a * cos_b, sin_a * cos_b, sin_b);
                let centre = DVec3::new(cos_a, sin_a, 0.0) * 40.0;
                mesh.positions.push((centre + normal * (15.0 + distribution.sample(&mut random))).into());
                let at = |i: usize, j: usize| ((i % m) * n + j % n) as u32;
                mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        mesh
    }

    #[test]
    fn known_noise_is_recovered() {
        for noise in [0.05, 0.1, 0.3, 0.5] {
            let mesh = noisy_torus(noise);
            let cloud = TriangleMesh { triangles: Vec::new(), ..mesh.clone() };
            for (kind, found) in [("mesh", estimate(&mesh, true)), ("cloud", estimate(&cloud, false))] {
                assert!((found / noise - 1.0).abs() < 0.15, "{kind}: {found} for {noise}");
            }
        }
    }

    #[test]
    fn a_smooth_surface_has_none() {
        assert!(estimate(&noisy_torus(0.0), true) < 0.005);
    }

    #[test]
    fn outliers_do_not_pull_it() {
        let mut mesh = noisy_torus(0.2);
        for position in mesh.positions.iter_mut().step_by(50) {
            position[2] += 10.0;
        }
        let found = estimate(&mesh, true);
        assert!((0.15..0.4).contains(&found), "{found}");
    }

    #[test]
    fn the_sides_of_a_thin_wall_are_told_apart_by_normals() {
        // Two squares of 40 x 40, 1.5 apart, that look away from each other, with points 2 apart.
        let mut random = ChaCha8Rng::seed_from_u64(12);
        let distribution = Normal::new(0.0, 0.1).unwrap();
        let mut cloud = TriangleMesh::default();
        for k in 0..800 {
            let [x, y] = [f64::from(k % 20) * 2.0, f64::from(k / 20 % 20) * 2.0];
            let up = f64::from(k / 400);
            let z = 1.5 * up + distribution.sample(&mut random);
            cloud.positions.push([x + 0.3 * f64::from(k % 3), y + 0.3 * f64::from(k % 7), z]);
            cloud.normals.push([0.0, 0.0, 2.0 * up - 1.0]);
        }
        let (apart, together) = (estimate(&cloud, true), estimate(&cloud, false));
        assert!((apart / 0.1 - 1.0).abs() < 0.2 && together > 0.3, "{apart}, {together}");
    }

    #[test]
    fn clutter_does_not_pull_it() {
        let mut cloud = TriangleMesh { triangles: Vec::new(), ..noisy_torus(0.2) };
        let mut random = ChaCha8Rng::seed_from_u64(13);
        for _ in 0..cloud.positions.len() {
            cloud.positions.push(std::array::from_fn(|_| random.random_range(-90.0..90.0)));
        }
        let found = estimate(&cloud, false);
        assert!((found / 0.2 - 1.0).abs() < 0.2, "{found}");
    }

    #[test]
    fn too_little_says_nothing() {
        let mut mesh = noisy_torus(0.2);
        mesh.triangles.truncate(10);
        assert_eq!(estimate(&mesh, true), 0.0);
        assert_eq!(estimate(&TriangleMesh { positions: vec![[0.0; 3]; 3], ..TriangleMesh::default() }, false), 0.0);
    }
}
