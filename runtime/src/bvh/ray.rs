//! Nearest hits.

use super::block::Shear;
use super::{Bvh, MAX_DEPTH};
use glam::{Vec3A, Vec4};
use obvhs::bvh2::node::Bvh2Node;

/// Where a ray meets a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// origin + t direction is the point that is hit.
    pub t: f64,
    /// Index of the triangle.
    pub triangle: u32,
    /// Weights of the triangle's corners at that point; they sum to one.
    pub weights: [f64; 3],
}

/// A hit in single precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalHit {
    pub(crate) t: f32,
    pub(crate) triangle: u32,
    pub(crate) weights: [f32; 3],
}

/// A ray in single precision, relative to the mesh's centre, made ready for traversal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalRay {
    shear: Shear,
    /// Origin plus and minus the boxes' padding: what to subtract from their lower and upper corners.
    from_low: Vec4,
    from_high: Vec4,
    inverse: Vec4,
}

impl LocalRay {
    /// A ray from `origin` over a mesh with the given half sides. Both must be finite, the direction not zero.
    ///
    /// Boxes are padded by 32 roundings of the largest distance from the origin to the mesh's corners: more than the
    /// shear and the slab test are off together (10 and 3 roundings), so that no box is missed whose triangle is hit.
    pub(crate) fn new(origin: Vec3A, direction: Vec3A, half_extent: Vec3A) -> Self {
        let reach = (origin.abs() + half_extent).max_element();
        let padding = Vec3A::splat((reach * (16.0 * f32::EPSILON)).max(1e-30));
        // The last coordinate makes the counts in the nodes' fourth places harmless: they become (0 - 1) * 0.
        let inverse = direction.to_array().map(|d| 1.0 / if d.abs() < 1e-20 { 1e-20f32.copysign(d) } else { d });
        Self {
            shear: Shear::new(origin, direction),
            from_low: (origin + padding).extend(1.0),
            from_high: (origin - padding).extend(1.0),
            inverse: Vec3A::from_array(inverse).extend(0.0),
        }
    }

    /// Where the ray enters a box, at least `t_min`, if it does so before `t_max`; else infinity.
    #[inline]
    fn enter(&self, node: &Bvh2Node, t_min: f32, t_max: f32) -> f32 {
        let [low, high]: &[Vec4; 2] = bytemuck::cast_ref(node);
        let a = (*low - self.from_low) * self.inverse;
        let b = (*high - self.from_high) * self.inverse;
        let near = Vec3A::from_vec4(a.min(b)).max_element().max(t_min);
        let far = Vec3A::from_vec4(a.max(b)).min_element().min(t_max);
        if near <= far { near } else { f32::INFINITY }
    }
}

impl Bvh {
    /// The nearest point with t in [0, `max_t`] where the ray meets the mesh, from either side of its triangles.
    /// `direction` need not be of unit length; t counts in its multiples. None also where the origin or direction is
    /// not finite, or the direction zero.
    ///
    /// A ray through an edge or a vertex that triangles share hits at least one of them. A triangle seen exactly
    /// edge-on, or without area, is not hit. Depth first, front to back (Schinko et al., alg. 2). The origin is
    /// first moved along the ray to the mesh's bounding box, so that it may lie far away.
    #[must_use]
    pub fn nearest_hit(&self, origin: [f64; 3], direction: [f64; 3], max_t: f64) -> Option<Hit> {
        let largest = direction.iter().fold(0.0f64, |m, d| m.max(d.abs()));
        if !origin.iter().chain(&direction).all(|x| x.is_finite()) || largest <= 0.0 || max_t.is_nan() {
            return None;
        }
        let direction = direction.map(|d| d / largest);
        let max_t = max_t * largest;
        let relative: [f64; 3] = std::array::from_fn(|k| origin[k] - self.center[k]);
        let (enter, leave) = self.clip(relative, direction, max_t)?;
        let start = Vec3A::from_array(std::array::from_fn(|k| (relative[k] + enter * direction[k]) as f32));
        let ray = LocalRay::new(start, Vec3A::from_array(direction.map(|d| d as f32)), self.half_extent);
        let hit = self.cast(&ray, -enter as f32, (leave - enter) as f32)?;
        let t = (enter + f64::from(hit.t)).clamp(0.0, max_t);
        let weights = hit.weights.map(f64::from);
        let sum: f64 = weights.iter().sum();
        Some(Hit { t: t / largest, triangle: hit.triangle, weights: weights.map(|w| w / sum) })
    }

    /// The part of [0, max_t] in which the ray is within twice the mesh's bounding box.
    fn clip(&self, origin: [f64; 3], direction: [f64; 3], max_t: f64) -> Option<(f64, f64)> {
        let (mut enter, mut leave) = (0.0f64, max_t);
        let reach = 2.0 * f64::from(self.half_extent.max_element());
        for k in 0..3 {
            if direction[k] == 0.0 {
                if origin[k].abs() > reach {
                    return None;
                }
            } else {
                let (a, b) = ((-reach - origin[k]) / direction[k], (reach - origin[k]) / direction[k]);
                enter = enter.max(a.min(b));
                leave = leave.min(a.max(b));
            }
        }
        (enter <= leave).then_some((enter, leave))
    }

    /// The nearest hit with t in [t_min, t_max].
    pub(crate) fn cast(&self, ray: &LocalRay, t_min: f32, t_max: f32) -> Option<LocalHit> {
        let nodes = &self.tree.nodes[..];
        let mut best: Option<LocalHit> = None;
        let mut t_max = t_max;
        let mut test_leaf = |node: &Bvh2Node, t_max: &mut f32| {
            let block = (node.first_index / 4) as usize;
            if let Some(hit) = self.blocks[block].intersect(&ray.shear, t_min, *t_max) {
                // Of hits at the same t the first found stays, so that the order of traversal decides nothing else.
                if best.is_none() || hit.t < *t_max {
                    *t_max = hit.t;
                    let triangle = self.tree.primitive_indices[node.first_index as usize + hit.lane];
                    best = Some(LocalHit { t: hit.t, triangle, weights: hit.weights });
                }
            }
        };
        let root = nodes.first()?;
        let mut stack = [(0u32, 0f32); MAX_DEPTH];
        let mut height = 0;
        let mut pair = if root.is_leaf() {
            test_leaf(root, &mut t_max);
            None
        } else {
            Some(root.first_index)
        };
        while let Some(first) = pair {
            let children = &nodes[first as usize..first as usize + 2];
            let (mut near, mut far) = (&children[0], &children[1]);
            let mut t_near = ray.enter(near, t_min, t_max);
            let mut t_far = ray.enter(far, t_min, t_max);
            if t_near > t_far {
                std::mem::swap(&mut near, &mut far);
                std::mem::swap(&mut t_near, &mut t_far);
            }
            pair = None;
            if t_near < f32::INFINITY {
                if near.is_leaf() {
                    test_leaf(near, &mut t_max);
                } else {
                    pair = Some(near.first_index);
                }
            }
            if t_far <= t_max && t_far < f32::INFINITY {
                if far.is_leaf() {
                    test_leaf(far, &mut t_max);
                } else if pair.is_some() {
                    stack[height] = (far.first_index, t_far);
                    height += 1;
                } else {
                    pair = Some(far.first_index);
                }
            }
            while pair.is_none() && height > 0 {
                height -= 1;
                let (first, t) = stack[height];
                if t <= t_max {
                    pair = Some(first);
                }
            }
        }
        best
    }
}
