//! The k nearest of many points: a k-d tree (Bentley 1975; Friedman, Bentley and Finkel 1977).

use crate::mesh::Bounds;
use glam::DVec3;

/// The largest number of points in a leaf.
const LEAF: usize = 8;

/// A k-d tree over points that it borrows. It stays balanced however the points lie.
pub(crate) struct Neighbours<'a> {
    points: &'a [[f64; 3]],
    /// Indices of points; every node has a run of them, its children the halves of that run.
    order: Vec<u32>,
    /// The planes between the children; those of node i are nodes 2 i + 1 and 2 i + 2.
    planes: Vec<Plane>,
}

/// Points with a smaller coordinate lie left; with a greater, right.
#[derive(Clone, Copy, Default)]
struct Plane {
    axis: usize,
    at: f64,
}

impl<'a> Neighbours<'a> {
    /// Sorts finite points, fewer than 2^32.
    pub(crate) fn new(points: &'a [[f64; 3]]) -> Self {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let mut planes = Vec::new();
        split(points, &mut order, 0, &mut planes);
        Self { points, order, planes }
    }

    /// Indices of the k points nearest to `at` (itself among them, if it is one), nearest first; ties by index.
    pub(crate) fn nearest(&self, at: [f64; 3], k: usize) -> Vec<u32> {
        let mut nearest = Nearest { k, points: Vec::with_capacity(k + 1) };
        self.search(&self.order, 0, at, &mut nearest);
        nearest.points.into_iter().map(|(_, index)| index).collect()
    }

    /// Calls `visit` with the index of every point at most `radius` away from `at`, in an order that depends on the
    /// points alone.
    pub(crate) fn within(&self, at: [f64; 3], radius: f64, visit: &mut impl FnMut(u32)) {
        self.gather(&self.order, 0, at, radius, visit);
    }

    fn gather(&self, run: &[u32], node: usize, at: [f64; 3], radius: f64, visit: &mut impl FnMut(u32)) {
        if run.len() <= LEAF {
            let is_near = |index: &&u32| squared_distance(self.points[**index as usize], at) <= radius * radius;
            run.iter().filter(is_near).for_each(|index| visit(*index));
            return;
        }
        let plane = self.planes[node];
        let beyond = at[plane.axis] - plane.at;
        let (left, right) = run.split_at(run.len() / 2);
        if beyond <= radius {
            self.gather(left, 2 * node + 1, at, radius, visit);
        }
        if beyond >= -radius {
            self.gather(right, 2 * node + 2, at, radius, visit);
        }
    }

    fn search(&self, run: &[u32], node: usize, at: [f64; 3], nearest: &mut Nearest) {
        if run.len() <= LEAF {
            for &index in run {
                nearest.offer(squared_distance(self.points[index as usize], at), index);
            }
            return;
        }
        let plane = self.planes[node];
        let beyond = at[plane.axis] - plane.at;
        let (left, right) = run.split_at(run.len() / 2);
        let (left, right) = ((left, 2 * node + 1), (right, 2 * node + 2));
        let (near, far) = if beyond < 0.0 { (left, right) } else { (right, left) };
        self.search(near.0, near.1, at, nearest);
        if beyond * beyond <= nearest.reach() {
            self.search(far.0, far.1, at, nearest);
        }
    }
}

fn split(points: &[[f64; 3]], run: &mut [u32], node: usize, planes: &mut Vec<Plane>) {
    if run.len() <= LEAF {
        return;
    }
    let bounds: Bounds = run.iter().map(|&i| DVec3::from_array(points[i as usize])).collect();
    let axis = bounds.longest_axis();
    let middle = run.len() / 2;
    let key = |&i: &u32| points[i as usize][axis];
    run.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    if planes.len() <= node {
        planes.resize(node + 1, Plane::default());
    }
    planes[node] = Plane { axis, at: key(&run[middle]) };
    let (left, right) = run.split_at_mut(middle);
    split(points, left, 2 * node + 1, planes);
    split(points, right, 2 * node + 2, planes);
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
        for (count, steps) in [(1, 9), (9, 3), (500, 7), (500, 1_000_000)] {
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
        }
    }
}
