//! Colours of files that have them as numbers of a scale that they do not tell.

/// Colours from numbers from 0 to 1, or from 0 to 255 where one of them is greater than 1: the file decides as a whole.
/// What is not a number becomes 0.
pub(super) fn of_numbers(colours: &[[f32; 3]]) -> Vec<[u8; 3]> {
    let scale = if colours.iter().flatten().any(|c| *c > 1.0) { 1.0 } else { 255.0 };
    colours.iter().map(|colour| colour.map(|c| byte(c * scale))).collect()
}

/// The nearest of the numbers 0 to 255; 0 of what is not a number.
pub(super) fn byte(component: f32) -> u8 {
    // The conversion saturates.
    component.round() as u8
}

/// A component of sRGB from a linear one between 0 and 1.
pub(super) fn of_linear(linear: f64) -> u8 {
    let component = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    byte((255.0 * component) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_is_that_of_all_colours() {
        assert_eq!(of_numbers(&[[0.0, 0.5, 1.0], [f32::NAN, -1.0, 0.002]]), [[0, 128, 255], [0, 0, 1]]);
        assert_eq!(of_numbers(&[[0.0, 1.0, 254.6], [1.0, 1e9, f32::NAN]]), [[0, 1, 255], [1, 255, 0]]);
    }
}
