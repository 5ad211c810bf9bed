//! Many lines that run close together, cast at once and in both directions.
//!
//! Neighbouring texels of a texture meet the same nodes and the same triangles. A packet takes 16 of them through the
//! tree together (Wald, Slusallek, Benthin, Wagner, 'Interactive Rendering with Coherent Ray Tracing', 2001): a node is
//! visited if any line of the packet meets it, a leaf is tested against all. The hits of a line do not depend on its
//! packet: every decision about a triangle is made for the line alone, by the arithmetic of
//! [`TriangleBlock::intersect`](super::block::TriangleBlock), on four lanes or on eight.

use super::block::{NO_TRIANGLE, shear_axes};
use super::group::LineGroup;
use super::{Bvh, Bvh2Node, MAX_DEPTH};
use glam::Vec3A;

/// The largest number of lines in a packet.
pub(crate) const PACKET: usize = 16;

/// A line through a point, in single precision, relative to the mesh's centre. Both are finite, the direction is not
/// zero.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Line {
    pub(crate) origin: Vec3A,
    pub(crate) direction: Vec3A,
}

/// The hits that count on every line of a packet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HitCriteria {
    /// The largest |t|.
    pub(crate) reach: f32,
    /// Hits with |t| up to this are at t = 0, and count for both directions. (Were such a hit at its own t for one of
    /// them, the result would depend on which hit comes first.)
    pub(crate) tolerance: f32,
    /// The orientation of the triangles: their normal (by their corners' order) goes with the line (1), against it
    /// (-1), or either way (0).
    pub(crate) facing: f32,
    /// The least cosine of the angle between a triangle's normal and the line (or its opposite); 0 admits all.
    pub(crate) cosine: f32,
}

/// The hits of a line that are nearest to its origin, on both sides of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BothWays {
    /// The least t >= 0; infinite where there is none.
    pub(crate) ahead: f32,
    /// The least -t >= 0; infinite where there is none.
    pub(crate) behind: f32,
}

impl BothWays {
    pub(crate) const NOTHING: Self = Self { ahead: f32::INFINITY, behind: f32::INFINITY };
}

/// The class of lines that can share a packet: their directions have the same signs and the same largest coordinate, so
/// that they meet the sides of boxes in one order and are sheared along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Octant {
    pub(super) negative: [bool; 3],
    /// The axes, permuted so that directions are largest along the last.
    pub(super) axes: [usize; 3],
}

impl Octant {
    pub(super) fn of(direction: Vec3A) -> Self {
        Self { negative: direction.to_array().map(f32::is_sign_negative), axes: shear_axes(direction) }
    }
}

impl Bvh {
    /// The nearest hits on both sides of the origins of at most [`PACKET`] lines; `hits` has as many entries as
    /// `lines`.
    pub(crate) fn cast_both_ways(&self, lines: &[Line], criteria: HitCriteria, hits: &mut [BothWays]) {
        let Some(first) = lines.first() else { return };
        let octant = Octant::of(first.direction);
        if lines.iter().all(|line| Octant::of(line.direction) == octant) {
            self.cast_octant(lines, octant, criteria, hits);
            return;
        }
        let octants: [Octant; PACKET] =
            std::array::from_fn(|i| Octant::of(lines.get(i).map_or(Vec3A::X, |l| l.direction)));
        let mut done = [false; PACKET];
        for first in 0..lines.len() {
            if done[first] {
                continue;
            }
            let mut members = [0; PACKET];
            let mut packet = [lines[first]; PACKET];
            let mut count = 0;
            for i in (first..lines.len()).filter(|&i| octants[i] == octants[first]) {
                (members[count], packet[count], done[i]) = (i, lines[i], true);
                count += 1;
            }
            let mut results = [BothWays::NOTHING; PACKET];
            self.cast_octant(&packet[..count], octants[first], criteria, &mut results);
            for (&i, result) in members[..count].iter().zip(results) {
                hits[i] = result;
            }
        }
    }

    /// Casts lines of one octant on N lanes, in at most G groups. Compiled for several kinds of processors.
    #[inline(always)]
    pub(super) fn cast_groups<const N: usize, const G: usize>(
        &self,
        lines: &[Line],
        octant: Octant,
        criteria: HitCriteria,
        hits: &mut [BothWays],
    ) {
        let count = lines.len().div_ceil(N);
        let mut groups = [LineGroup::<N>::default(); G];
        for g in 0..count {
            groups[g].fill(&lines[N * g..], octant, self.half_extent, criteria);
        }
        self.traverse(&mut groups[..count], lines[0].origin, octant, criteria);
        let within = |t: f32| if t <= criteria.reach { t } else { f32::INFINITY };
        for g in 0..count {
            let (behind, ahead) = groups[g].reached();
            for (i, hit) in hits[N * g..].iter_mut().take(N.min(lines.len() - N * g)).enumerate() {
                *hit = BothWays { ahead: within(ahead[i]), behind: within(-behind[i]) };
            }
        }
    }

    /// Traverses the tree depth first, the child nearer to `origin` first. A node is tested when its turn comes,
    /// against the nearest hits up to then.
    #[inline(always)]
    fn traverse<const N: usize>(
        &self,
        groups: &mut [LineGroup<N>],
        origin: Vec3A,
        octant: Octant,
        criteria: HitCriteria,
    ) {
        let nodes = &self.tree.nodes[..];
        if nodes.is_empty() {
            return;
        }
        // Two entries a level: node, and the first group that may meet it (those before it missed the parent).
        let mut stack = [(0u32, 0u32); 2 * MAX_DEPTH];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (index, mut first) = stack[height];
            let node = &nodes[index as usize];
            let sides: &[[f32; 4]; 2] = bytemuck::cast_ref(node);
            let side = |k: usize, far: bool| sides[usize::from(octant.negative[k] != far)][k];
            let near = [side(0, false), side(1, false), side(2, false)];
            let far = [side(0, true), side(1, true), side(2, true)];
            while (first as usize) < groups.len() && !groups[first as usize].meets(near, far) {
                first += 1;
            }
            if first as usize == groups.len() {
                continue;
            }
            if node.is_leaf() {
                self.test_leaf(node, &mut groups[first as usize..], octant.axes, criteria);
                continue;
            }
            let child = node.first_index;
            let away = |node: &Bvh2Node| {
                let aabb = node.aabb();
                (aabb.min + aabb.max - 2.0 * origin).length_squared()
            };
            let second = u32::from(away(&nodes[child as usize]) <= away(&nodes[child as usize + 1]));
            stack[height] = (child + second, first);
            stack[height + 1] = (child + 1 - second, first);
            height += 2;
        }
    }

    #[inline(always)]
    fn test_leaf<const N: usize>(
        &self,
        leaf: &Bvh2Node,
        groups: &mut [LineGroup<N>],
        [x, y, z]: [usize; 3],
        criteria: HitCriteria,
    ) {
        let block = &self.blocks[(leaf.first_index / 4) as usize];
        let corners: &[[[f32; 4]; 3]; 3] = bytemuck::cast_ref(&block.corners);
        for lane in 0..leaf.prim_count as usize {
            debug_assert_ne!(self.tree.primitive_indices[leaf.first_index as usize + lane], NO_TRIANGLE);
            let corner = |c: usize| [corners[c][x][lane], corners[c][y][lane], corners[c][z][lane]];
            let triangle = [corner(0), corner(1), corner(2)];
            let slant = if criteria.cosine > 0.0 { criteria.cosine * normal_length(block.triangle(lane)) } else { 0.0 };
            for group in groups.iter_mut() {
                group.intersect(triangle, slant, criteria.tolerance);
            }
        }
    }
}

/// Twice a triangle's area: the length of its normal before that is scaled to unit length.
pub(super) fn normal_length([a, b, c]: [Vec3A; 3]) -> f32 {
    (b - a).cross(c - a).length()
}
