//! The documents: X3D, pictures, meshes, report.

pub mod atomic;
pub mod colormap;
pub mod escape;
mod glyphs;
pub mod json;
pub mod measurement;
pub mod obj;
pub mod picture;
pub mod ply;
pub mod raster;
pub mod render;
pub mod report;
pub mod stl;
pub mod x3d;

/// A number as tables show it: four decimals for everyday sizes, an exponent for others, a dash if it is not finite.
#[must_use]
pub fn number(x: f64) -> String {
    if !x.is_finite() {
        return "-".into();
    }
    if x == 0.0 || (1e-4..1e7).contains(&x.abs()) { format!("{x:.4}") } else { format!("{x:.4e}") }
}
