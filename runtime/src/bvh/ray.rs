//! Nearest hits, and the order in which the leaves of the tree are visited.

use super::block::Shear;
use super::{Bvh, Bvh2Node, MAX_DEPTH};
use glam::{DVec3, Vec3A, Vec4};

/// The point where a ray meets a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// origin + t direction is the point that is hit.
    pub t: f64,
    /// Index of the triangle.
    pub triangle: u32,
}

/// A ray in single precision, relative to the mesh's centre, made ready for traversal.
#[derive(Clone, Copy, Debug)]
struct LocalRay {
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
    fn new(origin: Vec3A, direction: Vec3A, half_extent: Vec3A) -> Self {
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

    /// The t at which the ray enters a box, at least `t_min`, if it does so before `t_max`; else NaN.
    #[inline]
    fn enter(&self, node: &Bvh2Node, t_min: f32, t_max: f32) -> f32 {
        let [low, high]: &[Vec4; 2] = bytemuck::cast_ref(node);
        let a = (*low - self.from_low) * self.inverse;
        let b = (*high - self.from_high) * self.inverse;
        let near = Vec3A::from_vec4(a.min(b)).max_element().max(t_min);
        let far = Vec3A::from_vec4(a.max(b)).min_element().min(t_max);
        if near <= far { near } else { f32::NAN }
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
    pub fn nearest_hit(&self, origin: DVec3, direction: DVec3, max_t: f64) -> Option<Hit> {
        let largest = direction.abs().max_element();
        if !origin.is_finite() || !direction.is_finite() || largest <= 0.0 || max_t.is_nan() {
            return None;
        }
        let direction = direction / largest;
        let max_t = max_t * largest;
        let relative = origin - self.centre;
        let (enter, leave) = self.clip(relative, direction, max_t)?;
        let start = (relative + enter * direction).as_vec3a();
        let ray = LocalRay::new(start, direction.as_vec3a(), self.half_extent);
        let (t, triangle) = self.cast(&ray, -enter as f32, (leave - enter) as f32)?;
        Some(Hit { t: (enter + f64::from(t)).clamp(0.0, max_t) / largest, triangle })
    }

    /// The part of [0, max_t] in which the ray is within twice the mesh's bounding box.
    fn clip(&self, origin: DVec3, direction: DVec3, max_t: f64) -> Option<(f64, f64)> {
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

    /// The nearest hit with t in [t_min, t_max]: t and the triangle's index.
    fn cast(&self, ray: &LocalRay, t_min: f32, t_max: f32) -> Option<(f32, u32)> {
        let mut best = None;
        let test_leaf = |leaf: &Bvh2Node, t_max: f32| {
            let Some((lane, t)) = self.blocks[(leaf.first_index / 4) as usize].intersect(&ray.shear, t_min, t_max)
            else {
                return t_max;
            };
            // The first of several hits at the same t stays, so that the order of traversal decides nothing else.
            if best.is_none() || t < t_max {
                best = Some((t, self.tree.primitive_indices[leaf.first_index as usize + lane]));
            }
            t
        };
        self.visit_leaves(t_max, |node, t_max| ray.enter(node, t_min, t_max), test_leaf);
        best
    }

    /// Visits leaves depth first, of two children the nearer one first. `distance` is how far a node's box is, NaN
    /// where nothing in it is to be visited; boxes beyond the limit are left out. `visit` gets a leaf and the limit,
    /// and returns the limit from then on, which is not greater.
    #[inline(always)]
    pub(super) fn visit_leaves(
        &self,
        mut limit: f32,
        distance: impl Fn(&Bvh2Node, f32) -> f32,
        mut visit: impl FnMut(&Bvh2Node, f32) -> f32,
    ) {
        let nodes = &self.tree.nodes[..];
        let Some(root) = nodes.first() else { return };
        if root.is_leaf() {
            visit(root, limit);
            return;
        }
        let mut stack = [(0u32, 0f32); MAX_DEPTH];
        let mut height = 0;
        let mut pair = Some(root.first_index);
        while let Some(first) = pair.take() {
            let (mut near, mut far) = (&nodes[first as usize], &nodes[first as usize + 1]);
            let (mut to_near, mut to_far) = (distance(near, limit), distance(far, limit));
            if to_near > to_far {
                std::mem::swap(&mut near, &mut far);
                std::mem::swap(&mut to_near, &mut to_far);
            }
            if to_near <= limit {
                if near.is_leaf() {
                    limit = visit(near, limit);
                } else {
                    pair = Some(near.first_index);
                }
            }
            if to_far <= limit {
                if far.is_leaf() {
                    limit = visit(far, limit);
                } else if pair.is_some() {
                    stack[height] = (far.first_index, to_far);
                    height += 1;
                } else {
                    pair = Some(far.first_index);
                }
            }
            while pair.is_none() && height > 0 {
                height -= 1;
                let (first, squared) = stack[height];
                if squared <= limit {
                    pair = Some(first);
                }
            }
        }
    }
}
