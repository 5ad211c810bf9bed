//! Figures with as many digits as their uncertainty leaves.

use super::tables::{minus, number};
use crate::fit::FittedParameter;
use gml_compiler::program::Quantity;

/// The most decimals.
const DECIMALS: i32 = 9;

/// The unit of the last digit of an uncertainty with one significant digit, or two where the first is 1 or 2, and the
/// decimals that it then has.
fn last_digit(sd: f64) -> Option<(f64, usize)> {
    if !(sd > 0.0 && sd.is_finite()) {
        return None;
    }
    let first = |x: f64| x.abs().log10().floor() as i32;
    let place = first(sd);
    // 0.0996 becomes 0.10, not 0.100.
    let leading = (sd / 10f64.powi(place) * 1.000_001).floor();
    let place = if leading < 3.0 { place - 1 } else { place };
    Some((10f64.powi(place), (-place).clamp(0, DECIMALS) as usize))
}

/// The decimals of a figure with this uncertainty; none if that is not known.
pub(in crate::export) fn decimals(sd: f64) -> Option<usize> {
    last_digit(sd).map(|(_, decimals)| decimals)
}

/// `20.25 ± 0.06`; the value alone, with the digits of any other figure, if nothing is known of its uncertainty.
pub(super) fn with_uncertainty(value: f64, sd: Option<f64>) -> String {
    match (value.is_finite(), sd, sd.and_then(last_digit)) {
        (true, Some(sd), Some((unit, decimals))) => {
            let [value, sd] = [value, sd].map(|x| (x / unit).round() * unit);
            minus(&format!("{value:.decimals$} ± {sd:.decimals$}"))
        }
        _ => number(value),
    }
}

/// A value with the decimals of its uncertainty, and that itself.
pub(super) fn pair(value: f64, sd: Option<f64>) -> [String; 2] {
    let both = with_uncertainty(value, sd);
    match both.split_once(" ± ") {
        Some((value, sd)) => [value.to_owned(), sd.to_owned()],
        None => [both, String::new()],
    }
}

/// Factor and unit in which a parameter is shown: angles in degrees.
pub(super) fn unit_of(parameter: &FittedParameter) -> (f64, &'static str) {
    match parameter.quantity {
        Quantity::Angle => (1f64.to_degrees(), "&deg;"),
        Quantity::Length => (1.0, "mm"),
        _ => (1.0, ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_the_digits_of_their_uncertainty() {
        for (value, sd, expected) in [
            (20.2512, 0.0613, "20.25 ± 0.06"),
            (20.2512, 0.0213, "20.251 ± 0.021"),
            (-3.21, 0.0998, "&minus;3.21 ± 0.10"),
            (1234.5, 37.0, "1230 ± 40"),
            (0.5, 0.0, "0.500"),
            (0.5, f64::NAN, "0.500"),
            (f64::NAN, 1.0, "&ndash;"),
        ] {
            assert_eq!(with_uncertainty(value, Some(sd)), expected);
        }
        assert_eq!(with_uncertainty(40.0, None), "40.000");
        assert_eq!(pair(1.26, Some(0.5)), ["1.3", "0.5"]);
        assert_eq!(pair(1.26, None), ["1.260", ""]);
    }
}
