//! The open ends of a mesh: what surrounds them, and whether they lie in the material.

use super::winding::Winding;
use crate::mesh::TriangleMesh;
use glam::DVec3;
use std::collections::BTreeMap;

/// An open end lies in the material where the mean winding number over it, a little beyond it, is larger than this:
/// of a free end it is a half, of one that lies in a wall it is one and a half. A little is this part of the end's
/// radius, and the mean is over this number of points around.
const IN_MATERIAL: f64 = 0.9;
const BEYOND: f64 = 0.05;
const AROUND: usize = 16;

/// A place, to the bit.
type Corner = [u64; 3];

/// The open ends of a mesh, and which of its groups are joined.
pub(super) struct Ends {
    /// By group, the first of those that it is joined with by edges at the same place.
    pub(super) joined: Vec<usize>,
    pub(super) ends: Vec<End>,
}

/// Edges around an opening.
pub(super) struct End {
    /// The first of the groups that are joined there.
    pub(super) body: usize,
    /// In the direction that they have in the triangles beside the opening.
    edges: Vec<[DVec3; 2]>,
}

impl Ends {
    /// Of a mesh with groups, of which some are `turned`.
    pub(super) fn of(mesh: &TriangleMesh, turned: &[bool]) -> Self {
        let mut group_of = vec![0; mesh.triangles.len()];
        mesh.groups.iter().enumerate().for_each(|(patch, group)| group_of[group.start..group.end].fill(patch));
        // Groups do not share vertices, but places. How often an edge is passed in its direction, less how often
        // back.
        let mut edges: BTreeMap<[Corner; 2], (i32, usize)> = BTreeMap::new();
        let mut joined: Vec<usize> = (0..mesh.groups.len()).collect();
        for edge in mesh.boundary_edges() {
            let [from, to] = edge.ends.map(|vertex| mesh.positions[vertex as usize].map(|c| (c + 0.0).to_bits()));
            if from == to {
                continue;
            }
            let patch = group_of[edge.triangle as usize];
            let (balance, other) = edges.entry([from.min(to), from.max(to)]).or_insert((0, patch));
            *balance += if (from < to) != turned[patch] { 1 } else { -1 };
            let (a, b) = (root(&joined, patch), root(&joined, *other));
            joined[a.max(b)] = a.min(b);
        }
        let joined: Vec<usize> = (0..joined.len()).map(|patch| root(&joined, patch)).collect();
        let ends = Self::around(&edges, &joined);
        Self { joined, ends }
    }

    /// The edges that do not balance, by the openings that they surround.
    fn around(edges: &BTreeMap<[Corner; 2], (i32, usize)>, joined: &[usize]) -> Vec<End> {
        let open = || edges.iter().filter(|(_, (balance, _))| *balance != 0);
        let mut numbers: BTreeMap<Corner, usize> = BTreeMap::new();
        open().flat_map(|(corners, _)| corners).for_each(|corner| {
            let next = numbers.len();
            numbers.entry(*corner).or_insert(next);
        });
        let mut linked: Vec<usize> = (0..numbers.len()).collect();
        for (corners, _) in open() {
            let [a, b] = corners.map(|corner| root(&linked, numbers[&corner]));
            linked[a.max(b)] = a.min(b);
        }
        let mut ends: BTreeMap<usize, End> = BTreeMap::new();
        for (corners, (balance, patch)) in open() {
            let opening = root(&linked, numbers[&corners[0]]);
            let end = ends.entry(opening).or_insert_with(|| End { body: joined[*patch], edges: Vec::new() });
            let [from, to] = corners.map(|corner| DVec3::from_array(corner.map(f64::from_bits)));
            let edge = if *balance > 0 { [from, to] } else { [to, from] };
            end.edges.extend((0..balance.unsigned_abs()).map(|_| edge));
        }
        ends.into_values().collect()
    }
}

impl End {
    fn middle(&self) -> DVec3 {
        self.edges.iter().map(|[from, _]| *from).sum::<DVec3>() / self.edges.len() as f64
    }

    /// Triangles from the edges to their middle.
    pub(super) fn cap(&self) -> impl Iterator<Item = [DVec3; 3]> + use<'_> {
        let middle = self.middle();
        self.edges.iter().map(move |[from, to]| [*to, *from, middle])
    }

    /// Whether the opening lies in what the triangles enclose.
    pub(super) fn is_in_material(&self, winding: &Winding) -> bool {
        let middle = self.middle();
        let normal: DVec3 = self.cap().map(|[a, b, c]| (b - a).cross(c - a)).sum();
        let radius = self.edges.iter().map(|[from, _]| from.distance(middle)).sum::<f64>() / self.edges.len() as f64;
        let beyond = BEYOND * radius * normal.normalize_or_zero();
        let step = self.edges.len().div_ceil(AROUND);
        let (mut sum, mut count) = (0.0, 0.0);
        for [from, _] in self.edges.iter().step_by(step) {
            // The means of the inner and of the outer half of a disc's area.
            for part in [0.5, 0.85] {
                sum += winding.at(middle + part * (*from - middle) + beyond);
                count += 1.0;
            }
        }
        sum > IN_MATERIAL * count
    }
}

/// The first of the groups that are joined with one.
fn root(joined: &[usize], mut group: usize) -> usize {
    while joined[group] != group {
        group = joined[group];
    }
    group
}
