//! A tree of boxes over facets, refitted as the model moves.

use super::facet_block::{Asked, Block, Lanes, WIDTH};
use super::facets::Facing;
use crate::bvh::closest_weights;
use crate::mesh::Bounds;
use glam::{DVec3, Vec3, Vec4};

/// A tree of axis-aligned boxes in fours, with blocks of four facets as leaves; children stand behind their parent, so
/// that one pass backwards refits all.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    /// Coordinates of boxes and blocks are relative to this. Millimetres.
    origin: DVec3,
}

/// The boxes of four children. They are in single precision and enlarged, so that no rounding hides a facet.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: [Vec4; 3],
    high: [Vec4; 3],
    /// Nodes, blocks with `LEAF` added to their number, or `NONE`.
    child: [u32; WIDTH],
}

const LEAF: u32 = 1 << 31;
const NONE: u32 = u32::MAX;
/// Every level leaves at most three boxes for later, and sixteen levels hold all the facets that there may be.
const DEPTH: usize = 64;

impl Node {
    const EMPTY: Self = Self { low: [Vec4::INFINITY; 3], high: [Vec4::NEG_INFINITY; 3], child: [NONE; WIDTH] };

    /// Lower bounds of the squared distances from `q` to the children's boxes; infinite for an empty box.
    fn distances(&self, q: Lanes) -> Vec4 {
        let off = |k: usize, q: Vec4| (self.low[k] - q).max(q - self.high[k]).max(Vec4::ZERO);
        let (x, y, z) = (off(0, q.x), off(1, q.y), off(2, q.z));
        (x * x + y * y + z * z) * (1.0 - 1e-6)
    }
}

impl Tree {
    /// A tree over facets with these centres, and the order in which it holds them: the i-th facet of the tree is facet
    /// `order[i]`. Its boxes are empty until `refit`.
    pub(crate) fn build(centres: &[DVec3]) -> (Self, Vec<u32>) {
        let mut order: Vec<u32> = (0..centres.len() as u32).collect();
        let mut tree = Self::default();
        if !order.is_empty() {
            tree.grow(&mut order, 0, centres);
        }
        (tree, order)
    }

    /// Adds a node over some facets, the first of which opens a block; returns the node's number.
    fn grow(&mut self, items: &mut [u32], first: usize, centres: &[DVec3]) -> u32 {
        let number = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let (left, right) = halve(items, centres);
        let ((a, b), (c, d)) = (halve(left, centres), halve(right, centres));
        let mut block = first;
        for (k, part) in [a, b, c, d].into_iter().filter(|part| !part.is_empty()).enumerate() {
            let child = if part.len() <= WIDTH { LEAF + block as u32 } else { self.grow(part, block, centres) };
            self.nodes[number].child[k] = child;
            block += part.len().div_ceil(WIDTH);
        }
        number as u32
    }

    /// Fits every box to the corners of its facets; facets with a corner that is not finite are left out. `bounds`
    /// holds all corners, and `facet` has those of `count` facets, with their patches.
    pub(crate) fn refit(&mut self, bounds: Bounds, count: usize, facet: impl Fn(usize) -> ([DVec3; 4], u32)) {
        self.origin = bounds.centre();
        let size = bounds.size().max_element();
        // Rounding of a box and of a point to single precision moves a coordinate by less than 1e-7 of its size.
        let margin = Vec3::splat((4e-7 * size) as f32);
        self.blocks.clear();
        let mut boxes = Vec::with_capacity(count.div_ceil(WIDTH));
        for first in (0..count).step_by(WIDTH) {
            let (mut corners, mut patches) = ([[DVec3::NAN; 4]; WIDTH], [0; WIDTH]);
            let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            for ((i, corners), patch) in (first..count).zip(&mut corners).zip(&mut patches) {
                (*corners, *patch) = facet(i);
                if corners.iter().all(|c| c.is_finite()) {
                    for c in corners.map(|c| self.local(c)) {
                        (low, high) = (low.min(c - margin), high.max(c + margin));
                    }
                }
            }
            self.blocks.push(Block::new(&corners, patches, self.origin, size));
            boxes.push((low, high));
        }
        for i in (0..self.nodes.len()).rev() {
            for k in 0..WIDTH {
                let child = self.nodes[i].child[k];
                let (low, high) = if child & LEAF == 0 {
                    let Node { low, high, .. } = &self.nodes[child as usize];
                    (Vec3::from_array(low.map(|l| l.min_element())), Vec3::from_array(high.map(|h| h.max_element())))
                } else {
                    boxes.get((child - LEAF) as usize).copied().unwrap_or((Vec3::INFINITY, Vec3::NEG_INFINITY))
                };
                for c in 0..3 {
                    self.nodes[i].low[c][k] = low[c];
                    self.nodes[i].high[c][k] = high[c];
                }
            }
        }
    }

    fn local(&self, p: DVec3) -> Vec3 {
        (p - self.origin).as_vec3()
    }

    /// A point as blocks take it: for facets whose cosine with its normal (see `Facing`) is not below `across`.
    pub(crate) fn asked<'a>(&self, q: DVec3, facing: Option<Facing<'a>>, across: f64) -> Asked<'a> {
        Asked::new(self.local(q), facing, across)
    }

    /// Visits facets near a point, nearest boxes first. `item` gets a facet, a lower bound of its squared distance and
    /// the squared limit, and returns the limit from then on.
    pub(crate) fn visit(&self, asked: &Asked, limit: f64, mut item: impl FnMut(usize, f64, f64) -> f64) {
        if self.nodes.is_empty() {
            return;
        }
        let mut limit = limit;
        let mut stack = [(0.0_f32, 0_u32); DEPTH];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (d2, child) = stack[depth];
            if f64::from(d2) >= limit {
                continue;
            }
            if child & LEAF != 0 {
                let block = (child - LEAF) as usize;
                let lower = self.blocks[block].lower_bounds(asked);
                let mut left = below(lower, limit);
                if left == 0 {
                    continue;
                }
                // The nearest facet first: it may rule the others out.
                let mut lane = lower.min_position();
                let lower = lower.to_array();
                while left != 0 {
                    if f64::from(lower[lane]) < limit {
                        limit = item(block * WIDTH + lane, f64::from(lower[lane]), limit);
                    }
                    left &= !(1 << lane);
                    lane = left.trailing_zeros() as usize;
                }
                continue;
            }
            let node = &self.nodes[child as usize];
            let distances = node.distances(asked.place);
            let mut left = below(distances, limit);
            let distances = distances.to_array();
            let first = depth;
            while left != 0 {
                let lane = left.trailing_zeros() as usize;
                left &= left - 1;
                // The nearest one stands last.
                let mut k = depth;
                while k > first && stack[k - 1].0 < distances[lane] {
                    stack[k] = stack[k - 1];
                    k -= 1;
                }
                stack[k] = (distances[lane], node.child[lane]);
                depth += 1;
            }
        }
    }
}

/// A mask of the lanes that are below a limit, or equal to it within rounding.
fn below(lanes: Vec4, limit: f64) -> u32 {
    lanes.cmplt(Vec4::splat((limit as f32).next_up())).bitmask()
}

/// Halves items at the median of the widest axis, at a multiple of a block; the second half is empty where a block
/// holds all.
fn halve<'i>(items: &'i mut [u32], centres: &[DVec3]) -> (&'i mut [u32], &'i mut [u32]) {
    let half = items.len().div_ceil(WIDTH).div_ceil(2) * WIDTH;
    if half >= items.len() {
        let end = items.len();
        return items.split_at_mut(end);
    }
    let bounds: Bounds = items.iter().map(|i| centres[*i as usize]).filter(|c| c.is_finite()).collect();
    let axis = bounds.longest_axis();
    items.select_nth_unstable_by(half, |a, b| {
        centres[*a as usize][axis].total_cmp(&centres[*b as usize][axis]).then(a.cmp(b))
    });
    items.split_at_mut(half)
}

/// The point of triangle abc nearest to q as weights of a, b and c, and its squared distance. Not finite where the
/// triangle is not.
pub(crate) fn triangle_closest(q: DVec3, a: DVec3, b: DVec3, c: DVec3) -> ([f64; 3], f64) {
    let (ab, ac, ap) = (b - a, c - a, q - a);
    let weights = closest_weights([ap, ap - ab, ap - ac].map(|p| [ab.dot(p), ac.dot(p)]));
    let foot = ab * weights[1] + ac * weights[2];
    (weights, (ap - foot).length_squared())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn point(rng: &mut ChaCha8Rng) -> DVec3 {
        DVec3::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0))
    }

    #[test]
    fn the_closest_point_of_a_triangle_beats_a_fine_grid() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..200 {
            let [a, b, c, q] = [(); 4].map(|()| point(&mut rng));
            let (w, d2) = triangle_closest(q, a, b, c);
            assert!(
                (w.iter().sum::<f64>() - 1.0).abs() < 1e-12 && w.iter().all(|w| (-1e-12..=1.0 + 1e-12).contains(w))
            );
            let mut grid = f64::INFINITY;
            for i in 0..=40 {
                for j in 0..=40 - i {
                    let (s, t) = (f64::from(i) / 40.0, f64::from(j) / 40.0);
                    grid = grid.min((a + (b - a) * s + (c - a) * t - q).length_squared());
                }
            }
            assert!(d2 <= grid + 1e-12 && d2 > grid - 0.3, "{d2} {grid}");
        }
    }

    #[test]
    fn the_tree_finds_what_brute_force_finds() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let points: Vec<DVec3> = (0..777).map(|_| point(&mut rng)).collect();
        let (mut tree, order) = Tree::build(&points);
        // Refit to points that have moved since.
        let moved: Vec<DVec3> = points.iter().map(|p| *p * 1.3 + point(&mut rng) * 0.2).collect();
        tree.refit(moved.iter().copied().collect(), moved.len(), |i| ([moved[order[i] as usize]; 4], 0));
        for _ in 0..300 {
            let q = point(&mut rng) * 1.5;
            let mut found = (f64::INFINITY, usize::MAX);
            tree.visit(&tree.asked(q, None, 0.0), f64::INFINITY, |i, lower, limit| {
                let d2 = q.distance_squared(moved[order[i] as usize]);
                assert!(lower <= d2);
                if d2 < limit {
                    found = (d2, order[i] as usize);
                }
                limit.min(d2)
            });
            let brute = (0..777).min_by(|a, b| q.distance_squared(moved[*a]).total_cmp(&q.distance_squared(moved[*b])));
            assert_eq!(Some(found.1), brute);
        }
    }
}
