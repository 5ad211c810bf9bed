//! Pieces of a part's surface of equal area, on each of which one deviation is estimated.

use crate::variance::Deviations;
use crate::variance::distribution::{Distribution, Sample};
use glam::DVec3;

/// Texels of different directions are apart as if by so many edges of a footprint for each unit between their normals,
/// so that the two sides of a wall do not share a footprint.
const TURN: f64 = 2.0;

/// Texels whose footprints are found by one task.
const TASK: usize = 1 << 13;

/// A connected piece of a part's measured surface, where that is connected.
#[derive(Clone, Debug)]
pub(super) struct Footprint {
    /// Its texels, as indices into those of the deviations.
    pub(super) texels: Vec<u32>,
    /// Its area. Square millimetres.
    pub(super) area: f64,
    /// The signed deviation that half of its area exceeds, without the sag of the scan's triangles. Millimetres.
    pub(super) median: f64,
    /// Its centre of gravity. Millimetres.
    pub(super) centre: DVec3,
}

/// Divides measured texels into footprints of equal areas, each as near to `area` (square millimetres) as that allows:
/// halves the texels, again and again, along the axis of space or of directions in which they are spread the most.
pub(super) fn footprints(deviations: &Deviations, mut texels: Vec<u32>, area: f64) -> Vec<Footprint> {
    let total: f64 = texels.iter().map(|i| area_of(deviations, *i)).sum();
    // The cast saturates; there are no more footprints than texels.
    let count = ((total / area).round() as usize).clamp(1, texels.len().max(1));
    if texels.is_empty() {
        return Vec::new();
    }
    Divider { deviations, turn: TURN * (total / count as f64).sqrt() }.divide(&mut texels, count)
}

fn area_of(deviations: &Deviations, i: u32) -> f64 {
    f64::from(deviations.texels.area[i as usize])
}

struct Divider<'a> {
    deviations: &'a Deviations,
    /// Length that stands for a unit between normals. Millimetres.
    turn: f64,
}

impl Divider<'_> {
    fn divide(&self, texels: &mut [u32], count: usize) -> Vec<Footprint> {
        if count < 2 || texels.len() < 2 {
            return vec![self.footprint(texels)];
        }
        let (mut axis, [least, greatest]) = self.widest(texels, 6);
        if axis >= 3 && !self.is_even(texels, axis, 0.5 * (least + greatest), count) {
            axis = self.widest(texels, 3).0;
        }
        let mut sorted: Vec<u64> = texels.iter().map(|i| ordered(self.coordinate(*i, axis)) | u64::from(*i)).collect();
        sorted.sort_unstable();
        texels.iter_mut().zip(sorted).for_each(|(place, sorted)| *place = sorted as u32);
        let areas = |texels: &[u32]| texels.iter().map(|i| area_of(self.deviations, *i)).sum::<f64>();
        let total = areas(texels);
        let (cut, share) = if axis < 3 {
            (self.place_of(texels, total * (count / 2) as f64 / count as f64), count / 2)
        } else {
            // Sides that face different ways are not divided by their areas.
            let cut = texels.partition_point(|i| self.coordinate(*i, axis) < 0.5 * (least + greatest));
            (cut, (count as f64 * areas(&texels[..cut]) / total).round() as usize)
        };
        let (cut, share) = (cut.clamp(1, texels.len() - 1), share.clamp(1, count - 1));
        let both = texels.len() > TASK;
        let (low, high) = texels.split_at_mut(cut);
        let mut low = || self.divide(low, share);
        let mut high = || self.divide(high, count - share);
        let (mut low, high) = if both { rayon::join(low, high) } else { (low(), high()) };
        low.extend(high);
        low
    }

    /// Whether both sides of a cut are half a footprint at least.
    fn is_even(&self, texels: &[u32], axis: usize, cut: f32, count: usize) -> bool {
        let area = |low: bool| {
            let of_side = texels.iter().filter(|i| (self.coordinate(**i, axis) < cut) == low);
            of_side.map(|i| area_of(self.deviations, *i)).sum::<f64>()
        };
        let [low, high] = [true, false].map(area);
        low.min(high) * count as f64 >= 0.5 * (low + high)
    }

    /// The number of texels, from the first on, whose area is the nearest to `goal`.
    fn place_of(&self, texels: &[u32], goal: f64) -> usize {
        let mut reached = 0.0;
        let is_before = |i: &&u32| {
            let area = area_of(self.deviations, **i);
            reached += area;
            reached - 0.5 * area <= goal
        };
        texels.iter().take_while(is_before).count()
    }

    /// The axis along which texels are spread the most, 0 to 2 of positions, 3 to 5 of normals; and their range on it.
    /// Only the first `axes` are compared.
    fn widest(&self, texels: &[u32], axes: usize) -> (usize, [f32; 2]) {
        let range = |axis: usize| {
            texels.iter().fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], i| {
                let x = self.coordinate(*i, axis);
                [low.min(x), high.max(x)]
            })
        };
        let ranges = [0, 1, 2, 3, 4, 5].map(range);
        let spread = |axis: usize| ranges[axis][1] - ranges[axis][0];
        let widest = (0..axes).max_by(|a, b| spread(*a).total_cmp(&spread(*b))).unwrap_or(0);
        (widest, ranges[widest])
    }

    fn coordinate(&self, i: u32, axis: usize) -> f32 {
        let texels = &self.deviations.texels;
        match axis {
            0..3 => texels.position[i as usize][axis] as f32,
            _ => self.turn as f32 * texels.normal[i as usize][axis - 3],
        }
    }

    fn footprint(&self, texels: &[u32]) -> Footprint {
        let sample =
            |i: &u32| Sample::new(self.deviations.without_sag(*i as usize), self.deviations.texels.area[*i as usize]);
        let area: f64 = texels.iter().map(|i| area_of(self.deviations, *i)).sum();
        let moment = |i: &u32| area_of(self.deviations, *i) * DVec3::from(self.deviations.texels.position[*i as usize]);
        Footprint {
            texels: texels.to_vec(),
            area,
            median: Distribution::new(texels.iter().map(sample).collect()).median(),
            centre: texels.iter().map(moment).sum::<DVec3>() / area,
        }
    }
}

/// A number's place among others in the upper half of the bits.
fn ordered(x: f32) -> u64 {
    let bits = (x + 0.0).to_bits();
    u64::from(if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }) << 32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::variance::verdict::tests::{plate, sheet};

    #[test]
    fn footprints_have_equal_areas_and_are_compact() {
        let deviations = plate(200, 0.5, |x, _| x as f32);
        let all: Vec<u32> = (0..deviations.texels.len() as u32).collect();
        let found = footprints(&deviations, all, 9.0);
        // 100 x 100 mm.
        assert_eq!(found.len(), 1111);
        assert_eq!(found.iter().map(|f| f.texels.len()).sum::<usize>(), 200 * 200);
        for footprint in &found {
            assert!((footprint.area / 9.0 - 1.0).abs() < 0.12, "{}", footprint.area);
            let far = |i: &u32| footprint.centre.distance(DVec3::from(deviations.texels.position[*i as usize]));
            assert!(footprint.texels.iter().map(far).fold(0.0, f64::max) < 3.5, "{footprint:?}");
            // The deviation is the x of a place, and a footprint's median that of its middle.
            assert!((footprint.median - footprint.centre.x).abs() < 0.3, "{footprint:?}");
        }
        // A part that is smaller than a footprint is one.
        assert_eq!(footprints(&deviations, vec![0, 1, 2], 9.0).len(), 1);
        assert!(footprints(&deviations, Vec::new(), 9.0).is_empty());
    }

    #[test]
    fn sides_of_a_wall_do_not_share_footprints() {
        // Two sheets, 0.2 mm apart, with deviations of 1 and 2 mm.
        let deviations = sheet(40, 0.5, &[(0.0, 1.0, 1.0), (-0.2, -1.0, 2.0)]);
        let all: Vec<u32> = (0..deviations.texels.len() as u32).collect();
        let found = footprints(&deviations, all, 4.0);
        assert_eq!(found.len(), 200);
        for footprint in &found {
            let first = deviations.signed(footprint.texels[0] as usize);
            assert!(footprint.texels.iter().all(|i| deviations.signed(*i as usize) == first));
        }
        // What faces another way and is smaller than a footprint is no footprint of its own.
        let mut edge = sheet(40, 0.5, &[(0.0, 1.0, 1.0)]);
        edge.texels.normal[..3].fill([1.0, 0.0, 0.0]);
        let found = footprints(&edge, (0..1600).collect(), 4.0);
        assert!(found.iter().all(|f| f.area > 1.9 && f.area < 6.1), "{found:?}");
    }
}
