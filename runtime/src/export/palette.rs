//! Pictures of few colours in few bytes.

use super::image::{self, ImageError};
use super::picture::Picture;
use std::collections::HashMap;

/// The most levels of 255 by which a channel may be off.
const LEVELS: u8 = 4;

/// A PNG file with a palette, where 256 colours are enough for all channels to be off by at most four of 255 levels, as
/// in shaded surfaces of one colour. Another picture becomes a PNG file of all its colours.
///
/// # Errors
/// If the picture cannot be encoded.
pub fn png(picture: &Picture) -> Result<Vec<u8>, ImageError> {
    match [3, 4, 6].into_iter().find_map(|width| indexed(picture, width)) {
        Some((palette, pixels)) => {
            let palette = palette.as_flattened().to_vec();
            image::png_indexed(picture.width as u32, picture.height as u32, palette, &pixels)
        }
        None => super::measurement::png(picture),
    }
}

/// A palette of the means of colours that are alike, whose sums of channels differ by less than `width`, and for each
/// pixel its number. None if there are too many, or if one is off by too much.
fn indexed(picture: &Picture, width: i32) -> Option<(Vec<[u8; 3]>, Vec<u8>)> {
    let mut numbers: HashMap<[i32; 3], usize> = HashMap::new();
    let mut sums: Vec<([u64; 3], u64)> = Vec::new();
    let mut pixels = Vec::with_capacity(picture.pixels.len());
    for colour in &picture.pixels {
        let number = *numbers.entry(key(*colour, width)).or_insert_with(|| {
            sums.push(([0; 3], 0));
            sums.len() - 1
        });
        let (sum, count) = &mut sums[number];
        (0..3).for_each(|k| sum[k] += u64::from(colour[k]));
        *count += 1;
        pixels.push(u8::try_from(number).ok()?);
    }
    let mean = |(sum, count): &([u64; 3], u64)| sum.map(|s| ((s + count / 2) / count) as u8);
    let palette: Vec<[u8; 3]> = sums.iter().map(mean).collect();
    let near = |(colour, number): (&[u8; 3], &u8)| {
        (0..3).all(|k| colour[k].abs_diff(palette[usize::from(*number)][k]) <= LEVELS)
    };
    picture.pixels.iter().zip(&pixels).all(near).then_some((palette, pixels))
}

/// What alike colours have in common: their sum of channels and, roughly, their hue.
fn key([r, g, b]: [u8; 3], width: i32) -> [i32; 3] {
    let [r, g, b] = [r, g, b].map(i32::from);
    let sum = (r + g + b).max(1);
    let hue = |channel: i32| (96 * channel / sum + 1) / 2;
    [sum / width, hue(r), hue(b)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn decoded(file: Vec<u8>) -> (png::ColorType, Vec<u8>) {
        let mut decoder = png::Decoder::new(Cursor::new(file));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().expect("a picture");
        let kind = reader.info().color_type;
        let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
        reader.next_frame(&mut pixels).expect("pixels");
        (kind, pixels)
    }

    #[test]
    fn shades_of_one_colour_are_nearly_kept() {
        let shade = |i: usize| [198.0, 190.0, 178.0].map(|c| (c * (0.3 + 0.7 * i as f64 / 4095.0)).round() as u8);
        let pixels: Vec<[u8; 3]> = (0..4096).map(shade).collect();
        let picture = Picture { width: 64, height: 64, pixels };
        let (kind, read) = decoded(png(&picture).expect("a file"));
        assert_eq!(kind, png::ColorType::Indexed);
        let off = read.iter().zip(picture.pixels.as_flattened()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(off <= Some(LEVELS), "{off:?}");
    }

    #[test]
    fn many_colours_are_all_kept() {
        let pixels: Vec<[u8; 3]> = (0..4096_usize).map(|i| [i, i >> 4, i * 7].map(|c| c as u8)).collect();
        let picture = Picture { width: 64, height: 64, pixels };
        let (kind, read) = decoded(png(&picture).expect("a file"));
        assert_eq!(kind, png::ColorType::Rgb);
        assert_eq!(read, picture.pixels.as_flattened());
    }
}
