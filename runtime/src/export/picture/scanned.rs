//! The scan's colours as a texture.

use super::Picture;
use super::legend::Theme;
use super::texture::{WIDTH, period};
use crate::export::colormap::{class_colour, stripes};
use crate::variance::{Class, Deviations, ScanColours, dilate};

/// The texture with every texel in the colour that the scan has there, without a legend, so that renderers can take it.
/// What has no colour has the marks of the other textures: stripes, and the colours of classes. Beside the charts it
/// goes on with the nearest texel, up to 8 texels away, so that no seam shows under filtering.
#[must_use]
pub fn colour_texture(deviations: &Deviations, colours: &ScanColours) -> Picture {
    let texels = &deviations.texels;
    let mut picture = Picture::new(texels.width as usize, texels.height as usize, Theme::DARK.paper);
    let mut covered = vec![false; picture.pixels.len()];
    for (i, colour) in colours.texels.iter().enumerate() {
        let at = texels.index[i] as usize;
        picture.pixels[at] = colour.unwrap_or_else(|| mark(deviations.class(i), at, picture.width));
        covered[at] = true;
    }
    dilate(&mut picture.pixels, &mut covered, picture.width);
    picture
}

/// [`colour_texture`] in few pixels, for a page: at most 512 columns of means of the texels that have a colour.
#[must_use]
pub fn colour_figure(deviations: &Deviations, colours: &ScanColours) -> Picture {
    let texels = &deviations.texels;
    let factor = (texels.width as usize).div_ceil(WIDTH).max(1);
    let [width, height] = [texels.width, texels.height].map(|side| (side as usize).div_ceil(factor));
    let mut found = vec![Pixel::default(); width * height];
    for (i, colour) in colours.texels.iter().enumerate() {
        let [x, y] = texels.place(i).map(|n| n as usize / factor);
        let pixel = &mut found[y * width + x];
        match colour {
            Some(colour) => {
                (0..3).for_each(|k| pixel.sum[k] += u32::from(colour[k]));
                pixel.count += 1;
            }
            None => pixel.class = Some(deviations.class(i)),
        }
    }
    let mut picture = Picture::new(width, height, Theme::DARK.paper);
    let mut covered: Vec<bool> = found.iter().map(|pixel| pixel.count > 0 || pixel.class.is_some()).collect();
    for (at, Pixel { sum, count, class }) in found.into_iter().enumerate() {
        match class {
            _ if count > 0 => picture.pixels[at] = sum.map(|sum| ((sum + count / 2) / count) as u8),
            Some(class) => picture.pixels[at] = mark(class, at, width),
            None => {}
        }
    }
    dilate(&mut picture.pixels, &mut covered, width);
    picture
}

/// The sum over the texels of a pixel.
#[derive(Clone, Copy, Default)]
struct Pixel {
    sum: [u32; 3],
    count: u32,
    /// The class of the last texel without a colour.
    class: Option<Class>,
}

/// The colour of a pixel for which the scan has none, at a place in rows of `width` pixels: that of its class, or
/// stripes, also where something was measured whose points have no intensity.
fn mark(class: Class, at: usize, width: usize) -> [u8; 3] {
    let colour = class_colour(class).filter(|_| class != Class::NoData);
    colour.unwrap_or_else(|| stripes(at % width, at / width, period(width)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::colormap::{CONTRADICTED, NO_DATA, NO_DATA_DARK};
    use crate::model::Texels;
    use crate::variance::{ColourSource, ColourSummary};

    /// A chart of 512 x 2 texels in the upper left corner of 1024 x 16: red in even columns and blue in odd ones; the
    /// last 128 columns have no data, of which those of the second half stand in empty space.
    #[test]
    fn texels_have_their_colours_and_no_data_has_marks() {
        let (columns, n) = (512_u32, 1024);
        let texels = Texels {
            width: 1024,
            height: 16,
            index: (0..2).flat_map(|row| (0..columns).map(move |x| row * 1024 + x)).collect(),
            part: vec![0; n],
            position: vec![[0.0; 3]; n],
            normal: vec![[0.0, 0.0, 1.0]; n],
            area: vec![1.0; n],
            side: vec![1.0; n],
            part_names: vec!["a".to_owned()],
        };
        let column = |i: usize| i % 512;
        let outward = (0..n).map(|i| if column(i) < 384 { 0.1 } else { f32::NAN }).collect();
        let contradicted = (0..n).map(|i| column(i) >= 448).collect();
        let deviations = Deviations { contradicted, ..Deviations::new(texels, 1.0, outward, vec![f32::NAN; n]) };
        let [red, blue] = [[200, 0, 0], [0, 0, 100]];
        let colour = |i: usize| (column(i) < 384).then_some(if i.is_multiple_of(2) { red } else { blue });
        let summary = ColourSummary { source: ColourSource::Colours, stretch: None };
        let colours = ScanColours { summary, texels: (0..n).map(colour).collect() };
        let picture = colour_texture(&deviations, &colours);
        let at = |picture: &Picture, x: usize, y: usize| picture.pixels[y * picture.width + x];
        assert_eq!((picture.width, picture.height), (1024, 16));
        assert_eq!([0, 1, 382].map(|x| at(&picture, x, 1)), [red, blue, red]);
        assert!((384..448).all(|x| [NO_DATA, NO_DATA_DARK].contains(&at(&picture, x, 0))));
        assert_eq!([448, 511].map(|x| at(&picture, x, 1)), [CONTRADICTED; 2]);
        // Beside the chart it goes on for 8 texels.
        assert_eq!([9, 10].map(|y| at(&picture, 100, y)), [red, Theme::DARK.paper]);
        let figure = colour_figure(&deviations, &colours);
        assert_eq!((figure.width, figure.height, at(&figure, 3, 0)), (512, 8, [100, 0, 50]));
        assert_eq!(at(&figure, 230, 0), CONTRADICTED);
    }
}
