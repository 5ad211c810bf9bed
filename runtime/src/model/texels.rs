//! The places from which distances are measured.

use super::tessellation::{normal, unit_normals};
use super::{Atlas, Chart, EvaluationError, Instance, Model, Partials};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// The number of rows of the texture that are sampled together.
const BAND: u32 = 16;

/// The number of texels of a chart that are evaluated at once, as a grid: they stay in a core's own cache.
const BLOCK: u32 = 4096;

/// The number of bands that are in memory beside the arrays.
const BANDS: usize = 64;

/// The covered texels of a texture: one ray origin and direction each. Structure of arrays, all of one length,
/// ascending by `index`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Texels {
    /// Width of the texture.
    pub width: u32,
    /// Height of the texture.
    pub height: u32,
    /// `y * width + x`, row 0 at the top of the picture (v = 1 - (y + 0.5) / height).
    pub index: Vec<u32>,
    /// The part: index into `part_names`.
    pub part: Vec<u32>,
    /// Point of the exact surface. Millimetres.
    pub position: Vec<[f64; 3]>,
    /// Unit outward normal of the exact surface.
    pub normal: Vec<[f32; 3]>,
    /// Area of the surface that this texel stands for. Square millimetres.
    pub area: Vec<f32>,
    /// Names of the parts.
    pub part_names: Vec<String>,
}

/// One covered texel; its fields are those of [`Texels`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Texel {
    pub(super) index: u32,
    pub(super) part: u32,
    pub(super) position: [f64; 3],
    pub(super) normal: [f32; 3],
    pub(super) area: f32,
}

impl Texel {
    /// A texel without surface.
    const ABSENT: Self = Self { index: 0, part: 0, position: [0.0; 3], normal: [0.0; 3], area: f32::NAN };
}

impl Texels {
    /// Samples every chart's texels on the exact surface. A texel stands for the area `|du x dv|` at its centre times
    /// its extent in (u, v); one where the surface has no area is left out.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn of_model(model: &dyn Model, instance: &dyn Instance, atlas: &Atlas) -> Result<Self, EvaluationError> {
        let part_names = model.parts().iter().map(|p| p.name.clone()).collect();
        let mut texels = Self { width: atlas.size, height: atlas.size, part_names, ..Self::default() };
        let tops: Vec<u32> = (0..atlas.size).step_by(BAND as usize).collect();
        for tops in tops.chunks(BANDS) {
            let bands: Vec<Result<Self, _>> =
                tops.par_iter().map(|top| sample_band(instance, atlas, *top..top + BAND)).collect();
            for band in bands {
                texels.append(band?);
            }
        }
        Ok(texels)
    }

    /// Lays texels, ascending by index, out as arrays.
    pub(super) fn new(texels: &[Texel]) -> Self {
        Self {
            index: texels.iter().map(|t| t.index).collect(),
            part: texels.iter().map(|t| t.part).collect(),
            position: texels.iter().map(|t| t.position).collect(),
            normal: texels.iter().map(|t| t.normal).collect(),
            area: texels.iter().map(|t| t.area).collect(),
            ..Self::default()
        }
    }

    fn append(&mut self, mut others: Self) {
        self.index.append(&mut others.index);
        self.part.append(&mut others.part);
        self.position.append(&mut others.position);
        self.normal.append(&mut others.normal);
        self.area.append(&mut others.area);
    }

    /// For each part at most `most` of its texels, evenly spread.
    #[must_use]
    pub fn samples_of_parts(&self, most: usize) -> Vec<Vec<usize>> {
        let mut of_part: Vec<Vec<usize>> = vec![Vec::new(); self.part_names.len()];
        for (i, part) in self.part.iter().enumerate() {
            of_part[*part as usize].push(i);
        }
        let sample = |texels: Vec<usize>| {
            let step = texels.len().div_ceil(most.max(1)).max(1);
            texels.into_iter().step_by(step).collect()
        };
        of_part.into_iter().map(sample).collect()
    }

    /// Column and row of texel i in the texture.
    #[must_use]
    pub fn place(&self, i: usize) -> [u32; 2] {
        [self.index[i] % self.width, self.index[i] / self.width]
    }

    /// The number of texels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.index.len()
    }

    /// Whether there are no texels.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.index.is_empty()
    }
}

/// Samples all charts' texels in some rows of the texture.
fn sample_band(instance: &dyn Instance, atlas: &Atlas, rows: Range<u32>) -> Result<Texels, EvaluationError> {
    let mut texels = vec![Texel::ABSENT; rows.len() * atlas.size as usize];
    for (patch, chart) in atlas.charts.iter().enumerate() {
        let end = rows.end.min(chart.y + chart.height);
        let (high, wide) = block_of(chart);
        for y in (rows.start.max(chart.y)..end).step_by(high as usize) {
            for x in (chart.x..chart.x + chart.width).step_by(wide as usize) {
                let columns = x..(x + wide).min(chart.x + chart.width);
                sample_block(instance, atlas, patch, columns, y..(y + high).min(end), |texel| {
                    texels[(texel.index - rows.start * atlas.size) as usize] = texel;
                })?;
            }
        }
    }
    texels.retain(|texel| !texel.area.is_nan());
    Ok(Texels::new(&texels))
}

/// Rows and columns of a block of a chart's texels. The values that a model computes from u are kept from grid to grid
/// while they stay the same: those of a whole row, or of some rows where the chart is turned.
fn block_of(chart: &Chart) -> (u32, u32) {
    let width = chart.width.max(1);
    if chart.transposed { (BAND, BLOCK / BAND) } else { ((BLOCK / width).clamp(1, BAND), width) }
}

/// Samples a block of one chart's texels at once.
fn sample_block(
    instance: &dyn Instance,
    atlas: &Atlas,
    patch: usize,
    columns: Range<u32>,
    rows: Range<u32>,
    mut write: impl FnMut(Texel),
) -> Result<(), EvaluationError> {
    let chart = &atlas.charts[patch];
    let parameters = |x: u32, y: u32| chart.parameters(x - chart.x, y - chart.y);
    let along: Vec<(f64, f64)> = columns.clone().map(|x| parameters(x, rows.start)).collect();
    let down: Vec<(f64, f64)> = rows.clone().map(|y| parameters(columns.start, y)).collect();
    // Rows of texels are those of the grid, or its columns.
    let (u_along, v_along) = if chart.transposed { (&down, &along) } else { (&along, &down) };
    let (u, v): (Vec<f64>, Vec<f64>) = (u_along.iter().map(|p| p.0).collect(), v_along.iter().map(|p| p.1).collect());
    let mut grid = vec![Partials::default(); u.len() * v.len()];
    instance.partials_grid(patch, &u, &v, &mut grid)?;
    let texel = |x: u32, y: u32, p: &Partials, normal: DVec3, size: f64| {
        let (normal, area) = (normal.as_vec3().to_array(), (size * chart.cell()) as f32);
        Texel { index: y * atlas.size + x, part: patch as u32, position: p.point, normal, area }
    };
    let mut poles = Vec::new();
    for (k, y) in rows.enumerate() {
        for (i, x) in columns.clone().enumerate() {
            let p = &grid[if chart.transposed { i * down.len() + k } else { k * along.len() + i }];
            match normal(p) {
                Some((normal, size)) => write(texel(x, y, p, normal, size)),
                None => poles.push((x, y, *p)),
            }
        }
    }
    let (u, v): (Vec<f64>, Vec<f64>) = poles.iter().map(|(x, y, _)| parameters(*x, *y)).unzip();
    let partials: Vec<Partials> = poles.iter().map(|pole| pole.2).collect();
    for ((x, y, p), normal) in poles.iter().zip(unit_normals(instance, patch, &u, &v, &partials)?) {
        let size = DVec3::from_array(p.du).cross(DVec3::from_array(p.dv)).length();
        normal.into_iter().for_each(|normal| write(texel(*x, *y, p, normal, size)));
    }
    Ok(())
}
