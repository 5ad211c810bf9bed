//! Places in the order of weighted values, and what has to be looked at to find them.

use super::bins::{Bins, Weights};
use super::values::SHARES;
use std::ops::{Range, RangeInclusive};

/// Values whose distance from a centre is between two bounds, and the bins in which they are.
pub(super) struct Ring {
    pub(super) low: f64,
    pub(super) high: f64,
    /// Bins that hold some of them, on either side of the centre.
    sides: [RangeInclusive<usize>; 2],
    /// Bins all of whose values are nearer to the centre.
    pub(super) inside: Range<usize>,
}

impl Ring {
    pub(super) fn new(bins: &Bins, center: f64, low: f64, high: f64) -> Ring {
        // Rounding keeps order: a value that is greater than such an end is not in an earlier bin.
        let bin = |x: f64| bins.of(x as f32);
        let sides = [bin(center - high)..=bin(center - low), bin(center + low)..=bin(center + high)];
        let inside = sides[0].end() + 1..*sides[1].start();
        Ring { low, high, sides, inside }
    }

    pub(super) fn bins(&self) -> impl Iterator<Item = usize> {
        self.sides.iter().cloned().flatten()
    }
}

/// A value and its area as an integer of the same order: equal values by their areas, so that the order in which they were found plays
/// no role.
#[inline(always)]
pub(super) fn pack(value: f32, area: f32) -> u64 {
    let bits = value.to_bits();
    let order = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
    u64::from(order) << 32 | u64::from(area.to_bits())
}

pub(super) fn unpack(packed: u64) -> (f32, f32) {
    let order = (packed >> 32) as u32;
    let bits = if order >> 31 == 1 { order & !(1 << 31) } else { !order };
    (f32::from_bits(bits), f32::from_bits(packed as u32))
}

/// With their weights; those without are left out.
pub(super) fn weighed(values: &[u64], weighting: usize) -> Vec<(f64, f64)> {
    let weight = |area: f32| if weighting == 0 { f64::from(area) } else { 1.0 };
    let values = values.iter().map(|packed| unpack(*packed));
    values.map(|(x, area)| (f64::from(x), weight(area))).filter(|v| v.1 > 0.0).collect()
}

/// Of values that contain those of the bins around every quantile.
pub(super) fn quantiles(found: &[(f64, f64)], weights: &Weights, bins: &Bins) -> Vec<f64> {
    let of_share = |share: &f64| {
        let goal = share * weights.total();
        let first = weights.first_around(goal);
        let start = found.partition_point(|(x, _)| bins.of(*x as f32) < first);
        quantile(&found[start..], weights.before(first), goal).0
    };
    SHARES.iter().map(of_share).collect()
}

/// The value below which the weight `goal` lies: linear in cumulative weight between values, each of which stands at the middle of its
/// own weight (Hazen's rule where all weigh alike). `before` is the weight before the first. NaN where there are none. Also whether it
/// lies between two of them; else it is the first or the last.
pub(super) fn quantile(values: &[(f64, f64)], mut before: f64, goal: f64) -> (f64, bool) {
    let mut last: Option<(f64, f64)> = None;
    for &(value, weight) in values {
        let place = before + 0.5 * weight;
        if place >= goal {
            return match last {
                Some((least, from)) if place > from => {
                    (least + (value - least) * ((goal - from) / (place - from)).clamp(0.0, 1.0), true)
                }
                _ => (value, false),
            };
        }
        (last, before) = (Some((value, place)), before + weight);
    }
    (last.map_or(f64::NAN, |l| l.0), false)
}
