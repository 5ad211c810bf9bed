//! Legends of pictures: the bar of a scale with its ticks, unit and meaning, the histogram along it, and swatches.

use super::{Picture, number};
use crate::export::bins::Bins;
use crate::export::colormap::{AMBIGUOUS, BURIED, CONTRADICTED, FILLED, NO_DATA, stripes};
use crate::export::glyphs::{GLYPH_HEIGHT, draw, text_width};
use crate::export::scale::Scale;
use crate::variance::Deviations;

/// The colours behind and of a legend's letters.
#[derive(Clone, Copy, Debug)]
pub(in crate::export) struct Theme {
    pub(in crate::export) paper: [u8; 3],
    pub(in crate::export) ink: [u8; 3],
    /// The bars of the histogram.
    pub(in crate::export) bars: [u8; 3],
}

impl Theme {
    /// That of the textures.
    pub(in crate::export) const DARK: Self = Self { paper: [38, 38, 42], ink: [235, 235, 235], bars: [150, 154, 162] };
    /// That of views.
    pub(in crate::export) const LIGHT: Self = Self { paper: [250, 250, 251], ink: [60, 62, 66], bars: [138, 144, 153] };
}

/// The bins of a legend's histogram.
pub(in crate::export) const BINS: usize = 60;

/// The rows of a histogram, in dots of the letters.
const HISTOGRAM_HEIGHT: usize = 36;

/// A label of the scale.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::export) struct Tick {
    /// Its place on the bar, from -1 to 1.
    pub(in crate::export) place: f64,
    pub(in crate::export) text: String,
    /// Whether it goes before others where there is no room for all.
    pub(in crate::export) is_main: bool,
}

/// The content of a legend.
pub(in crate::export) struct Legend<'a> {
    /// The meaning of the lower end of the scale.
    pub(in crate::export) below: &'a str,
    /// The meaning of the upper end.
    pub(in crate::export) above: &'a str,
    pub(in crate::export) unit: &'a str,
    /// Colours of classes, and their meaning.
    pub(in crate::export) swatches: &'a [([u8; 3], &'a str)],
    /// Ascending.
    pub(in crate::export) ticks: &'a [Tick],
    /// The colour at a place of the bar, from -1 to 1.
    pub(in crate::export) colour: &'a dyn Fn(f64) -> [u8; 3],
    /// The histogram along the bar, and what its bars are.
    pub(in crate::export) histogram: Option<(&'a Bins, &'a str)>,
}

/// The ticks of a scale of deviations.
pub(in crate::export) fn ticks(scale: &Scale) -> Vec<Tick> {
    let tick = |d: f64| Tick { place: d / scale.end, text: number(d), is_main: scale.is_main(d) };
    scale.ticks().into_iter().map(tick).collect()
}

/// The classes that a measurement has, with their colours: those without a distance.
pub(in crate::export) fn classes(deviations: &Deviations) -> Vec<([u8; 3], &'static str)> {
    let has = |marks: &[bool]| marks.contains(&true);
    let classes = [
        (true, NO_DATA, "no data"),
        (has(&deviations.filled), FILLED, "filled hole"),
        (has(&deviations.buried), BURIED, "buried"),
        (has(&deviations.contradicted), CONTRADICTED, "empty space"),
        (has(&deviations.ambiguous), AMBIGUOUS, "ambiguous"),
    ];
    classes.into_iter().filter(|(is_there, ..)| *is_there).map(|(_, colour, text)| (colour, text)).collect()
}

/// A legend for the deviations of a measurement, `width` pixels wide, in letters of `size` pixels a dot.
pub(in crate::export) fn of_deviations(
    deviations: &Deviations,
    scale: &Scale,
    [width, size]: [usize; 2],
    theme: &Theme,
) -> Picture {
    of_classes(deviations, scale, &classes(deviations), [width, size], theme)
}

/// As [`of_deviations`], with these swatches.
pub(super) fn of_classes(
    deviations: &Deviations,
    scale: &Scale,
    swatches: &[([u8; 3], &str)],
    [width, size]: [usize; 2],
    theme: &Theme,
) -> Picture {
    let bins = Bins::of_deviations(deviations, scale, BINS, None);
    let legend = Legend {
        below: "- scan inside",
        above: "scan outside +",
        unit: "mm",
        swatches,
        ticks: &ticks(scale),
        colour: &|place| scale.colour(place * scale.end),
        histogram: Some((&bins, "measured area")),
    };
    legend.draw(width, size, theme)
}

impl Legend<'_> {
    /// Draws the legend, `width` pixels wide and as high as it needs to be, in letters of `size` pixels a dot.
    pub(in crate::export) fn draw(&self, width: usize, size: usize, theme: &Theme) -> Picture {
        let line = (GLYPH_HEIGHT + 4) * size;
        let widest = self.ticks.iter().map(|tick| text_width(&tick.text, size)).max().unwrap_or(0);
        let left = widest / 2 + 4 * size;
        let bar = width.saturating_sub(2 * left).max(2);
        let histogram = self.histogram.filter(|(bins, _)| bins.total > 0.0);
        let beyond = histogram.map_or([0.0; 2], |(bins, _)| bins.beyond());
        let is_beyond = beyond != [0.0; 2];
        let swatches = self.flow(width, size);
        let lines = 4 + usize::from(is_beyond) + swatches.last().map_or(0, |(_, row)| row + 1);
        let high = histogram.map_or(0, |_| HISTOGRAM_HEIGHT * size);
        let mut picture = Picture::new(width, 12 * size + high + lines * line, theme.paper);

        let mut y = 4 * size;
        draw(&mut picture, left, y, size, theme.ink, self.below);
        let right = (left + bar).saturating_sub(text_width(self.above, size));
        draw(&mut picture, right, y, size, theme.ink, self.above);
        y += line;
        if let Some((bins, _)) = histogram {
            bars(&mut picture, bins, [left, y, bar, high], theme);
        }
        y += high;
        for x in 0..bar {
            let place = 2.0 * (x as f64 + 0.5) / bar as f64 - 1.0;
            picture.fill(left + x, y, 1, 8 * size, (self.colour)(place));
        }
        y += 8 * size;
        self.label(&mut picture, [left, y, bar, size], theme);
        y += line + 3 * size;
        let middle = |text: &str| (width / 2).saturating_sub(text_width(text, size) / 2);
        let unit = match histogram {
            Some((_, bars)) => format!("{}; bars: {bars}", self.unit),
            None => self.unit.to_owned(),
        };
        draw(&mut picture, middle(&unit), y, size, theme.ink, &unit);
        y += line;
        if is_beyond {
            let [below, above] = beyond;
            let beyond = format!("beyond: {below:.1} % below, {above:.1} % above");
            draw(&mut picture, middle(&beyond), y, size, theme.ink, &beyond);
            y += line;
        }
        for ((colour, text), (x, row)) in self.swatches.iter().zip(&swatches) {
            let top = y + row * line + 2 * size;
            swatch(&mut picture, [*x, top], size, *colour);
            draw(&mut picture, x + 11 * size, top, size, theme.ink, text);
        }
        picture
    }

    /// Left edges and rows of the swatches.
    fn flow(&self, width: usize, size: usize) -> Vec<(usize, usize)> {
        let (mut x, mut row) = (4 * size, 0);
        let mut places = Vec::with_capacity(self.swatches.len());
        for (_, text) in self.swatches {
            let wide = 18 * size + text_width(text, size);
            if x > 4 * size && x + wide > width {
                (x, row) = (4 * size, row + 1);
            }
            places.push((x, row));
            x += wide;
        }
        places
    }

    /// Draws ticks and their labels; main ones first, others where they have room.
    fn label(&self, picture: &mut Picture, [left, y, bar, size]: [usize; 4], theme: &Theme) {
        let mut taken: Vec<[usize; 2]> = Vec::new();
        let (main, other): (Vec<&Tick>, Vec<&Tick>) = self.ticks.iter().partition(|tick| tick.is_main);
        for tick in main.into_iter().chain(other) {
            let x = left + ((tick.place + 1.0) / 2.0 * (bar - 1) as f64).round() as usize;
            picture.fill(x.saturating_sub(size / 2), y, size, 2 * size, theme.ink);
            let wide = text_width(&tick.text, size);
            let start = x.saturating_sub(wide / 2);
            let range = [start, start + wide];
            // Signs and digits of neighbours are read together without a gap.
            let gap = text_width("0", size);
            if taken.iter().all(|other| range[1] + gap < other[0] || other[1] + gap < range[0]) {
                draw(picture, start, y + 3 * size, size, theme.ink, &tick.text);
                taken.push(range);
            }
        }
    }
}

/// A square in the colour of a class; that of no data has its stripes.
fn swatch(picture: &mut Picture, [left, top]: [usize; 2], size: usize, colour: [u8; 3]) {
    let side = 8 * size;
    picture.fill(left, top, side, side, colour);
    if colour == NO_DATA {
        for y in top..top + side {
            for x in left..left + side {
                picture.fill(x, y, 1, 1, stripes(x, y, side / 2));
            }
        }
    }
}

/// The bars of a histogram in a rectangle: left, top, width, height.
fn bars(picture: &mut Picture, bins: &Bins, [left, top, width, height]: [usize; 4], theme: &Theme) {
    let most = bins.areas.iter().copied().fold(0.0, f64::max);
    if most <= 0.0 {
        return;
    }
    let count = bins.areas.len();
    for (bin, area) in bins.areas.iter().enumerate().filter(|(_, area)| **area > 0.0) {
        let [start, end] = [bin, bin + 1].map(|edge| left + edge * width / count);
        let high = ((area / most * height as f64).ceil() as usize).min(height);
        let wide = (end - start).saturating_sub(1).max(1);
        picture.fill(start, top + height - high, wide, high, theme.bars);
    }
}

#[cfg(test)]
mod tests {
    use super::{Bins, Legend, Theme, Tick};
    use crate::export::colormap::{BURIED, NO_DATA, NO_DATA_DARK, diverging};

    fn tick(place: f64, is_main: bool) -> Tick {
        Tick { place, text: "+0.125".to_owned(), is_main }
    }

    #[test]
    fn a_legend_has_a_bar_a_histogram_and_swatches() {
        let bins = Bins::new(4, [(0.1, 1.0), (0.9, 4.0)].into_iter());
        let legend = Legend {
            below: "below",
            above: "above",
            unit: "mm",
            swatches: &[(NO_DATA, "no data"), (BURIED, "buried")],
            ticks: &[tick(-1.0, true), tick(0.0, true), tick(0.02, false), tick(1.0, true)],
            colour: &diverging,
            histogram: Some((&bins, "area")),
        };
        let picture = legend.draw(400, 2, &Theme::DARK);
        let count = |colour| picture.pixels.iter().filter(|pixel| **pixel == colour).count();
        for colour in [NO_DATA, NO_DATA_DARK, BURIED] {
            assert!(count(colour) > 50, "{colour:?}: {}", count(colour));
        }
        // A quarter of the bar is 78 pixels wide, one of which is a gap; the bars are 72 and 18 pixels high.
        assert_eq!(count(Theme::DARK.bars), 77 * (72 + 18));
        let without = Legend { ticks: &legend.ticks[..2], ..legend }.draw(400, 2, &Theme::DARK);
        let ink = |picture: &crate::export::picture::Picture| {
            picture.pixels.iter().filter(|pixel| **pixel == Theme::DARK.ink).count()
        };
        let label = ink(&picture) - ink(&without);
        assert!(label < 2 * 300, "a label without room is left out: {label}");
    }
}
