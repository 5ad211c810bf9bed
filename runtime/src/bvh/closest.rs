//! Closest points.

use super::block::NO_TRIANGLE;
use super::{Bvh, Bvh2Node};
use glam::{DVec3, Vec3A};
use std::ops::{Add, Div, Mul, Sub};

/// The point of a mesh that is closest to a given point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoint {
    /// Distance between the two. Millimetres.
    pub distance: f64,
    /// The point of the mesh. Millimetres.
    pub point: DVec3,
    /// Index of its triangle.
    pub triangle: u32,
    /// Weights of the triangle's corners at that point; they sum to one.
    pub weights: [f64; 3],
}

impl Bvh {
    /// The point of the mesh that is closest to `p`, if it is at most `max_distance` away (which may be infinite).
    /// None also where `p` is not finite.
    #[must_use]
    pub fn closest_point(&self, p: DVec3, max_distance: f64) -> Option<ClosestPoint> {
        self.closest_among(p, max_distance, |_| true)
    }

    /// The closest point among the triangles whose normal (counter-clockwise from outside) makes an angle with
    /// `normal`, which is of unit length, whose cosine is greater than `cosine`; otherwise as
    /// [`closest_point`](Self::closest_point).
    #[must_use]
    pub fn closest_point_facing(
        &self,
        p: DVec3,
        max_distance: f64,
        normal: DVec3,
        cosine: f32,
    ) -> Option<ClosestPoint> {
        let normal = normal.as_vec3a();
        self.closest_among(p, max_distance, |[a, b, c]| {
            let across = (b - a).cross(c - a);
            across.dot(normal) > cosine * across.length()
        })
    }

    /// Calls `visit` for every triangle that is at most `radius` away from `p`, with its closest point.
    pub(crate) fn all_within(&self, p: DVec3, radius: f64, mut visit: impl FnMut(ClosestPoint)) {
        let local = self.to_local(p);
        let reach = (local.abs() + self.half_extent).max_element();
        let limit = (radius as f32 + 4.0 * f32::EPSILON * reach).powi(2);
        // At most one node a level waits beside the one that is visited.
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
                let closest = self.closest_in_triangle(p, block, lane);
                if closest.distance <= radius {
                    visit(closest);
                }
            }
        }
    }

    /// The point of one triangle that is closest to `p`.
    fn closest_in_triangle(&self, p: DVec3, block: usize, lane: usize) -> ClosestPoint {
        let p = p - self.centre;
        let corners = self.blocks[block].triangle(lane).map(|c| c.as_dvec3());
        let [a, b, c] = corners.map(|corner| corner - p);
        let (ab, ac) = (b - a, c - a);
        let weights = closest_weights([a, b, c].map(|from| [-ab.dot(from), -ac.dot(from)]));
        let nearest = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
        ClosestPoint {
            distance: (nearest - p).length(),
            point: nearest + self.centre,
            triangle: self.tree.primitive_indices[4 * block + lane],
            weights,
        }
    }

    fn closest_among(&self, p: DVec3, max_distance: f64, admits: impl Fn([Vec3A; 3]) -> bool) -> Option<ClosestPoint> {
        if !p.is_finite() || max_distance.is_nan() || max_distance < 0.0 {
            return None;
        }
        let local = self.to_local(p);
        // Rounding must not exclude what lies at the very limit; the comparison at the end is exact.
        let reach = (local.abs() + self.half_extent).max_element();
        let slack = 4.0 * f64::from(f32::EPSILON) * f64::from(reach);
        let limit = (max_distance + slack) as f32;
        let (block, lane) = self.closest_triangle(local, reach, limit * limit, admits)?;
        let closest = self.closest_in_triangle(p, block, lane);
        (closest.distance <= max_distance).then_some(closest)
    }

    /// Block and lane of the triangle closest to `p` among those that `admits` admits, if its squared distance is at
    /// most `limit`. `reach` is the largest distance along an axis from `p` to the mesh's corners.
    fn closest_triangle(
        &self,
        p: Vec3A,
        reach: f32,
        limit: f32,
        admits: impl Fn([Vec3A; 3]) -> bool,
    ) -> Option<(usize, usize)> {
        // All distances become at most about one, so that fourth powers neither overflow nor vanish.
        let scale = 1.0 / reach.max(f32::MIN_POSITIVE);
        let mut best = None;
        let test_leaf = |leaf: &Bvh2Node, mut limit: f32| {
            let block = (leaf.first_index / 4) as usize;
            for lane in 0..leaf.prim_count as usize {
                debug_assert_ne!(self.tree.primitive_indices[4 * block + lane], NO_TRIANGLE);
                let triangle = self.blocks[block].triangle(lane);
                let squared = squared_distance(p, scale, triangle);
                if (squared < limit || best.is_none() && squared <= limit) && admits(triangle) {
                    limit = squared;
                    best = Some((block, lane));
                }
            }
            limit
        };
        self.visit_leaves(limit, |node, _| squared_to_box(p, node), test_leaf);
        best
    }
}

fn squared_to_box(p: Vec3A, node: &Bvh2Node) -> f32 {
    let aabb = node.aabb();
    (p - p.max(aabb.min).min(aabb.max)).length_squared()
}

fn squared_distance(p: Vec3A, scale: f32, corners: [Vec3A; 3]) -> f32 {
    // Relative to the point, so that nearby triangles lose no digits.
    let [a, b, c] = corners.map(|corner| corner - p);
    let (sa, sb, sc) = (a * scale, b * scale, c * scale);
    let (ab, ac) = (sb - sa, sc - sa);
    let [wa, wb, wc] = closest_weights([sa, sb, sc].map(|from| [-ab.dot(from), -ac.dot(from)]));
    (a * wa + b * wb + c * wc).length_squared()
}

/// Weights of the corners a, b and c at the point of a triangle that is closest to a point p, by regions (Ericson,
/// 'Real-Time Collision Detection', sect. 5.1.5); they sum to one. `dots` holds, for each corner q, the products of
/// p - q with the edges from a to b and from a to c. Triangles without area are segments or points; numbers that are
/// not finite give weights that are not.
#[inline(always)]
pub(crate) fn closest_weights<T>(dots: [[T; 2]; 3]) -> [T; 3]
where
    T: Copy + PartialOrd + From<u8> + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Div<Output = T>,
{
    let (zero, one) = (T::from(0), T::from(1));
    let [[d1, d2], [d3, d4], [d5, d6]] = dots;
    if d1 <= zero && d2 <= zero {
        return [one, zero, zero];
    }
    if d3 >= zero && d4 <= d3 {
        return [zero, one, zero];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= zero && d1 >= zero && d3 <= zero {
        let v = d1 / (d1 - d3);
        return [one - v, v, zero];
    }
    if d6 >= zero && d5 <= d6 {
        return [zero, zero, one];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= zero && d2 >= zero && d6 <= zero {
        let w = d2 / (d2 - d6);
        return [one - w, zero, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= zero && d4 >= d3 && d5 >= d6 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [zero, one - w, w];
    }
    let sum = va + vb + vc;
    // Only rounding brings a triangle without area here.
    if sum <= zero { [one, zero, zero] } else { [va / sum, vb / sum, vc / sum] }
}
