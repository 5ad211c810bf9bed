//! Which side of the parts is out: the model says so, and the scan only says whether it faces the same way.

use crate::bvh::Bvh;
use crate::mesh::{TriangleMesh, tetrahedron};
use crate::model::Texels;
use std::collections::HashMap;
use std::f64::consts::PI;

/// Sampled texels per part.
const SAMPLES: usize = 2000;
/// The share of the samples whose parts face the other way from which on it is the scan that is turned.
const REVERSED: f64 = 0.9;
/// The scan's side that a part faces is that of another surface if it is so many times farther off than the other side.
const OTHER_SIDE: f64 = 3.0;

/// How a scan faces, compared with the model.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Facings {
    /// All parts, or nearly all, face the other way.
    pub(crate) reversed: bool,
    /// Names of the parts that face the scan's other side, after the scan was turned if it is `reversed`.
    pub(crate) contested: Vec<String>,
}

/// A place of a part with the closest one of the scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct PartVote {
    /// The number of the place among those that were looked at.
    pub(super) of: usize,
    /// Millimetres.
    pub(super) distance: f64,
    /// 1 if the scan faces the same way there, -1 if not.
    pub(super) sign: f64,
}

impl Facings {
    /// For a sample of every part's texels the closest point of the scan (at most `max_distance` away) is found. Only
    /// the nearer half of a part's sample votes, so that neither the other side of a wall nor gross deviations decide.
    pub(crate) fn of(texels: &Texels, scan: &TriangleMesh, bvh: &Bvh, max_distance: f64) -> Self {
        let samples = texels.samples_of_parts(SAMPLES);
        let votes = samples.iter().map(|sample| votes(texels, sample, scan, bvh, max_distance)).collect();
        let own_side = |votes: &[PartVote], turn: f64| -> Vec<Option<f64>> {
            let of_vote = |vote: &PartVote| {
                let normal = texels.normal[vote.of].map(|c| turn * f64::from(c));
                let closest =
                    bvh.closest_point_facing(texels.position[vote.of].into(), max_distance, normal.into(), 0.0);
                closest.map(|c| c.distance)
            };
            votes.iter().map(of_vote).collect()
        };
        Self::of_votes(&texels.part_names, votes, own_side)
    }

    /// By the votes of each of the parts of some names. `own_side` has the distances, from the places of some votes, to
    /// the nearest surface that faces as the part does after the scan was turned, if the number is -1.
    pub(super) fn of_votes(
        names: &[String],
        mut votes: Vec<Vec<PartVote>>,
        own_side: impl Fn(&[PartVote], f64) -> Vec<Option<f64>>,
    ) -> Self {
        for votes in &mut votes {
            votes.sort_by(|a, b| a.distance.total_cmp(&b.distance));
            votes.truncate(votes.len().div_ceil(2));
        }
        let sum = |votes: &[PartVote]| votes.iter().map(|v| v.sign).sum::<f64>();
        let all: usize = votes.iter().map(Vec::len).sum();
        let against: usize = votes.iter().filter(|v| sum(v) < 0.0).map(Vec::len).sum();
        let reversed = all > 0 && against as f64 >= REVERSED * all as f64;
        let turn = if reversed { -1.0 } else { 1.0 };
        let is_contested = |votes: &Vec<PartVote>| {
            let has_own_side =
                |(vote, own): (&PartVote, Option<f64>)| own.is_some_and(|d| d <= OTHER_SIDE * vote.distance);
            turn * sum(votes) < 0.0
                && 2 * votes.iter().zip(own_side(votes, turn)).filter(|v| has_own_side(*v)).count() < votes.len()
        };
        let parts = names.iter().zip(&votes);
        Self { reversed, contested: parts.filter(|(_, v)| is_contested(v)).map(|(name, _)| name.clone()).collect() }
    }
}

fn votes(texels: &Texels, sample: &[usize], scan: &TriangleMesh, bvh: &Bvh, max_distance: f64) -> Vec<PartVote> {
    let vote = |&texel: &usize| {
        let closest = bvh.closest_point(texels.position[texel].into(), max_distance)?;
        let normal = scan.triangle_normal(*scan.triangles.get(closest.triangle as usize)?)?;
        let cosine: f64 = (0..3).map(|k| normal[k] * f64::from(texels.normal[texel][k])).sum();
        // Edges, and whatever stands across the surface, do not vote.
        (cosine.abs() > 0.5).then_some(PartVote { of: texel, distance: closest.distance, sign: cosine.signum() })
    };
    sample.iter().filter_map(vote).collect()
}

/// Turns the normals and triangles of some parts. The model's `mesh` has one group per part, in the order of the
/// texels' parts; groups do not share vertices.
pub(crate) fn turn(texels: &mut Texels, mesh: &mut TriangleMesh, turned: &[bool]) {
    for (i, &part) in texels.part.iter().enumerate() {
        if turned[part as usize] {
            texels.normal[i] = texels.normal[i].map(|c| -c);
        }
    }
    turn_mesh(mesh, turned);
}

/// Turns the normals and triangles of some parts of a mesh. See [`turn`].
pub(crate) fn turn_mesh(mesh: &mut TriangleMesh, turned: &[bool]) {
    let mut vertices = vec![false; mesh.positions.len()];
    for (group, _) in mesh.groups.iter().zip(turned).filter(|(_, t)| **t) {
        for triangle in &mut mesh.triangles[group.start..group.end] {
            triangle.swap(1, 2);
            for &v in triangle.iter() {
                vertices[v as usize] = true;
            }
        }
    }
    for (normal, _) in mesh.normals.iter_mut().zip(vertices).filter(|(_, v)| *v) {
        *normal = normal.map(|c| -c);
    }
}

/// Whether a mesh encloses a negative volume, whatever surface closes the openings that it has.
pub(crate) fn is_inside_out(mesh: &TriangleMesh) -> bool {
    Enclosed::by(mesh).is_some_and(|enclosed| enclosed.volume + enclosed.uncertain(mesh) < 0.0)
}

/// The volume that a mesh encloses, negative where it is inside out; none where it is not closed, every edge between
/// two triangles that agree. Cubic millimetres.
pub(crate) fn enclosed_volume(mesh: &TriangleMesh) -> Option<f64> {
    Enclosed::by(mesh).filter(|enclosed| enclosed.rim == 0.0).map(|enclosed| enclosed.volume)
}

/// The volume that a mesh encloses, whose openings leave it uncertain.
struct Enclosed {
    /// Of the tetrahedra between its triangles and a place of it. Cubic millimetres.
    volume: f64,
    /// The length of the edges that are not between two triangles that agree. Millimetres.
    rim: f64,
}

impl Enclosed {
    /// The most that surfaces across the openings add to the volume or take from it: curves of a length L span an area
    /// of at most L^2 / 4 pi (the isoperimetric inequality), within their convex hull, and a surface no farther from a
    /// place than D makes a third of its area times D. Cubic millimetres.
    fn uncertain(&self, mesh: &TriangleMesh) -> f64 {
        self.rim * self.rim * mesh.bounds().diagonal() / (12.0 * PI)
    }

    /// None of a mesh without triangles.
    fn by(mesh: &TriangleMesh) -> Option<Self> {
        // Parts of a mesh do not share vertices, but places.
        let place = mesh.position_numbers();
        let mut edges: HashMap<[u32; 2], (i32, f64)> = HashMap::new();
        let mut volume = 0.0;
        let origin = mesh.triangles.first().map(|t| mesh.corners(*t)[0])?;
        for triangle in &mesh.triangles {
            let corners = mesh.corners(*triangle);
            for k in 0..3 {
                let [from, to] = [triangle[k], triangle[(k + 1) % 3]].map(|v| place[v as usize]);
                // A triangle without area may have an edge of no length.
                if from == to {
                    continue;
                }
                let length = corners[k].distance(corners[(k + 1) % 3]);
                let edge = edges.entry([from.min(to), from.max(to)]).or_insert((0, length));
                edge.0 += if from < to { 1 } else { -1 };
            }
            volume += tetrahedron(corners.map(|p| p - origin));
        }
        let rim = edges.values().map(|(balance, length)| f64::from(balance.abs()) * length).sum();
        Some(Self { volume, rim })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of radius 10 of so many rows of triangles, of which the last are left out.
    fn ball(rows: u32, left_out: u32) -> TriangleMesh {
        let columns = 2 * rows;
        let mut mesh = TriangleMesh::default();
        for i in 0..=rows {
            let (sin, cos) = if i % rows == 0 { (0.0, 1.0) } else { (PI * f64::from(i) / f64::from(rows)).sin_cos() };
            let cos = if i == rows { -1.0 } else { cos };
            for j in 0..columns {
                let (y, x) = (2.0 * PI * f64::from(j) / f64::from(columns)).sin_cos();
                mesh.positions.push([10.0 * sin * x, 10.0 * sin * y, 10.0 * cos]);
            }
        }
        let at = |i: u32, j: u32| i * columns + j % columns;
        for (i, j) in (0..rows - left_out).flat_map(|i| (0..columns).map(move |j| (i, j))) {
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
        mesh
    }

    #[test]
    fn the_side_of_a_mesh_is_known_in_spite_of_small_openings() {
        let turned = |mut mesh: TriangleMesh| {
            mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
            mesh
        };
        let volume = enclosed_volume(&ball(20, 0)).unwrap();
        assert!((volume / (4000.0 / 3.0 * PI) - 1.0).abs() < 0.02, "{volume}");
        for left_out in [0, 1, 4] {
            assert_eq!(enclosed_volume(&ball(20, left_out)).is_some(), left_out == 0);
            assert!(!is_inside_out(&ball(20, left_out)) && is_inside_out(&turned(ball(20, left_out))), "{left_out}");
        }
        // A bowl has no side.
        assert!(!is_inside_out(&turned(ball(20, 10))));
    }
}
