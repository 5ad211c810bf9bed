//! Deviations as textures.

use super::Deviations;
use rayon::prelude::*;

/// Texels by which colours reach beyond the charts: more than the width of the gutters between charts.
const GUTTER: usize = 8;

/// Texels of the texture per task.
const BAND: usize = 1 << 16;

/// Bit of the third channel: there is a hit along +normal.
const OUTWARD: u8 = 128;

/// Bit of the third channel: there is a hit along -normal.
const INWARD: u8 = 64;

/// Bit of the third channel: there is no distance, since the ray meets a closed hole of the scan.
const FILLED: u8 = 32;

/// Bit of the third channel: there is no distance, since the surface is inside of the model's own material.
const BURIED: u8 = 16;

/// Bit of the third channel: there is no distance, and the scan shows the space there to be empty.
const CONTRADICTED: u8 = 8;

/// Bit of the third channel: there is no distance, since what the ray meets belongs to another place of the model.
const AMBIGUOUS: u8 = 4;

/// The byte up to which the steps of [`DistanceTexture::finer`] are fine; its shaders know the number.
pub const FINE_CODE: u8 = 223;

/// Distances as the paper codes them (\[VA\] sect. 6), 3 bytes a texel, row 0 at the top: the distance along +normal
/// and that along -normal, as bytes of which 255 stands for the maximum distance; then 128 if there is a hit along
/// +normal plus 64 if there is one along -normal (or 32 alone for a closed hole of the scan, 16 alone for surface
/// inside of the model's own material, 8 alone for surface where the scan shows empty space, 4 alone where what the ray
/// meets belongs elsewhere). Texels that no chart covers take the code of the nearest covered one if it is at most 8
/// texels away, so that no seam shows under filtering, otherwise (0, 0, 0).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DistanceTexture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `3 * width * height` bytes.
    pub rgb: Vec<u8>,
}

impl DistanceTexture {
    /// Codes the deviations.
    #[must_use]
    pub fn new(deviations: &Deviations) -> Self {
        let max = deviations.max_distance;
        // Distances are not negative: adding a half and truncating rounds to nearest.
        Self::coded(deviations, &|d| (255.0 * d / max + 0.5) as u8)
    }

    /// Codes the deviations in finer steps up to `fine` millimetres, for which the byte [`FINE_CODE`] stands, and in
    /// larger ones from there to the maximum distance; in equal steps where they would not be finer.
    #[must_use]
    pub fn finer(deviations: &Deviations, fine: f64) -> Self {
        let (code, max) = (f64::from(FINE_CODE), deviations.max_distance);
        let fine = fine_end(fine, max);
        let byte = |d: f64| {
            let place = if d <= fine { code * d / fine } else { code + (255.0 - code) * (d - fine) / (max - fine) };
            (place + 0.5) as u8
        };
        Self::coded(deviations, &byte)
    }

    fn coded(deviations: &Deviations, byte: &(dyn Fn(f64) -> u8 + Sync)) -> Self {
        let (width, height) = (deviations.texels.width, deviations.texels.height);
        let mut codes = vec![[0u8; 3]; width as usize * height as usize];
        let mut covered = vec![false; codes.len()];
        let index = &deviations.texels.index;
        let rows = codes.par_chunks_mut(BAND).zip(covered.par_chunks_mut(BAND)).enumerate();
        rows.for_each(|(band, (codes, covered))| {
            let start = band * BAND;
            let first = index.partition_point(|i| (*i as usize) < start);
            for i in first..index.len() {
                let place = index[i] as usize - start;
                if place >= codes.len() {
                    break;
                }
                codes[place] = code(deviations.outward[i], deviations.inward[i], byte);
                codes[place][2] |= if deviations.is_filled(i) { FILLED } else { 0 };
                codes[place][2] |= if deviations.is_buried(i) { BURIED } else { 0 };
                codes[place][2] |= if deviations.is_contradicted(i) { CONTRADICTED } else { 0 };
                codes[place][2] |= if deviations.is_ambiguous(i) { AMBIGUOUS } else { 0 };
                covered[place] = true;
            }
        });
        dilate(&mut codes, &mut covered, width as usize);
        Self { width, height, rgb: codes.into_flattened() }
    }
}

/// The signed distance of every texel of the texture along its ray, row by row from the top, in millimetres; NaN where
/// there is no data or no chart. Nothing is rounded or dilated.
#[must_use]
pub fn signed_distances(deviations: &Deviations) -> Vec<f32> {
    let mut distances = vec![f32::NAN; deviations.texels.width as usize * deviations.texels.height as usize];
    for (i, &index) in deviations.texels.index.iter().enumerate() {
        distances[index as usize] = deviations.along(i);
    }
    distances
}

/// The end of the finer steps of [`DistanceTexture::finer`]: `fine`, or where all steps are equal. Millimetres.
#[must_use]
pub fn fine_end(fine: f64, max_distance: f64) -> f64 {
    fine.min(max_distance * f64::from(FINE_CODE) / 255.0)
}

fn code(outward: f32, inward: f32, byte: &(dyn Fn(f64) -> u8 + Sync)) -> [u8; 3] {
    let byte = |d: f32| if d.is_nan() { 0 } else { byte(f64::from(d)) };
    let flags = if outward.is_nan() { 0 } else { OUTWARD } | if inward.is_nan() { 0 } else { INWARD };
    [byte(outward), byte(inward), flags]
}

/// Gives uncovered texels the value of the nearest covered one, ring by ring, up to [`GUTTER`] texels away. `width` is
/// that of a row.
pub(crate) fn dilate(values: &mut [[u8; 3]], covered: &mut [bool], width: usize) {
    if width == 0 {
        return;
    }
    let height = covered.len() / width;
    // Direct neighbours before diagonal ones; the first in this order wins.
    const NEIGHBOURS: [(isize, isize); 8] = [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];
    let around = |i: usize| {
        let (x, y) = (i % width, i / width);
        NEIGHBOURS.into_iter().filter_map(move |(dx, dy)| {
            let (x, y) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
            (x < width && y < height).then(|| y * width + x)
        })
    };
    let near = |i: &usize| !covered[*i] && around(*i).any(|j| covered[j]);
    let of_row = |y: usize| (y * width..(y + 1) * width).filter(near);
    let mut frontier: Vec<usize> = (0..height).into_par_iter().flat_map_iter(of_row).collect();
    for ring in 0..GUTTER {
        let filled: Vec<[u8; 3]> =
            frontier.iter().map(|&i| around(i).find(|&j| covered[j]).map_or([0; 3], |j| values[j])).collect();
        for (&i, value) in frontier.iter().zip(filled) {
            values[i] = value;
            covered[i] = true;
        }
        if ring + 1 < GUTTER {
            let mut next: Vec<usize> = frontier.iter().flat_map(|&i| around(i)).filter(|&j| !covered[j]).collect();
            next.sort_unstable();
            next.dedup();
            frontier = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{DistanceTexture, signed_distances};
    use crate::model::Texels;
    use crate::variance::Deviations;

    fn deviations(width: u32, height: u32, texels: &[(u32, f32, f32)]) -> Deviations {
        let n = texels.len();
        let (outward, inward) = texels.iter().map(|t| (t.1, t.2)).unzip();
        let texels = Texels {
            width,
            height,
            index: texels.iter().map(|t| t.0).collect(),
            part: vec![0; n],
            position: vec![[0.0; 3]; n],
            normal: vec![[0.0, 0.0, 1.0]; n],
            area: vec![1.0; n],
            side: vec![1.0; n],
            part_names: vec!["body".to_owned()],
        };
        Deviations::new(texels, 2.0, outward, inward)
    }

    fn at(texture: &DistanceTexture, x: u32, y: u32) -> [u8; 3] {
        let i = 3 * (y * texture.width + x) as usize;
        [texture.rgb[i], texture.rgb[i + 1], texture.rgb[i + 2]]
    }

    #[test]
    fn codes_are_the_papers() {
        let nan = f32::NAN;
        let d = deviations(4, 1, &[(0, 2.0, nan), (1, nan, 1.0), (2, 0.0, 0.0), (3, nan, nan)]);
        let texture = DistanceTexture::new(&d);
        assert_eq!(texture.rgb, [255, 0, 128, 0, 128, 64, 0, 0, 192, 0, 0, 0]);
        let signed = signed_distances(&d);
        assert_eq!(signed[..3], [2.0, -1.0, 0.0]);
        assert!(signed[3].is_nan());
    }

    /// Every code stands for its distance to half a step.
    #[test]
    fn codes_lose_at_most_half_a_step() {
        for i in 0..=1000u32 {
            let distance = i as f32 * 0.002;
            let texture = DistanceTexture::new(&deviations(1, 1, &[(0, distance, f32::NAN)]));
            let decoded = f64::from(texture.rgb[0]) / 255.0 * 2.0;
            assert!((decoded - f64::from(distance)).abs() <= 2.0 / 255.0 / 2.0 + 1e-7);
        }
    }

    #[test]
    fn gutters_take_the_nearest_code() {
        let nan = f32::NAN;
        let mut covered: Vec<(u32, f32, f32)> = (0..40).map(|y| (y * 40, 2.0, nan)).collect();
        covered.extend((0..40).map(|y| (y * 40 + 6, nan, 2.0)));
        let mut sorted = covered;
        sorted.sort_by_key(|t| t.0);
        let texture = DistanceTexture::new(&deviations(40, 40, &sorted));
        for y in 0..40 {
            for x in 0..40 {
                let expected = match x {
                    0..=2 => Some([255, 0, 128]),
                    3 => None,
                    4..=14 => Some([0, 255, 64]),
                    _ => Some([0, 0, 0]),
                };
                assert!(expected.is_none_or(|e| e == at(&texture, x, y)), "{x} {y}");
            }
        }
    }

    #[test]
    fn missing_data_is_dilated_as_missing() {
        let texture = DistanceTexture::new(&deviations(3, 1, &[(0, f32::NAN, f32::NAN), (2, 1.0, f32::NAN)]));
        assert_eq!(at(&texture, 0, 0), [0, 0, 0]);
        let empty = DistanceTexture::new(&deviations(0, 0, &[]));
        assert!(empty.rgb.is_empty());
    }
}
