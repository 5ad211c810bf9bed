//! Vertex normals of files without normals.

use super::neighbours::Neighbours;
use crate::mesh::TriangleMesh;
use glam::DVec3;
use nalgebra::{Const, Matrix3, SymmetricEigen};
use rayon::prelude::*;

/// Neighbours from which a point's normal is found in a cloud.
const NEIGHBOURS: usize = 16;

/// Unit normals for all vertices: from the triangles, or in a cloud from the nearest points.
pub(super) fn compute(mesh: &TriangleMesh) -> Vec<[f64; 3]> {
    if mesh.triangles.is_empty() { of_cloud(&mesh.positions) } else { mesh.vertex_normals() }
}

/// The direction in which the nearest points vary least (Hoppe et al. 1992). Its sign is a guess: away from the centre
/// of the cloud.
fn of_cloud(positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let tree = Neighbours::new(positions);
    let centre = positions.iter().map(|&p| DVec3::from(p)).sum::<DVec3>() / positions.len().max(1) as f64;
    positions
        .par_iter()
        .map(|&p| {
            let near: Vec<DVec3> =
                tree.nearest(p, NEIGHBOURS).iter().map(|&i| DVec3::from(positions[i as usize])).collect();
            let normal = least_variation(&near).unwrap_or(DVec3::Z);
            if normal.dot(DVec3::from(p) - centre) < 0.0 { -normal } else { normal }.into()
        })
        .collect()
}

/// Unit direction of least variance of some points; none where it is not defined (fewer than three points).
pub(super) fn least_variation(points: &[DVec3]) -> Option<DVec3> {
    if points.len() < 3 {
        return None;
    }
    let eigen = variation(points)?;
    let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    DVec3::new(normal[0], normal[1], normal[2]).try_normalize()
}

/// The principal axes of some points, with their shares of the variance; none where all points are one.
pub(super) fn variation(points: &[DVec3]) -> Option<SymmetricEigen<f64, Const<3>>> {
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
    SymmetricEigen::try_new(covariance / size, f64::EPSILON, 1000)
}

#[cfg(test)]
mod tests {
    use super::*;

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
