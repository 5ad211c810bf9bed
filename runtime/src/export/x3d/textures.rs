//! The deviations as textures: coded for shaders, and in colours for viewers without.

use super::X3dScene;
use crate::export::colormap::{AMBIGUOUS, BURIED, CONTRADICTED, FILLED, NO_DATA, NO_DATA_DARK, diverging, stripes};
use crate::export::image::{self, ImageError};
use crate::variance::{DistanceTexture, FINE_CODE, fine_end};

/// Ends of the colour scale up to which distances have fine steps: what is farther is rare.
const FINE: f64 = 3.0;

/// Colours on either side of zero: as many as are told apart on a scale of the size of a hand.
const STEPS: i32 = 24;

/// Texels a side of the colours: every second one of 1,024. They are for viewers without shaders; with every texel the
/// scene of the cup has half a megabyte more.
const COLOURED_SIDE: usize = 512;

/// The period of the stripes where there is no data. Texels of the colours.
const PERIOD: usize = 6;

/// The colours of texels without a distance, in the order of their bits in the coded texture.
const CLASSES: [(u8, [u8; 3]); 4] = [(32, FILLED), (16, BURIED), (8, CONTRADICTED), (4, AMBIGUOUS)];

/// Textures and what shaders must know of them.
pub(super) struct Textures {
    /// The distances along +normal and -normal, coded, and below them the words of the model's tiles: a PNG file whose
    /// sides are powers of two, because viewers resample others. It is one file, because Castle Game Engine 4.2 gives
    /// all textures of a shader the first of them.
    pub(super) coded: Vec<u8>,
    /// Rows of distances.
    pub(super) rows: u32,
    /// The nearer of the two in colours: a PNG file with a palette.
    pub(super) colours: Vec<u8>,
    /// The distance for which the byte `FINE_CODE` stands. Millimetres.
    pub(super) fine: f64,
}

impl Textures {
    pub(super) fn new(scene: &X3dScene<'_>, words: &[[u8; 3]]) -> Result<Self, ImageError> {
        let X3dScene { deviations, scale, robust_range, .. } = scene;
        // The surface is not to have steps where the scale of colours is small.
        let fine = FINE * scale.end.max(*robust_range);
        let texture = DistanceTexture::finer(deviations, fine);
        let fine = fine_end(fine, deviations.max_distance);
        let (width, height) = (texture.width, texture.height);
        let millimetres = |code: u8| match code.checked_sub(FINE_CODE) {
            None => f64::from(code) / f64::from(FINE_CODE) * fine,
            Some(over) => fine + f64::from(over) / f64::from(255 - FINE_CODE) * (deviations.max_distance - fine),
        };
        let number = |[outward, inward, flags]: [u8; 3], x: usize, y: usize| {
            let distance = match (flags & 128 != 0, flags & 64 != 0) {
                (true, false) => millimetres(outward),
                (true, true) if outward <= inward => millimetres(outward),
                (false, false) => {
                    let class = CLASSES.iter().position(|(bit, _)| flags & bit != 0);
                    let stripe = usize::from(stripes(x, y, PERIOD) != NO_DATA);
                    return 2 * STEPS as usize + 1 + class.map_or(stripe, |class| 2 + class);
                }
                _ => -millimetres(inward),
            };
            (STEPS + (scale.place(distance) * f64::from(STEPS)).round() as i32) as usize
        };
        let [columns, rows] = [width, height].map(|n| n as usize);
        let step = columns.max(rows).div_ceil(COLOURED_SIDE);
        let sides = [columns.div_ceil(step), rows.div_ceil(step)];
        let codes = texture.rgb.as_chunks::<3>().0;
        let places = (0..sides[1]).flat_map(|y| (0..sides[0]).map(move |x| (x, y)));
        let pixels: Vec<u8> = places.map(|(x, y)| number(codes[step * (y * columns + x)], x, y) as u8).collect();
        let colours = (-STEPS..=STEPS).map(|step| diverging(f64::from(step) / f64::from(STEPS)));
        let colours = colours.chain([NO_DATA, NO_DATA_DARK]).chain(CLASSES.map(|(_, colour)| colour));
        let colours =
            image::png_indexed(sides[0] as u32, sides[1] as u32, colours.collect::<Vec<_>>().concat(), &pixels)?;
        let mut coded = texture.rgb;
        coded.extend_from_slice(words.as_flattened());
        let sides = [columns, (coded.len() / 3 / columns).next_power_of_two()];
        coded.resize(3 * sides[0] * sides[1], 0);
        Ok(Self { coded: image::png_data(sides[0] as u32, sides[1] as u32, &coded)?, rows: height, colours, fine })
    }
}
