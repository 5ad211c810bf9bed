//! How wide texels are on the surface: the finest detail that a measurement can show.

use super::Deviations;
use super::distribution::quantile;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// The widths of texels on the surface, the roots of the areas that they stand for. Percentiles are by area: on half of
/// the surface texels are wider than `median`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TexelWidths {
    /// On a twentieth of the surface they are narrower. Millimetres.
    pub p5: f64,
    /// Millimetres.
    pub median: f64,
    /// On a twentieth of the surface they are wider. Millimetres.
    pub p95: f64,
    /// The widest. Millimetres.
    pub max: f64,
    /// The longest side of a texel: the narrowest detail that none can miss. Millimetres.
    pub longest_side: f64,
}

/// Bits of a number in single precision that do not tell two areas apart: those that agree to a thousandth do, so that
/// widths are told to half of that. Sorting all areas took longer than all other statistics.
const ALIKE_BITS: u32 = 13;

/// Areas of some texels, alike ones together, and their longest side.
#[derive(Clone, Debug, Default)]
pub(super) struct TexelSizes {
    /// By the leading bits of an area, whose order is that of areas: the number and the sum of such.
    alike: HashMap<u32, Alike>,
    largest: f32,
    longest_side: f32,
}

/// Areas that are alike.
#[derive(Clone, Copy, Debug, Default)]
struct Alike {
    number: u32,
    sum: f64,
}

impl TexelSizes {
    /// The texels of each part that are not buried and have an area.
    pub(super) fn by_part(deviations: &Deviations) -> Vec<Self> {
        let texels = &deviations.texels;
        let mut parts = vec![Self::default(); texels.part_names.len()];
        // Neighbours are alike: those that follow each other are looked up once.
        let mut run: Option<(usize, u32, Alike)> = None;
        for (i, area) in texels.area.iter().copied().enumerate() {
            if !(area.is_finite() && area > 0.0) || deviations.is_buried(i) {
                continue;
            }
            let place = texels.part[i] as usize;
            let part = &mut parts[place];
            part.largest = part.largest.max(area);
            part.longest_side = part.longest_side.max(texels.side[i]);
            let key = area.to_bits() >> ALIKE_BITS;
            match &mut run {
                Some((of, of_key, alike)) if (*of, *of_key) == (place, key) => alike.add(1, f64::from(area)),
                _ => {
                    let begun = run.replace((place, key, Alike { number: 1, sum: f64::from(area) }));
                    begun.into_iter().for_each(|(of, key, alike)| parts[of].add(key, alike));
                }
            }
        }
        run.into_iter().for_each(|(of, key, alike)| parts[of].add(key, alike));
        parts
    }

    fn add(&mut self, key: u32, alike: Alike) {
        self.alike.entry(key).or_default().add(alike.number, alike.sum);
    }

    /// The texels of several parts together.
    pub(super) fn merge<'a>(parts: impl Iterator<Item = &'a Self>) -> Self {
        let mut merged = Self::default();
        for part in parts {
            // In one order whatever the hashes are: sums depend on it by rounding.
            part.in_order().into_iter().for_each(|(key, alike)| merged.add(key, alike));
            merged.largest = merged.largest.max(part.largest);
            merged.longest_side = merged.longest_side.max(part.longest_side);
        }
        merged
    }

    /// Ascending areas.
    fn in_order(&self) -> Vec<(u32, Alike)> {
        let mut all: Vec<(u32, Alike)> = self.alike.iter().map(|(key, alike)| (*key, *alike)).collect();
        all.sort_unstable_by_key(|(key, _)| *key);
        all
    }

    /// None where no texel has an area.
    pub(super) fn widths(&self) -> Option<TexelWidths> {
        let all = self.in_order();
        let whole: f64 = all.iter().map(|(_, alike)| alike.sum).sum();
        let width = |alike: &Alike| (alike.sum / f64::from(alike.number)).sqrt();
        let weighted = all.iter().map(|(_, alike)| (width(alike), alike.sum));
        let [p5, median, p95] = [0.05, 0.5, 0.95].map(|share| quantile(weighted.clone(), share * whole, 0.0, None));
        let max = f64::from(self.largest).sqrt();
        (!all.is_empty()).then(|| TexelWidths { p5, median, p95, max, longest_side: f64::from(self.longest_side) })
    }
}

impl Alike {
    fn add(&mut self, number: u32, sum: f64) {
        self.number += number;
        self.sum += sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Texels;

    #[test]
    fn percentiles_are_by_area_and_buried_texels_do_not_count() {
        // Areas 1, 2, ..., 100: below a width w lies about w^4 / 2 of 5050.
        let areas = (1..=101).map(|k| if k == 101 { 1e6 } else { k as f32 });
        let area: Vec<f32> = areas.collect();
        let n = area.len();
        let texels = Texels {
            width: n as u32,
            height: 1,
            index: (0..n as u32).collect(),
            part: vec![0; n],
            position: vec![[0.0; 3]; n],
            normal: vec![[0.0, 0.0, 1.0]; n],
            side: area.iter().map(|a| 2.0 * a.sqrt()).collect(),
            area,
            part_names: vec!["a".to_owned(), "nothing".to_owned()],
        };
        let buried = (0..n).map(|i| i == 100).collect();
        let deviations = Deviations { buried, ..Deviations::new(texels, 1.0, vec![0.0; n], vec![0.0; n]) };
        let sizes = TexelSizes::by_part(&deviations);
        let widths = sizes[0].widths().expect("there are texels");
        let expected = |share: f64| (2.0 * 5050.0 * share).powf(0.25);
        for (found, share) in [(widths.p5, 0.05), (widths.median, 0.5), (widths.p95, 0.95)] {
            assert!((found / expected(share) - 1.0).abs() < 0.01, "{found}, not {}", expected(share));
        }
        assert_eq!((widths.max, widths.longest_side), (10.0, 20.0));
        assert!(sizes[1].widths().is_none());
        assert_eq!(TexelSizes::merge(sizes.iter()).widths(), Some(widths));
    }
}
