//! The scan's own colours, or else the strengths of its echoes, at the texels.
//!
//! A texel takes the colour of what it has its distance from: of a mesh the colours of a triangle's corners, mixed as
//! the place within it says; of a cloud the mean of the points in its cylinder, with the weights of the plane through
//! them.

use super::Deviations;
use super::hits::Hit;
use crate::mesh::TriangleMesh;
use crate::scan::Attributes;
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The percentiles of the texels' intensities that become black and white: a few mirrors and holes, which echo much
/// more or less than all else, do not take the contrast of the rest.
const PERCENTILES: [f64; 2] = [1.0, 99.0];

/// The grey of texels that all have one intensity.
const GREY: u8 = 128;

/// What the colours of texels are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ColourSource {
    /// The scan's colours.
    Colours,
    /// Its intensities, as greys.
    Intensities,
}

/// How the colours of texels were made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourSummary {
    /// What they are made of.
    pub source: ColourSource,
    /// How intensities became greys; none of colours.
    #[serde(flatten, default, skip_serializing_if = "Option::is_none")]
    pub stretch: Option<Stretch>,
}

/// The intensities that are black and white.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stretch {
    /// Which percentiles of the texels' intensities these are.
    pub percentiles: [f64; 2],
    /// What is not greater is black. On the scanner's own scale.
    pub black: f64,
    /// What is not less is white.
    pub white: f64,
}

/// The scan's colours at the texels.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanColours {
    /// How they were made.
    pub summary: ColourSummary,
    /// By texel, in sRGB; none where there is no distance, or where the points that it is from have no intensity.
    pub texels: Vec<Option<[u8; 3]>>,
}

/// What of a scan becomes colours: three numbers a point.
#[derive(Clone, Copy, Debug)]
pub(in crate::variance) enum Tints<'a> {
    Colours(&'a [[u8; 3]]),
    /// Three equal numbers.
    Intensities(&'a [f32]),
}

impl<'a> Tints<'a> {
    /// The colours, or else the intensities, if they are not all the same: files have fields that nobody filled.
    pub(in crate::variance) fn of(attributes: &'a Attributes) -> Option<Self> {
        fn varies<T: PartialEq>(values: &[T]) -> bool {
            values.iter().any(|value| *value != values[0])
        }
        let Attributes { colours, intensities, .. } = attributes;
        if varies(colours) {
            return Some(Self::Colours(colours));
        }
        // What is not a number differs from itself.
        let (low, high) = range(intensities.iter().copied());
        (low < high).then_some(Self::Intensities(intensities))
    }

    /// The mean of some points of the scan with their weights; NaN where none of them has a value.
    pub(in crate::variance) fn mean(&self, points: impl Iterator<Item = (u32, f64)>) -> [f32; 3] {
        let (mut sum, mut total) = (DVec3::ZERO, 0.0);
        for (point, weight) in points {
            let tint = match self {
                Self::Colours(colours) => colours.get(point as usize).map(|c| DVec3::from(c.map(f64::from))),
                Self::Intensities(intensities) => intensities.get(point as usize).map(|i| DVec3::splat(f64::from(*i))),
            };
            if let Some(tint) = tint.filter(|tint| tint.is_finite()) {
                (sum, total) = (sum + weight * tint, total + weight);
            }
        }
        if total > 0.0 { (sum / total).as_vec3().into() } else { [f32::NAN; 3] }
    }

    /// The colours of the texels, from the means that they found.
    pub(in crate::variance) fn colours(&self, found: &[[f32; 3]], deviations: &Deviations) -> ScanColours {
        let at = |i: usize| found[i].map(|tint| if deviations.along(i).is_nan() { f32::NAN } else { tint });
        let (source, stretch) = match self {
            Self::Colours(_) => (ColourSource::Colours, None),
            Self::Intensities(_) => (ColourSource::Intensities, Stretch::of((0..found.len()).map(|i| at(i)[0]))),
        };
        let byte = |tint: f32| stretch.map_or_else(|| tint.round() as u8, |stretch| stretch.grey(f64::from(tint)));
        let colour = |tint: [f32; 3]| (!tint[0].is_nan()).then(|| tint.map(byte));
        let texels = (0..found.len()).into_par_iter().map(|i| colour(at(i))).collect();
        ScanColours { summary: ColourSummary { source, stretch }, texels }
    }

    /// Those of the texels of a mesh, from the places that they have their distances from.
    pub(in crate::variance) fn of_hits(
        &self,
        hits: &[Option<Hit>],
        mesh: &TriangleMesh,
        deviations: &Deviations,
    ) -> ScanColours {
        let tint = |hit: &Option<Hit>| {
            let Some(Hit { triangle, weights }) = hit else { return [f32::NAN; 3] };
            self.mean(mesh.triangles[*triangle as usize].into_iter().zip(weights.map(f64::from)))
        };
        let found: Vec<[f32; 3]> = hits.par_iter().map(tint).collect();
        self.colours(&found, deviations)
    }
}

/// The least and the largest of some numbers, but for those that are not finite.
fn range(values: impl Iterator<Item = f32>) -> (f32, f32) {
    let values = values.filter(|value| value.is_finite());
    values.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

impl Stretch {
    /// Of the intensities of texels; none where no texel has one.
    fn of(intensities: impl Iterator<Item = f32>) -> Option<Self> {
        let mut values: Vec<f32> = intensities.filter(|value| value.is_finite()).collect();
        let last = values.len().checked_sub(1)?;
        let mut at = |percentile: f64| {
            let place = (percentile / 100.0 * last as f64).round() as usize;
            f64::from(*values.select_nth_unstable_by(place, f32::total_cmp).1)
        };
        let [black, white] = PERCENTILES.map(&mut at);
        Some(Self { percentiles: PERCENTILES, black, white })
    }

    fn grey(&self, intensity: f64) -> u8 {
        let share = (intensity - self.black) / (self.white - self.black);
        if share.is_finite() { (255.0 * share.clamp(0.0, 1.0)).round() as u8 } else { GREY }
    }
}

#[cfg(test)]
mod tests;
