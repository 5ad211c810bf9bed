//! The k nearest of many points: a k-d tree (Bentley 1975; Friedman, Bentley and Finkel 1977), searched with the
//! distance of each cell that grows axis by axis (Arya and Mount, 'Algorithms for fast vector quantization', 1993).

use crate::mesh::Bounds;
use glam::DVec3;
use rayon::prelude::*;

/// The largest number of points in a leaf, a power of two.
const LEAF: usize = 8;
/// Runs of more points are split by several threads.
const PARALLEL: usize = 1 << 14;
/// The number of points that are searched one after the other, so that each finds the memory of the last one at hand.
const TOGETHER: usize = 1024;

/// A k-d tree over points. It stays balanced however the points lie.
pub(crate) struct Neighbours {
    /// The points in the order of the leaves: those of a leaf lie beside each other in memory.
    points: Vec<[f64; 3]>,
    /// Their indices; every node has a run of them, its children the halves of that run.
    order: Vec<u32>,
    /// The planes between the children: first a node's own, then those of its left child, then those of its right one.
    planes: Vec<Plane>,
}

/// Points with a smaller coordinate lie left; with a greater, right.
#[derive(Clone, Copy, Default)]
struct Plane {
    axis: usize,
    at: f64,
}

/// The number of planes in the tree of a run: one less than leaves. Halving leaves runs of two lengths at each depth.
fn planes_of(count: usize) -> usize {
    if count <= LEAF {
        return 0;
    }
    // The least depth at which the shorter of the runs are leaves.
    let shallow = count.ilog2() - LEAF.ilog2();
    let depth = if count >> shallow <= LEAF { shallow } else { shallow + 1 };
    let shorter = count >> depth;
    let longer = count - (shorter << depth);
    // Longer ones have a point more.
    if shorter == LEAF { (1 << depth) + longer - 1 } else { (1 << depth) - 1 }
}

impl Neighbours {
    /// Sorts finite points, fewer than 2^32.
    pub(crate) fn new(points: &[[f64; 3]]) -> Self {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let mut planes = vec![Plane::default(); planes_of(points.len())];
        split(points, &mut order, &mut planes);
        Self { points: order.iter().map(|i| points[*i as usize]).collect(), order, planes }
    }

    /// Indices of the k points nearest to `at` (itself among them, if it is one), nearest first; ties by index.
    pub(crate) fn nearest(&self, at: [f64; 3], k: usize) -> Vec<u32> {
        let mut nearest = Nearest { k, points: Vec::with_capacity(k + 1) };
        self.search(self.all(), at, ([0.0; 3], 0.0), &mut nearest);
        nearest.points.into_iter().map(|(_, index)| index).collect()
    }

    /// What `of` makes of each point, given by its index, and of the k nearest to it; in the order of the points, on
    /// all threads. Neighbours are looked for one after the other, which takes a third of the time of any other order.
    pub(crate) fn at_each<T: Send>(&self, k: usize, of: impl Fn(usize, &[u32]) -> T + Sync) -> Vec<T> {
        let together = |(order, points): (&[u32], &[[f64; 3]])| {
            let mut nearest = Nearest { k, points: Vec::with_capacity(k + 1) };
            let mut indices = Vec::with_capacity(k);
            let one = |(index, at): (&u32, &[f64; 3])| {
                nearest.points.clear();
                self.search(self.all(), *at, ([0.0; 3], 0.0), &mut nearest);
                indices.clear();
                indices.extend(nearest.points.iter().map(|(_, index)| *index));
                (*index, of(*index as usize, &indices))
            };
            order.iter().zip(points).map(one).collect::<Vec<_>>()
        };
        let runs = self.order.par_chunks(TOGETHER).zip(self.points.par_chunks(TOGETHER));
        let mut found: Vec<Option<T>> = (0..self.order.len()).map(|_| None).collect();
        let all: Vec<Vec<(u32, T)>> = runs.map(together).collect();
        for (index, value) in all.into_iter().flatten() {
            found[index as usize] = Some(value);
        }
        found.into_iter().flatten().collect()
    }

    /// Calls `visit` with the index of every point at most `radius` away from `at`, in an order that depends on the
    /// points alone.
    pub(crate) fn within(&self, at: [f64; 3], radius: f64, visit: &mut impl FnMut(u32)) {
        self.gather(self.all(), at, radius, visit);
    }

    fn all(&self) -> Node<'_> {
        Node { points: &self.points, order: &self.order, planes: &self.planes }
    }

    fn gather(&self, node: Node<'_>, at: [f64; 3], radius: f64, visit: &mut impl FnMut(u32)) {
        let Some((plane, left, right)) = node.children() else {
            for (point, index) in node.points.iter().zip(node.order) {
                if squared_distance(*point, at) <= radius * radius {
                    visit(*index);
                }
            }
            return;
        };
        let beyond = at[plane.axis] - plane.at;
        if beyond <= radius {
            self.gather(left, at, radius, visit);
        }
        if beyond >= -radius {
            self.gather(right, at, radius, visit);
        }
    }

    /// `cell` has the distance of the place from the node's cell along each axis, and the square of all.
    fn search(&self, node: Node<'_>, at: [f64; 3], cell: ([f64; 3], f64), nearest: &mut Nearest) {
        let Some((plane, left, right)) = node.children() else {
            for (point, index) in node.points.iter().zip(node.order) {
                nearest.offer(squared_distance(*point, at), *index);
            }
            return;
        };
        let beyond = at[plane.axis] - plane.at;
        let (near, far) = if beyond < 0.0 { (left, right) } else { (right, left) };
        self.search(near, at, cell, nearest);
        let (mut along, squared) = cell;
        let farther = squared - along[plane.axis] * along[plane.axis] + beyond * beyond;
        along[plane.axis] = beyond;
        // Sums of squares in another order may be a little larger than the distance itself.
        if farther * (1.0 - 1e-12) <= nearest.reach() {
            self.search(far, at, (along, farther), nearest);
        }
    }
}

/// A part of the tree.
#[derive(Clone, Copy)]
struct Node<'t> {
    points: &'t [[f64; 3]],
    order: &'t [u32],
    planes: &'t [Plane],
}

impl<'t> Node<'t> {
    /// The plane and the two halves; none of a leaf.
    fn children(self) -> Option<(Plane, Self, Self)> {
        if self.order.len() <= LEAF {
            return None;
        }
        let middle = self.order.len() / 2;
        let (plane, planes) = self.planes.split_first()?;
        let (order, points) = (self.order.split_at(middle), self.points.split_at(middle));
        let planes = planes.split_at(planes_of(middle));
        let left = Self { points: points.0, order: order.0, planes: planes.0 };
        Some((*plane, left, Self { points: points.1, order: order.1, planes: planes.1 }))
    }
}

fn split(points: &[[f64; 3]], run: &mut [u32], planes: &mut [Plane]) {
    let count = run.len();
    let Some((plane, planes)) = planes.split_first_mut() else { return };
    let bounds: Bounds = run.iter().map(|&i| DVec3::from_array(points[i as usize])).collect();
    let axis = bounds.longest_axis();
    let middle = count / 2;
    let key = |&i: &u32| points[i as usize][axis];
    run.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    *plane = Plane { axis, at: key(&run[middle]) };
    let (left, right) = run.split_at_mut(middle);
    let (left_planes, right_planes) = planes.split_at_mut(planes_of(middle));
    if count > PARALLEL {
        rayon::join(|| split(points, left, left_planes), || split(points, right, right_planes));
    } else {
        split(points, left, left_planes);
        split(points, right, right_planes);
    }
}

fn squared_distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    DVec3::from_array(a).distance_squared(DVec3::from_array(b))
}

/// The k nearest points so far, ascending by squared distance and index.
struct Nearest {
    k: usize,
    points: Vec<(f64, u32)>,
}

impl Nearest {
    fn offer(&mut self, distance: f64, index: u32) {
        let place = self.points.partition_point(|&entry| entry < (distance, index));
        if place < self.k {
            self.points.insert(place, (distance, index));
            self.points.truncate(self.k);
        }
    }

    fn reach(&self) -> f64 {
        if self.points.len() < self.k { f64::INFINITY } else { self.points.last().map_or(-1.0, |last| last.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn agrees_with_brute_force() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        // Coarse coordinates, so that there are ties; one far outlier; a flat cloud.
        for (count, steps) in [(1, 9), (9, 3), (17, 50), (500, 7), (500, 1_000_000), (9000, 40_000)] {
            let mut points: Vec<[f64; 3]> =
                (0..count).map(|_| std::array::from_fn(|_| f64::from(random.random_range(0..steps)))).collect();
            points[0] = [1e9, 0.0, 0.0];
            let tree = Neighbours::new(&points);
            for at in points.iter().chain(&[[0.5, 2.5, -1.0]]) {
                let mut all: Vec<u32> = (0..points.len() as u32).collect();
                let distance = |&i: &u32| squared_distance(points[i as usize], *at);
                all.sort_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)));
                all.truncate(12);
                assert_eq!(tree.nearest(*at, 12), all);
                let mut near = Vec::new();
                tree.within(*at, 2.0, &mut |index| near.push(index));
                near.sort_unstable();
                let is_near = |i: &u32| squared_distance(points[*i as usize], *at) <= 4.0;
                assert_eq!(near, (0..points.len() as u32).filter(is_near).collect::<Vec<u32>>());
            }
            assert!(tree.nearest([0.0; 3], 0).is_empty());
            let each = tree.at_each(3, |i, near| (i, near.to_vec()));
            assert!(each.iter().enumerate().all(|(i, (at, near))| i == *at && *near == tree.nearest(points[i], 3)));
        }
    }
}
