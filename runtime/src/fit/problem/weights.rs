//! Prior weights of the points of a scan.

use crate::mesh::TriangleMesh;
use serde::{Deserialize, Serialize};

/// The prior weights of the points of a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Weights {
    /// A mesh's point counts as the area that it stands for, however finely the mesh is divided there. The points of a
    /// cloud, of which no area is known, count alike.
    #[default]
    Area,
    /// All points count alike: a surface counts as the number of its points.
    Points,
}

impl Weights {
    /// The prior weight of every vertex, 1 on the average; none where all vertices count alike. With `Area` it is a
    /// third of the areas of its triangles, as in the lumped mass of finite elements: the sum over the vertices is the
    /// integral over the mesh of what is linear on its triangles. It is capped (see `cap`).
    pub(crate) fn of(self, mesh: &TriangleMesh) -> Vec<f64> {
        if self == Self::Points || mesh.triangles.is_empty() {
            return Vec::new();
        }
        let mut area = vec![0.0; mesh.positions.len()];
        for triangle in &mesh.triangles {
            let third = mesh.triangle_area(*triangle) / 3.0;
            triangle.iter().for_each(|i| area[*i as usize] += third);
        }
        let total: f64 = area.iter().sum();
        // Triangles so small that their areas underflow, or so large that they overflow, say nothing on the areas.
        if !(total > 0.0 && total.is_finite()) {
            return Vec::new();
        }
        let most = cap(&area);
        area.iter_mut().for_each(|a| *a = a.min(most));
        let mean = area.iter().sum::<f64>() / area.len() as f64;
        area.iter_mut().for_each(|a| *a /= mean);
        area
    }
}

/// The cap on the areas of n vertices at which the largest is sqrt(n) times the mean of all, or infinity if none is
/// larger (Ionides 2008, for the weights of importance sampling). No vertex then counts for more than 1 / sqrt(n) of
/// the scan, and the effective sample size, at least n over the largest weight, is at least sqrt(n).
fn cap(area: &[f64]) -> f64 {
    let root = (area.len() as f64).sqrt();
    let mut sorted = area.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let mut sum = 0.0;
    // Of every vertex the area of those that are not larger, from the smallest on.
    let up_to: Vec<f64> = sorted
        .iter()
        .map(|a| {
            sum += a;
            sum
        })
        .collect();
    // With k vertices at the cap c and a sum s of the others, c = sqrt(n) (k c + s) / n.
    for (k, (a, sum)) in sorted.iter().zip(&up_to).rev().enumerate() {
        let cap = sum / (root - k as f64);
        if *a <= cap {
            return if k == 0 { f64::INFINITY } else { cap };
        }
    }
    f64::INFINITY
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fan of triangles about the origin in the plane z = 0, whose rim has the given angles (radians) and radii.
    fn fan(rim: &[(f64, f64)]) -> TriangleMesh {
        let count = rim.len() as u32;
        let mut mesh = TriangleMesh { positions: vec![[0.0; 3]], ..TriangleMesh::default() };
        mesh.positions.extend(rim.iter().map(|(angle, radius)| [radius * angle.cos(), radius * angle.sin(), 0.0]));
        mesh.triangles = (0..count).map(|i| [0, 1 + i, 1 + (i + 1) % count]).collect();
        mesh
    }

    #[test]
    fn a_vertex_weighs_a_third_of_its_triangles() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let rim: Vec<(f64, f64)> = (0..4).map(|i| (f64::from(i) * quarter, 1.0)).collect();
        // Four triangles of 1/2 each: the centre has a third of 2, the others a third of 1, the mean is 2/5.
        let weights = Weights::Area.of(&fan(&rim));
        let expected = [2.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0].map(|a| a / 0.4);
        assert!(weights.iter().zip(expected).all(|(w, e)| (w - e).abs() < 1e-14), "{weights:?}");
        assert_eq!(Weights::Points.of(&fan(&rim)), Vec::<f64>::new());
        let cloud = TriangleMesh { triangles: Vec::new(), ..fan(&rim) };
        assert_eq!(Weights::Area.of(&cloud), Vec::<f64>::new());
    }

    #[test]
    fn no_vertex_weighs_more_than_the_root_of_their_number() {
        // 99 narrow triangles, and one that is ten million times as large as all of them.
        let rim: Vec<(f64, f64)> = (0..99).map(|i| (f64::from(i) * 0.06, 1.0)).collect();
        let mut mesh = fan(&rim);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([[9.0, 0.0, 0.0], [9e3, 0.0, 0.0], [9.0, 9e3, 0.0]]);
        mesh.triangles.push([first, first + 1, first + 2]);
        let weights = Weights::Area.of(&mesh);
        let count = weights.len() as f64;
        assert!((weights.iter().sum::<f64>() - count).abs() < 1e-9);
        let largest = weights.iter().copied().fold(0.0, f64::max);
        assert!((largest - count.sqrt()).abs() < 1e-9, "{largest}");
        // Those on the rim keep their proportions.
        let apart = Weights::Area.of(&fan(&rim));
        let ratio = weights[5] / apart[5];
        assert!(weights.iter().zip(&apart).skip(1).all(|(w, a)| (w / a - ratio).abs() < 1e-9 * ratio));
        // Areas that overflow or vanish say nothing.
        for scale in [1e-170, 1e170] {
            let mut other = mesh.clone();
            other.positions.iter_mut().flatten().for_each(|c| *c *= scale);
            assert_eq!(Weights::Area.of(&other), Vec::<f64>::new());
        }
    }
}
