//! How noisy a scan is: the spread of its vertices about a smooth surface through their neighbours.
//!
//! A vertex is predicted from its nearest neighbours: they are seen from the plane that fits them best, and a quadric
//! z = c0 + c1 u + c2 v + c3 u^2 + c4 u v + c5 v^2 is fitted by least squares. If all have independent noise of SD s
//! along the normal, the vertex's distance from the quadric has the variance s^2 (1 + h), where h is the prediction's
//! leverage, the first diagonal element of the inverse normal matrix. Divided by sqrt(1 + h) every vertex is therefore
//! a sample of s, whatever its neighbourhood; no calibration is needed. The median of their sizes, times 1.4826, is the
//! estimate: edges, outliers and holes do not pull it.
//!
//! Neighbours are the nearest ones of the place below the vertex on that plane: those of the vertex itself would be
//! like it. Where the noise is larger than the distances between vertices, the nearest ones are a ball out of a thick
//! layer, and show no surface. Then the scan is thinned, until they reach farther than the layer is thick: the noise
//! stays, the distances grow. Edges of triangles are of no use there, as they climb from end to end of the layer.
//!
//! Of a scan in sections, whose rows of points are farther apart than such a neighbourhood reaches, a vertex is
//! predicted from its row: by a parabola in the plane in which the row is. Thinned until they are not on a line, its
//! neighbourhoods show the surface, and its normals.
//!
//! The noise is that along the normals. A scanner's own lies along its rays: at an angle of incidence a its part along
//! the normal has the deviation s cos a, and the median over all angles is below the root mean square. A ball that is
//! seen from all sides at angles up to 75 degrees has 0.62 s where the root mean square is 0.70 s. Rays are not known
//! to a cloud, so that nothing is corrected for them.
//!
//! Noise that a scanner's software has smoothed over more than such a neighbourhood is underestimated.

use super::neighbours::Neighbours;
use super::normals::Variation;
use super::outliers::outliers;
use super::thinned::{Thinned, least_thinning};
use crate::mesh::TriangleMesh;
use crate::robust::{MAD_TO_SD, median};
use glam::DVec3;
use nalgebra::{SMatrix, SVector, Vector3, Vector6};
use rayon::prelude::*;

/// The number of vertices that are predicted: the estimate's own error is then below one per cent.
const SAMPLES: usize = 20_000;
/// The number of neighbours that predict a vertex.
const NEAREST: usize = 14;
/// The fewest neighbours that determine a quadric and leave something over to judge it by: it has six coefficients.
const FEWEST: usize = 8;
/// The fewest predicted vertices whose median is an estimate.
const ENOUGH: usize = 20;
/// Neighbourhoods show the surface that reach farther than so many standard deviations of the noise.
const REACH: f64 = 4.0;

/// The noise of a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Noise {
    /// Standard deviation along the normal, in millimetres; 0 where there are too few vertices to tell.
    pub(super) deviation: f64,
    /// The neighbourhoods of a scan that is thinned to one vertex in so many show the surface. 1 where none do.
    pub(super) one_in: usize,
    /// Those of all vertices, or of as many as are looked at, do not, as they are in a layer.
    pub(super) is_thick: bool,
    /// Or as they are in a row.
    pub(super) in_rows: bool,
}

/// The noise. `sided` says whether the normals tell the sides of a thin wall from each other: without them a vertex's
/// neighbours may lie on both sides, and the wall's thickness passes for noise.
pub(super) fn estimate(mesh: &TriangleMesh, sided: bool) -> Noise {
    let first = least_thinning(mesh);
    let (mut finest, mut of_rows, mut one_in) = (None, None, first);
    while let Some(Level { deviation, reach, in_rows }) = level(&Thinned::new(mesh, one_in), sided) {
        if in_rows {
            of_rows.get_or_insert(deviation);
        } else if reach >= REACH * deviation {
            let in_rows = of_rows.is_some();
            let is_thick = one_in > first && !in_rows;
            return Noise { deviation: of_rows.unwrap_or(deviation), one_in, is_thick, in_rows };
        }
        finest.get_or_insert(deviation);
        one_in *= 2;
    }
    // Too few vertices, or no size of neighbourhood shows a surface.
    Noise { deviation: finest.unwrap_or(0.0), one_in: 1, ..Noise::default() }
}

/// The noise that neighbourhoods of some size show.
struct Level {
    /// Standard deviation along the normal. Millimetres.
    deviation: f64,
    /// Median distance of a vertex's farthest neighbour. Millimetres.
    reach: f64,
    /// Most neighbourhoods are on a line.
    in_rows: bool,
}

/// The noise by the neighbourhoods of a thinned scan; none where there are too few.
fn level(thinned: &Thinned, sided: bool) -> Option<Level> {
    let Thinned { positions, .. } = thinned;
    let tree = Neighbours::new(positions);
    let count = positions.len();
    let samples: Vec<u32> = (0..count as u32).step_by(count.div_ceil(SAMPLES).max(1)).collect();
    let outliers = outliers(&tree, positions, &samples);
    let of_vertex = |(vertex, outlier): (u32, bool)| {
        let at = DVec3::from(positions[vertex as usize]);
        let near = offsets(thinned, &tree, vertex, at, sided);
        let normal = Variation::of(&near).filter(|_| !outlier)?.normal;
        let height = normal.dot(near.iter().sum::<DVec3>()) / near.len() as f64;
        let near = offsets(thinned, &tree, vertex, at + height * normal, sided);
        let variation = Variation::of(&near)?;
        let deviation = if variation.is_row() { in_row(&near, &variation) } else { of_surface(&near, &variation) };
        Some((deviation?, near.last()?.length(), variation.is_row()))
    };
    let found: Vec<(f64, f64, bool)> = samples.into_par_iter().zip(outliers).filter_map(of_vertex).collect();
    if found.len() < ENOUGH {
        return None;
    }
    let rows = found.iter().filter(|(_, _, in_row)| *in_row).count();
    let in_rows = 2 * rows > found.len();
    // A row's residuals are in its plane, the others along the normal: they are not mixed.
    let alike = found.into_iter().filter(|(_, _, in_row)| *in_row == in_rows);
    let (mut deviations, mut reaches): (Vec<f64>, Vec<f64>) = alike.map(|(d, reach, _)| (d, reach)).unzip();
    Some(Level { deviation: median(&mut deviations)? * MAD_TO_SD, reach: median(&mut reaches)?, in_rows })
}

/// The vectors from a vertex to the others that are nearest to `place`, nearest first.
fn offsets(thinned: &Thinned, tree: &Neighbours, vertex: u32, place: DVec3, sided: bool) -> Vec<DVec3> {
    let at = DVec3::from(thinned.positions[vertex as usize]);
    let normal = |i: u32| DVec3::from(thinned.normals[i as usize]);
    let near = tree.nearest(place.into(), if sided { 2 * NEAREST } else { NEAREST } + 1);
    let alike = |i: &u32| *i != vertex && (!sided || normal(*i).dot(normal(vertex)) > 0.0);
    let offset = |i: u32| DVec3::from(thinned.positions[i as usize]) - at;
    near.into_iter().filter(alike).take(NEAREST).map(offset).collect()
}

/// Distance of the origin from a quadric through `offsets`, over the square root of its variance for unit noise.
fn of_surface(offsets: &[DVec3], variation: &Variation) -> Option<f64> {
    let (tangent, bitangent) = variation.normal.any_orthonormal_pair();
    let terms = |offset: DVec3| {
        let (u, v) = (offset.dot(tangent), offset.dot(bitangent));
        Vector6::new(1.0, u, v, u * u, u * v, v * v)
    };
    off(offsets, variation.normal, terms, |quadric| quadric[1].hypot(quadric[2]))
}

/// The same of a parabola through points in a row, in the plane in which they vary most.
fn in_row(offsets: &[DVec3], variation: &Variation) -> Option<f64> {
    let along = variation.across.cross(variation.normal);
    let terms = |offset: DVec3| {
        let u = offset.dot(along);
        Vector3::new(1.0, u, u * u)
    };
    off(offsets, variation.across, terms, |parabola| parabola[1])
}

/// Distance of the origin from a function that is the sum of some terms, the first of which is 1, with the coefficients
/// that fit `offsets` best, over the square root of its variance for unit noise. The function is along the unit
/// `normal`, and `slope` is its slope at the origin by the coefficients.
fn off<const N: usize>(
    offsets: &[DVec3],
    normal: DVec3,
    terms: impl Fn(DVec3) -> SVector<f64, N>,
    slope: impl Fn(&SVector<f64, N>) -> f64,
) -> Option<f64> {
    if offsets.len() < FEWEST {
        return None;
    }
    let scale = offsets.iter().map(|d| d.length()).sum::<f64>() / offsets.len() as f64;
    let (mut matrix, mut right) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
    for offset in offsets {
        let row = terms(*offset / scale);
        matrix += row * row.transpose();
        right += row * (offset.dot(normal) / scale);
    }
    let factors = matrix.cholesky()?;
    let fitted = factors.solve(&right);
    let leverage = factors.inverse()[(0, 0)];
    // A prediction less certain than the vertex itself is an extrapolation, from a border or a thin strip.
    if !(leverage > 0.0 && leverage < 1.0) {
        return None;
    }
    // The height at the origin, made a distance by the slope there.
    let distance = scale * fitted[0].abs() / slope(&fitted).hypot(1.0);
    Some(distance / (1.0 + leverage).sqrt()).filter(|d| d.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    /// A torus of radii 40 and 15, vertices about 0.8 apart, moved along its normals by noise.
    fn noisy_torus(noise: f64) -> TriangleMesh {
        torus(320, 120, noise)
    }

    /// One of so many rings of so many vertices.
    fn torus(m: usize, n: usize, noise: f64) -> TriangleMesh {
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
        // Vertices are 0.39 apart.
        for ratio in [0.05, 0.2, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0] {
            let noise = 0.39 * ratio;
            let mesh = torus(640, 240, noise);
            let cloud = TriangleMesh { triangles: Vec::new(), ..mesh.clone() };
            for (kind, found) in [("mesh", estimate(&mesh, false)), ("cloud", estimate(&cloud, false))] {
                let Noise { deviation, is_thick, .. } = found;
                assert!((deviation / noise - 1.0).abs() < 0.15, "{kind}: {deviation} for {noise}");
                assert!(ratio == 0.7 || is_thick == (ratio > 0.7), "{kind}: {found:?} for {noise}");
            }
        }
    }

    #[test]
    fn the_noise_of_sections_is_that_of_their_rows() {
        // A cylinder of 33 mm in sections of 5 mm, whose points are 0.25 mm apart.
        let mut random = ChaCha8Rng::seed_from_u64(14);
        for noise in [0.0, 0.03, 0.1] {
            let distribution = Normal::new(33.0, noise).unwrap();
            let mut cloud = TriangleMesh::default();
            for k in 0..20 * 830 {
                let (angle, r): (f64, f64) =
                    (f64::from(k % 830) / 830.0 * std::f64::consts::TAU, distribution.sample(&mut random));
                cloud.positions.push([r * angle.cos(), r * angle.sin(), f64::from(k / 830) * 5.0]);
            }
            let Noise { deviation, one_in, in_rows, .. } = estimate(&cloud, false);
            assert!((deviation - noise).abs() < 0.05 * noise + 1e-5, "{deviation} for {noise}");
            assert!(in_rows && one_in >= 2, "{one_in}");
            let normals = super::super::normals::over_neighbourhoods(&cloud, one_in).normals;
            let off = |(n, p): (&[f64; 3], &[f64; 3])| 1.0 - (n[0] * p[0] + n[1] * p[1]).abs() / p[0].hypot(p[1]);
            let mut off: Vec<f64> = normals.iter().zip(&cloud.positions).map(off).collect();
            // 0.034 is 15 degrees.
            assert!(median(&mut off).unwrap() < 0.034);
        }
    }

    fn with_normals(mesh: TriangleMesh) -> TriangleMesh {
        TriangleMesh { normals: mesh.vertex_normals(), ..mesh }
    }

    #[test]
    fn a_smooth_surface_has_none() {
        assert!(estimate(&with_normals(noisy_torus(0.0)), true).deviation < 0.005);
    }

    #[test]
    fn outliers_do_not_pull_it() {
        let mut mesh = noisy_torus(0.2);
        for position in mesh.positions.iter_mut().step_by(50) {
            position[2] += 10.0;
        }
        let found = estimate(&with_normals(mesh), true).deviation;
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
        let (apart, together) = (estimate(&cloud, true).deviation, estimate(&cloud, false).deviation);
        assert!((apart / 0.1 - 1.0).abs() < 0.2 && together > 0.3, "{apart}, {together}");
    }

    #[test]
    fn clutter_does_not_pull_it() {
        let mut cloud = TriangleMesh { triangles: Vec::new(), ..noisy_torus(0.2) };
        let mut random = ChaCha8Rng::seed_from_u64(13);
        for _ in 0..cloud.positions.len() {
            cloud.positions.push(std::array::from_fn(|_| random.random_range(-90.0..90.0)));
        }
        let found = estimate(&cloud, false).deviation;
        assert!((found / 0.2 - 1.0).abs() < 0.2, "{found}");
    }

    #[test]
    fn too_little_says_nothing() {
        let few = TriangleMesh { positions: noisy_torus(0.2).positions[..10].to_vec(), ..TriangleMesh::default() };
        assert_eq!(estimate(&few, false), Noise { deviation: 0.0, one_in: 1, ..Noise::default() });
        assert_eq!(estimate(&TriangleMesh { positions: vec![[0.0; 3]; 3], ..few }, false).deviation, 0.0);
    }
}
