//! Charts: the places of the patches on the texture.

use super::breaks::{Break, Breaks, spans};
use super::packing::largest_packing;
use super::{EvaluationError, Instance, Model, Partials};
use glam::DVec3;
use rayon::prelude::*;
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

    /// Texture coordinates, on a texture of `size` x `size` texels, of a point of the chart's rectangle: its place from
    /// 0 to 1 along the patch's u and v.
    pub(super) fn texcoord(&self, u: f64, v: f64, size: u32) -> [f64; 2] {
        let (right, up) = if self.transposed { (v, u) } else { (u, v) };
        let column = f64::from(self.x) + right * f64::from(self.width);
        let row = f64::from(self.y) + (1.0 - up) * f64::from(self.height);
        [column / f64::from(size), 1.0 - row / f64::from(size)]
    }

    /// The steps of u and of v from a texel to the next.
    pub(super) fn steps(&self) -> [f64; 2] {
        let [right, up] = [self.width, self.height].map(|texels| 1.0 / f64::from(texels));
        if self.transposed { [up, right] } else { [right, up] }
    }

    /// The area of a texel in the patch's parameters: its share of their unit square.
    pub(super) fn cell(&self) -> f64 {
        1.0 / (f64::from(self.width) * f64::from(self.height))
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

/// The reason why there is no atlas.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum AtlasError {
    /// The surface cannot be evaluated.
    #[error(transparent)]
    Evaluation(#[from] EvaluationError),
    /// Too many patches for the resolution.
    #[error("{patches} patches do not fit on a texture of {size} x {size} texels; choose a higher resolution")]
    TooSmall {
        /// The number of patches.
        patches: usize,
        /// Side of the texture.
        size: u32,
    },
    /// Too large a texture would be needed.
    #[error(
        "texels of {edge} mm need a texture of more than {LARGEST} x {LARGEST} texels; choose texels of at least {least:.3} mm"
    )]
    TooFine {
        /// The width of texels that was asked for. Millimetres.
        edge: f64,
        /// The width of texels on the largest texture. Millimetres.
        least: f64,
    },
}

/// The smallest side of the textures from which one of the right fineness is chosen, in texels.
pub const SMALLEST: u32 = 16;
/// The largest side, in texels.
pub const LARGEST: u32 = 16384;

impl Atlas {
    /// Lays the patches out on `size` x `size` texels, as large as they fit, each in proportion to its true area and
    /// nearly with the proportions that make texels square.
    ///
    /// # Errors
    /// The surface cannot be evaluated, or there are too many patches.
    pub fn new(model: &dyn Model, instance: &dyn Instance, size: u32) -> Result<Atlas, AtlasError> {
        Self::of_extents(&extents(model, instance)?, size)
    }

    /// As [`new`](Self::new), on the smallest texture whose side is a power of two and whose texels are on the average
    /// at most `edge` millimetres wide.
    ///
    /// # Errors
    /// As `new`; or that texture would be larger than [`LARGEST`] texels.
    pub fn with_texels_of(model: &dyn Model, instance: &dyn Instance, edge: f64) -> Result<Atlas, AtlasError> {
        let extents = extents(model, instance)?;
        let area: f64 = extents.iter().map(|e| e[0] * e[1]).sum();
        let mut size = SMALLEST;
        // No texture is used more than wholly: below that no packing need be tried.
        while size < LARGEST && area.sqrt() > edge * f64::from(size) {
            size *= 2;
        }
        loop {
            let atlas = Self::of_extents(&extents, size);
            let covered = |atlas: &Atlas| atlas.used() * f64::from(size) * f64::from(size);
            match atlas {
                Ok(atlas) if (area / covered(&atlas)).sqrt() <= edge => return Ok(atlas),
                Ok(_) | Err(AtlasError::TooSmall { .. }) if size < LARGEST => size *= 2,
                Ok(atlas) => return Err(AtlasError::TooFine { edge, least: (area / covered(&atlas)).sqrt() }),
                Err(error) => return Err(error),
            }
        }
    }

    fn of_extents(extents: &[[f64; 2]], size: u32) -> Result<Atlas, AtlasError> {
        let charts = largest_packing(extents, size).ok_or(AtlasError::TooSmall { patches: extents.len(), size })?;
        Ok(Atlas { size, charts })
    }

    /// Texture coordinates (s to the right, t upwards, both in [0, 1]) of a point of a patch.
    #[must_use]
    pub fn texcoord(&self, patch: usize, u: f64, v: f64) -> [f64; 2] {
        self.charts[patch].texcoord(u, v, self.size)
    }

    /// Fraction of the texture that charts cover.
    #[must_use]
    pub fn used(&self) -> f64 {
        let covered: u64 = self.charts.iter().map(|c| u64::from(c.width) * u64::from(c.height)).sum();
        covered as f64 / (f64::from(self.size) * f64::from(self.size))
    }
}

/// The rectangles that represent the patches.
fn extents(model: &dyn Model, instance: &dyn Instance) -> Result<Vec<[f64; 2]>, EvaluationError> {
    (0..model.parts().len()).into_par_iter().map(|p| extent(instance, p)).collect::<Vec<_>>().into_iter().collect()
}

/// Width and height in millimetres of the rectangle that represents a patch: its area is the patch's, its proportions
/// are those with which texels are square on the average, |dS/du| to |dS/dv|: the mean of the ratio's logarithm by
/// area.
fn extent(instance: &dyn Instance, patch: usize) -> Result<[f64; 2], EvaluationError> {
    // Where breaks cannot be looked for, partial derivatives may still exist.
    let breaks = Breaks::of_patch(instance, patch).unwrap_or_default();
    let [(u, of_u), (v, of_v)] = [breaks.u, breaks.v].map(|breaks| midpoints(&breaks));
    let mut samples = vec![Partials::default(); u.len() * v.len()];
    instance.partials_grid(patch, &u, &v, &mut samples)?;
    let (mut sum, mut logarithms) = (0.0, 0.0);
    for (k, p) in samples.iter().enumerate() {
        let (du, dv) = (DVec3::from_array(p.du), DVec3::from_array(p.dv));
        let area = du.cross(dv).length() * of_u[k % u.len()] * of_v[k / u.len()];
        // Where there is area, neither partial derivative vanishes.
        if area > 0.0 {
            sum += area;
            logarithms += area * (du.length() / dv.length()).ln();
        }
    }
    let (area, proportion) = (sum, (logarithms / sum).exp());
    let extent = [(area * proportion).sqrt(), (area / proportion).sqrt()];
    Ok(if extent.iter().all(|e| *e > 0.0 && e.is_finite()) { extent } else { [0.0, 0.0] })
}

/// The nodes of the midpoint rule on every span between breaks, with their weights.
fn midpoints(breaks: &[Break]) -> (Vec<f64>, Vec<f64>) {
    const NODES: f64 = 32.0;
    const LEAST: f64 = 4.0;
    let of_span = |(start, end): (f64, f64)| {
        let length = end - start;
        let count = (NODES * length).ceil().max(LEAST);
        (0..count as u32).map(move |k| (start + length * ((f64::from(k) + 0.5) / count), length / count))
    };
    spans(breaks.iter().map(|b| (b.before, b.after))).flat_map(of_span).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gml_compiler::program::{Options, compile};
    use gml_compiler::source::{NoFiles, SourceFile};

    #[test]
    fn areas_are_right_between_breaks() {
        // Seven pieces of an equal share of u, 63 mm long together, and five steps of 8 mm by 10 mm.
        let corners =
            "(0mm, 0mm), (1mm, 0mm), (1mm, 30mm), (2mm, 30mm), (2mm, 1mm), (3mm, 1mm), (3mm, 1.5mm), (3.5mm, 1.5mm)";
        let text = format!(
            "use std.polyline (polyline)\nuse std.sweep (extrude)\nmodel areas {{\n\
             part a = extrude(polyline([{corners}]), 10mm)\n\
             part b = |u: real, v: real| (u * 40mm, v * 10mm, floor(5 * u) * 7mm)\n}}"
        );
        let script = SourceFile { name: "areas.gml".to_owned(), text };
        let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
        let instance = Model::instantiate(&program, &[]).expect("it exists");
        let extents = extents(&program, &*instance).expect("they exist");
        for ([width, height], area) in extents.into_iter().zip([630.0, 400.0]) {
            // Both are linear between their breaks, so that the rule is exact but for rounding.
            assert!((width * height - area).abs() < 1e-9 * area, "{} for {area}", width * height);
        }
    }

    #[test]
    fn a_texture_is_as_large_as_its_texels_are_to_be_fine() {
        let text = "use std.surface (plane)\nmodel plates { part a = plane(100mm, 80mm)\npart b = plane(30mm, 50mm) }";
        let script = SourceFile { name: "plates.gml".to_owned(), text: text.to_owned() };
        let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
        let instance = Model::instantiate(&program, &[]).expect("it exists");
        for edge in [5.0, 1.0, 0.3, 0.05] {
            let atlas = Atlas::with_texels_of(&program, &*instance, edge).expect("it fits");
            let texel = |atlas: &Atlas| (9500.0 / atlas.used()).sqrt() / f64::from(atlas.size);
            assert!(texel(&atlas) <= edge, "{edge}: {}", atlas.size);
            let half = Atlas::new(&program, &*instance, atlas.size / 2);
            assert!(half.map_or(true, |half| texel(&half) > edge), "{edge}: {}", atlas.size);
        }
        let error = Atlas::with_texels_of(&program, &*instance, 1e-3).err();
        assert!(matches!(error, Some(AtlasError::TooFine { .. })), "{error:?}");
    }

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
