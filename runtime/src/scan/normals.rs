//! Vertex normals: of files without normals, and where those of a file or of its triangles point anywhere.

use super::attributes::Stations;
use super::connected::Connected;
use super::neighbours::Neighbours;
use super::thinned::{Thinned, least_thinning};
use crate::eigen::{self, Eigen};
use crate::mesh::TriangleMesh;
use crate::robust::median;
use glam::DVec3;
use nalgebra::{Const, Matrix3};
use rayon::prelude::*;

/// Neighbours from which a point's normal is found in a cloud; and fewer, which count where they are much flatter: the
/// sixteen nearest at the edge of a thin wall lie on both of its sides, and vary least across the edge.
const NEIGHBOURS: usize = 16;
const FEWER: [usize; 2] = [10, 6];
/// So much of the variation that more neighbours have is much flatter. Of six points in a noisy plane, one in a hundred
/// has less than that of sixteen.
const FLATTER: f64 = 0.25;
/// Points are not on a line whose second variance is so much of the first: that of a row of six is below a hundredth.
const WIDE: f64 = 0.1;
/// Neighbours by which the normals of a scan are judged, and from which they are found where they are no good.
const NEARBY: usize = 24;
/// The number of vertices at which normals are judged.
const JUDGED: usize = 5000;
/// Normals agree where their mean along the surface's own is longer than this: 1 where they are exact, 0.2 of 24 random
/// ones. Triangles whose noise is as large as their edges have 0.75.
const AGREEMENT: f64 = 0.7;
/// The side that neighbours' normals take together is no accident from so many standard deviations on.
const SIDE_CLEAR: f64 = 3.0;

/// Unit normals for all vertices: from the triangles, or in a cloud from the nearest points.
pub(super) fn compute(mesh: &TriangleMesh) -> Vec<[f64; 3]> {
    if mesh.triangles.is_empty() { of_cloud(&mesh.positions) } else { mesh.vertex_normals() }
}

/// The direction in which the nearest points vary least (Hoppe et al. 1992). Its sign is a guess: away from the centre
/// of the cloud.
fn of_cloud(positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let tree = Neighbours::new(positions);
    let centre = positions.iter().map(|&p| DVec3::from(p)).sum::<DVec3>() / positions.len().max(1) as f64;
    tree.at_each(NEIGHBOURS, |i, near| {
        let near: Vec<DVec3> = near.iter().map(|&i| DVec3::from(positions[i as usize])).collect();
        let normal = flattest(&near).unwrap_or(DVec3::Z);
        if normal.dot(DVec3::from(positions[i]) - centre) < 0.0 { -normal } else { normal }.into()
    })
}

/// Turns the normals of a cloud towards the scanner, which sees no surface from behind; false where a point's station
/// is not known.
pub(super) fn turn_to_stations(mesh: &mut TriangleMesh, stations: &Stations) -> bool {
    let known = !stations.of_points.is_empty() && (0..stations.of_points.len()).all(|i| stations.of(i).is_some());
    if known {
        for (i, (normal, position)) in mesh.normals.iter_mut().zip(&mesh.positions).enumerate() {
            let towards = stations.of(i).map_or(DVec3::ZERO, |s| DVec3::from(s.place) - DVec3::from(*position));
            if DVec3::from(*normal).dot(towards) < 0.0 {
                *normal = normal.map(|c| -c);
            }
        }
    }
    known
}

/// The normal of a point's neighbours (nearest first), or of fewer of them where these are much flatter. None where it
/// is not defined.
fn flattest(near: &[DVec3]) -> Option<DVec3> {
    let mut best: Option<(DVec3, f64)> = None;
    for count in [near.len()].into_iter().chain(FEWER.into_iter().filter(|count| *count < near.len())) {
        let Some(Variation { normal, thickness, width, .. }) = Variation::of(&near[..count]) else { continue };
        // A plane through n points takes three of their degrees of freedom.
        let thickness = thickness * count as f64 / (count as f64 - 3.0).max(1.0);
        if best.is_none_or(|(_, least)| width > WIDE && thickness < FLATTER * least) {
            best = Some((normal, thickness));
        }
    }
    best.map(|(normal, _)| normal)
}

/// Whether the vertices' normals agree with each other and with the surface, at most places: in space, where those of
/// the two sides of a thin wall may be opposite, or along the triangles. The sides of a wall that is hardly thicker
/// than the noise are mixed in space, and only the triangles tell them apart.
pub(super) fn agree(mesh: &TriangleMesh) -> bool {
    agree_in_space(mesh) || agree_along_triangles(mesh)
}

/// By the vertices that triangles connect.
fn agree_along_triangles(mesh: &TriangleMesh) -> bool {
    if mesh.triangles.is_empty() || mesh.normals.len() != mesh.positions.len() {
        return false;
    }
    let connected = Connected::new(mesh);
    let step = mesh.positions.len().div_ceil(JUDGED).max(1);
    let agreement = |vertex: usize| {
        let about = connected.about(vertex as u32, NEARBY);
        let sum: DVec3 = about.iter().map(|i| DVec3::from(mesh.normals[*i as usize])).sum();
        (about.len() == NEARBY).then(|| sum.length() / NEARBY as f64)
    };
    let mut agreements: Vec<f64> =
        (0..mesh.positions.len()).into_par_iter().step_by(step).filter_map(agreement).collect();
    median(&mut agreements).is_some_and(|agreement| agreement > AGREEMENT)
}

fn agree_in_space(mesh: &TriangleMesh) -> bool {
    let Thinned { positions, normals } = Thinned::new(mesh, least_thinning(mesh));
    let tree = Neighbours::new(&positions);
    let agreement = |at: &[f64; 3]| {
        let near = tree.nearest(*at, NEARBY);
        let points: Vec<DVec3> = near.iter().map(|i| DVec3::from(positions[*i as usize])).collect();
        let across = least_variation(&points)?;
        let middle = points.iter().sum::<DVec3>() / points.len() as f64;
        let (mut mean, mut sided) = (0.0, 0.0);
        for (i, point) in near.iter().zip(&points) {
            let along = DVec3::from(normals[*i as usize]).dot(across) / points.len() as f64;
            mean += along;
            sided += along * (*point - middle).dot(across).signum();
        }
        Some(f64::max(mean.abs(), sided.abs()))
    };
    let step = positions.len().div_ceil(JUDGED).max(1);
    let mut agreements: Vec<f64> = positions.par_iter().step_by(step).filter_map(agreement).collect();
    // Where there are hardly any vertices nothing speaks against them.
    positions.len() <= NEARBY || median(&mut agreements).is_none_or(|agreement| agreement > AGREEMENT)
}

/// Normals from neighbourhoods.
pub(super) struct OverNeighbourhoods {
    /// Unit normals of all vertices.
    pub(super) normals: Vec<[f64; 3]>,
    /// The normals that there were, though any may be far off, take a side together at most places.
    pub(super) sided: bool,
}

/// Normals from neighbourhoods that are larger than the noise: those of the scan thinned to one vertex in `one_in`.
/// Their sides are those of most of the mesh's present normals near by.
pub(super) fn over_neighbourhoods(mesh: &TriangleMesh, one_in: usize) -> OverNeighbourhoods {
    let Thinned { positions, .. } = Thinned::new(mesh, one_in);
    let tree = Neighbours::new(&positions);
    let nearest = |p: &[f64; 3]| tree.nearest(*p, 1).first().map_or(0, |place| *place as usize);
    let place: Vec<usize> = mesh.positions.par_iter().map(nearest).collect();
    let mut sums = vec![(DVec3::ZERO, 0.0); positions.len()];
    for (place, normal) in place.iter().zip(&mesh.normals) {
        let (sum, count) = sums[*place];
        sums[*place] = (sum + DVec3::from(*normal), count + 1.0);
    }
    let of_place = |at: &[f64; 3]| {
        let near = tree.nearest(*at, NEARBY);
        let points: Vec<DVec3> = near.iter().map(|i| DVec3::from(positions[*i as usize])).collect();
        let across = least_variation(&points).unwrap_or(DVec3::Z);
        let sums = near.iter().map(|i| sums[*i as usize]);
        let (sum, count) = sums.fold((DVec3::ZERO, 0.0), |all, of| (all.0 + of.0, all.1 + of.1));
        let side = across.dot(sum);
        // The component of a random unit vector has the variance 1/3.
        (if side < 0.0 { -across } else { across }, side.abs() / f64::max(count / 3.0, 1.0).sqrt())
    };
    let (normals, mut sides): (Vec<DVec3>, Vec<f64>) = positions.par_iter().map(of_place).unzip();
    OverNeighbourhoods {
        normals: place.iter().map(|place| normals[*place].into()).collect(),
        sided: median(&mut sides).is_some_and(|side| side > SIDE_CLEAR),
    }
}

/// Unit direction of least variance of some points; none where it is not defined (fewer than three points).
pub(super) fn least_variation(points: &[DVec3]) -> Option<DVec3> {
    Variation::of(points).map(|variation| variation.normal)
}

/// How some points vary about their least direction.
pub(super) struct Variation {
    /// The unit direction of least variance.
    pub(super) normal: DVec3,
    /// That of the next least variance.
    pub(super) across: DVec3,
    /// The variance along the normal, as a part of that across.
    thickness: f64,
    /// That one, as a part of the variance in the third direction: small where the points are nearly on a line.
    width: f64,
}

impl Variation {
    /// None where it is not defined (fewer than three points).
    pub(super) fn of(points: &[DVec3]) -> Option<Self> {
        if points.len() < 3 {
            return None;
        }
        let eigen = variation(points)?;
        let axis = |k: usize| {
            let axis = eigen.eigenvectors.column(k);
            DVec3::new(axis[0], axis[1], axis[2]).try_normalize()
        };
        let (least, largest) = (eigen.eigenvalues.imin(), eigen.eigenvalues.imax());
        let normal = axis(least)?;
        let across = axis(largest)?.cross(normal).try_normalize()?;
        let most = eigen.eigenvalues[largest].max(f64::MIN_POSITIVE);
        let next = (eigen.eigenvalues.sum() - eigen.eigenvalues[least] - most).max(f64::MIN_POSITIVE);
        Some(Self { normal, across, thickness: eigen.eigenvalues[least].max(0.0) / next, width: next / most })
    }

    /// Whether the points are on a line, and show no surface.
    pub(super) fn is_row(&self) -> bool {
        self.width < WIDE
    }
}

/// The principal axes of some points, with their shares of the variance; none where all points are one.
pub(super) fn variation(points: &[DVec3]) -> Option<Eigen<Const<3>>> {
    let mean = points.iter().sum::<DVec3>() / points.len() as f64;
    let mut covariance = Matrix3::<f64>::zeros();
    for &point in points {
        let d: [f64; 3] = (point - mean).into();
        for (row, &a) in d.iter().enumerate() {
            for (column, &b) in d.iter().enumerate() {
                covariance[(row, column)] += a * b;
            }
        }
    }
    let size = covariance.trace();
    if !(size.is_finite() && size > 0.0) {
        return None;
    }
    Some(eigen::symmetric(covariance / size))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    /// A latitude-longitude sphere: its exact normals are its positions.
    fn sphere(n: usize) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        let angle = std::f64::consts::PI / n as f64;
        for i in 1..n {
            for j in 0..2 * n {
                let (theta, phi) = (i as f64 * angle, j as f64 * angle);
                mesh.positions.push([theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]);
            }
        }
        let at = |i: usize, j: usize| ((i - 1) * 2 * n + j % (2 * n)) as u32;
        for i in 1..n - 1 {
            for j in 0..2 * n {
                mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        mesh
    }

    #[test]
    fn of_a_sphere_point_outwards() {
        let mesh = sphere(40);
        let cloud = TriangleMesh { triangles: Vec::new(), ..mesh.clone() };
        for (mesh, limit) in [(&mesh, 0.9985), (&cloud, 0.99)] {
            // The rows nearest to the open poles see one side only.
            for (normal, position) in compute(mesh).iter().zip(&mesh.positions).skip(160).take(80 * 35) {
                let cosine = DVec3::from(*normal).dot(DVec3::from(*position));
                assert!(cosine > limit, "{cosine}");
            }
        }
    }

    #[test]
    fn the_edge_of_a_thin_wall_has_the_walls_normals() {
        // Two planes 2 mm apart, points 1 mm apart with noise of 0.05 mm, which end at z = 0.
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let noise = Normal::new(0.0, 0.05).unwrap();
        let mut positions = Vec::new();
        for (x, z) in (0..40).flat_map(|x| (0..20).map(move |z| (f64::from(x), f64::from(z)))) {
            positions.extend([0.0, 2.0].map(|y| [x, y + noise.sample(&mut random), z]));
        }
        let normals = of_cloud(&positions);
        // The corners' neighbours are on both sides, however few are taken.
        for (normal, [x, _, z]) in normals.iter().zip(&positions) {
            assert!(normal[1].abs() > 0.9 || !(3.0..37.0).contains(x) || *z > 16.0, "{normal:?} at {x}, {z}");
        }
    }

    /// A mesh with its vertices moved along its normals at random, and with the normals of its triangles.
    fn noisy(mut mesh: TriangleMesh, noise: f64) -> TriangleMesh {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let distribution = Normal::new(0.0, noise).unwrap();
        for position in &mut mesh.positions {
            *position = (DVec3::from(*position) * (1.0 + distribution.sample(&mut random))).into();
        }
        mesh.normals = mesh.vertex_normals();
        mesh
    }

    #[test]
    fn neighbourhoods_larger_than_the_noise_have_the_normals_of_the_surface() {
        // Edges are 0.008 and less.
        let mesh = noisy(sphere(400), 0.024);
        let right = |normals: &[[f64; 3]]| {
            let cosines =
                normals.iter().zip(&mesh.positions).map(|(n, p)| DVec3::from(*n).dot(DVec3::from(*p).normalize()));
            cosines.filter(|c| *c > 0.9).count() as f64 / normals.len() as f64
        };
        assert!(right(&mesh.normals) < 0.4 && !agree(&mesh), "{}", right(&mesh.normals));
        let found = over_neighbourhoods(&mesh, 64);
        assert!(right(&found.normals) > 0.93 && found.sided, "{}", right(&found.normals));
    }

    /// A sheet of 1.3 mm with noise of 0.5, scanned every 1.5 mm from both sides.
    #[test]
    fn the_two_sides_of_a_sheet_as_thin_as_noise_agree() {
        let mut random = ChaCha8Rng::seed_from_u64(9);
        let noise = Normal::new(0.0, 0.5).unwrap();
        let mut mesh = TriangleMesh::default();
        let n = 40_u32;
        for (side, z) in [0.0, 1.3].into_iter().enumerate() {
            let first = mesh.positions.len() as u32;
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let mut moved = |x: f64| x + noise.sample(&mut random);
                mesh.positions.push([moved(1.5 * f64::from(i)), moved(1.5 * f64::from(j)), moved(z)]);
            }
            for (i, j) in (0..n - 1).flat_map(|i| (0..n - 1).map(move |j| (i, j))) {
                let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| first + i * n + j);
                let up = [[a, b, c], [a, c, d]];
                mesh.triangles.extend(up.map(|[a, b, c]| if side == 0 { [a, c, b] } else { [a, b, c] }));
            }
        }
        mesh.normals = mesh.vertex_normals();
        assert!(!agree_in_space(&mesh) && agree(&mesh));
        // Triangles that face any way do not agree along themselves either.
        let turned = |(k, [a, b, c]): (usize, [u32; 3])| if (k * k / 7) % 2 == 0 { [a, c, b] } else { [a, b, c] };
        mesh.triangles = mesh.triangles.into_iter().enumerate().map(turned).collect();
        mesh.normals = mesh.vertex_normals();
        assert!(!agree(&mesh));
    }

    #[test]
    fn random_normals_take_no_side() {
        let mut mesh = noisy(sphere(60), 0.001);
        assert!(agree(&mesh));
        let mut random = ChaCha8Rng::seed_from_u64(5);
        mesh.normals.iter_mut().for_each(|n| *n = n.map(|c| if random.random_bool(0.5) { c } else { -c }));
        assert!(!agree(&mesh) && !over_neighbourhoods(&mesh, 1).sided);
    }

    #[test]
    fn degenerate_neighbourhoods_have_some_unit_normal() {
        let line: Vec<[f64; 3]> = (0..30).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        for positions in [line, vec![[1.0; 3]], vec![[1e11, 0.0, 0.0], [0.0; 3]]] {
            let mesh = TriangleMesh { positions, ..TriangleMesh::default() };
            for normal in compute(&mesh) {
                assert!((DVec3::from(normal).length() - 1.0).abs() < 1e-9);
            }
        }
    }
}
