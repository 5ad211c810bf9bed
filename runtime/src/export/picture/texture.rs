//! Textures as pictures: every texel in the colour of a scale, above a legend.

use super::legend::{self, Legend, Theme, Tick, ticks};
use super::{Picture, names};
use crate::export::bins::Bins;
use crate::export::colormap::{NO_DATA, diverging, stripes, texel_colour};
use crate::export::glyphs::LEGIBLE;
use crate::export::scale::Scale;
use crate::model::{SensitivityMap, SensitivityMaps, Texels};
use crate::variance::{Class, Deviations, SensitivityRange};

/// The least width of a picture with a legend, and that for which the least letters are meant; wider pictures have
/// larger ones, since they are shown smaller.
pub(super) const WIDTH: usize = 512;

/// The texture with every texel in the colour of its signed distance, striped where there is no data, with the names of
/// the parts; below it a legend with the scale, its unit, what its ends mean, and the histogram of the deviations.
#[must_use]
pub fn deviation_picture(deviations: &Deviations, scale: &Scale) -> Picture {
    texel_picture(deviations, scale, &legend::classes(deviations), |_| true)
}

/// As [`deviation_picture`], with the colour of zero where the deviation is not above the level of its part. `levels`
/// are in millimetres, one a part.
#[must_use]
pub fn significance_picture(deviations: &Deviations, scale: &Scale, levels: &[f64]) -> Picture {
    let level = |i: usize| levels.get(deviations.texels.part[i] as usize).copied().unwrap_or(0.0);
    let mut swatches = legend::classes(deviations);
    swatches.push((diverging(0.0), "below the level of detection"));
    let is_shown = |i: usize| f64::from(deviations.signed(i)).abs() > level(i).max(deviations.precision);
    texel_picture(deviations, scale, &swatches, is_shown)
}

/// The texture with every texel in the colour of its probability of conformance, striped where it has none, as where
/// nothing was measured or its part has no tolerance; below it a legend. Conformance is blue, so that red stands for
/// what is beyond the tolerance with certainty.
#[must_use]
pub fn conformance_picture(deviations: &Deviations, probabilities: &[f32]) -> Picture {
    let map = conformance_map(deviations, probabilities);
    let size = letters(map.width);
    with_legend(map, |width| conformance_legend(deviations, probabilities, width, size))
}

/// [`conformance_picture`] in few pixels, for a page: at most 512 columns of means of texels.
#[must_use]
pub fn conformance_figure(deviations: &Deviations, probabilities: &[f32]) -> Picture {
    let map = conformance_map(deviations, probabilities);
    let map = map.reduced(map.width.div_ceil(WIDTH));
    with_legend(map, |width| conformance_legend(deviations, probabilities, width, LEGIBLE))
}

fn conformance_map(deviations: &Deviations, probabilities: &[f32]) -> Picture {
    let texels = &deviations.texels;
    let mut map = Picture::new(texels.width as usize, texels.height as usize, Theme::DARK.paper);
    for (i, probability) in probabilities.iter().enumerate() {
        let [x, y] = texels.place(i).map(|n| n as usize);
        // Steps of a hundredth cannot be told apart, and take fewer bytes.
        let place = 1.0 - 0.02 * f64::from((100.0 * probability).round());
        let colour = if place.is_nan() { stripes(x, y, period(map.width)) } else { diverging(place) };
        map.pixels[y * map.width + x] = colour;
    }
    map
}

fn conformance_legend(deviations: &Deviations, probabilities: &[f32], width: usize, size: usize) -> Picture {
    let places = probabilities.iter().map(|probability| 1.0 - 2.0 * f64::from(*probability));
    let areas = deviations.texels.area.iter().map(|area| f64::from(*area));
    let bins = Bins::new(legend::BINS, places.zip(areas));
    let tick = |place: f64| Tick { place, text: (0.5 - 0.5 * place).to_string(), is_main: true };
    let legend = Legend {
        below: "within",
        above: "beyond",
        unit: "probability",
        swatches: &[(NO_DATA, "no data, or no tolerance")],
        ticks: &[-1.0, -0.5, 0.0, 0.5, 1.0].map(tick),
        colour: &diverging,
        histogram: Some((&bins, "area")),
    };
    legend.draw(width, size, &Theme::DARK)
}

/// A picture of the texels. Those with a distance that are not `shown` get the colour of zero.
fn texel_picture(
    deviations: &Deviations,
    scale: &Scale,
    swatches: &[([u8; 3], &str)],
    shown: impl Fn(usize) -> bool,
) -> Picture {
    let texels = &deviations.texels;
    let mut map = Picture::new(texels.width as usize, texels.height as usize, Theme::DARK.paper);
    for i in 0..texels.len() {
        let [x, y] = texels.place(i).map(|n| n as usize);
        let distance = f64::from(deviations.signed(i));
        let drawn = if distance.is_nan() || shown(i) { distance } else { 0.0 };
        map.pixels[y * map.width + x] = match deviations.class(i) {
            Class::NoData => stripes(x, y, period(map.width)),
            _ => texel_colour(deviations, i, drawn, scale),
        };
    }
    let size = letters(map.width);
    names::write(&mut map, &names::names(texels, size), size);
    with_legend(map, |width| legend::of_classes(deviations, scale, swatches, [width, size], &Theme::DARK))
}

/// Pixels a dot of the letters in a picture of this width.
pub(super) fn letters(width: usize) -> usize {
    LEGIBLE.max(width / WIDTH)
}

/// The period of the stripes in a picture of this width, in pixels.
pub(super) fn period(width: usize) -> usize {
    (width / 85).max(6)
}

/// A map above its legend, which is made for the width of both.
pub(super) fn with_legend(map: Picture, legend: impl Fn(usize) -> Picture) -> Picture {
    let legend = legend(map.width.max(WIDTH));
    let mut picture = Picture::new(legend.width, map.height + legend.height, Theme::DARK.paper);
    picture.put(&map, 0, 0);
    picture.put(&legend, 0, map.height);
    picture
}

/// A map of the surface's movement along its normal for a unit of a parameter: in the colours of the deviations on a
/// scale up to the largest of them, striped where no part depends on it; below it a legend. Smaller than the texture
/// where not every texel was evaluated.
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
    let scale = Scale::continuous(if largest > 0.0 { largest } else { 1.0 });
    let mut picture = Picture::new(width, height, Theme::DARK.paper);
    for (value, i) in map.values.iter().zip(&maps.texels) {
        let [x, y] = texels.place(*i as usize).map(|n| (n / step) as usize);
        let colour = if value.is_nan() { stripes(x, y, period(width)) } else { scale.colour(f64::from(*value)) };
        picture.pixels[y * width + x] = colour;
    }
    let unit = format!("{} by {}", range.unit, map.parameter);
    let legend = Legend {
        below: "- inwards",
        above: "outwards +",
        unit: &unit,
        swatches: &[(NO_DATA, "no effect")],
        ticks: &ticks(&scale),
        colour: &diverging,
        histogram: None,
    };
    with_legend(picture, |whole| legend.draw(whole, letters(width), &Theme::DARK))
}

#[cfg(test)]
mod tests {
    use super::{Scale, Theme, WIDTH, conformance_figure, conformance_picture, deviation_picture};
    use crate::export::colormap::{AMBIGUOUS, BURIED, CONTRADICTED, FILLED, NO_DATA, NO_DATA_DARK, diverging};
    use crate::model::Texels;
    use crate::variance::{Deviations, Tolerance};

    fn deviations() -> Deviations {
        let texels = Texels {
            width: 600,
            height: 4,
            index: vec![0, 601, 1202, 1206],
            part: vec![0; 4],
            position: vec![[0.0; 3]; 4],
            normal: vec![[0.0, 0.0, 1.0]; 4],
            area: vec![1.0; 4],
            side: vec![1.0; 4],
            part_names: vec!["a".to_owned()],
        };
        let (outward, inward) = (vec![0.25, f32::NAN, f32::NAN, f32::NAN], vec![1.5, 0.5, f32::NAN, f32::NAN]);
        Deviations::new(texels, 2.0, outward, inward)
    }

    #[test]
    fn classes_have_colours_of_their_own() {
        let (scale, mark) = (Scale::continuous(0.5), vec![false, false, true, false]);
        let deviations = deviations();
        for (marked, colour) in [
            (Deviations { filled: mark.clone(), ..deviations.clone() }, FILLED),
            (Deviations { buried: mark.clone(), ..deviations.clone() }, BURIED),
            (Deviations { contradicted: mark.clone(), ..deviations.clone() }, CONTRADICTED),
            (Deviations { ambiguous: mark.clone(), ..deviations.clone() }, AMBIGUOUS),
        ] {
            let picture = deviation_picture(&marked, &scale);
            assert_eq!(picture.pixels[1202], colour);
            assert!(picture.pixels[4 * 600..].contains(&colour), "in the legend");
        }
    }

    #[test]
    fn texels_have_their_colours_and_the_legend_is_below() {
        let picture = deviation_picture(&deviations(), &Scale::continuous(0.5));
        assert_eq!(picture.width, 600);
        assert_eq!(picture.pixels.len(), picture.width * picture.height);
        assert_eq!([0, 601].map(|i| picture.pixels[i]), [diverging(0.5), diverging(-1.0)]);
        assert_eq!(picture.pixels[1], Theme::DARK.paper);
        // The period of the stripes is seven pixels: places 4 and 8 from the corner lie in different ones.
        let tones = [1202, 1206].map(|i| picture.pixels[i]);
        assert!(tones == [NO_DATA_DARK, NO_DATA] || tones == [NO_DATA, NO_DATA_DARK], "{tones:?}");
        let legend = &picture.pixels[4 * 600..];
        for colour in [diverging(-1.0), diverging(1.0), NO_DATA, NO_DATA_DARK, Theme::DARK.bars] {
            assert!(legend.contains(&colour), "{colour:?}");
        }
        let scale = Scale { end: 0.9, tolerance: Some(Tolerance { lower: -0.3, upper: 0.3 }) };
        let followed = deviation_picture(&deviations(), &scale);
        assert_eq!([0, 601].map(|i| followed.pixels[i]), [diverging(0.0), diverging(-0.5)]);
    }

    #[test]
    fn conformance_is_blue() {
        let (deviations, map) = (deviations(), [1.0, 0.0, f32::NAN, f32::NAN]);
        let picture = conformance_picture(&deviations, &map);
        assert_eq!([0, 601].map(|i| picture.pixels[i]), [diverging(-1.0), diverging(1.0)]);
        let tones = [1202, 1206].map(|i| picture.pixels[i]);
        assert!(tones.contains(&NO_DATA) && tones.contains(&NO_DATA_DARK));
        let small = conformance_figure(&deviations, &map);
        assert!(small.width == WIDTH && small.height < picture.height);
    }
}
