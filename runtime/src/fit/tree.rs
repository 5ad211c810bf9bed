//! A tree of boxes over facets, refitted as the model moves.

use glam::{DVec3, Vec4};

/// A binary tree of axis-aligned boxes; children stand behind their parent, so that one pass backwards refits all.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    /// What the boxes' coordinates are relative to.
    origin: DVec3,
}

/// Boxes are in single precision, a little larger than what they hold, so that no rounding hides an item.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec4,
    high: Vec4,
    /// First item of a leaf, else the left child; the right one follows it.
    first: u32,
    /// Items of a leaf; 0 in an inner node.
    count: u32,
}

const LEAF: usize = 1;
/// Median splits halve the items, so 64 levels hold any count.
const DEPTH: usize = 64;

impl Tree {
    /// A tree over items at `centres`, and the order in which it wants the items: the i-th item of the tree is item
    /// `order[i]`. Boxes are empty until `refit`.
    pub(crate) fn build(centres: &[DVec3]) -> (Self, Vec<u32>) {
        let mut order: Vec<u32> = (0..centres.len() as u32).collect();
        let empty = Node { low: Vec4::INFINITY, high: Vec4::NEG_INFINITY, first: 0, count: centres.len() as u32 };
        let mut nodes = vec![empty];
        let mut next = 0;
        while next < nodes.len() {
            let Node { first, count, .. } = nodes[next];
            if count as usize > LEAF {
                let items = &mut order[first as usize..(first + count) as usize];
                let half = split(items, centres) as u32;
                let left = nodes.len() as u32;
                nodes.push(Node { first, count: half, ..empty });
                nodes.push(Node { first: first + half, count: count - half, ..empty });
                nodes[next] = Node { first: left, count: 0, ..empty };
            }
            next += 1;
        }
        (Self { nodes, origin: DVec3::ZERO }, order)
    }

    /// Fits every box to the corners of its items; items with a corner that is not finite are left out. `bounds` holds all
    /// corners.
    pub(crate) fn refit(&mut self, (low, high): (DVec3, DVec3), corners: impl Fn(usize) -> [[f64; 3]; 4]) {
        let empty = !low.cmple(high).all();
        self.origin = if empty { DVec3::ZERO } else { 0.5 * (low + high) };
        // Rounding to single precision, of the box and of whoever asks, moves a coordinate by less than 1e-7 of its size.
        let margin = if empty { 0.0 } else { (4e-7 * (high - low).max_element()) as f32 };
        let margin = Vec4::new(margin, margin, margin, 0.0);
        for i in (0..self.nodes.len()).rev() {
            let Node { first, count, .. } = self.nodes[i];
            let (mut low, mut high) = (Vec4::INFINITY, Vec4::NEG_INFINITY);
            if count == 0 {
                for child in &self.nodes[first as usize..first as usize + 2] {
                    low = low.min(child.low);
                    high = high.max(child.high);
                }
            } else {
                for item in first..first + count {
                    let corners = corners(item as usize).map(|c| self.local(DVec3::from_array(c)));
                    if corners.iter().all(|c| c.is_finite()) {
                        for c in corners {
                            low = low.min(c - margin);
                            high = high.max(c + margin);
                        }
                    }
                }
            }
            (self.nodes[i].low, self.nodes[i].high) = (low, high);
        }
    }

    fn local(&self, p: DVec3) -> Vec4 {
        (p - self.origin).as_vec3().extend(0.0)
    }

    /// Visits items near `q`, nearest boxes first. `item` gets an item and the squared distance that it must beat, and
    /// returns the one to beat from then on.
    pub(crate) fn visit(&self, q: DVec3, limit: f64, mut item: impl FnMut(usize, f64) -> f64) {
        let mut limit = limit;
        let place = self.local(q);
        let mut stack = [(0.0_f64, 0_u32); DEPTH];
        let mut depth = 0;
        if self.nodes.is_empty() {
            return;
        }
        stack[depth] = (self.distance(0, place), 0);
        depth += 1;
        while depth > 0 {
            depth -= 1;
            let (d2, mut node) = stack[depth];
            if d2 >= limit {
                continue;
            }
            loop {
                let Node { first, count, .. } = self.nodes[node as usize];
                if count > 0 {
                    for i in first..first + count {
                        limit = item(i as usize, limit);
                    }
                    break;
                }
                let (mut near, mut far) = (first, first + 1);
                let (mut d_near, mut d_far) = (self.distance(near, place), self.distance(far, place));
                if d_far < d_near {
                    (near, far, d_near, d_far) = (far, near, d_far, d_near);
                }
                if d_near >= limit {
                    break;
                }
                if d_far < limit {
                    stack[depth] = (d_far, far);
                    depth += 1;
                }
                node = near;
            }
        }
    }

    /// Squared distance from `q` to a node's box, not more than it is; infinite for an empty one.
    fn distance(&self, node: u32, q: Vec4) -> f64 {
        let Node { low, high, .. } = self.nodes[node as usize];
        f64::from((low - q).max(q - high).max(Vec4::ZERO).length_squared()) * (1.0 - 1e-6)
    }
}

/// Halves items at the median of the widest axis.
fn split(items: &mut [u32], centres: &[DVec3]) -> usize {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for i in items.iter() {
        let c = centres[*i as usize];
        if c.is_finite() {
            low = low.min(c);
            high = high.max(c);
        }
    }
    let extent = high - low;
    let axis = if extent.x >= extent.y && extent.x >= extent.z {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    };
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |a, b| {
        centres[*a as usize][axis].total_cmp(&centres[*b as usize][axis]).then(a.cmp(b))
    });
    half
}

/// The point of triangle abc nearest to q as weights of a, b and c, and its squared distance (Ericson, Real-Time
/// Collision Detection, 5.1.5). Not finite where the triangle is not.
pub(crate) fn triangle_closest(q: DVec3, a: DVec3, b: DVec3, c: DVec3) -> ([f64; 3], f64) {
    let (ab, ac, ap) = (b - a, c - a, q - a);
    let weights = triangle_weights(ab, ac, ap);
    let foot = ab * weights[1] + ac * weights[2];
    (weights, (ap - foot).length_squared())
}

fn triangle_weights(ab: DVec3, ac: DVec3, ap: DVec3) -> [f64; 3] {
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = ap - ab;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let cp = ap - ac;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    // A triangle without area has no interior; its first corner stands for it.
    if sum <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    [va / sum, vb / sum, vc / sum]
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
        let low = moved.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = moved.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        tree.refit((low, high), |i| [moved[order[i] as usize].to_array(); 4]);
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
