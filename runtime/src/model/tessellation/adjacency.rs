//! The triangles at the edges of a mesh that is being divided.

use super::refine::{Edge, Points};
use std::collections::HashMap;

/// The triangles at each edge. Those that have lost an edge since stay noted there.
pub(super) struct Adjacency {
    /// By edge, of the triangles that there were at first.
    first: Vec<(Edge, u32)>,
    /// Of those that were added.
    added: HashMap<Edge, Vec<u32>>,
}

impl Adjacency {
    pub(super) fn of(triangles: &[[u32; 3]], points: &Points) -> Self {
        let noted = |(t, corners): (usize, &[u32; 3])| edges(*corners, points).map(|edge| (edge, t as u32));
        let mut first: Vec<(Edge, u32)> = triangles.iter().enumerate().flat_map(noted).collect();
        first.sort_unstable();
        Self { first, added: HashMap::new() }
    }

    /// Notes triangles that are new or have new edges.
    pub(super) fn add(&mut self, fresh: &[usize], triangles: &[[u32; 3]], points: &Points) {
        for t in fresh {
            for edge in edges(triangles[*t], points) {
                self.added.entry(edge).or_default().push(*t as u32);
            }
        }
    }

    /// The triangles that have an edge; some of them may come twice.
    pub(super) fn at<'a>(
        &'a self,
        edge: Edge,
        triangles: &'a [[u32; 3]],
        points: &'a Points,
    ) -> impl Iterator<Item = usize> + 'a {
        let from = self.first.partition_point(|(other, _)| *other < edge);
        let first = self.first[from..].iter().take_while(move |(other, _)| *other == edge).map(|(_, t)| *t);
        let noted = first.chain(self.added.get(&edge).into_iter().flatten().copied()).map(|t| t as usize);
        noted.filter(move |t| edges(triangles[*t], points).contains(&edge))
    }
}

fn edges(corners: [u32; 3], points: &Points) -> [Edge; 3] {
    [0, 1, 2].map(|k| points.edge(corners[k], corners[(k + 1) % 3]).0)
}
