//! Charts: where on the texture each patch lies.

use super::packing::largest_packing;
use super::{EvaluationError, Instance, Model, Partials, vector};
use thiserror::Error;

/// A patch's rectangle on the texture. The patch's (u, v) run linearly over it: u to the right and v upwards, or, where
/// `transposed`, v to the right and u upwards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Chart {
    /// First column.
    pub x: u32,
    /// First row, counted from the top.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Whether u and v are exchanged.
    pub transposed: bool,
}

impl Chart {
    /// Surface parameters of the centre of the texel in column `i` and row `j` of the chart.
    #[must_use]
    pub fn parameters(&self, i: u32, j: u32) -> (f64, f64) {
        let right = (f64::from(i) + 0.5) / f64::from(self.width);
        let up = 1.0 - (f64::from(j) + 0.5) / f64::from(self.height);
        if self.transposed { (up, right) } else { (right, up) }
    }
}

/// A square texture with a chart for every patch.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Atlas {
    /// Side in texels.
    pub size: u32,
    /// The charts, in the order of the patches.
    pub charts: Vec<Chart>,
}

/// Why there is no atlas.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum AtlasError {
    /// The surface cannot be evaluated.
    #[error(transparent)]
    Evaluation(#[from] EvaluationError),
    /// Too many patches for the resolution.
    #[error("{patches} patches do not fit on a texture of {size} x {size} texels: ask for a higher resolution")]
    TooSmall {
        /// How many.
        patches: usize,
        /// Side of the texture.
        size: u32,
    },
}

impl Atlas {
    /// Lays the patches out on `size` x `size` texels, as large as they fit, each in proportion to its true area and
    /// nearly with the proportions of its mean extents along u and v.
    ///
    /// # Errors
    /// Where the surface cannot be evaluated or there are too many patches.
    pub fn new(model: &dyn Model, instance: &dyn Instance, size: u32) -> Result<Atlas, AtlasError> {
        let sizes = (0..model.parts().len()).map(|p| extent(instance, p)).collect::<Result<Vec<_>, _>>()?;
        let charts = largest_packing(&sizes, size).ok_or(AtlasError::TooSmall { patches: sizes.len(), size })?;
        Ok(Atlas { size, charts })
    }

    /// Texture coordinates (s to the right, t upwards, both in [0, 1]) of a point of a patch.
    #[must_use]
    pub fn texcoord(&self, patch: usize, u: f64, v: f64) -> [f64; 2] {
        let c = &self.charts[patch];
        let (right, up) = if c.transposed { (v, u) } else { (u, v) };
        let side = f64::from(self.size);
        let column = f64::from(c.x) + right * f64::from(c.width);
        let row = f64::from(c.y) + (1.0 - up) * f64::from(c.height);
        [column / side, 1.0 - row / side]
    }

    /// Fraction of the texture that charts cover.
    #[must_use]
    pub fn used(&self) -> f64 {
        let covered: u64 = self.charts.iter().map(|c| u64::from(c.width) * u64::from(c.height)).sum();
        covered as f64 / (f64::from(self.size) * f64::from(self.size))
    }
}

/// Width and height in millimetres of the rectangle that stands for a patch: its proportions are those of the mean
/// lengths of the lines along u and v, its area is the patch's.
fn extent(instance: &dyn Instance, patch: usize) -> Result<[f64; 2], EvaluationError> {
    const LATTICE: u32 = 32;
    let at: Vec<f64> = (0..LATTICE).map(|i| (f64::from(i) + 0.5) / f64::from(LATTICE)).collect();
    let mut samples = vec![Partials::default(); at.len() * at.len()];
    instance.partials_grid(patch, &at, &at, &mut samples)?;
    let mean = |f: &dyn Fn(&Partials) -> f64| samples.iter().map(f).sum::<f64>() / samples.len() as f64;
    let along_u = mean(&|p| vector::length(p.du));
    let along_v = mean(&|p| vector::length(p.dv));
    let area = mean(&|p| vector::length(vector::cross(p.du, p.dv)));
    if !(along_u > 0.0 && along_v > 0.0 && area > 0.0) {
        return Ok([0.0, 0.0]);
    }
    let correction = (area / (along_u * along_v)).sqrt();
    Ok([along_u * correction, along_v * correction])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_texel_centre_maps_back_to_its_texel() {
        let charts = largest_packing(&[[30.0, 10.0], [5.0, 20.0]], 128).expect("they fit");
        let atlas = Atlas { size: 128, charts };
        for (patch, c) in atlas.charts.iter().enumerate() {
            for (i, j) in [(0, 0), (c.width - 1, 0), (1, c.height - 1)] {
                let (u, v) = c.parameters(i, j);
                let [s, t] = atlas.texcoord(patch, u, v);
                assert!((s * 128.0 - (f64::from(c.x + i) + 0.5)).abs() < 1e-9);
                assert!(((1.0 - t) * 128.0 - (f64::from(c.y + j) + 0.5)).abs() < 1e-9);
            }
        }
    }
}
