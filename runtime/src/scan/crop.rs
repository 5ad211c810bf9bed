//! Cutting out a box, and what its sides cut through: where one runs through the noise of a face, it takes away the
//! points that noise has put outside, and the face of those that are left lies farther inside.

use super::raw::RawMesh;
use crate::mesh::{Bounds, renumber_used, retain_marked};
use glam::DVec3;
use gml_compiler::number::plain;

/// Points are counted by their distances from a side, whose bins begin with this one (millimetres) and are each so many
/// times as wide as the last one: to 1.5 km.
const FIRST_BIN: f64 = 1e-4;
const WIDER: f64 = 1.25;
const BINS: usize = 105;
/// How far noise puts points from their face, and how far away others are that tell how many lie there without one
/// (standard deviations).
const REACH: f64 = 3.0;
const BESIDE: [f64; 2] = [4.0, 16.0];
/// A side cuts through a face where, inside and outside alike, more points are within reach than this share of the
/// kept ones, and so many times as many as the neighbourhood lets expect.
const SHARE: f64 = 2e-3;
const DENSER: f64 = 3.0;
/// The fewest points within reach on either side that tell.
const FEWEST: f64 = 20.0;

/// The numbers of points beside the sides of a box, by side (low x, high x, low y, ...): of those that lie between the
/// other sides.
#[derive(Clone, Debug)]
pub(super) struct Sides {
    bounds: Bounds,
    /// Inside and outside.
    counts: [[[u32; BINS]; 2]; 6],
}

impl Sides {
    /// Those of a box of millimetres.
    pub(super) fn new(bounds: Bounds) -> Self {
        Self { bounds, counts: [[[0; BINS]; 2]; 6] }
    }

    /// Counts a point. Returns whether it lies in the box.
    pub(super) fn take(&mut self, at: DVec3) -> bool {
        // Beyond which side it lies, and by how much; inside these are negative.
        let beyond: [f64; 6] = std::array::from_fn(|side| {
            let axis = side / 2;
            if side % 2 == 0 { self.bounds.low[axis] - at[axis] } else { at[axis] - self.bounds.high[axis] }
        });
        let outside = beyond.iter().filter(|beyond| **beyond > 0.0).count();
        for (counts, beyond) in self.counts.iter_mut().zip(beyond).filter(|(_, beyond)| beyond.is_finite()) {
            let is_beyond = beyond > 0.0;
            if outside == usize::from(is_beyond) {
                counts[usize::from(is_beyond)][bin(beyond.abs())] += 1;
            }
        }
        outside == 0
    }

    /// Sentences on the sides that run through the noise of a face, of which `kept` points are left.
    pub(super) fn warnings(&self, noise: f64, kept: usize, path: &str) -> Vec<String> {
        let told = |side: usize| {
            let [inside, outside] = &self.counts[side];
            let least = FEWEST.max(SHARE * kept as f64);
            let near = |counts: &[u32; BINS]| within(counts, 0.0, REACH * noise);
            let expected = |counts: &[u32; BINS]| {
                REACH / (BESIDE[1] - BESIDE[0]) * within(counts, BESIDE[0] * noise, BESIDE[1] * noise)
            };
            let expected = expected(inside).max(expected(outside));
            let (within, beyond) = (near(inside), near(outside));
            if !(noise > 0.0) || within.min(beyond) < least.max(DENSER * expected) {
                return None;
            }
            let axis = side / 2;
            let (end, place) = match side % 2 {
                0 => ("lower", self.bounds.low[axis]),
                _ => ("upper", self.bounds.high[axis]),
            };
            let length = |x: f64| format!("{x:.2e}").parse().map_or_else(|_| plain(x), plain);
            let name = ["x", "y", "z"][axis];
            Some(format!(
                "`{path}`: the {end} end of {name} of --crop ({} mm) cuts through the noise of a face: within {} mm of it some {beyond:.0} points are cut off and {within:.0} stay, so that the face seems to lie farther inside; move that end by {} mm or more",
                length(place),
                length(REACH * noise),
                length(2.0 * REACH * noise)
            ))
        };
        (0..6).filter_map(told).collect()
    }
}

/// The bin of a distance.
fn bin(distance: f64) -> usize {
    let bin = (distance / FIRST_BIN).max(1.0).log(WIDER);
    (bin as usize).min(BINS - 1)
}

/// The number of points at distances in a range, as far as bins tell.
fn within(counts: &[u32; BINS], from: f64, to: f64) -> f64 {
    let mut low = 0.0;
    let mut sum = 0.0;
    for (k, count) in counts.iter().enumerate() {
        let high = FIRST_BIN * WIDER.powi(k as i32 + 1);
        let overlap = (to.min(high) - from.max(low)).max(0.0);
        sum += f64::from(*count) * overlap / (high - low);
        low = high;
    }
    sum
}

/// Leaves out what of a mesh does not lie in a box of millimetres: triangles with a corner outside, and vertices that
/// none uses then. `unit` is that of the mesh in millimetres. Returns the number of vertices that are gone; clouds are
/// cut while they are read.
pub(super) fn crop(raw: &mut RawMesh, bounds: Bounds, unit: f64) -> u64 {
    if raw.triangles.is_empty() {
        return 0;
    }
    let mut sides = Sides::new(bounds);
    let inside: Vec<bool> = raw.positions.iter().map(|p| sides.take(DVec3::from(*p) * unit)).collect();
    raw.sides = Some(Box::new(sides));
    let kept: Vec<bool> = raw.triangles.iter().map(|t| t.iter().all(|v| inside[*v as usize])).collect();
    let counts = |end: usize| kept[..end].iter().filter(|kept| **kept).count();
    for group in &mut raw.groups {
        (group.start, group.end) = (counts(group.start), counts(group.end));
    }
    raw.groups.retain(|group| group.start < group.end);
    retain_marked(&mut raw.triangles, &kept);
    retain_marked(&mut raw.corner_normals, &kept);
    retain_marked(&mut raw.corner_texcoords, &kept);
    let used = renumber_used(&mut raw.triangles, raw.positions.len());
    let before = raw.positions.len();
    retain_marked(&mut raw.positions, &used);
    retain_marked(&mut raw.normals, &used);
    retain_marked(&mut raw.texcoords, &used);
    raw.attributes.retain_marked(&used);
    (before - raw.positions.len()) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::thinned::mixed;

    #[test]
    fn a_side_through_the_noise_of_a_face_is_named() {
        let uniform = |i: u64| (mixed(i) % 1_000_000) as f64 / 1e6;
        let normal = |i: u64| (0..12).map(|k| uniform(12 * i + k) - 0.5).sum::<f64>();
        // A face at z = 0, with noise of 0.05, and a wall of a tenth of its points upright on it.
        let face = (0..20_000).map(|i| DVec3::new(60.0 * uniform(7 * i), 40.0 * uniform(7 * i + 3), 0.05 * normal(i)));
        let wall = (0..2000).map(|i| DVec3::new(0.05 * normal(90_000 + i), 40.0 * uniform(i), 30.0 * uniform(i + 77)));
        let points: Vec<DVec3> = face.chain(wall).collect();
        let named = |low: f64, x: f64| {
            let high = DVec3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY);
            let mut sides = Sides::new(Bounds { low: DVec3::new(x, f64::NEG_INFINITY, low), high });
            let kept = points.iter().filter(|p| sides.take(**p)).count();
            sides.warnings(0.05, kept, "a.xyz")
        };
        for (low, cuts) in [(0.0, true), (0.05, true), (-0.05, true), (-0.5, false), (0.5, false), (15.0, false)] {
            let said = named(low, f64::NEG_INFINITY);
            assert_eq!(said.len(), usize::from(cuts), "{low}: {said:?}");
            assert!(said.iter().all(|s| s.contains("lower end of z") && s.contains("stay")), "{said:?}");
        }
        let said = named(f64::NEG_INFINITY, 0.0);
        assert!(said.len() == 1 && said[0].contains("lower end of x"), "{said:?}");
        // A face that a side crosses.
        assert!(named(f64::NEG_INFINITY, 20.0).is_empty());
    }
}
