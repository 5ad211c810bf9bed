//! The lines of a packet side by side: N of them are one operand of every operation.

use super::block::{Edges, edges};
use super::lanes::Lanes;
use super::packet::{Line, Octant, PACKET, Search};
use glam::Vec3A;

/// The lines of a packet, coordinate by coordinate; places beyond the last hold the first once more.
pub(super) struct Lines {
    pub(super) count: usize,
    origin: [[f32; PACKET]; 3],
    direction: [[f32; PACKET]; 3],
}

/// N lines of one octant.
#[derive(Clone, Copy)]
pub(super) struct Group<const N: usize> {
    /// Origin plus or minus the boxes' padding: what to subtract from a box's nearer and farther sides.
    from_near: [Lanes<N>; 3],
    from_far: [Lanes<N>; 3],
    inverse: [Lanes<N>; 3],
    /// As in [`Shear`](super::block::Shear), of N lines.
    origin: [Lanes<N>; 3],
    shear: [Lanes<N>; 2],
    scale: Lanes<N>,
    facing: Lanes<N>,
    /// t between which hits are still of interest; empty where the place holds no line.
    behind: Lanes<N>,
    ahead: Lanes<N>,
}

impl Lines {
    /// Of one to [`PACKET`] lines.
    pub(super) fn new(lines: &[Line]) -> Self {
        let mut all = Self { count: lines.len(), origin: [[0.0; PACKET]; 3], direction: [[0.0; PACKET]; 3] };
        for i in 0..PACKET {
            let Line { origin, direction } = if i < lines.len() { lines[i] } else { lines[0] };
            for k in 0..3 {
                all.origin[k][i] = origin[k];
                all.direction[k][i] = direction[k];
            }
        }
        all
    }

    pub(super) fn first_origin(&self) -> Vec3A {
        Vec3A::new(self.origin[0][0], self.origin[1][0], self.origin[2][0])
    }
}

impl<const N: usize> Default for Group<N> {
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

impl<const N: usize> Group<N> {
    /// Takes the lines from `first` on.
    #[inline(always)]
    pub(super) fn fill(&mut self, lines: &Lines, first: usize, octant: Octant, half_extent: Vec3A, search: Search) {
        let origin = |k: usize| Lanes::<N>::load(&lines.origin[k], first);
        let direction = |k: usize| Lanes::<N>::load(&lines.direction[k], first);
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
        self.facing = Lanes::splat(search.facing) * direction(z);
        let mut ends = [f32::NEG_INFINITY; N];
        ends[..N.min(lines.count - first)].fill(search.reach.next_up());
        self.ahead = Lanes::load(&ends, 0);
        self.behind = Lanes::splat(0.0) - self.ahead;
    }

    /// The ends of what is still of interest.
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
        // In sheared axes, which keep their handedness, a normal as long as the doubled area is large has -det along z: its
        // component along the line, divided by the line's along z. `slant` is the least component that is admitted.
        let inside = inside & (self.facing * det + Lanes::splat(slant)).at_most(zero);
        if !inside.any() {
            return;
        }
        let t = self.scale * (u * az + v * bz + w * cz) / det;
        let t = t.abs().at_most(Lanes::splat(tolerance)).select(zero, t);
        let ahead = inside & t.at_least(zero) & t.below(self.ahead);
        self.ahead = ahead.select(t, self.ahead);
        let behind = inside & t.at_most(zero) & t.above(self.behind);
        self.behind = behind.select(t, self.behind);
    }
}
