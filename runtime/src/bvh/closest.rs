//! Closest points.

use super::block::NO_TRIANGLE;
use super::{Bvh, MAX_DEPTH};
use glam::{DVec3, Vec3A};
use obvhs::bvh2::node::Bvh2Node;

/// The point of a mesh that is closest to a given point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoint {
    /// How far away it is. Millimetres.
    pub distance: f64,
    /// Where it is. Millimetres.
    pub point: [f64; 3],
    /// Index of its triangle.
    pub triangle: u32,
    /// Weights of the triangle's corners at that point; they sum to one.
    pub weights: [f64; 3],
}

impl Bvh {
    /// The point of the mesh that is closest to `p`, if it is at most `max_distance` away (which may be infinite).
    /// None also where `p` is not finite.
    #[must_use]
    pub fn closest_point(&self, p: [f64; 3], max_distance: f64) -> Option<ClosestPoint> {
        self.closest_among(p, max_distance, |_| true)
    }

    /// Likewise among the triangles whose normal (counter-clockwise from outside) makes less than a right angle with `normal`.
    #[must_use]
    pub fn closest_point_facing(&self, p: [f64; 3], max_distance: f64, normal: [f64; 3]) -> Option<ClosestPoint> {
        self.closest_point_within(p, max_distance, normal, Some(0.0))
    }

    /// Likewise, where the cosine of the angle between the normals must exceed a limit; any triangle where there is none. `normal` is of
    /// unit length.
    #[must_use]
    pub(crate) fn closest_point_within(
        &self,
        p: [f64; 3],
        max_distance: f64,
        normal: [f64; 3],
        cosine: Option<f32>,
    ) -> Option<ClosestPoint> {
        let Some(cosine) = cosine else { return self.closest_point(p, max_distance) };
        let normal = Vec3A::from_array(normal.map(|c| c as f32));
        self.closest_among(p, max_distance, |[a, b, c]| {
            let across = (b - a).cross(c - a);
            across.dot(normal) > cosine * across.length()
        })
    }

    /// Calls `visit` for every triangle that is at most `radius` away from `p`, with its closest point.
    pub(crate) fn all_within(&self, p: [f64; 3], radius: f64, mut visit: impl FnMut(ClosestPoint)) {
        let local = self.to_local(p);
        let reach = (local.abs() + self.half_extent).max_element();
        let limit = (radius as f32 + 4.0 * f32::EPSILON * reach).powi(2);
        let origin = DVec3::from(p) - DVec3::from(self.center);
        // Of every level at most one node waits beside the one whose turn it is.
        let mut open: Vec<u32> = if self.tree.nodes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(index) = open.pop() {
            let node = &self.tree.nodes[index as usize];
            // Written so that NaN ends here.
            if !(squared_to_box(local, node) <= limit) {
                continue;
            }
            if !node.is_leaf() {
                open.extend([node.first_index + 1, node.first_index]);
                continue;
            }
            let block = (node.first_index / 4) as usize;
            for lane in 0..node.prim_count as usize {
                let found = self.closest_in_triangle(origin, block, lane);
                if found.distance <= radius {
                    visit(found);
                }
            }
        }
    }

    /// The point of one triangle that is closest to `origin`, which is relative to the centre.
    fn closest_in_triangle(&self, origin: DVec3, block: usize, lane: usize) -> ClosestPoint {
        let corners = self.blocks[block].triangle(lane).map(|c| c.as_dvec3());
        let weights = closest_weights(origin, corners);
        let nearest = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
        ClosestPoint {
            distance: (nearest - origin).length(),
            point: (nearest + DVec3::from(self.center)).to_array(),
            triangle: self.tree.primitive_indices[4 * block + lane],
            weights,
        }
    }

    fn closest_among(
        &self,
        p: [f64; 3],
        max_distance: f64,
        among: impl Fn([Vec3A; 3]) -> bool,
    ) -> Option<ClosestPoint> {
        if !p.iter().all(|x| x.is_finite()) || max_distance.is_nan() || max_distance < 0.0 {
            return None;
        }
        let local = self.to_local(p);
        // Rounding must not exclude what lies at the very limit; the comparison at the end is exact.
        let reach = (local.abs() + self.half_extent).max_element();
        let slack = 4.0 * f64::from(f32::EPSILON) * f64::from(reach);
        let limit = (max_distance + slack) as f32;
        let scale = 1.0 / reach.max(f32::MIN_POSITIVE);
        let (block, lane) = self.closest_triangle(local, scale, limit * limit, among)?;
        let origin = DVec3::from(p) - DVec3::from(self.center);
        let found = self.closest_in_triangle(origin, block, lane);
        (found.distance <= max_distance).then_some(found)
    }

    /// Block and lane of the triangle closest to `p` among those that `among` admits, if its squared distance is at most `best`. `scale` brings all
    /// distances to at most about one, so that fourth powers neither overflow nor vanish.
    fn closest_triangle(
        &self,
        p: Vec3A,
        scale: f32,
        mut best: f32,
        among: impl Fn([Vec3A; 3]) -> bool,
    ) -> Option<(usize, usize)> {
        let nodes = &self.tree.nodes[..];
        let mut found = None;
        let mut test_leaf = |node: &Bvh2Node, best: &mut f32| {
            let block = (node.first_index / 4) as usize;
            for lane in 0..node.prim_count as usize {
                debug_assert_ne!(self.tree.primitive_indices[4 * block + lane], NO_TRIANGLE);
                let triangle = self.blocks[block].triangle(lane);
                let squared = squared_distance(p, scale, triangle);
                if !among(triangle) {
                    continue;
                }
                if squared < *best || found.is_none() && squared <= *best {
                    *best = squared;
                    found = Some((block, lane));
                }
            }
        };
        let root = nodes.first()?;
        let mut stack = [(0u32, 0f32); MAX_DEPTH];
        let mut height = 0;
        let mut pair = if root.is_leaf() {
            test_leaf(root, &mut best);
            None
        } else {
            Some(root.first_index)
        };
        while let Some(first) = pair {
            let (mut near, mut far) = (&nodes[first as usize], &nodes[first as usize + 1]);
            let (mut d_near, mut d_far) = (squared_to_box(p, near), squared_to_box(p, far));
            if d_near > d_far {
                std::mem::swap(&mut near, &mut far);
                std::mem::swap(&mut d_near, &mut d_far);
            }
            pair = None;
            if d_near <= best {
                if near.is_leaf() {
                    test_leaf(near, &mut best);
                } else {
                    pair = Some(near.first_index);
                }
            }
            if d_far <= best {
                if far.is_leaf() {
                    test_leaf(far, &mut best);
                } else if pair.is_some() {
                    stack[height] = (far.first_index, d_far);
                    height += 1;
                } else {
                    pair = Some(far.first_index);
                }
            }
            while pair.is_none() && height > 0 {
                height -= 1;
                let (first, squared) = stack[height];
                if squared <= best {
                    pair = Some(first);
                }
            }
        }
        found
    }
}

fn squared_to_box(p: Vec3A, node: &Bvh2Node) -> f32 {
    let aabb = node.aabb();
    (p - p.max(aabb.min).min(aabb.max)).length_squared()
}

fn squared_distance(p: Vec3A, scale: f32, corners: [Vec3A; 3]) -> f32 {
    // Relative to the point, so that nearby triangles lose no digits.
    let [a, b, c] = corners.map(|corner| corner - p);
    let [wa, wb, wc] = closest_weights_f32(a * scale, b * scale, c * scale);
    (a * wa + b * wb + c * wc).length_squared()
}

/// Weights of the corners at the point of a triangle closest to `p`, by regions (Ericson, 'Real-Time Collision
/// Detection', sect. 5.1.5). Triangles without area are segments or points.
macro_rules! closest_weights_by_region {
    ($zero:expr, $one:expr, $a:expr, $b:expr, $c:expr) => {{
        let (a, b, c) = ($a, $b, $c);
        let (ab, ac) = (b - a, c - a);
        let (d1, d2) = (-ab.dot(a), -ac.dot(a));
        let (d3, d4) = (-ab.dot(b), -ac.dot(b));
        let (d5, d6) = (-ab.dot(c), -ac.dot(c));
        let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
        let (zero, one) = ($zero, $one);
        if d1 <= zero && d2 <= zero {
            [one, zero, zero]
        } else if d3 >= zero && d4 <= d3 {
            [zero, one, zero]
        } else if d6 >= zero && d5 <= d6 {
            [zero, zero, one]
        } else if vc <= zero && d1 >= zero && d3 <= zero {
            let v = d1 / (d1 - d3);
            [one - v, v, zero]
        } else if vb <= zero && d2 >= zero && d6 <= zero {
            let w = d2 / (d2 - d6);
            [one - w, zero, w]
        } else if va <= zero && d4 >= d3 && d5 >= d6 {
            let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
            [zero, one - w, w]
        } else {
            let sum = va + vb + vc;
            // Only rounding brings a triangle without area here.
            if sum > zero { [va / sum, vb / sum, vc / sum] } else { [one, zero, zero] }
        }
    }};
}

fn closest_weights_f32(a: Vec3A, b: Vec3A, c: Vec3A) -> [f32; 3] {
    closest_weights_by_region!(0.0f32, 1.0f32, a, b, c)
}

fn closest_weights(p: DVec3, corners: [DVec3; 3]) -> [f64; 3] {
    let [a, b, c] = corners.map(|corner| corner - p);
    closest_weights_by_region!(0.0f64, 1.0f64, a, b, c)
}
