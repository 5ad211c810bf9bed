//! The colour scale of deviations.

use super::scale::Scale;
use crate::variance::{Class, Deviations};

/// The colour of what has no data: a grey that the scale does not contain. Pictures have stripes of it and of
/// `NO_DATA_DARK`, since light makes a pale colour of the scale as grey.
pub const NO_DATA: [u8; 3] = [128, 128, 128];

/// The darker stripes of what has no data.
pub const NO_DATA_DARK: [u8; 3] = [70, 70, 70];

/// The colour of surface inside of the model's own material.
pub const BURIED: [u8; 3] = [84, 84, 84];

/// The colour of surface that stands where the scan shows empty space: an amber that the scale does not contain.
pub const CONTRADICTED: [u8; 3] = [240, 180, 0];

/// The colour of a texel whose ray meets what belongs elsewhere: a green that the scale does not contain.
pub const AMBIGUOUS: [u8; 3] = [40, 150, 110];

/// The colour of a texel that faces a closed hole of the scan: an olive that the scale does not contain either.
pub const FILLED: [u8; 3] = [140, 140, 60];

/// Anchors from 0 to 1 on the inner side, evenly spaced: made in OKLCh with lightness falling linearly from 0.965 to
/// 0.4, so that equal steps of deviation are equal steps of lightness; hue from 235 to 262 degrees.
const BLUES: [[u8; 3]; 5] = [[243, 243, 243], [149, 205, 247], [69, 158, 238], [12, 109, 209], [18, 64, 153]];

/// The same lightnesses on the outer side; hue from 45 to 22 degrees.
const REDS: [[u8; 3]; 5] = [[243, 243, 243], [245, 180, 158], [228, 115, 91], [191, 55, 48], [136, 11, 30]];

/// Anchors from 0 to 1 of what has no sign, with the same lightnesses; hue from 308 to 302 degrees, which no other
/// scale or class has.
const VIOLETS: [[u8; 3]; 5] = [[243, 243, 243], [213, 183, 240], [176, 127, 223], [133, 79, 189], [88, 43, 137]];

/// The sRGB colour of a deviation relative to the scale's end: -1 (scan inside the model) is dark blue, 0 nearly white,
/// 1 (scan outside) dark red; linear between anchors. Beyond the ends the end's colour; for NaN the grey of no data.
#[must_use]
pub fn diverging(x: f64) -> [u8; 3] {
    if x.is_nan() {
        return NO_DATA;
    }
    between(if x < 0.0 { &BLUES } else { &REDS }, x.abs())
}

/// The sRGB colour of what has no sign, such as an uncertainty, relative to the scale's end: 0 is nearly white, 1 dark
/// violet. Beyond the end the end's colour; for NaN the grey of no data.
#[must_use]
pub fn sequential(x: f64) -> [u8; 3] {
    if x.is_nan() { NO_DATA } else { between(&VIOLETS, x.max(0.0)) }
}

/// A colour between evenly spaced anchors; beyond 1 the last one.
fn between(anchors: &[[u8; 3]; 5], place: f64) -> [u8; 3] {
    let place = place.min(1.0) * 4.0;
    let below = (place as usize).min(3);
    let share = place - below as f64;
    let mix = |k: usize| f64::from(anchors[below][k]) * (1.0 - share) + f64::from(anchors[below + 1][k]) * share;
    [0, 1, 2].map(|k| mix(k).round() as u8)
}

/// The colour of a pixel without data: diagonal stripes, a half of `period` pixels wide each.
#[must_use]
pub fn stripes(x: usize, y: usize, period: usize) -> [u8; 3] {
    if (x + y) % period.max(2) < period.max(2) / 2 { NO_DATA } else { NO_DATA_DARK }
}

/// The sRGB colour of a texel whose deviation is drawn as `drawn` millimetres; that of its class if it has no distance.
#[must_use]
pub fn texel_colour(deviations: &Deviations, i: usize, drawn: f64, scale: &Scale) -> [u8; 3] {
    class_colour(deviations.class(i)).unwrap_or_else(|| scale.colour(drawn))
}

/// The sRGB colour of a class of texels without a distance; none of those that have one.
#[must_use]
pub fn class_colour(class: Class) -> Option<[u8; 3]> {
    match class {
        Class::Buried => Some(BURIED),
        Class::Filled => Some(FILLED),
        Class::Contradicted => Some(CONTRADICTED),
        Class::Ambiguous => Some(AMBIGUOUS),
        Class::NoData => Some(NO_DATA),
        Class::Measured | Class::Beyond | Class::FacingAway => None,
    }
}

#[cfg(test)]
mod tests {
    use super::{AMBIGUOUS, CONTRADICTED, NO_DATA, NO_DATA_DARK, diverging, sequential, stripes};

    /// CIE lightness L* of an sRGB colour.
    fn lightness(rgb: [u8; 3]) -> f64 {
        let linear = rgb.map(|c| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        });
        116.0 * (0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]).cbrt() - 16.0
    }

    #[test]
    fn lightness_falls_evenly_to_both_sides() {
        for i in 0..40 {
            let (a, b) = (f64::from(i) / 40.0, f64::from(i + 1) / 40.0);
            for side in [-1.0, 1.0] {
                let step = lightness(diverging(side * a)) - lightness(diverging(side * b));
                assert!((0.5..3.0).contains(&step), "step {step} at {}", side * a);
            }
            assert!((lightness(diverging(a)) - lightness(diverging(-a))).abs() < 6.0);
            let step = lightness(sequential(a)) - lightness(sequential(b));
            assert!((0.5..3.0).contains(&step), "step {step} at {a}");
        }
    }

    #[test]
    fn stripes_are_diagonal_and_of_two_tones() {
        let row = |y: usize| (0..8).map(|x| stripes(x, y, 4)).collect::<Vec<_>>();
        assert_eq!(row(0), [[NO_DATA; 2], [NO_DATA_DARK; 2]].concat().repeat(2));
        assert_eq!(row(0)[1..], row(1)[..7]);
    }

    #[test]
    fn ends_and_no_data() {
        assert_eq!(diverging(0.0), diverging(-0.0));
        assert_eq!(diverging(7.0), diverging(1.0));
        assert_eq!(diverging(f64::NEG_INFINITY), diverging(-1.0));
        assert_eq!(diverging(f64::NAN), NO_DATA);
        for i in -100..=100 {
            let [r, g, b] = diverging(f64::from(i) / 100.0);
            assert!(r.abs_diff(g).max(g.abs_diff(b)) > 20 || r > 200, "{i} looks like no data");
            for class in [CONTRADICTED, AMBIGUOUS] {
                let apart = |k: usize| u32::from([r, g, b][k].abs_diff(class[k])).pow(2);
                assert!((0..3).map(apart).sum::<u32>() > 70 * 70, "{i} looks like {class:?}");
            }
        }
    }
}
