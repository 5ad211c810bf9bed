//! Building the tree: a sweep over sorted centroids for the least surface area cost.

use super::block::NO_TRIANGLE;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use rayon::prelude::*;

/// No leaf is deeper than this (the root's depth is 0), so that traversal needs a stack of this size at most.
pub(crate) const MAX_DEPTH: usize = 64;

/// The largest number of triangles in a leaf.
const LEAF: usize = 4;

/// Subtrees with fewer triangles are built on one thread.
const PARALLEL: usize = 4096;

/// A place in the order of a subtree's triangles by their centroids on one axis, and room to work in.
#[derive(Clone, Copy)]
struct Slot {
    triangle: u32,
    scratch: u32,
    area: f32,
}

/// The input that all subtrees share.
struct Sweep<'a> {
    boxes: &'a [Aabb],
    /// Per axis and triangle: the centroid's coordinate as an integer of the same order.
    keys: [Vec<u32>; 3],
}

/// A way to split: its cost, and how many triangles go left.
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
    let mut root = Bvh2Node::default();
    let mut nodes = vec![Bvh2Node::default(); 2 * (count - 1)];
    sweep.build_subtree(orders.each_mut().map(Vec::as_mut_slice), 0, &mut root, (&mut nodes, 0), 0);
    compact(root, &nodes, &orders[0])
}

impl Sweep<'_> {
    /// All triangles in ascending order of centroid, then of index.
    fn sorted(&self, axis: usize) -> Vec<Slot> {
        let mut keyed: Vec<u64> =
            self.keys[axis].par_iter().enumerate().map(|(i, &key)| u64::from(key) << 32 | i as u64).collect();
        keyed.par_sort_unstable();
        keyed.into_iter().map(|k| Slot { triangle: k as u32, scratch: 0, area: 0.0 }).collect()
    }

    /// Builds the subtree over three orders of the same n triangles into `node` and, below it, the 2 (n - 1) nodes of
    /// `rest`, of which the first has the index `rest.1`. The orders begin at `offset` in those of all triangles.
    fn build_subtree(
        &self,
        orders: [&mut [Slot]; 3],
        offset: usize,
        node: &mut Bvh2Node,
        (rest, base): (&mut [Bvh2Node], usize),
        depth: usize,
    ) {
        let count = orders[0].len();
        let aabb = orders[0].iter().fold(Aabb::empty(), |aabb, slot| aabb.union(&self.boxes[slot.triangle as usize]));
        if count <= LEAF {
            *node = Bvh2Node::new(aabb, count as u32, offset as u32);
            return;
        }
        *node = Bvh2Node::new(aabb, 0, base as u32);
        let (orders, left) = self.divide(orders, depth);
        let [o0, o1, o2] = orders.map(|order| order.split_at_mut(left));
        let (children, rest) = rest.split_at_mut(2);
        let (left_rest, right_rest) = rest.split_at_mut(2 * (left - 1));
        let (left_base, right_base) = (base + 2, base + 2 + left_rest.len());
        let [left_node, right_node] = children else { return };
        let mut go_left =
            || self.build_subtree([o0.0, o1.0, o2.0], offset, left_node, (left_rest, left_base), depth + 1);
        let mut go_right = || {
            self.build_subtree([o0.1, o1.1, o2.1], offset + left, right_node, (right_rest, right_base), depth + 1);
        };
        if count >= PARALLEL {
            rayon::join(go_left, go_right);
        } else {
            go_left();
            go_right();
        }
    }

    /// Chooses a split and brings the triangles that go left to the front of all three orders, by stable partitions.
    fn divide<'a>(&self, mut orders: [&'a mut [Slot]; 3], depth: usize) -> ([&'a mut [Slot]; 3], usize) {
        let count = orders[0].len();
        let Split { axis, left, .. } = self.choose(&mut orders, depth);
        let pivot = orders[axis][left].triangle;
        let keys = &self.keys[axis];
        let limit = (keys[pivot as usize], pivot);
        let is_left = |i: u32| (keys[i as usize], i) < limit;
        let partition = |(k, order): (usize, &mut &mut [Slot])| {
            if k != axis {
                partition(order, left, is_left);
            }
        };
        if count >= PARALLEL {
            orders.par_iter_mut().enumerate().for_each(partition);
        } else {
            orders.iter_mut().enumerate().for_each(partition);
        }
        (orders, left)
    }

    /// The best split over all axes, or the median where the best would be too deep or where the centroids coincide.
    fn choose(&self, orders: &mut [&mut [Slot]; 3], depth: usize) -> Split {
        let count = orders[0].len();
        let spread = [0, 1, 2].map(|axis| {
            let at = |slot: usize| self.boxes[orders[axis][slot].triangle as usize].center()[axis];
            at(count - 1) - at(0)
        });
        let widest = (1..3).fold(0, |best, k| if spread[k] > spread[best] { k } else { best });
        let median = Split { cost: 0.0, axis: widest, left: count / 2 };
        let levels_needed = count.next_power_of_two().trailing_zeros() as usize;
        if depth + levels_needed >= MAX_DEPTH || spread[widest] <= 0.0 {
            return median;
        }
        let sweep = |(axis, order): (usize, &mut &mut [Slot])| self.best_on_axis(axis, order);
        let splits: Vec<Split> = if count >= PARALLEL {
            orders.par_iter_mut().enumerate().map(sweep).collect()
        } else {
            orders.iter_mut().enumerate().map(sweep).collect()
        };
        splits.into_iter().reduce(|best, s| if s.cost < best.cost { s } else { best }).unwrap_or(median)
    }

    /// The split of least N_L A_L + N_R A_R; of equals the most even one.
    fn best_on_axis(&self, axis: usize, order: &mut [Slot]) -> Split {
        let count = order.len();
        let mut right = Aabb::empty();
        for slot in order[1..].iter_mut().rev() {
            right = right.union(&self.boxes[slot.triangle as usize]);
            slot.area = right.half_area();
        }
        let mut best = Split { cost: f32::INFINITY, axis, left: count / 2 };
        let mut left = Aabb::empty();
        for i in 1..count {
            left = left.union(&self.boxes[order[i - 1].triangle as usize]);
            let cost = i as f32 * left.half_area() + (count - i) as f32 * order[i].area;
            if cost < best.cost || cost == best.cost && i.abs_diff(count / 2) < best.left.abs_diff(count / 2) {
                best = Split { cost, axis, left: i };
            }
        }
        best
    }
}

/// Moves the triangles for which `is_left` holds (`left` of them) to the front; both sides keep their order.
fn partition(order: &mut [Slot], left: usize, is_left: impl Fn(u32) -> bool) {
    let (mut l, mut r) = (0, left);
    for i in 0..order.len() {
        let triangle = order[i].triangle;
        let place = if is_left(triangle) { &mut l } else { &mut r };
        order[*place].scratch = triangle;
        *place += 1;
    }
    order.iter_mut().for_each(|slot| slot.triangle = slot.scratch);
}

/// The tree without the gaps between its nodes, and with every leaf at a multiple of four.
fn compact(root: Bvh2Node, sparse: &[Bvh2Node], order: &[Slot]) -> Bvh2 {
    let mut nodes = vec![root];
    let mut primitive_indices = Vec::new();
    let mut pending = vec![0usize];
    while let Some(i) = pending.pop() {
        let first = nodes[i].first_index as usize;
        if nodes[i].is_leaf() {
            nodes[i].first_index = primitive_indices.len() as u32;
            let leaf = &order[first..first + nodes[i].prim_count as usize];
            primitive_indices.extend(leaf.iter().map(|slot| slot.triangle));
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

/// A finite number as an integer of the same order; -0 equals 0.
fn ordered(x: f32) -> u32 {
    let bits = (x + 0.0).to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}
