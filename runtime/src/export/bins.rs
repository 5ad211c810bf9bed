//! Areas by place on a scale of colours: what histograms draw.

use super::scale::Scale;
use crate::variance::Deviations;

/// Areas in bins of equal width from one end of a scale to the other, and what is beyond the ends.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Bins {
    /// Areas from the lower end on. Square millimetres, as the others.
    pub(super) areas: Vec<f64>,
    pub(super) below: f64,
    pub(super) above: f64,
    pub(super) total: f64,
}

impl Bins {
    /// Sums areas by their places, from -1 to 1 between the ends; those without a place, or without an area, are left
    /// out.
    pub(super) fn new(count: usize, values: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut bins = Self { areas: vec![0.0; count], ..Self::default() };
        for (place, area) in values {
            if place.is_nan() || !area.is_finite() || area <= 0.0 {
                continue;
            }
            bins.total += area;
            match (place + 1.0) * 0.5 * count as f64 {
                bin if bin < 0.0 => bins.below += area,
                bin if bin < count as f64 => bins.areas[bin as usize] += area,
                // The upper end itself is on the scale.
                _ if place <= 1.0 && count > 0 => bins.areas[count - 1] += area,
                _ => bins.above += area,
            }
        }
        bins
    }

    /// The measured area of all parts, or of one, by its deviation.
    pub(super) fn of_deviations(deviations: &Deviations, scale: &Scale, count: usize, part: Option<usize>) -> Self {
        let texels = &deviations.texels;
        let is_counted = |i: &usize| part.is_none_or(|part| texels.part[*i] as usize == part);
        let value = |i: usize| (f64::from(deviations.signed(i)) / scale.end, f64::from(texels.area[i]));
        Self::new(count, (0..texels.len()).filter(is_counted).map(value))
    }

    /// The shares of the whole area.
    pub(super) fn shares(&self) -> Vec<f64> {
        self.areas.iter().map(|area| area / self.total).collect()
    }

    /// The shares below and above the scale, in percent.
    pub(super) fn beyond(&self) -> [f64; 2] {
        [self.below, self.above].map(|area| 100.0 * area / self.total)
    }
}

#[cfg(test)]
mod tests {
    use super::Bins;

    #[test]
    fn areas_are_summed_by_place() {
        let values = [(-1.0, 1.0), (-0.1, 2.0), (0.0, 4.0), (1.0, 8.0), (1.1, 16.0), (-3.0, 32.0)];
        let nothing = [(f64::NAN, 1.0), (0.5, f64::NAN), (0.5, 0.0)];
        let bins = Bins::new(2, values.into_iter().chain(nothing));
        assert_eq!(bins, Bins { areas: vec![3.0, 12.0], below: 32.0, above: 16.0, total: 63.0 });
        assert_eq!(bins.beyond(), [32.0, 16.0].map(|area| 100.0 * area / 63.0));
    }
}
