//! How wide texels are on the surface: the finest detail that a measurement can show.

use super::Deviations;
use super::distribution::quantiles;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

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

/// Areas of some texels in ascending order, and their longest side.
#[derive(Clone, Debug, Default)]
pub(super) struct TexelSizes {
    areas: Vec<f32>,
    longest_side: f32,
}

impl TexelSizes {
    /// The texels of each part that are not buried and have an area.
    pub(super) fn by_part(deviations: &Deviations) -> Vec<Self> {
        let texels = &deviations.texels;
        let mut parts = vec![Self::default(); texels.part_names.len()];
        for (i, area) in texels.area.iter().enumerate().filter(|(_, area)| area.is_finite() && **area > 0.0) {
            if !deviations.is_buried(i) {
                let part = &mut parts[texels.part[i] as usize];
                part.areas.push(*area);
                part.longest_side = part.longest_side.max(texels.side[i]);
            }
        }
        parts.par_iter_mut().for_each(|part| part.areas.par_sort_unstable_by(f32::total_cmp));
        parts
    }

    /// The texels of several parts together.
    pub(super) fn merge<'a>(parts: impl Iterator<Item = &'a Self>) -> Self {
        let mut merged = Self::default();
        for part in parts {
            merged.areas.extend_from_slice(&part.areas);
            merged.longest_side = merged.longest_side.max(part.longest_side);
        }
        // The stable sort finds the sorted runs and merges them.
        merged.areas.sort_by(f32::total_cmp);
        merged
    }

    /// None where no texel has an area.
    pub(super) fn widths(&self) -> Option<TexelWidths> {
        let areas = || self.areas.iter().map(|area| f64::from(*area));
        let max = areas().next_back()?.sqrt();
        let whole: f64 = areas().sum();
        let [p5, median, p95] = quantiles(areas().map(|a| (a.sqrt(), a)), [0.05, 0.5, 0.95].map(|share| share * whole));
        Some(TexelWidths { p5, median, p95, max, longest_side: f64::from(self.longest_side) })
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
