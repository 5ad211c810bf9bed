//! The lines of a packet in lanes: N of them are one operand of every operation.

use super::block::{Edges, edges};
use super::lanes::Lanes;
use super::packet::{HitCriteria, Line, Octant};
use glam::Vec3A;

/// N lines of one octant.
#[derive(Clone, Copy)]
pub(super) struct LineGroup<const N: usize> {
    /// Origin plus or minus the boxes' padding: what to subtract from a box's nearer and farther sides.
    from_near: [Lanes<N>; 3],
    from_far: [Lanes<N>; 3],
    inverse: [Lanes<N>; 3],
    /// The shears of N lines, as in [`Shear`](super::block::Shear).
    origin: [Lanes<N>; 3],
    shear: [Lanes<N>; 2],
    scale: Lanes<N>,
    facing: Lanes<N>,
    /// The values of t between which hits are still of interest; an empty interval in lanes without a line.
    behind: Lanes<N>,
    ahead: Lanes<N>,
}

impl<const N: usize> Default for LineGroup<N> {
    #[inline(always)]
    fn default() -> Self {
        let zero = Lanes::splat(0.0);
        Self {
            from_near: [zero; 3],
            from_far: [zero; 3],
            inverse: [zero; 3],
            origin: [zero; 3],
            shear: [zero; 2],
            scale: zero,
            facing: zero,
            behind: zero,
            ahead: zero,
        }
    }
}

impl<const N: usize> LineGroup<N> {
    /// Takes one to N lines; lanes beyond the last line hold that once more.
    #[inline(always)]
    pub(super) fn fill(&mut self, lines: &[Line], octant: Octant, half_extent: Vec3A, criteria: HitCriteria) {
        let (mut origin, mut direction) = ([[0.0; N]; 3], [[0.0; N]; 3]);
        for i in 0..N {
            let line = &lines[i.min(lines.len() - 1)];
            for k in 0..3 {
                origin[k][i] = line.origin[k];
                direction[k][i] = line.direction[k];
            }
        }
        let origin = |k: usize| Lanes::of(origin[k]);
        let direction = |k: usize| Lanes::of(direction[k]);
        // As `LocalRay::new` explains.
        let reach = |k: usize| origin(k).abs() + Lanes::splat(half_extent[k]);
        let padding = reach(0).max(reach(1)).max(reach(2)) * Lanes::splat(16.0 * f32::EPSILON);
        let padding = padding.max(Lanes::splat(1e-30));
        let one = Lanes::splat(1.0);
        for k in 0..3 {
            let (less, more) = (origin(k) - padding, origin(k) + padding);
            (self.from_near[k], self.from_far[k]) = if octant.negative[k] { (less, more) } else { (more, less) };
            let least = Lanes::splat(if octant.negative[k] { -1e-20 } else { 1e-20 });
            let d = direction(k);
            self.inverse[k] = one / d.abs().below(least.abs()).select(least, d);
        }
        let [x, y, z] = octant.axes;
        self.origin = [origin(x), origin(y), origin(z)];
        self.shear = [direction(x) / direction(z), direction(y) / direction(z)];
        self.scale = one / direction(z);
        self.facing = Lanes::splat(criteria.facing) * direction(z);
        let mut ends = [f32::NEG_INFINITY; N];
        ends[..N.min(lines.len())].fill(criteria.reach.next_up());
        self.ahead = Lanes::of(ends);
        self.behind = Lanes::splat(0.0) - self.ahead;
    }

    /// The values of t between which hits are still of interest.
    #[inline(always)]
    pub(super) fn reached(&self) -> ([f32; N], [f32; N]) {
        (self.behind.to_array(), self.ahead.to_array())
    }

    /// Whether any line meets the box between its `behind` and its `ahead`.
    #[inline(always)]
    pub(super) fn meets(&self, near: [f32; 3], far: [f32; 3]) -> bool {
        let enter = |k: usize| (Lanes::splat(near[k]) - self.from_near[k]) * self.inverse[k];
        let leave = |k: usize| (Lanes::splat(far[k]) - self.from_far[k]) * self.inverse[k];
        let first = enter(0).max(enter(1)).max(enter(2)).max(self.behind);
        let last = leave(0).min(leave(1)).min(leave(2)).min(self.ahead);
        first.at_most(last).any()
    }

    /// Tests one triangle, whose corners' coordinates are permuted as the group's axes: the watertight test of
    /// [`TriangleBlock::intersect`](super::block::TriangleBlock), which explains it.
    #[inline(always)]
    pub(super) fn intersect(&mut self, corners: [[f32; 3]; 3], slant: f32, tolerance: f32) {
        let corner = |c: usize| [Lanes::splat(corners[c][0]), Lanes::splat(corners[c][1]), Lanes::splat(corners[c][2])];
        let corners = [corner(0), corner(1), corner(2)];
        let Edges { weights: [u, v, w], z: [az, bz, cz], det, inside } = edges(&corners, &self.origin, &self.shear);
        let zero = Lanes::splat(0.0);
        // In sheared axes, which keep their handedness, a normal as long as the doubled area is large has -det along z:
        // its component along the line, divided by the line's component along z. `slant` is the least component
        // admitted.
        let inside = inside & (self.facing * det + Lanes::splat(slant)).at_most(zero);
        if !inside.any() {
            return;
        }
        let t = self.scale * (u * az + v * bz + w * cz) / det;
        let t = t.abs().at_most(Lanes::splat(tolerance)).select(zero, t);
        let ahead = inside & zero.at_most(t) & t.below(self.ahead);
        self.ahead = ahead.select(t, self.ahead);
        let behind = inside & t.at_most(zero) & self.behind.below(t);
        self.behind = behind.select(t, self.behind);
    }
}
