//! Triangle meshes, the plain data that stages exchange, and boxes of points. Millimetres, doubles.

use glam::DVec3;
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};

/// An indexed triangle mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions. Millimetres.
    pub positions: Vec<[f64; 3]>,
    /// Unit vertex normals: none, or as many as positions.
    pub normals: Vec<[f64; 3]>,
    /// Texture coordinates, v upwards: none, or as many as positions.
    pub texcoords: Vec<[f64; 2]>,
    /// Vertex indices, each below `positions.len()`; counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Named runs of triangles in ascending order; none, or they cover all triangles.
    pub groups: Vec<Group>,
}

/// A named run of triangles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// Name of the part.
    pub name: String,
    /// First triangle.
    pub start: usize,
    /// One past the last.
    pub end: usize,
}

impl TriangleMesh {
    /// The corners of a triangle.
    ///
    /// # Panics
    /// If an index of the triangle is not below the number of positions.
    #[must_use]
    pub fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|i| DVec3::from_array(self.positions[i as usize]))
    }

    /// A triangle's unit normal by the right-hand rule; none where the triangle has no area. Panics as
    /// [`corners`](Self::corners).
    #[must_use]
    pub fn triangle_normal(&self, triangle: [u32; 3]) -> Option<DVec3> {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).try_normalize()
    }

    /// A triangle's area in square millimetres. Panics as [`corners`](Self::corners).
    #[must_use]
    pub fn triangle_area(&self, triangle: [u32; 3]) -> f64 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).length() / 2.0
    }

    /// The area of all triangles in square millimetres; 0 where there are none. Panics as [`corners`](Self::corners).
    #[must_use]
    pub fn area(&self) -> f64 {
        // Not `sum`, which makes -0 of nothing.
        self.triangles.iter().fold(0.0, |area, triangle| area + self.triangle_area(*triangle))
    }

    /// Unit vertex normals: the normals of the triangles around a vertex, weighted by their angles there (Thuermer and
    /// Wuethrich, 'Computing vertex normals from polygonal facets', 1998), so that they do not depend on how the
    /// surface is cut into triangles. A vertex that no triangle with an area uses gets +z.
    #[must_use]
    pub fn vertex_normals(&self) -> Vec<[f64; 3]> {
        /// Triangles whose shares are computed at the same time, and are then added one after the other.
        const RUN: usize = 1 << 18;
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        let mut first = vec![DVec3::Z; self.positions.len()];
        let share = |triangle: &[u32; 3]| {
            let normal = self.triangle_normal(*triangle)?;
            let corners = self.corners(*triangle);
            Some((normal, [0, 1, 2].map(|c| angle_at(&corners, c))))
        };
        for run in self.triangles.chunks(RUN) {
            let shares: Vec<Option<(DVec3, [f64; 3])>> = run.par_iter().with_min_len(1 << 12).map(share).collect();
            for (triangle, share) in run.iter().zip(shares) {
                let Some((normal, angles)) = share else { continue };
                for (vertex, angle) in triangle.iter().zip(angles) {
                    let vertex = *vertex as usize;
                    if sums[vertex] == DVec3::ZERO {
                        first[vertex] = normal;
                    }
                    sums[vertex] += angle * normal;
                }
            }
        }
        // Where two triangles lie back to back the sum vanishes and the first one's normal stands.
        let unit = |(sum, first): (&DVec3, &DVec3)| if sum.length() > 1e-9 { sum.normalize() } else { *first }.into();
        sums.iter().zip(&first).map(unit).collect()
    }

    /// For every vertex the number of its position, in the order in which positions come first: vertices at one
    /// position (on either side of a corner or of a seam of the texture) have one. Signs of zeros do not count.
    #[must_use]
    pub fn position_numbers(&self) -> Vec<u32> {
        let mut known: HashMap<[u64; 3], u32> = HashMap::with_capacity(self.positions.len());
        let number = |p: &[f64; 3]| {
            let next = known.len() as u32;
            *known.entry(p.map(|c| (c + 0.0).to_bits())).or_insert(next)
        };
        self.positions.iter().map(number).collect()
    }

    /// The box around all positions, whether or not a triangle uses them.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.positions.iter().map(|p| DVec3::from_array(*p)).collect()
    }
}

impl TriangleMesh {
    /// Drops triangles that a group, or a mesh without groups, has twice: with the same corners in the same order
    /// round. Returns their number. Vertices stay.
    pub(crate) fn drop_repeated(&mut self) -> usize {
        let place = self.position_numbers();
        let mut group_of = vec![0; self.triangles.len()];
        for (k, group) in self.groups.iter().enumerate() {
            group_of[group.start..group.end].fill(k);
        }
        let mut seen = HashSet::with_capacity(self.triangles.len());
        let is_new = |(t, corners): (usize, &[u32; 3])| {
            let mut around = corners.map(|v| place[v as usize]);
            let least = (0..3).min_by_key(|k| around[*k]).unwrap_or(0);
            around.rotate_left(least);
            seen.insert((group_of[t], around))
        };
        let kept: Vec<bool> = self.triangles.iter().enumerate().map(is_new).collect();
        let before = self.triangles.len();
        retain_marked(&mut self.triangles, &kept);
        if self.triangles.len() < before {
            let count = |range: std::ops::Range<usize>| kept[range].iter().filter(|kept| **kept).count();
            for group in &mut self.groups {
                let start = count(0..group.start);
                (group.start, group.end) = (start, start + count(group.start..group.end));
            }
        }
        before - self.triangles.len()
    }

    /// A mesh of some triangles, with the vertices that they use in the order of their first use.
    #[must_use]
    pub(crate) fn submesh(&self, triangles: impl Iterator<Item = [u32; 3]>) -> Self {
        let mut renumbered = vec![u32::MAX; self.positions.len()];
        let mut mesh = Self::default();
        for triangle in triangles {
            let triangle = triangle.map(|old| {
                let new = &mut renumbered[old as usize];
                if *new == u32::MAX {
                    *new = mesh.positions.len() as u32;
                    mesh.positions.push(self.positions[old as usize]);
                    mesh.normals.extend(self.normals.get(old as usize));
                }
                *new
            });
            mesh.triangles.push(triangle);
        }
        mesh
    }

    /// The edges that belong to a single triangle, ordered by their vertices.
    #[must_use]
    pub(crate) fn boundary_edges(&self) -> Vec<BoundaryEdge> {
        let of_triangle = |(i, t): (usize, &[u32; 3])| {
            let t = *t;
            (0..3).map(move |k| {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                (a.min(b), a.max(b), a < b, i as u32)
            })
        };
        let mut edges: Vec<(u32, u32, bool, u32)> =
            self.triangles.par_iter().enumerate().flat_map_iter(of_triangle).collect();
        edges.par_sort_unstable();
        let runs = edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
        runs.filter_map(|run| match *run {
            [(low, high, forward, triangle)] if low != high => {
                let ends = if forward { [low, high] } else { [high, low] };
                Some(BoundaryEdge { ends, triangle })
            }
            _ => None,
        })
        .collect()
    }
}

/// An edge that belongs to a single triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoundaryEdge {
    /// Its vertices, in the triangle's order.
    pub(crate) ends: [u32; 2],
    /// Index of the triangle.
    pub(crate) triangle: u32,
}

/// The angle of a triangle at one of its corners. Radians.
pub(crate) fn angle_at(corners: &[DVec3; 3], corner: usize) -> f64 {
    let to = |k: usize| corners[(corner + k) % 3] - corners[corner];
    to(1).angle_between(to(2))
}

/// The volume of the tetrahedron between a triangle and the origin, negative where that is outside of the triangle.
pub(crate) fn tetrahedron([a, b, c]: [DVec3; 3]) -> f64 {
    a.dot(b.cross(c)) / 6.0
}

/// Renumbers vertices so that those of `count` that no triangle uses can be left out; returns which are used.
pub(crate) fn renumber_used(triangles: &mut [[u32; 3]], count: usize) -> Vec<bool> {
    let mut used = vec![false; count];
    for &vertex in triangles.iter().flatten() {
        used[vertex as usize] = true;
    }
    let mut next = 0;
    let number = |used: &bool| {
        next += u32::from(*used);
        next.wrapping_sub(1)
    };
    let numbers: Vec<u32> = used.iter().map(number).collect();
    for vertex in triangles.iter_mut().flatten() {
        *vertex = numbers[*vertex as usize];
    }
    used
}

/// Keeps the values whose mark is set.
pub(crate) fn retain_marked<T>(values: &mut Vec<T>, marks: &[bool]) {
    let mut marks = marks.iter();
    values.retain(|_| marks.next() == Some(&true));
}

/// The smallest axis-aligned box around some points: `points.collect::<Bounds>()`. Coordinates that are NaN are left
/// out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least coordinates; infinite where there are no points.
    pub low: DVec3,
    /// Greatest coordinates; minus infinite where there are no points.
    pub high: DVec3,
}

impl Bounds {
    /// The box around no points.
    pub const EMPTY: Self = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    /// Whether there are no points in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !self.low.cmple(self.high).all()
    }

    /// The middle; the origin where the box is empty.
    #[must_use]
    pub fn centre(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { 0.5 * self.low + 0.5 * self.high }
    }

    /// The lengths of the sides; zeros where the box is empty.
    #[must_use]
    pub fn size(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { self.high - self.low }
    }

    /// The length of the diagonal; 0 where the box is empty.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        self.size().length()
    }

    /// The axis along which the box is longest: 0, 1 or 2, the first of equals.
    #[must_use]
    pub fn longest_axis(&self) -> usize {
        self.size().max_position()
    }
}

impl FromIterator<DVec3> for Bounds {
    fn from_iter<I: IntoIterator<Item = DVec3>>(points: I) -> Self {
        // glam's minimum is its second operand where the first is NaN.
        let include = |bounds: Self, p: DVec3| Self { low: p.min(bounds.low), high: p.max(bounds.high) };
        points.into_iter().fold(Self::EMPTY, include)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_area_of_a_rectangle_is_the_product_of_its_sides_and_that_of_nothing_is_no_negative_zero() {
        let positions = vec![[1.0, 5.0, 2.0], [4.0, 5.0, 2.0], [4.0, 5.0, 9.0], [1.0, 5.0, 9.0]];
        let mut mesh = TriangleMesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..TriangleMesh::default() };
        assert_eq!(mesh.area(), 3.0 * 7.0);
        mesh.triangles.clear();
        assert_eq!(mesh.area().to_bits(), 0.0_f64.to_bits());
    }
}
