//! Charts: the places of the patches on the texture.

use super::packing::largest_packing;
use super::spacing::{Layout, Spacing};
use super::{EvaluationError, Instance, Model};
use rayon::prelude::*;
use thiserror::Error;

/// A patch's rectangle on the texture. The patch's u runs over it to the right and v upwards, or, where `transposed`, v
/// to the right and u upwards; how fast is said by the atlas.
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
    /// Texture coordinates, on a texture of `size` x `size` texels, of a point of the chart's rectangle: its place from
    /// 0 to 1 in the directions of the patch's u and v.
    pub(super) fn texcoord(&self, u: f64, v: f64, size: u32) -> [f64; 2] {
        let (right, up) = if self.transposed { (v, u) } else { (u, v) };
        let column = f64::from(self.x) + right * f64::from(self.width);
        let row = f64::from(self.y) + (1.0 - up) * f64::from(self.height);
        [column / f64::from(size), 1.0 - row / f64::from(size)]
    }

    /// Whether the texel in column `i` and row `j` is the how manieth along u, and along v.
    pub(super) fn lines(&self, i: u32, j: u32) -> [usize; 2] {
        let [right, up] = [i, self.height - 1 - j].map(|k| k as usize);
        if self.transposed { [up, right] } else { [right, up] }
    }

    /// The numbers of texels along u and along v.
    fn sides(&self) -> [u32; 2] {
        if self.transposed { [self.height, self.width] } else { [self.width, self.height] }
    }
}

/// A square texture with a chart for every patch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Atlas {
    /// Side in texels.
    pub size: u32,
    /// The charts, in the order of the patches.
    pub charts: Vec<Chart>,
    /// How fast u and v run over each chart.
    pub spacings: Vec<[Spacing; 2]>,
}

/// A row or a column of texels of a chart: the value of u or of v in its middle, and how far it reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    pub(super) value: f64,
    pub(super) width: f64,
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
    /// nearly with the proportions that make texels square. Rows and columns of texels stand for equal areas, but at
    /// poles.
    ///
    /// # Errors
    /// The surface cannot be evaluated, or there are too many patches.
    pub fn new(model: &dyn Model, instance: &dyn Instance, size: u32) -> Result<Atlas, AtlasError> {
        Self::of_layouts(&Self::equal(model, instance)?, size)
    }

    /// As [`new`](Self::new), but with charts over which u and v run linearly, for meshes of few triangles: within one
    /// texture coordinates are linear.
    ///
    /// # Errors
    /// As `new`.
    pub fn linear(model: &dyn Model, instance: &dyn Instance, size: u32) -> Result<Atlas, AtlasError> {
        Self::of_layouts(&layouts(model, |patch| Layout::linear(instance, patch))?, size)
    }

    fn equal(model: &dyn Model, instance: &dyn Instance) -> Result<Vec<Layout>, EvaluationError> {
        let patches = model.parts().len();
        layouts(model, |patch| Layout::equal(instance, patch, patches))
    }

    /// As [`new`](Self::new), on the smallest texture whose side is a power of two and whose texels are on the average
    /// at most `edge` millimetres wide.
    ///
    /// # Errors
    /// As `new`; or that texture would be larger than [`LARGEST`] texels.
    pub fn with_texels_of(model: &dyn Model, instance: &dyn Instance, edge: f64) -> Result<Atlas, AtlasError> {
        let layouts = Self::equal(model, instance)?;
        let area: f64 = layouts.iter().map(|layout| layout.area).sum();
        let mut size = SMALLEST;
        // No texture is used more than wholly: below that no packing need be tried.
        while size < LARGEST && area.sqrt() > edge * f64::from(size) {
            size *= 2;
        }
        loop {
            let atlas = Self::of_layouts(&layouts, size);
            let covered = |atlas: &Atlas| atlas.used() * f64::from(size) * f64::from(size);
            match atlas {
                Ok(atlas) if (area / covered(&atlas)).sqrt() <= edge => return Ok(atlas),
                Ok(_) | Err(AtlasError::TooSmall { .. }) if size < LARGEST => size *= 2,
                Ok(atlas) => return Err(AtlasError::TooFine { edge, least: (area / covered(&atlas)).sqrt() }),
                Err(error) => return Err(error),
            }
        }
    }

    fn of_layouts(layouts: &[Layout], size: u32) -> Result<Atlas, AtlasError> {
        let extents: Vec<[f64; 2]> = layouts.iter().map(|layout| layout.extent).collect();
        let charts = largest_packing(&extents, size).ok_or(AtlasError::TooSmall { patches: extents.len(), size })?;
        Ok(Atlas { size, charts, spacings: layouts.iter().map(|layout| layout.spacings.clone()).collect() })
    }

    /// Surface parameters of the centre of the texel in column `i` and row `j` of a patch's chart.
    #[must_use]
    pub fn parameters(&self, patch: usize, i: u32, j: u32) -> (f64, f64) {
        let (chart, [of_u, of_v]) = (&self.charts[patch], &self.spacings[patch]);
        let [(u, along), (v, across)] = [0, 1].map(|axis| (chart.lines(i, j)[axis], chart.sides()[axis]));
        let at = |k: usize, count: u32| (k as f64 + 0.5) / f64::from(count);
        (of_u.value(at(u, along)), of_v.value(at(v, across)))
    }

    /// The rows and columns of texels of a patch: those along u, and those along v.
    pub(super) fn lines(&self, patch: usize) -> [Vec<Line>; 2] {
        [0, 1].map(|axis| {
            let (count, spacing) = (self.charts[patch].sides()[axis], &self.spacings[patch][axis]);
            let at = |k: f64| spacing.value(k / f64::from(count));
            let line = |k: u32| {
                let k = f64::from(k);
                Line { value: at(k + 0.5), width: at(k + 1.0) - at(k) }
            };
            (0..count).map(line).collect()
        })
    }

    /// Texture coordinates (s to the right, t upwards, both in [0, 1]) of a point of a patch.
    #[must_use]
    pub fn texcoord(&self, patch: usize, u: f64, v: f64) -> [f64; 2] {
        let [of_u, of_v] = &self.spacings[patch];
        self.charts[patch].texcoord(of_u.place(u), of_v.place(v), self.size)
    }

    /// Fraction of the texture that charts cover.
    #[must_use]
    pub fn used(&self) -> f64 {
        let covered: u64 = self.charts.iter().map(|c| u64::from(c.width) * u64::from(c.height)).sum();
        covered as f64 / (f64::from(self.size) * f64::from(self.size))
    }
}

/// The charts of the patches before they are packed.
fn layouts(
    model: &dyn Model,
    of_patch: impl Fn(usize) -> Result<Layout, EvaluationError> + Send + Sync,
) -> Result<Vec<Layout>, EvaluationError> {
    (0..model.parts().len()).into_par_iter().map(of_patch).collect::<Vec<_>>().into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gml_compiler::program::{Options, compile};
    use gml_compiler::source::{NoFiles, SourceFile};

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
        let uneven = Spacing::new(vec![0.0, 0.25, 0.5, 1.0], &[3.0, 1.0, 4.0]);
        let spacings = vec![[uneven.clone(), Spacing::default()], [Spacing::default(), uneven]];
        let atlas = Atlas { size: 128, charts, spacings };
        for (patch, c) in atlas.charts.iter().enumerate() {
            for (i, j) in [(0, 0), (c.width - 1, 0), (1, c.height - 1)] {
                let (u, v) = atlas.parameters(patch, i, j);
                let [of_u, of_v] = atlas.lines(patch);
                let [along, across] = c.lines(i, j);
                assert_eq!((of_u[along].value, of_v[across].value), (u, v));
                assert!((of_u.iter().map(|line| line.width).sum::<f64>() - 1.0).abs() < 1e-12);
                let [s, t] = atlas.texcoord(patch, u, v);
                assert!((s * 128.0 - (f64::from(c.x + i) + 0.5)).abs() < 1e-9);
                assert!(((1.0 - t) * 128.0 - (f64::from(c.y + j) + 0.5)).abs() < 1e-9);
            }
        }
    }
}
