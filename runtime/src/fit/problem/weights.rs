//! Prior weights of the points of a scan.

use crate::mesh::TriangleMesh;
use crate::scan::spikes;
use foldhash::fast::FixedState;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

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
    /// integral over the mesh of what is linear on its triangles. A spike's triangles count as the surface below it:
    /// those that one vertex in a thousand of a dense mesh raises have a tenth of its area. The weight is capped (see
    /// `cap`).
    pub(crate) fn of(self, mesh: &TriangleMesh, noise: f64) -> Vec<f64> {
        if self == Self::Points || mesh.triangles.is_empty() {
            return Vec::new();
        }
        let lowered = lowered(mesh, &spikes(mesh, noise));
        let mut area = vec![0.0; mesh.positions.len()];
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|i| lowered.get(&i).copied().unwrap_or(mesh.positions[i as usize].into()));
            let third = (b - a).cross(c - a).length() / 6.0;
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

/// The places of a mesh's spikes in the middle of those of their neighbours that are none.
fn lowered(mesh: &TriangleMesh, is_spike: &[bool]) -> HashMap<u32, DVec3, FixedState> {
    let mut sums: HashMap<u32, (DVec3, f64), FixedState> = HashMap::default();
    for triangle in mesh.triangles.iter().filter(|t| t.iter().any(|i| is_spike[*i as usize])) {
        for spike in triangle.iter().filter(|i| is_spike[**i as usize]) {
            let (sum, count) = sums.entry(*spike).or_default();
            for neighbour in triangle.iter().filter(|i| !is_spike[**i as usize]) {
                *sum += DVec3::from(mesh.positions[*neighbour as usize]);
                *count += 1.0;
            }
        }
    }
    sums.into_iter().filter(|(_, (_, count))| *count > 0.0).map(|(i, (sum, count))| (i, sum / count)).collect()
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
        let weights = Weights::Area.of(&fan(&rim), 0.0);
        let expected = [2.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0].map(|a| a / 0.4);
        assert!(weights.iter().zip(expected).all(|(w, e)| (w - e).abs() < 1e-14), "{weights:?}");
        assert_eq!(Weights::Points.of(&fan(&rim), 0.0), Vec::<f64>::new());
        let cloud = TriangleMesh { triangles: Vec::new(), ..fan(&rim) };
        assert_eq!(Weights::Area.of(&cloud, 0.0), Vec::<f64>::new());
    }

    #[test]
    fn no_vertex_weighs_more_than_the_root_of_their_number() {
        // 99 narrow triangles, and one that is ten million times as large as all of them.
        let rim: Vec<(f64, f64)> = (0..99).map(|i| (f64::from(i) * 0.06, 1.0)).collect();
        let mut mesh = fan(&rim);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([[9.0, 0.0, 0.0], [9e3, 0.0, 0.0], [9.0, 9e3, 0.0]]);
        mesh.triangles.push([first, first + 1, first + 2]);
        let weights = Weights::Area.of(&mesh, 0.0);
        let count = weights.len() as f64;
        assert!((weights.iter().sum::<f64>() - count).abs() < 1e-9);
        let largest = weights.iter().copied().fold(0.0, f64::max);
        assert!((largest - count.sqrt()).abs() < 1e-9, "{largest}");
        // Those on the rim keep their proportions.
        let apart = Weights::Area.of(&fan(&rim), 0.0);
        let ratio = weights[5] / apart[5];
        assert!(weights.iter().zip(&apart).skip(1).all(|(w, a)| (w / a - ratio).abs() < 1e-9 * ratio));
        // Areas that overflow or vanish say nothing.
        for scale in [1e-170, 1e170] {
            let mut other = mesh.clone();
            other.positions.iter_mut().flatten().for_each(|c| *c *= scale);
            assert_eq!(Weights::Area.of(&other, 0.0), Vec::<f64>::new());
        }
    }

    #[test]
    fn spikes_weigh_what_lies_below_them() {
        // A plane of 1 mm squares; every hundredth of its inner vertices stands out by 20 mm.
        let count = 41_u32;
        let mut mesh = TriangleMesh::default();
        for (i, j) in (0..count).flat_map(|i| (0..count).map(move |j| (i, j))) {
            let inner = i % (count - 1) > 0 && j % (count - 1) > 0;
            let height = if inner && (7 * i + 31 * j) % 97 == 0 { 20.0 } else { 0.01 * f64::from((i * 7 + j * 3) % 5) };
            mesh.positions.push([f64::from(i), f64::from(j), height]);
        }
        for (i, j) in (0..count - 1).flat_map(|i| (0..count - 1).map(move |j| (i * count + j, count))) {
            mesh.triangles.extend([[i, i + j, i + 1], [i + 1, i + j, i + j + 1]]);
        }
        let share = |noise: f64| {
            let weights = Weights::Area.of(&mesh, noise);
            let above = weights.iter().zip(&mesh.positions).filter(|(_, p)| p[2] > 10.0);
            (
                above.clone().count() as f64 / weights.len() as f64,
                above.map(|(w, _)| w).sum::<f64>() / weights.len() as f64,
            )
        };
        let (of_points, of_area) = share(0.01);
        assert!((of_area / of_points - 1.0).abs() < 0.1, "{of_area} {of_points}");
        // As they stand their triangles have most of the area.
        let (_, raised) = share(0.0);
        assert!(raised > 0.1, "{raised}");
    }
}
