//! Deviations as a picture for people: the texture in the colours of the scale, with a legend.

use super::colormap::{AMBIGUOUS, BURIED, CONTRADICTED, FILLED, NO_DATA, diverging, texel_colour};
use super::glyphs::{GLYPH_HEIGHT, draw, text_width};
use super::round_up;
use crate::model::{SensitivityMap, SensitivityMaps, Texels};
use crate::variance::{Deviations, SensitivityRange, Statistics};

/// The colour beside the charts and behind the legend.
const BACKGROUND: [u8; 3] = [38, 38, 42];

/// The colour of the legend's letters.
const INK: [u8; 3] = [235, 235, 235];

/// A picture in sRGB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row by row from the top.
    pub pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// A picture of one colour.
    #[must_use]
    pub fn new(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Self { width, height, pixels: vec![colour; width * height] }
    }

    /// Fills a rectangle; what lies beyond the picture is cut off.
    pub fn fill(&mut self, x: usize, y: usize, width: usize, height: usize, colour: [u8; 3]) {
        for row in y.min(self.height)..(y + height).min(self.height) {
            let start = row * self.width;
            self.pixels[start + x.min(self.width)..start + (x + width).min(self.width)].fill(colour);
        }
    }

    /// Pictures of one size side by side, `columns` a row.
    #[must_use]
    pub fn sheet(pictures: &[Picture], columns: usize) -> Picture {
        let (width, height) = pictures.first().map_or((1, 1), |p| (p.width, p.height));
        let columns = columns.max(1);
        let mut sheet = Picture::new(width * columns, height * pictures.len().div_ceil(columns).max(1), [255; 3]);
        for (i, picture) in pictures.iter().enumerate() {
            let (left, top) = (i % columns * width, i / columns * height);
            for y in 0..picture.height.min(height) {
                let from = &picture.pixels[y * picture.width..][..picture.width.min(width)];
                let start = (top + y) * sheet.width + left;
                sheet.pixels[start..start + from.len()].copy_from_slice(from);
            }
        }
        sheet
    }
}

/// A sensible end for the colour scale: the 95th percentile of the unsigned distances, rounded up to 1, 2 or 5 times a
/// power of ten; the maximum distance where nothing was measured or everything is exact.
#[must_use]
pub fn scale_end(statistics: &Statistics, max_distance: f64) -> f64 {
    let p95 = statistics.weighted.percentiles.p95;
    if p95.is_nan() || p95 < 1e-9 {
        return max_distance;
    }
    round_up(p95).min(max_distance)
}

/// The texture with every texel in the colour of its signed distance on a scale that ends at `end` millimetres, grey
/// where there is no data; below it a legend with the scale, its unit and what its ends mean.
#[must_use]
pub fn deviation_picture(deviations: &Deviations, end: f64) -> Picture {
    texel_picture(deviations, end, |_| true)
}

/// As [`deviation_picture`], with the colour of zero where the deviation is not above the level of its part. `levels`
/// are in millimetres, one a part.
#[must_use]
pub fn significance_picture(deviations: &Deviations, end: f64, levels: &[f64]) -> Picture {
    let level = |i: usize| levels.get(deviations.texels.part[i] as usize).copied().unwrap_or(0.0);
    texel_picture(deviations, end, |i| f64::from(deviations.signed(i)).abs() > level(i).max(deviations.precision))
}

/// The texture with every texel in the colour of its probability of conformance, grey where it has none, as where
/// nothing was measured or its part has no tolerance; below it a legend. Conformance is blue, so that red stands for
/// what is beyond the tolerance with certainty.
#[must_use]
pub fn conformance_picture(deviations: &Deviations, probabilities: &[f32]) -> Picture {
    let (width, height) = (deviations.texels.width as usize, deviations.texels.height as usize);
    let words = Legend {
        below: "within",
        above: "beyond",
        unit: "probability of conformance",
        swatches: &[(NO_DATA, "none")],
        label: &|tick| (0.5 - 0.5 * tick).to_string(),
    };
    let drawn = probabilities.iter().enumerate().map(|(i, probability)| {
        let place = 1.0 - 2.0 * f64::from(*probability);
        (deviations.texels.place(i), diverging(place))
    });
    with_legend([width, height], legend(width.max(256), &words), drawn)
}

/// A picture of the texels. Those with a distance that are not `shown` get the colour of zero.
fn texel_picture(deviations: &Deviations, end: f64, shown: impl Fn(usize) -> bool) -> Picture {
    let (width, height) = (deviations.texels.width as usize, deviations.texels.height as usize);
    let mut swatches = vec![(NO_DATA, "no data")];
    if deviations.filled.contains(&true) {
        swatches.push((FILLED, "filled hole"));
    }
    if deviations.buried.contains(&true) {
        swatches.push((BURIED, "buried"));
    }
    if deviations.contradicted.contains(&true) {
        swatches.push((CONTRADICTED, "empty space"));
    }
    if deviations.ambiguous.contains(&true) {
        swatches.push((AMBIGUOUS, "ambiguous"));
    }
    let label = |tick: f64| number(tick * end);
    let words =
        Legend { below: "- scan inside", above: "scan outside +", unit: "mm", swatches: &swatches, label: &label };
    let drawn = (0..deviations.texels.len()).map(|i| {
        let distance = f64::from(deviations.signed(i));
        let drawn = if distance.is_nan() || shown(i) { distance } else { 0.0 };
        (deviations.texels.place(i), texel_colour(deviations, i, drawn, end))
    });
    with_legend([width, height], legend(width.max(256), &words), drawn)
}

/// Pixels of a texture, by column and row, above a legend.
fn with_legend(
    [width, height]: [usize; 2],
    legend: Picture,
    pixels: impl Iterator<Item = ([u32; 2], [u8; 3])>,
) -> Picture {
    let mut picture = Picture::new(width.max(256), height + legend.height, BACKGROUND);
    for ([x, y], colour) in pixels {
        picture.pixels[y as usize * picture.width + x as usize] = colour;
    }
    let start = height * picture.width;
    picture.pixels[start..].copy_from_slice(&legend.pixels);
    picture
}

/// A map of the surface's movement along its normal for a unit of a parameter: in the colours of the deviations on a
/// scale up to the largest of them, grey where no part depends on it; below it a legend. Smaller than the texture where
/// not every texel was evaluated.
#[must_use]
pub fn sensitivity_picture(
    maps: &SensitivityMaps,
    map: &SensitivityMap,
    range: &SensitivityRange,
    texels: &Texels,
) -> Picture {
    let step = maps.step.max(1);
    let [width, height] = [texels.width, texels.height].map(|n| n.div_ceil(step) as usize);
    let largest = range.max.abs().max(range.min.abs());
    let end = if largest > 0.0 { largest } else { 1.0 };
    let swatches = [(NO_DATA, "no effect")];
    let heading = format!("by {}", map.parameter);
    let words = Legend {
        below: "- inwards",
        above: "outwards +",
        unit: &format!("{} {heading}", range.unit),
        swatches: &swatches,
        label: &|tick| number(tick * end),
    };
    let drawn = map.values.iter().zip(&maps.texels).map(|(value, i)| {
        let place = texels.place(*i as usize).map(|n| n / step);
        (place, diverging(f64::from(*value) / end))
    });
    with_legend([width, height], legend(width.max(256), &words), drawn)
}

/// The words of a legend.
struct Legend<'a> {
    /// The meaning of the lower end of the scale.
    below: &'a str,
    /// The meaning of the upper end.
    above: &'a str,
    unit: &'a str,
    /// Colours beside the scale, and their meaning.
    swatches: &'a [([u8; 3], &'a str)],
    /// The label of a place on the scale, from -1 to 1.
    label: &'a dyn Fn(f64) -> String,
}

fn legend(width: usize, words: &Legend<'_>) -> Picture {
    let scale = (width / 360).max(1);
    let line = (GLYPH_HEIGHT + 3) * scale;
    let bar_height = 10 * scale;
    let mut legend = Picture::new(width, 3 * line + bar_height + 2 * scale, BACKGROUND);
    let swatch = 8 * scale;
    let widest = words.swatches.iter().map(|(_, text)| text_width(text, scale)).max();
    let beside = widest.map_or(0, |text| text + swatch + 3 * scale);
    let left = text_width(&(words.label)(-1.0), scale) / 2 + 2 * scale;
    let bar_width = width.saturating_sub(2 * left + beside + 8 * scale).max(2);
    for x in 0..bar_width {
        let value = 2.0 * x as f64 / (bar_width - 1) as f64 - 1.0;
        legend.fill(left + x, line, 1, bar_height, diverging(value));
    }
    let right = (left + bar_width).saturating_sub(text_width(words.above, scale));
    draw(&mut legend, left, scale, scale, INK, words.below);
    draw(&mut legend, right, scale, scale, INK, words.above);
    let below = line + bar_height + 3 * scale;
    for tick in [-1.0, -0.5, 0.0, 0.5, 1.0] {
        let x = left + ((tick + 1.0) / 2.0 * (bar_width - 1) as f64) as usize;
        legend.fill(x, line + bar_height, scale, 2 * scale, INK);
        let text = (words.label)(tick);
        draw(&mut legend, x.saturating_sub(text_width(&text, scale) / 2), below, scale, INK, &text);
    }
    let middle = left + bar_width / 2;
    draw(&mut legend, middle.saturating_sub(text_width(words.unit, scale) / 2), below + line, scale, INK, words.unit);
    let side = left + bar_width + left + 2 * scale;
    for (k, (colour, text)) in words.swatches.iter().enumerate() {
        let top = line + scale + k * line;
        legend.fill(side, top, swatch, swatch, *colour);
        draw(&mut legend, side + swatch + 3 * scale, top, scale, INK, text);
    }
    legend
}

/// A tick's label: signed, with at most four significant digits.
fn number(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let magnitude = x.abs().log10().floor();
    if !(-4.0..4.0).contains(&magnitude) {
        return format!("{x:+.1e}");
    }
    let text = format!("{x:+.*}", (3.0 - magnitude) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::{BACKGROUND, conformance_picture, deviation_picture, number};
    use crate::export::colormap::{AMBIGUOUS, BURIED, CONTRADICTED, FILLED, NO_DATA, diverging};
    use crate::model::Texels;
    use crate::variance::Deviations;

    #[test]
    fn texels_have_their_colours_and_the_legend_is_below() {
        let texels = Texels {
            width: 300,
            height: 4,
            index: vec![0, 301, 602],
            part: vec![0; 3],
            position: vec![[0.0; 3]; 3],
            normal: vec![[0.0, 0.0, 1.0]; 3],
            area: vec![1.0; 3],
            side: vec![1.0; 3],
            part_names: vec!["a".to_owned()],
        };
        let deviations = Deviations::new(texels, 2.0, vec![0.25, f32::NAN, f32::NAN], vec![1.5, 0.5, f32::NAN]);
        let filled = Deviations { filled: vec![false, false, true], ..deviations.clone() };
        let picture = deviation_picture(&filled, 0.5);
        assert_eq!(picture.pixels[602], FILLED);
        assert!(picture.pixels[4 * 300..].contains(&FILLED));
        let buried = Deviations { buried: vec![false, false, true], ..deviations.clone() };
        let picture = deviation_picture(&buried, 0.5);
        assert_eq!(picture.pixels[602], BURIED);
        assert!(picture.pixels[4 * 300..].contains(&BURIED));
        let contradicted = Deviations { contradicted: vec![false, false, true], ..deviations.clone() };
        let picture = deviation_picture(&contradicted, 0.5);
        assert_eq!(picture.pixels[602], CONTRADICTED);
        assert!(picture.pixels[4 * 300..].contains(&CONTRADICTED));
        let ambiguous = Deviations { ambiguous: vec![false, false, true], ..deviations.clone() };
        let picture = deviation_picture(&ambiguous, 0.5);
        assert_eq!(picture.pixels[602], AMBIGUOUS);
        assert!(picture.pixels[4 * 300..].contains(&AMBIGUOUS));
        let picture = deviation_picture(&deviations, 0.5);
        assert_eq!(picture.width, 300);
        assert_eq!(picture.pixels.len(), picture.width * picture.height);
        assert_eq!(picture.pixels[0], diverging(0.5));
        assert_eq!(picture.pixels[301], diverging(-1.0));
        assert_eq!(picture.pixels[602], NO_DATA);
        assert_eq!(picture.pixels[1], BACKGROUND);
        let conformance = conformance_picture(&deviations, &[1.0, 0.0, f32::NAN]);
        assert_eq!([0, 301, 602].map(|i| conformance.pixels[i]), [diverging(-1.0), diverging(1.0), NO_DATA]);
        let legend = &picture.pixels[4 * 300..];
        for colour in [diverging(-1.0), diverging(1.0), NO_DATA] {
            assert!(legend.contains(&colour));
        }
    }

    #[test]
    fn labels_are_short() {
        let labels: Vec<String> = [-0.5, 0.25, 0.0, 10.0, 2e-7, -12345.0, 16.956777, -2000.0].map(number).to_vec();
        assert_eq!(labels, ["-0.5", "+0.25", "0", "+10", "+2.0e-7", "-1.2e4", "+16.96", "-2000"]);
    }
}
