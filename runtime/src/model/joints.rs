//! How the patches of a mesh are joined at the edges of its triangles, and where they are not.

use super::closed::{Faults, OpenBorder};
use crate::mesh::TriangleMesh;
use glam::DVec3;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap, HashMap};

/// The largest sine of the angle between two surfaces that touch: they are as near to each other as solids that
/// coincide within a strip that is as wide as the root of that distance times the radius, at whose edges the sine is
/// some 1e-3 for a radius of a millimetre.
const TOUCHING: f64 = 0.02;
/// The largest distance between two edges without a neighbour that are beside each other, in their lengths.
const BESIDE: f64 = 4.0;
/// Edges without a neighbour of each patch that are compared with others: where surfaces touch there are many.
const MOST_COMPARED: usize = 64;

/// Patches that have a border in common, and whether their outer sides agree along it.
pub(super) struct Joints {
    /// By patch its neighbours; of each, on how much more border they agree than not.
    neighbours: Vec<BTreeMap<usize, f64>>,
}

/// Of patches with names, the number of the part that each is a surface of, as `plate` of `plate.hole.wall`.
pub(crate) fn bodies<'n>(names: impl Iterator<Item = &'n str>) -> Vec<usize> {
    let mut numbers: HashMap<&str, usize> = HashMap::new();
    let number = |name: &'n str| {
        let next = numbers.len();
        *numbers.entry(name.split('.').next().unwrap_or(name)).or_insert(next)
    };
    names.map(number).collect()
}

/// The pairs of those that meet at one border: where several parts touch there, those of the same part.
pub(super) fn pairs<T: Copy>(meeting: &[T], body: impl Fn(&T) -> usize) -> impl Iterator<Item = [T; 2]> {
    meeting.iter().enumerate().filter_map(move |(i, first)| {
        let is_other = |k: usize, other: &T| k != i && (meeting.len() == 2 || body(other) == body(first));
        let mut others = meeting.iter().enumerate().filter(|(k, other)| is_other(*k, other));
        match (others.next(), others.next()) {
            (Some((k, second)), None) if i < k => Some([*first, *second]),
            _ => None,
        }
    })
}

/// A patch that a joint of some weight reaches, and whether it is turned against the first one.
struct Reached {
    weight: f64,
    patch: usize,
    turned: bool,
}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        self.weight.total_cmp(&other.weight).then(other.patch.cmp(&self.patch))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Reached {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Reached {}

impl Joints {
    pub(super) fn new(patches: usize) -> Self {
        Self { neighbours: vec![BTreeMap::new(); patches] }
    }

    /// Notes that two patches meet, and whether their outer sides agree there. The weight is the length of the border,
    /// or one, where whole borders meet.
    pub(super) fn add(&mut self, a: usize, b: usize, agree: bool, weight: f64) {
        for (patch, neighbour) in [(a, b), (b, a)] {
            *self.neighbours[patch].entry(neighbour).or_default() += if agree { weight } else { -weight };
        }
    }

    /// Patches that are joined, each with whether it is turned against the first one, by the heaviest joints: where
    /// surfaces touch, short pieces of their borders may meet as they like.
    pub(super) fn components(&self) -> Vec<Vec<(usize, bool)>> {
        let mut seen = vec![false; self.neighbours.len()];
        let mut components = Vec::new();
        for first in 0..self.neighbours.len() {
            let mut component = Vec::new();
            let mut reached = BinaryHeap::from([Reached { weight: 0.0, patch: first, turned: false }]);
            while let Some(Reached { patch, turned, .. }) = reached.pop() {
                if std::mem::replace(&mut seen[patch], true) {
                    continue;
                }
                component.push((patch, turned));
                reached.extend(self.neighbours[patch].iter().map(|(neighbour, agreeing)| Reached {
                    weight: agreeing.abs(),
                    patch: *neighbour,
                    turned: turned == (*agreeing >= 0.0),
                }));
            }
            if !component.is_empty() {
                components.push(component);
            }
        }
        components
    }
}

/// An edge of a triangle at the border of a patch.
struct Rim {
    patch: usize,
    ends: [DVec3; 2],
    /// The normal of the surface at its beginning.
    normal: DVec3,
}

impl Rim {
    fn middle(&self) -> DVec3 {
        0.5 * (self.ends[0] + self.ends[1])
    }

    fn length(&self) -> f64 {
        self.ends[0].distance(self.ends[1])
    }

    fn is_beside(&self, other: &Self) -> bool {
        self.middle().distance(other.middle()) <= BESIDE * self.length().max(other.length())
    }

    /// Whether both lie in one plane that is tangent to both surfaces.
    fn touches(&self, other: &Self) -> bool {
        let way = other.middle() - self.middle();
        self.normal.cross(other.normal).length() < TOUCHING && way.dot(self.normal).abs() <= TOUCHING * self.length()
    }
}

/// How the patches of a mesh with normals meet at the edges of its triangles; the edges without a neighbour, by patch,
/// and those whose triangles run against each other.
pub(super) fn joined(mesh: &TriangleMesh) -> (Joints, Faults) {
    let number = mesh.position_numbers();
    let mut sides: HashMap<[u32; 2], Vec<(usize, [u32; 2])>> = HashMap::new();
    for (patch, group) in mesh.groups.iter().enumerate() {
        for triangle in &mesh.triangles[group.start..group.end] {
            for k in 0..3 {
                let ends = [triangle[k], triangle[(k + 1) % 3]];
                let [a, b] = ends.map(|i| number[i as usize]);
                if a != b {
                    sides.entry([a.min(b), a.max(b)]).or_default().push((patch, ends));
                }
            }
        }
    }
    let mut joints = Joints::new(mesh.groups.len());
    let bodies = bodies(mesh.groups.iter().map(|group| group.name.as_str()));
    // By patch the edges that no other triangle has, and those that other patches have, too.
    let [mut open, mut shared]: [Vec<Vec<Rim>>; 2] = [(); 2].map(|()| mesh.groups.iter().map(|_| Vec::new()).collect());
    let mut edges: Vec<_> = sides.into_iter().collect();
    edges.sort_unstable();
    let position = |i: u32| DVec3::from_array(mesh.positions[i as usize]);
    let forth = |[a, b]: [u32; 2]| number[a as usize] < number[b as usize];
    let rim = |patch: usize, ends: [u32; 2]| {
        let normal = DVec3::from_array(mesh.normals[ends[0] as usize]);
        Rim { patch, ends: ends.map(position), normal }
    };
    // Edges that run the same way in both of their triangles, or more often one way than the other.
    let mut against = Vec::new();
    for (_, of_edge) in edges {
        let middle = |ends: [u32; 2]| 0.5 * (position(ends[0]) + position(ends[1]));
        let forward = of_edge.iter().filter(|(_, ends)| forth(*ends)).count();
        if of_edge.len() > 1 && 2 * forward != of_edge.len() {
            against.push(([of_edge[0].0, of_edge[1].0], middle(of_edge[0].1)));
        }
        match of_edge[..] {
            [(patch, ends)] => open[patch].push(rim(patch, ends)),
            [(a, _), (b, _)] if a == b => {}
            _ => of_edge.iter().for_each(|(patch, ends)| shared[*patch].push(rim(*patch, *ends))),
        }
        for [(a, first), (b, second)] in pairs(&of_edge, |(patch, _)| bodies[*patch]) {
            if a != b {
                let length = position(first[0]).distance(position(first[1]));
                joints.add(a, b, forth(first) != forth(second), length);
            }
        }
    }
    // Where most of a joint does not agree one of its patches is inside out.
    let agree = |[a, b]: [usize; 2]| a == b || joints.neighbours[a].get(&b).is_none_or(|agreeing| *agreeing > 0.0);
    let against =
        against.into_iter().filter(|(patches, _)| agree(*patches)).map(|(patches, at)| (patches[0], at.to_array()));
    let against = against.collect();
    let open = (0..open.len()).filter_map(|patch| border(&open, &shared, patch)).collect();
    (joints, Faults { open, against })
}

/// The edges of a patch that have no neighbour, as one border.
fn border(open: &[Vec<Rim>], shared: &[Vec<Rim>], patch: usize) -> Option<OpenBorder> {
    let own = &open[patch];
    let longest = own.iter().max_by(|a, b| a.length().total_cmp(&b.length()))?;
    let some = |rims: &[Rim]| rims.len().div_ceil(MOST_COMPARED).max(1);
    // The first of other patches' rims that is as it should be beside one of the own.
    let find = |rims: &[Vec<Rim>], is_wanted: &dyn Fn(&Rim, &Rim) -> bool| {
        let others = rims.iter().filter(|of_other| of_other.first().is_some_and(|other| other.patch != patch));
        let compared: Vec<&Rim> = others.flat_map(|of_other| of_other.iter().step_by(some(of_other))).collect();
        own.iter().step_by(some(own)).find_map(|edge| {
            let other = compared.iter().find(|other| edge.is_beside(other) && is_wanted(edge, other))?;
            Some((edge.middle(), other.patch))
        })
    };
    let touch = find(open, &Rim::touches).or_else(|| find(shared, &Rim::touches));
    let gap = touch.or_else(|| find(open, &|_, _| true));
    let at = gap.map_or(longest.middle(), |(at, _)| at).to_array();
    Some(OpenBorder {
        patch,
        side: "no other part meets it".to_owned(),
        length: own.iter().map(Rim::length).sum(),
        at: Some(at),
        beside: gap.map(|(_, other)| other),
        touches: touch.is_some(),
    })
}
