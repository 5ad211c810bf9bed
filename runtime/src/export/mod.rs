//! The documents: X3D, pictures, meshes, report.

pub mod atomic;
pub mod begun;
mod bins;
pub mod colormap;
pub mod escape;
pub mod exchange;
pub mod folder;
mod gltf;
mod glyphs;
pub mod image;
pub mod json;
mod lock;
mod lookup;
pub mod measurement;
pub mod mesh;
pub mod palette;
pub mod picture;
pub mod population;
pub mod render;
pub mod report;
pub mod scale;
pub mod scan;
mod section;
pub(crate) mod surfels;
pub mod svg;
pub mod views;
pub mod x3d;

/// A number as tables show it: four decimals for everyday sizes, an exponent for others, a dash if it is not finite.
#[must_use]
pub fn number(x: f64) -> String {
    if !x.is_finite() {
        return "-".into();
    }
    if x == 0.0 || (1e-4..1e7).contains(&x.abs()) { format!("{x:.4}") } else { format!("{x:.4e}") }
}

/// The largest of 1, 2 and 5 times a power of ten that is not above x.
fn round_down(x: f64) -> f64 {
    let power = 10f64.powf(x.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|m| m * power).find(|step| *step <= x * (1.0 + 1e-12)).unwrap_or(power)
}

/// The smallest of 1, 2 and 5 times a power of ten that is not below x, but for rounding.
fn round_up(x: f64) -> f64 {
    let power = 10f64.powf(x.log10().floor());
    let steps = [1.0, 2.0, 5.0].map(|m| m * power);
    steps.into_iter().find(|step| *step >= x * (1.0 - 1e-12)).unwrap_or(10.0 * power)
}
