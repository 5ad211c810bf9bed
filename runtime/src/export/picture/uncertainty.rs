//! The uncertainty of the distances to a cloud as a picture.

use super::legend::{self, BINS, Legend, Theme, Tick};
use super::texture::{WIDTH, letters, period, with_legend};
use super::{Picture, number};
use crate::export::bins::Bins;
use crate::export::colormap::{class_colour, sequential, stripes};
use crate::export::glyphs::LEGIBLE;
use crate::export::round_up;
use crate::variance::{Class, CylinderSummary, Deviations};

/// The texture with every texel in the colour of the standard uncertainty of its distance, from 0 to the 95th
/// percentile, rounded up to 1, 2 or 5 times a power of ten; striped where there is no data. Below it a legend with the
/// scale and the histogram by area.
#[must_use]
pub fn uncertainty_picture(deviations: &Deviations, summary: &CylinderSummary) -> Picture {
    let end = end(summary);
    let map = map(deviations, end);
    let size = letters(map.width);
    with_legend(map, |width| legend(deviations, end, width, size))
}

/// [`uncertainty_picture`] in few pixels, for a page: at most 512 columns of means of texels.
#[must_use]
pub fn uncertainty_figure(deviations: &Deviations, summary: &CylinderSummary) -> Picture {
    let end = end(summary);
    let map = map(deviations, end);
    let map = map.reduced(map.width.div_ceil(WIDTH));
    with_legend(map, |width| legend(deviations, end, width, LEGIBLE))
}

/// Where the scale ends. Millimetres.
fn end(summary: &CylinderSummary) -> f64 {
    if summary.uncertainty_p95 > 0.0 { round_up(summary.uncertainty_p95) } else { 1.0 }
}

fn map(deviations: &Deviations, end: f64) -> Picture {
    let texels = &deviations.texels;
    let mut map = Picture::new(texels.width as usize, texels.height as usize, Theme::DARK.paper);
    for i in 0..texels.len() {
        let [x, y] = texels.place(i).map(|n| n as usize);
        map.pixels[y * map.width + x] = match deviations.class(i) {
            Class::NoData => stripes(x, y, period(map.width)),
            class => class_colour(class).unwrap_or_else(|| {
                // Steps of a hundredth cannot be told apart, and take fewer bytes.
                sequential((100.0 * f64::from(deviations.uncertainty[i]) / end).round() / 100.0)
            }),
        };
    }
    map
}

fn legend(deviations: &Deviations, end: f64, width: usize, size: usize) -> Picture {
    let measured = |i: &usize| deviations.class(*i) == Class::Measured;
    let value =
        |i: usize| (2.0 * f64::from(deviations.uncertainty[i]) / end - 1.0, f64::from(deviations.texels.area[i]));
    let bins = Bins::new(BINS, (0..deviations.texels.len()).filter(measured).map(value));
    let tick = |share: f64| Tick {
        place: 2.0 * share - 1.0,
        text: number(share * end).replace('+', ""),
        is_main: share != 0.25 && share != 0.75,
    };
    let legend = Legend {
        below: "more certain",
        above: "less certain",
        unit: "standard uncertainty in mm",
        swatches: &legend::classes(deviations),
        ticks: &[0.0, 0.25, 0.5, 0.75, 1.0].map(tick),
        colour: &|place| sequential(0.5 * (place + 1.0)),
        histogram: Some((&bins, "measured area")),
    };
    legend.draw(width, size, &Theme::DARK)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::colormap::{NO_DATA, NO_DATA_DARK};
    use crate::model::Texels;

    #[test]
    fn the_scale_ends_above_the_95th_percentile_and_no_data_is_striped() {
        let n = 600;
        let texels = Texels {
            width: 600,
            height: 1,
            index: (0..n).collect(),
            part: vec![0; 600],
            position: vec![[0.0; 3]; 600],
            normal: vec![[0.0, 0.0, 1.0]; 600],
            area: vec![1.0; 600],
            side: vec![1.0; 600],
            part_names: vec!["a".to_owned()],
        };
        let outward = (0..n).map(|i| if i < 300 { 0.1 } else { f32::NAN }).collect();
        let uncertainty = (0..n).map(|i| i as f32 * 1e-4).collect();
        let deviations = Deviations { uncertainty, ..Deviations::new(texels, 1.0, outward, vec![f32::NAN; 600]) };
        let summary = CylinderSummary::new(vec![1.0; 300], vec![15.0; 300], &deviations);
        // Those without a distance do not count.
        assert!((summary.uncertainty_p95 - 0.0285).abs() < 1e-6 && (summary.uncertainty_median - 0.015).abs() < 1e-6);
        let picture = uncertainty_picture(&deviations, &summary);
        assert_eq!([0, 250, 299].map(|i| picture.pixels[i]), [0.0, 0.5, 0.6].map(sequential));
        assert!(picture.pixels[300..600].iter().all(|pixel| [NO_DATA, NO_DATA_DARK].contains(pixel)));
        let figure = uncertainty_figure(&deviations, &summary);
        assert_eq!(figure.width, WIDTH);
    }
}
