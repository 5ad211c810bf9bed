//! Many lines that run close together, cast at once and in both directions.
//!
//! Neighbouring texels of a texture meet the same nodes and the same triangles. A packet takes 16 of them through the tree
//! together (Wald, Slusallek, Benthin, Wagner, 'Interactive Rendering with Coherent Ray Tracing', 2001): a node is visited if any of
//! its lines meets it, a leaf is tested against all. What a line finds does not depend on its packet: every decision about
//! a triangle is made for the line alone, by the arithmetic of [`TriangleBlock::intersect`](super::block::TriangleBlock).

use super::block::{Edges, NO_TRIANGLE, edges};
use super::{Bvh, MAX_DEPTH};
use glam::{BVec4A, Vec3A, Vec4};
use obvhs::bvh2::node::Bvh2Node;

/// Lines a packet at most.
pub(crate) const PACKET: usize = 16;

/// Lines that one register holds.
const LANES: usize = 4;

/// A line through a point, in single precision, relative to the mesh's centre. Both finite, the direction not zero.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Line {
    pub(crate) origin: Vec3A,
    pub(crate) direction: Vec3A,
}

/// What is looked for on every line of a packet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search {
    /// The largest |t|.
    pub(crate) reach: f32,
    /// Hits with |t| up to this are at t = 0, and count for both directions. (Were such a hit at its own t for one of them,
    /// what a line finds would depend on which hit comes first.)
    pub(crate) tolerance: f32,
    /// Which triangles are hit: those whose normal (by their corners' order) goes with the line (1), against it (-1), or any (0).
    pub(crate) facing: f32,
    /// Among those only the ones whose normal's angle with the line (or with its opposite) has at least this cosine; 0 admits all.
    pub(crate) cosine: f32,
}

/// The hits of a line that are nearest to its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BothWays {
    /// Least t >= 0; infinite where there is none.
    pub(crate) ahead: f32,
    /// Least -t >= 0; infinite where there is none.
    pub(crate) behind: f32,
}

impl BothWays {
    pub(crate) const NOTHING: Self = Self { ahead: f32::INFINITY, behind: f32::INFINITY };
}

/// Lines that can share a packet: their directions have the same signs and the same largest coordinate, so that they meet the
/// sides of boxes in one order and are sheared along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Octant {
    negative: [bool; 3],
    /// The axes, permuted so that the last is where directions are largest.
    axes: [usize; 3],
}

/// Four lines of a packet, coordinate by coordinate.
#[derive(Clone, Copy)]
struct Group {
    /// Origin plus or minus the boxes' padding: what to subtract from a box's nearer and farther sides.
    from_near: [Vec4; 3],
    from_far: [Vec4; 3],
    inverse: [Vec4; 3],
    /// As in [`Shear`](super::block::Shear), of four lines.
    origin: [Vec4; 3],
    shear: [Vec4; 2],
    scale: Vec4,
    facing: Vec4,
    /// t between which hits are still of interest; empty where the place holds no line.
    behind: Vec4,
    ahead: Vec4,
}

impl Octant {
    fn of(direction: Vec3A) -> Self {
        let d = direction.to_array();
        let z = (1..3).fold(0, |best, k| if d[k].abs() > d[best].abs() { k } else { best });
        Self { negative: d.map(f32::is_sign_negative), axes: [(z + 1) % 3, (z + 2) % 3, z] }
    }
}

impl Group {
    /// Of one to four lines of one octant.
    fn new(lines: &[Line], octant: Octant, half_extent: Vec3A, search: Search) -> Self {
        let lane = |i: usize| lines[if i < lines.len() { i } else { 0 }];
        let four = |f: &dyn Fn(Line) -> f32| Vec4::from_array(std::array::from_fn(|i| f(lane(i))));
        // As `LocalRay::new` explains.
        let padding = four(&|l| {
            let reach = (l.origin.abs() + half_extent).max_element();
            (reach * (16.0 * f32::EPSILON)).max(1e-30)
        });
        let sides = |sign: f32| {
            std::array::from_fn(|k| {
                let origin = four(&|l| l.origin[k]);
                if octant.negative[k] { origin - sign * padding } else { origin + sign * padding }
            })
        };
        let [x, y, z] = octant.axes;
        let beyond = search.reach.next_up();
        let present =
            |t: f32| Vec4::from_array(std::array::from_fn(|i| if i < lines.len() { t } else { -f32::INFINITY }));
        Self {
            from_near: sides(1.0),
            from_far: sides(-1.0),
            inverse: std::array::from_fn(|k| {
                four(&|l| {
                    let d = l.direction[k];
                    1.0 / if d.abs() < 1e-20 { 1e-20f32.copysign(d) } else { d }
                })
            }),
            origin: octant.axes.map(|k| four(&|l| l.origin[k])),
            shear: [x, y].map(|k| four(&|l| l.direction[k] / l.direction[z])),
            scale: four(&|l| 1.0 / l.direction[z]),
            facing: four(&|l| search.facing * l.direction[z]),
            behind: -present(beyond),
            ahead: present(beyond),
        }
    }

    /// Whether any line meets the box between its `behind` and its `ahead`.
    #[inline(always)]
    fn meets(&self, near: &[Vec4; 3], far: &[Vec4; 3]) -> bool {
        let enter: [Vec4; 3] = std::array::from_fn(|k| (near[k] - self.from_near[k]) * self.inverse[k]);
        let leave: [Vec4; 3] = std::array::from_fn(|k| (far[k] - self.from_far[k]) * self.inverse[k]);
        let first = enter[0].max(enter[1]).max(enter[2]).max(self.behind);
        let last = leave[0].min(leave[1]).min(leave[2]).min(self.ahead);
        first.cmple(last).any()
    }

    /// Tests one triangle, whose corners' coordinates are permuted as the group's axes: the watertight test of
    /// [`TriangleBlock::intersect`](super::block::TriangleBlock), which explains it.
    #[inline(always)]
    fn intersect(&mut self, corners: &[[Vec4; 3]; 3], slant: Vec4, tolerance: Vec4) {
        let Edges { weights: [u, v, w], z: [az, bz, cz], det, inside } = edges(corners, &self.origin, &self.shear);
        // In sheared axes, which keep their handedness, a normal as long as the doubled area is large has -det along z: its
        // component along the line, divided by the line's along z. `slant` is the least component that is admitted.
        let faces = (self.facing * det + slant).cmple(Vec4::ZERO);
        let inside = inside & faces;
        if !inside.any() {
            return;
        }
        let t = self.scale * (u * az + v * bz + w * cz) / det;
        let t = Vec4::select(t.abs().cmple(tolerance), Vec4::ZERO, t);
        let ahead: BVec4A = inside & t.cmpge(Vec4::ZERO) & t.cmplt(self.ahead);
        self.ahead = Vec4::select(ahead, t, self.ahead);
        let behind: BVec4A = inside & t.cmple(Vec4::ZERO) & t.cmpgt(self.behind);
        self.behind = Vec4::select(behind, t, self.behind);
    }
}

impl Bvh {
    /// The nearest hits on both sides of every line's origin; `found` has as many entries as `lines`. As
    /// [`cast`](Self::cast) finds them, one ray at a time. At most [`PACKET`] lines.
    pub(crate) fn cast_both_ways(&self, lines: &[Line], search: Search, found: &mut [BothWays]) {
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
            self.cast_packet(&packet[..count], octants[first], search, &mut results);
            for (&i, result) in members[..count].iter().zip(results) {
                found[i] = result;
            }
        }
    }

    /// Lines of one octant.
    fn cast_packet(&self, lines: &[Line], octant: Octant, search: Search, results: &mut [BothWays; PACKET]) {
        let count = lines.len().div_ceil(LANES);
        let group = |g: usize| {
            let members = &lines[(LANES * g).min(lines.len() - 1)..(LANES * (g + 1)).min(lines.len())];
            Group::new(members, octant, self.half_extent, search)
        };
        let mut groups: [Group; PACKET / LANES] = [group(0); PACKET / LANES];
        for g in 1..count {
            groups[g] = group(g);
        }
        self.traverse(&mut groups[..count], lines[0].origin, octant, search);
        for (i, result) in results[..lines.len()].iter_mut().enumerate() {
            let (ahead, behind) = (groups[i / LANES].ahead[i % LANES], -groups[i / LANES].behind[i % LANES]);
            let within = |t: f32| if t <= search.reach { t } else { f32::INFINITY };
            *result = BothWays { ahead: within(ahead), behind: within(behind) };
        }
    }

    /// Depth first, the child nearer to `origin` first. A node is tested when its turn comes, with what has been found by then.
    fn traverse(&self, groups: &mut [Group], origin: Vec3A, octant: Octant, search: Search) {
        let nodes = &self.tree.nodes[..];
        if nodes.is_empty() {
            return;
        }
        // Two entries a level: node, and the first group that may meet it (those before it missed the parent).
        let mut stack = [(0u32, 0u32); 2 * MAX_DEPTH];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (index, first) = stack[height];
            let node = &nodes[index as usize];
            let sides: &[Vec4; 2] = bytemuck::cast_ref(node);
            let side = |k: usize, far: bool| Vec4::splat(sides[usize::from(octant.negative[k] != far)][k]);
            let (near, far) = ([0, 1, 2].map(|k| side(k, false)), [0, 1, 2].map(|k| side(k, true)));
            let Some(skipped) = groups[first as usize..].iter().position(|g| g.meets(&near, &far)) else { continue };
            let first = first + skipped as u32;
            if node.is_leaf() {
                self.test_leaf(node, &mut groups[first as usize..], octant.axes, search);
                continue;
            }
            let child = node.first_index;
            let [a, b] = [0, 1].map(|i| {
                let aabb = nodes[child as usize + i].aabb();
                (aabb.min + aabb.max - 2.0 * origin).length_squared()
            });
            let second = u32::from(a <= b);
            stack[height] = (child + second, first);
            stack[height + 1] = (child + 1 - second, first);
            height += 2;
        }
    }

    fn test_leaf(&self, leaf: &Bvh2Node, groups: &mut [Group], axes: [usize; 3], search: Search) {
        let tolerance = Vec4::splat(search.tolerance);
        let block = &self.blocks[(leaf.first_index / 4) as usize];
        for lane in 0..leaf.prim_count as usize {
            debug_assert_ne!(self.tree.primitive_indices[leaf.first_index as usize + lane], NO_TRIANGLE);
            let corners = block.corners.map(|corner| axes.map(|k| Vec4::splat(corner[k][lane])));
            let slant = if search.cosine > 0.0 { search.cosine * normal_length(block.triangle(lane)) } else { 0.0 };
            let slant = Vec4::splat(slant);
            for group in groups.iter_mut() {
                group.intersect(&corners, slant, tolerance);
            }
        }
    }
}

/// Of the normal that is as long as twice the triangle's area is large.
pub(super) fn normal_length([a, b, c]: [Vec3A; 3]) -> f32 {
    (b - a).cross(c - a).length()
}
