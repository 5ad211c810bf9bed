//! Up to four triangles tested at once.

use glam::{BVec4A, Vec3A, Vec4};

/// In place of a triangle's index where a leaf has fewer than four.
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
    origin: [Vec4; 3],
    shear: [Vec4; 2],
    scale: Vec4,
}

/// Where a ray meets a triangle of a block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockHit {
    pub(crate) lane: usize,
    pub(crate) t: f32,
    pub(crate) weights: [f32; 3],
}

impl Shear {
    /// Of a ray with finite origin and finite, nonzero direction.
    pub(crate) fn new(origin: Vec3A, direction: Vec3A) -> Self {
        let (o, d) = (origin.to_array(), direction.to_array());
        let z = (1..3).fold(0, |best, k| if d[k].abs() > d[best].abs() { k } else { best });
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        Self {
            axes,
            origin: axes.map(|k| Vec4::splat(o[k])),
            shear: [Vec4::splat(d[axes[0]] / d[z]), Vec4::splat(d[axes[1]] / d[z])],
            scale: Vec4::splat(1.0 / d[z]),
        }
    }
}

/// What the watertight test of [`TriangleBlock::intersect`] knows before it looks for the place, of four pairs of a line and a
/// triangle.
pub(super) struct Edges {
    /// Doubled areas that a line cuts off: weights of the corners when divided by `det`.
    pub(super) weights: [Vec4; 3],
    /// The corners' distances from the origin along the last axis.
    pub(super) z: [Vec4; 3],
    /// Sum of the weights.
    pub(super) det: Vec4,
    /// Whether a line goes through its triangle.
    pub(super) inside: BVec4A,
}

/// Of corners, an origin and a shear whose axes are permuted as in [`Shear`].
#[inline(always)]
pub(super) fn edges(corners: &[[Vec4; 3]; 3], origin: &[Vec4; 3], shear: &[Vec4; 2]) -> Edges {
    let [ox, oy, oz] = *origin;
    let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = [0, 1, 2].map(|i| {
        let z = corners[i][2] - oz;
        [corners[i][0] - ox - shear[0] * z, corners[i][1] - oy - shear[1] * z, z]
    });
    let u = cx * by - cy * bx;
    let v = ax * cy - ay * cx;
    let w = bx * ay - by * ax;
    let low = u.min(v).min(w);
    let high = u.max(v).max(w);
    let det = u + v + w;
    let inside = (low.cmpge(Vec4::ZERO) | high.cmple(Vec4::ZERO)) & det.cmpne(Vec4::ZERO);
    Edges { weights: [u, v, w], z: [az, bz, cz], det, inside }
}

impl TriangleBlock {
    /// The triangles whose indices `leaf` names; `corners` gives a triangle's corners.
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

    /// The nearest hit with t in [t_min, t_max].
    ///
    /// Watertight (Woop, Benthin, Wald, 'Watertight Ray/Triangle Intersection', JCGT 2(1), 2013): a corner's sheared
    /// position does not depend on its triangle, and the sign of a difference of two rounded products is that of the
    /// exact difference, or zero. Zero counts as inside, so that of two triangles at an edge at least one is hit;
    /// the paper's recomputation in double precision is needed only where at most one must be.
    #[inline]
    pub(crate) fn intersect(&self, ray: &Shear, t_min: f32, t_max: f32) -> Option<BlockHit> {
        let corners = self.corners.map(|corner| ray.axes.map(|k| corner[k]));
        let Edges { weights: [u, v, w], z: [az, bz, cz], det, inside } = edges(&corners, &ray.origin, &ray.shear);
        if !inside.any() {
            return None;
        }
        let t = ray.scale * (u * az + v * bz + w * cz) / det;
        let hit: BVec4A = inside & t.cmpge(Vec4::splat(t_min)) & t.cmple(Vec4::splat(t_max));
        if !hit.any() {
            return None;
        }
        let t = Vec4::select(hit, t, Vec4::INFINITY);
        let lane = (1..4).fold(0, |best, i| if t[i] < t[best] { i } else { best });
        Some(BlockHit { lane, t: t[lane], weights: [u[lane], v[lane], w[lane]].map(|x| x / det[lane]) })
    }
}
