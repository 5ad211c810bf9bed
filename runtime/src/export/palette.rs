//! Pictures of few colours in few bytes.

use super::image::{self, ImageError};
use super::picture::Picture;
use std::collections::HashMap;

/// The most levels of 255 by which a channel may be off.
const LEVELS: u8 = 4;

/// A PNG file with a palette of 256 colours: without loss where the picture has no more; else with every channel within
/// four of 255 levels where that many are enough, as in shaded surfaces of one colour; else with the best that median
/// cut finds.
///
/// # Errors
/// If the picture cannot be encoded.
pub fn png(picture: &Picture) -> Result<Vec<u8>, ImageError> {
    let exact = || exact(picture);
    let alike = || [3, 4, 6].into_iter().find_map(|width| indexed(picture, width));
    let (palette, pixels) = exact().or_else(alike).unwrap_or_else(|| median_cut(picture));
    let palette = palette.as_flattened().to_vec();
    image::png_indexed(picture.width as u32, picture.height as u32, palette, &pixels)
}

/// A palette, and for each pixel the number of its colour.
type Indexed = (Vec<[u8; 3]>, Vec<u8>);

/// The picture's own colours; none if there are more than 256.
fn exact(picture: &Picture) -> Option<Indexed> {
    let mut numbers: HashMap<[u8; 3], u8> = HashMap::new();
    let mut palette = Vec::new();
    let mut pixels = Vec::with_capacity(picture.pixels.len());
    for colour in &picture.pixels {
        let number = match numbers.get(colour) {
            Some(number) => *number,
            None => {
                let number = u8::try_from(palette.len()).ok()?;
                palette.push(*colour);
                numbers.insert(*colour, number);
                number
            }
        };
        pixels.push(number);
    }
    Some((palette, pixels))
}

/// A palette of 256 means of boxes of colours (Heckbert, 'Color image quantization for frame buffer display', 1982):
/// the box with the largest sum of squares is divided at the mean of its widest channel.
fn median_cut(picture: &Picture) -> Indexed {
    let mut counts: HashMap<[u8; 3], u64> = HashMap::new();
    picture.pixels.iter().for_each(|colour| *counts.entry(*colour).or_default() += 1);
    let mut colours: Vec<([u8; 3], u64)> = counts.into_iter().collect();
    colours.sort_unstable();
    let mut boxes = vec![ColourBox::new(colours)];
    while boxes.len() < 256 {
        let largest = (0..boxes.len()).max_by(|a, b| boxes[*a].spread.total_cmp(&boxes[*b].spread));
        let Some(largest) = largest.filter(|k| boxes[*k].spread > 0.0) else { break };
        let (low, high) = boxes.swap_remove(largest).divided();
        boxes.extend([low, high]);
    }
    let palette: Vec<[u8; 3]> = boxes.iter().map(|b| b.mean.map(|c| c.round() as u8)).collect();
    let number = |(i, b): (usize, &ColourBox)| b.colours.iter().map(|(c, _)| (*c, i as u8)).collect::<Vec<_>>();
    let numbers: HashMap<[u8; 3], u8> = boxes.iter().enumerate().flat_map(number).collect();
    let pixels = picture.pixels.iter().map(|colour| numbers[colour]).collect();
    (palette, pixels)
}

/// Colours with the numbers of their pixels.
struct ColourBox {
    colours: Vec<([u8; 3], u64)>,
    mean: [f64; 3],
    /// The channel in which they differ the most, and the sum of the squares of these differences.
    channel: usize,
    spread: f64,
}

impl ColourBox {
    fn new(colours: Vec<([u8; 3], u64)>) -> Self {
        let count = colours.iter().map(|(_, n)| *n as f64).sum::<f64>().max(1.0);
        let sum = |value: &dyn Fn([u8; 3]) -> f64| colours.iter().map(|(c, n)| *n as f64 * value(*c)).sum::<f64>();
        let mean = [0, 1, 2].map(|k: usize| sum(&|c| f64::from(c[k])) / count);
        let spreads = [0, 1, 2].map(|k: usize| sum(&|c| (f64::from(c[k]) - mean[k]).powi(2)));
        let channel = (0..3).max_by(|a, b| spreads[*a].total_cmp(&spreads[*b])).unwrap_or(0);
        Self { colours, mean, channel, spread: spreads[channel] }
    }

    /// Both parts, below and above the mean; neither is empty where there is a spread.
    fn divided(self) -> (Self, Self) {
        let (channel, mean) = (self.channel, self.mean[self.channel]);
        let (low, high) = self.colours.into_iter().partition(|(c, _)| f64::from(c[channel]) < mean);
        (Self::new(low), Self::new(high))
    }
}

/// A palette of the means of colours that are alike, whose sums of channels differ by less than `width`, and for each
/// pixel its number. None if there are too many, or if one is off by too much.
fn indexed(picture: &Picture, width: i32) -> Option<Indexed> {
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
    fn few_colours_are_all_kept() {
        let pixels: Vec<[u8; 3]> = (0..4096_usize).map(|i| [i % 2, i % 128, 77].map(|c| c as u8)).collect();
        let picture = Picture { width: 64, height: 64, pixels };
        let (kind, read) = decoded(png(&picture).expect("a file"));
        assert_eq!(kind, png::ColorType::Indexed);
        assert_eq!(read, picture.pixels.as_flattened());
    }

    #[test]
    fn many_colours_are_nearly_kept() {
        let pixels: Vec<[u8; 3]> = (0..4096_usize).map(|i| [i % 64 * 4, i / 64 * 4, 200].map(|c| c as u8)).collect();
        let picture = Picture { width: 64, height: 64, pixels };
        let (kind, read) = decoded(png(&picture).expect("a file"));
        assert_eq!(kind, png::ColorType::Indexed);
        let off = |(a, b): (&u8, &u8)| u64::from(a.abs_diff(*b)).pow(2);
        let squares: u64 = read.iter().zip(picture.pixels.as_flattened()).map(off).sum();
        // 256 squares of 16 x 16 levels of two channels: 16 / sqrt 12 each if they were placed at best.
        let rms = (squares as f64 / (2.0 * 4096.0)).sqrt();
        assert!(rms < 6.0, "{rms}");
    }
}
