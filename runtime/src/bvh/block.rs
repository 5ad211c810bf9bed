//! Up to four triangles tested at once.

use super::lanes::{Lanes, Mask};
use glam::{Vec3A, Vec4};

/// The entry in place of a triangle's index where a leaf has fewer than four.
pub(crate) const NO_TRIANGLE: u32 = u32::MAX;

/// The triangles of one leaf, coordinate by coordinate: `corners[c][k]` holds coordinate k of corner c of all four.
/// Places without a triangle have three equal corners, which no ray hits.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct TriangleBlock {
    pub(crate) corners: [[Vec4; 3]; 3],
}

/// A ray as the watertight test wants it: the axes permuted so that z is where the direction is largest, and the
/// shear and scale that turn the direction into (0, 0, 1).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shear {
    axes: [usize; 3],
    origin: [Lanes<4>; 3],
    shear: [Lanes<4>; 2],
    scale: Lanes<4>,
}

/// The axes, permuted so that the direction is largest along the last.
pub(super) fn shear_axes(direction: Vec3A) -> [usize; 3] {
    let d = direction.to_array();
    let z = (1..3).fold(0, |best, k| if d[k].abs() > d[best].abs() { k } else { best });
    [(z + 1) % 3, (z + 2) % 3, z]
}

impl Shear {
    /// The shear of a ray with finite origin and finite, nonzero direction.
    pub(crate) fn new(origin: Vec3A, direction: Vec3A) -> Self {
        let (o, d, axes) = (origin.to_array(), direction.to_array(), shear_axes(direction));
        let z = axes[2];
        Self {
            axes,
            origin: axes.map(|k| Lanes::splat(o[k])),
            shear: [Lanes::splat(d[axes[0]] / d[z]), Lanes::splat(d[axes[1]] / d[z])],
            scale: Lanes::splat(1.0 / d[z]),
        }
    }
}

/// The edge functions of the watertight test of [`TriangleBlock::intersect`], of N pairs of a line and a triangle.
pub(super) struct Edges<const N: usize> {
    /// The doubled areas that a line cuts off: weights of the corners when divided by `det`.
    pub(super) weights: [Lanes<N>; 3],
    /// The corners' distances from the origin along the last axis.
    pub(super) z: [Lanes<N>; 3],
    /// The sum of the weights.
    pub(super) det: Lanes<N>,
    /// Whether a line goes through its triangle.
    pub(super) inside: Mask<N>,
}

/// The edge functions of corners, an origin and a shear whose axes are permuted as in [`Shear`].
#[inline(always)]
pub(super) fn edges<const N: usize>(
    corners: &[[Lanes<N>; 3]; 3],
    origin: &[Lanes<N>; 3],
    shear: &[Lanes<N>; 2],
) -> Edges<N> {
    let [ox, oy, oz] = *origin;
    // Written out, since `map` on arrays is not always inlined into code for other processors.
    let sheared = |c: usize| {
        let z = corners[c][2] - oz;
        (corners[c][0] - ox - shear[0] * z, corners[c][1] - oy - shear[1] * z, z)
    };
    let ((ax, ay, az), (bx, by, bz), (cx, cy, cz)) = (sheared(0), sheared(1), sheared(2));
    let u = cx * by - cy * bx;
    let v = ax * cy - ay * cx;
    let w = bx * ay - by * ax;
    let zero = Lanes::splat(0.0);
    let low = u.min(v).min(w);
    let high = u.max(v).max(w);
    let det = u + v + w;
    let inside = (zero.at_most(low) | high.at_most(zero)) & det.differs(zero);
    Edges { weights: [u, v, w], z: [az, bz, cz], det, inside }
}

impl TriangleBlock {
    /// The block of the triangles whose indices `leaf` names; `corners` gives a triangle's corners.
    pub(crate) fn new(leaf: &[u32], corners: impl Fn(usize) -> [Vec3A; 3]) -> Self {
        let mut block = Self::default();
        for (lane, &triangle) in leaf.iter().enumerate() {
            if triangle != NO_TRIANGLE {
                for (c, corner) in corners(triangle as usize).iter().enumerate() {
                    for k in 0..3 {
                        block.corners[c][k][lane] = corner[k];
                    }
                }
            }
        }
        block
    }

    /// The corners of one triangle.
    pub(crate) fn triangle(&self, lane: usize) -> [Vec3A; 3] {
        self.corners.map(|c| Vec3A::new(c[0][lane], c[1][lane], c[2][lane]))
    }

    /// The nearest hit with t in [t_min, t_max]: the triangle's lane, and t.
    ///
    /// Watertight (Woop, Benthin, Wald, 'Watertight Ray/Triangle Intersection', JCGT 2(1), 2013): a corner's sheared
    /// position does not depend on its triangle, and the sign of a difference of two rounded products is that of the
    /// exact difference, or zero. Zero counts as inside, so that of two triangles at an edge at least one is hit;
    /// the paper's recomputation in double precision is needed only where at most one must be.
    #[inline]
    pub(crate) fn intersect(&self, ray: &Shear, t_min: f32, t_max: f32) -> Option<(usize, f32)> {
        let corners = self.corners.map(|corner| ray.axes.map(|k| Lanes::from(corner[k])));
        let Edges { weights: [u, v, w], z: [az, bz, cz], det, inside } = edges(&corners, &ray.origin, &ray.shear);
        if !inside.any() {
            return None;
        }
        let t = ray.scale * (u * az + v * bz + w * cz) / det;
        let hit = inside & Lanes::splat(t_min).at_most(t) & t.at_most(Lanes::splat(t_max));
        if !hit.any() {
            return None;
        }
        let t = hit.select(t, Lanes::splat(f32::INFINITY)).to_array();
        let lane = (1..4).fold(0, |best, i| if t[i] < t[best] { i } else { best });
        Some((lane, t[lane]))
    }
}
