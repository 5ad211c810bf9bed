//! The standard deviation of the deviations of many objects as a picture.

use super::legend::{BINS, Legend, Theme, Tick};
use super::texture::{letters, period, with_legend};
use super::{Picture, names, number};
use crate::export::bins::Bins;
use crate::export::colormap::{NO_DATA, sequential, stripes};
use crate::export::round_up;
use crate::model::Texels;

/// The share of the texels that the scale covers.
const COVERED: f64 = 0.95;

/// The texture with every texel in the colour of the standard deviation there, from 0 to the 95th percentile, rounded
/// up to 1, 2 or 5 times a power of ten; striped where there is none. `values` are those of the whole texture, row by
/// row, in millimetres. Below it a legend with the scale and the histogram by area.
#[must_use]
pub fn spread_picture(texels: &Texels, values: &[f32]) -> Picture {
    let value = |i: usize| values.get(texels.index[i] as usize).copied().unwrap_or(f32::NAN);
    let mut known: Vec<f32> = (0..texels.len()).map(value).filter(|v| v.is_finite()).collect();
    let place = (known.len() as f64 * COVERED) as usize;
    let largest = match place < known.len() {
        true => f64::from(*known.select_nth_unstable_by(place, f32::total_cmp).1),
        false => 0.0,
    };
    let end = if largest > 0.0 { round_up(largest) } else { 1.0 };
    let mut map = Picture::new(texels.width as usize, texels.height as usize, Theme::DARK.paper);
    for i in 0..texels.len() {
        let [x, y] = texels.place(i).map(|n| n as usize);
        let share = f64::from(value(i)) / end;
        // Steps of a hundredth cannot be told apart, and take fewer bytes.
        let colour =
            if share.is_nan() { stripes(x, y, period(map.width)) } else { sequential((100.0 * share).round() / 100.0) };
        map.pixels[y * map.width + x] = colour;
    }
    let size = letters(map.width);
    names::write(&mut map, &names::names(texels, size), size);
    let places = (0..texels.len()).map(|i| (2.0 * f64::from(value(i)) / end - 1.0, f64::from(texels.area[i])));
    let bins = Bins::new(BINS, places.filter(|(place, _)| place.is_finite()));
    let tick =
        |share: f64| Tick { place: 2.0 * share - 1.0, text: number(share * end).replace('+', ""), is_main: true };
    let legend = Legend {
        below: "alike",
        above: "different",
        unit: "sd in mm",
        swatches: &[(NO_DATA, "too few")],
        ticks: &[0.0, 0.5, 1.0].map(tick),
        colour: &|place| sequential(0.5 * (place + 1.0)),
        histogram: Some((&bins, "area")),
    };
    with_legend(map, |width| legend.draw(width, size, &Theme::DARK))
}
