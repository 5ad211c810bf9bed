//! Building the tree: a sweep over sorted centroids for the least surface area cost.

use super::block::NO_TRIANGLE;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use rayon::prelude::*;

/// No leaf is deeper than this (the root's depth is 0), so that traversal needs a stack of this size at most.
pub(crate) const MAX_DEPTH: usize = 64;

/// Triangles a leaf.
const LEAF: usize = 4;

/// Subtrees with fewer triangles are built on one thread.
const PARALLEL: usize = 4096;

/// The triangles of a subtree in ascending order of their centroids on one axis, and room to work in.
struct Lane<'a> {
    order: &'a mut [u32],
    scratch: &'a mut [u32],
    areas: &'a mut [f32],
}

/// What all subtrees read.
struct Sweep<'a> {
    boxes: &'a [Aabb],
    /// Per axis and triangle: the centroid's coordinate as an integer of the same order.
    keys: [Vec<u32>; 3],
}

/// A way to split: cost, and how many triangles go left.
#[derive(Clone, Copy)]
struct Split {
    cost: f32,
    axis: usize,
    left: usize,
}

/// Builds the tree over the boxes of triangles. `primitive_indices` has four entries a leaf, filled up with
/// `NO_TRIANGLE`.
pub(super) fn build(boxes: &[Aabb]) -> Bvh2 {
    let count = boxes.len();
    if count == 0 {
        return Bvh2::default();
    }
    let keys = [0, 1, 2].map(|axis| boxes.par_iter().map(|b| ordered(b.center()[axis])).collect::<Vec<u32>>());
    let sweep = Sweep { boxes, keys };
    let mut orders = [0, 1, 2].map(|axis| sweep.sorted(axis));
    let mut scratch = [0, 1, 2].map(|_| vec![0u32; count]);
    let mut areas = [0, 1, 2].map(|_| vec![0f32; count]);
    let mut root = Bvh2Node::default();
    let mut nodes = vec![Bvh2Node::default(); 2 * (count - 1)];
    {
        let [o0, o1, o2] = &mut orders;
        let [s0, s1, s2] = &mut scratch;
        let [a0, a1, a2] = &mut areas;
        let lanes =
            [(o0, s0, a0), (o1, s1, a1), (o2, s2, a2)].map(|(order, scratch, areas)| Lane { order, scratch, areas });
        sweep.build_subtree(lanes, 0, &mut root, (&mut nodes, 0), 0);
    }
    compact(root, &nodes, &orders[0])
}

impl Sweep<'_> {
    /// All triangles in ascending order of centroid, then of index.
    fn sorted(&self, axis: usize) -> Vec<u32> {
        let mut keyed: Vec<u64> =
            self.keys[axis].par_iter().enumerate().map(|(i, &key)| u64::from(key) << 32 | i as u64).collect();
        keyed.par_sort_unstable();
        keyed.into_iter().map(|k| k as u32).collect()
    }

    /// Builds the subtree over `lanes` into `node` and, below it, the 2 (n - 1) nodes of `rest`, of which the first
    /// has the index `rest.1`. `offset` is where the lanes begin in the whole order.
    fn build_subtree(
        &self,
        lanes: [Lane; 3],
        offset: usize,
        node: &mut Bvh2Node,
        (rest, base): (&mut [Bvh2Node], usize),
        depth: usize,
    ) {
        let order = &*lanes[0].order;
        let count = order.len();
        let mut aabb = self.boxes[order[0] as usize];
        for &i in &order[1..] {
            aabb = aabb.union(&self.boxes[i as usize]);
        }
        if count <= LEAF {
            *node = Bvh2Node::new(aabb, count as u32, offset as u32);
            return;
        }
        *node = Bvh2Node::new(aabb, 0, base as u32);
        let (lanes, left) = self.divide(lanes, depth);
        let [l0, l1, l2] = lanes.map(|lane| lane.split_at(left));
        let (children, rest) = rest.split_at_mut(2);
        let (left_rest, right_rest) = rest.split_at_mut(2 * (left - 1));
        let (left_base, right_base) = (base + 2, base + 2 + left_rest.len());
        let [left_node, right_node] = children else { return };
        let go_left = || self.build_subtree([l0.0, l1.0, l2.0], offset, left_node, (left_rest, left_base), depth + 1);
        let go_right = || {
            self.build_subtree([l0.1, l1.1, l2.1], offset + left, right_node, (right_rest, right_base), depth + 1);
        };
        if count >= PARALLEL {
            rayon::join(go_left, go_right);
        } else {
            go_left();
            go_right();
        }
    }

    /// Chooses a split and brings the triangles that go left to the front of all three lanes, which keep their order.
    fn divide<'a>(&self, mut lanes: [Lane<'a>; 3], depth: usize) -> ([Lane<'a>; 3], usize) {
        let count = lanes[0].order.len();
        let Split { axis, left, .. } = self.choose(&mut lanes, depth);
        let pivot = lanes[axis].order[left];
        let keys = &self.keys[axis];
        let limit = (keys[pivot as usize], pivot);
        let is_left = |i: u32| (keys[i as usize], i) < limit;
        let partition = |(k, lane): (usize, &mut Lane)| {
            if k != axis {
                lane.partition(left, is_left);
            }
        };
        if count >= PARALLEL {
            lanes.par_iter_mut().enumerate().for_each(partition);
        } else {
            lanes.iter_mut().enumerate().for_each(partition);
        }
        (lanes, left)
    }

    /// The best split over all axes, or the median where the best would be too deep or where the centroids coincide.
    fn choose(&self, lanes: &mut [Lane; 3], depth: usize) -> Split {
        let count = lanes[0].order.len();
        let spread = [0, 1, 2].map(|axis| {
            let order = &lanes[axis].order;
            let [low, high] = [order[0], order[count - 1]].map(|i| self.boxes[i as usize].center()[axis]);
            high - low
        });
        let widest = (1..3).fold(0, |best, k| if spread[k] > spread[best] { k } else { best });
        let median = Split { cost: 0.0, axis: widest, left: count / 2 };
        let levels_needed = count.next_power_of_two().trailing_zeros() as usize;
        if depth + levels_needed >= MAX_DEPTH || spread[widest] <= 0.0 {
            return median;
        }
        let sweep = |(axis, lane): (usize, &mut Lane)| self.best_on_axis(axis, lane);
        let splits: Vec<Split> = if count >= PARALLEL {
            lanes.par_iter_mut().enumerate().map(sweep).collect()
        } else {
            lanes.iter_mut().enumerate().map(sweep).collect()
        };
        splits.into_iter().reduce(|best, s| if s.cost < best.cost { s } else { best }).unwrap_or(median)
    }

    /// The split of least N_L A_L + N_R A_R; of equals the most even one.
    fn best_on_axis(&self, axis: usize, lane: &mut Lane) -> Split {
        let count = lane.order.len();
        let mut right = Aabb::empty();
        for i in (1..count).rev() {
            right = right.union(&self.boxes[lane.order[i] as usize]);
            lane.areas[i] = right.half_area();
        }
        let mut best = Split { cost: f32::INFINITY, axis, left: count / 2 };
        let mut left = Aabb::empty();
        for i in 1..count {
            left = left.union(&self.boxes[lane.order[i - 1] as usize]);
            let cost = i as f32 * left.half_area() + (count - i) as f32 * lane.areas[i];
            if cost < best.cost || cost == best.cost && i.abs_diff(count / 2) < best.left.abs_diff(count / 2) {
                best = Split { cost, axis, left: i };
            }
        }
        best
    }
}

impl<'a> Lane<'a> {
    /// Moves the triangles for which `is_left` holds (`left` of them) to the front; both sides keep their order.
    fn partition(&mut self, left: usize, is_left: impl Fn(u32) -> bool) {
        let (mut l, mut r) = (0, left);
        for &i in &*self.order {
            let place = if is_left(i) { &mut l } else { &mut r };
            self.scratch[*place] = i;
            *place += 1;
        }
        self.order.copy_from_slice(self.scratch);
    }

    fn split_at(self, left: usize) -> (Lane<'a>, Lane<'a>) {
        let (order_l, order_r) = self.order.split_at_mut(left);
        let (scratch_l, scratch_r) = self.scratch.split_at_mut(left);
        let (areas_l, areas_r) = self.areas.split_at_mut(left);
        (
            Lane { order: order_l, scratch: scratch_l, areas: areas_l },
            Lane { order: order_r, scratch: scratch_r, areas: areas_r },
        )
    }
}

/// The tree without the gaps between its nodes, and with every leaf at a multiple of four.
fn compact(root: Bvh2Node, sparse: &[Bvh2Node], order: &[u32]) -> Bvh2 {
    let mut nodes = vec![root];
    let mut primitive_indices = Vec::new();
    let mut pending = vec![0usize];
    while let Some(i) = pending.pop() {
        let first = nodes[i].first_index as usize;
        if nodes[i].is_leaf() {
            nodes[i].first_index = primitive_indices.len() as u32;
            primitive_indices.extend_from_slice(&order[first..first + nodes[i].prim_count as usize]);
            primitive_indices.resize(nodes[i].first_index as usize + LEAF, NO_TRIANGLE);
        } else {
            nodes[i].first_index = nodes.len() as u32;
            pending.extend([nodes.len() + 1, nodes.len()]);
            nodes.extend_from_slice(&sparse[first..first + 2]);
        }
    }
    nodes.shrink_to_fit();
    Bvh2 { nodes, primitive_indices, max_depth: MAX_DEPTH, children_are_ordered_after_parents: true, ..Bvh2::default() }
}

/// A finite float as an integer of the same order; -0 equals 0.
fn ordered(x: f32) -> u32 {
    let bits = (x + 0.0).to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}
