//! A tree of boxes over facets, refitted as the model moves.

use crate::bvh::closest_weights;
use crate::mesh::Bounds;
use glam::{DVec3, Vec3, Vec4};

/// A tree of axis-aligned boxes in fours, with single facets as leaves; children stand behind their parent, so that one
/// pass backwards refits all.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    /// Coordinates of boxes are relative to this. Millimetres.
    origin: DVec3,
}

/// The boxes of four children. They are in single precision and enlarged, so that no rounding hides a facet.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: [Vec4; 3],
    high: [Vec4; 3],
    /// Nodes, facets with `LEAF` added to their number, or `NONE`.
    child: [u32; WIDTH],
}

/// Children of a node.
const WIDTH: usize = 4;
const LEAF: u32 = 1 << 31;
const NONE: u32 = u32::MAX;
/// Every level leaves at most three boxes for later, and sixteen levels hold all the facets that there may be.
const DEPTH: usize = 64;

impl Node {
    const EMPTY: Self = Self { low: [Vec4::INFINITY; 3], high: [Vec4::NEG_INFINITY; 3], child: [NONE; WIDTH] };

    /// Lower bounds of the squared distances from `q` to the children's boxes; infinite for an empty box.
    fn distances(&self, q: [Vec4; 3]) -> Vec4 {
        let off = |k: usize| (self.low[k] - q[k]).max(q[k] - self.high[k]).max(Vec4::ZERO);
        let (x, y, z) = (off(0), off(1), off(2));
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

    /// Adds a node over some facets, which stand from `first` on in the order; returns the node's number.
    fn grow(&mut self, items: &mut [u32], first: usize, centres: &[DVec3]) -> u32 {
        let number = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        if items.len() <= WIDTH {
            for k in 0..items.len() {
                self.nodes[number].child[k] = LEAF + (first + k) as u32;
            }
            return number as u32;
        }
        let (left, right) = halve(items, centres);
        let ((a, b), (c, d)) = (halve(left, centres), halve(right, centres));
        let mut first = first;
        for (k, part) in [a, b, c, d].into_iter().filter(|part| !part.is_empty()).enumerate() {
            self.nodes[number].child[k] = self.grow(part, first, centres);
            first += part.len();
        }
        number as u32
    }

    /// Fits every box to the corners of its facets; facets with a corner that is not finite are left out. `bounds`
    /// holds all corners, and `facet` has those of a facet.
    pub(crate) fn refit(&mut self, bounds: Bounds, facet: impl Fn(usize) -> [DVec3; 4]) {
        self.origin = bounds.centre();
        // Rounding of a box and of a point to single precision moves a coordinate by less than 1e-7 of its size.
        let margin = Vec3::splat((4e-7 * bounds.size().max_element()) as f32);
        let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let of_facet = |corners: [DVec3; 4], origin: DVec3| {
            if !corners.iter().all(|c| c.is_finite()) {
                return nothing;
            }
            let corners = corners.map(|c| (c - origin).as_vec3());
            corners.iter().fold(nothing, |(low, high), c| (low.min(*c - margin), high.max(*c + margin)))
        };
        for i in (0..self.nodes.len()).rev() {
            for k in 0..WIDTH {
                let (low, high) = match self.nodes[i].child[k] {
                    NONE => nothing,
                    leaf if leaf & LEAF != 0 => of_facet(facet((leaf - LEAF) as usize), self.origin),
                    node => {
                        let Node { low, high, .. } = &self.nodes[node as usize];
                        (low.map(|l| l.min_element()).into(), high.map(|h| h.max_element()).into())
                    }
                };
                for c in 0..3 {
                    self.nodes[i].low[c][k] = low[c];
                    self.nodes[i].high[c][k] = high[c];
                }
            }
        }
    }

    /// Visits facets near a point, nearest boxes first. `item` gets a facet and the squared limit, and returns the
    /// limit from then on.
    pub(crate) fn visit(&self, q: DVec3, limit: f64, mut item: impl FnMut(usize, f64) -> f64) {
        if self.nodes.is_empty() {
            return;
        }
        let q = (q - self.origin).as_vec3().to_array().map(Vec4::splat);
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
                limit = item((child - LEAF) as usize, limit);
                continue;
            }
            let node = &self.nodes[child as usize];
            let distances = node.distances(q);
            // Those that are below the limit, or equal to it within rounding.
            let mut left = distances.cmplt(Vec4::splat((limit as f32).next_up())).bitmask();
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

/// Halves items at the median of the widest axis, at a multiple of a node's width so that nodes are full; the second
/// half is empty where one node holds all.
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
        tree.refit(moved.iter().copied().collect(), |i| [moved[order[i] as usize]; 4]);
        for _ in 0..300 {
            let q = point(&mut rng) * 1.5;
            let mut found = (f64::INFINITY, usize::MAX);
            tree.visit(q, f64::INFINITY, |i, limit| {
                let d2 = q.distance_squared(moved[order[i] as usize]);
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
