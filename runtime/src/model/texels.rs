//! The places from which distances are measured.

use super::atlas::Atlas;
use super::tessellation::unit_normals;
use super::{EvaluationError, Instance, Model, Partials, vector};
use rayon::prelude::*;

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
    /// Which part (index into `part_names`).
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

/// One covered texel, before the arrays are made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texel {
    pub(super) index: u32,
    pub(super) part: u32,
    pub(super) position: [f64; 3],
    pub(super) normal: [f32; 3],
    pub(super) area: f32,
}

impl Texels {
    /// Samples every chart's texels on the exact surface. A texel stands for the area `|du x dv|` at its centre times
    /// its extent in (u, v); one where the surface has no area is left out.
    ///
    /// # Errors
    /// Where the surface cannot be evaluated.
    pub fn of_model(model: &dyn Model, instance: &dyn Instance, atlas: &Atlas) -> Result<Texels, EvaluationError> {
        let rows: Vec<(usize, u32)> =
            atlas.charts.iter().enumerate().flat_map(|(p, c)| (0..c.height).map(move |j| (p, j))).collect();
        let sampled: Vec<Vec<Texel>> =
            rows.par_iter().map(|&(patch, j)| sample_row(instance, atlas, patch, j)).collect::<Result<_, _>>()?;
        let names = model.parts().iter().map(|p| p.name.clone()).collect();
        Ok(Texels::new(atlas.size, atlas.size, names, sampled.into_iter().flatten().collect()))
    }

    /// Sorts the texels by index and lays them out as arrays.
    pub(super) fn new(width: u32, height: u32, part_names: Vec<String>, mut texels: Vec<Texel>) -> Texels {
        texels.sort_unstable_by_key(|t| t.index);
        Texels {
            width,
            height,
            index: texels.iter().map(|t| t.index).collect(),
            part: texels.iter().map(|t| t.part).collect(),
            position: texels.iter().map(|t| t.position).collect(),
            normal: texels.iter().map(|t| t.normal).collect(),
            area: texels.iter().map(|t| t.area).collect(),
            part_names,
        }
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.index.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.index.is_empty()
    }
}

fn sample_row(instance: &dyn Instance, atlas: &Atlas, patch: usize, j: u32) -> Result<Vec<Texel>, EvaluationError> {
    let chart = &atlas.charts[patch];
    let (u, v): (Vec<f64>, Vec<f64>) = (0..chart.width).map(|i| chart.parameters(i, j)).unzip();
    let mut partials = vec![Partials::default(); u.len()];
    instance.partials(patch, &u, &v, &mut partials)?;
    let normals = unit_normals(instance, patch, &u, &v, &partials)?;
    let cell = 1.0 / (f64::from(chart.width) * f64::from(chart.height));
    let texel = |(i, (p, n)): (usize, (&Partials, &Option<[f64; 3]>))| {
        n.map(|n| Texel {
            index: (chart.y + j) * atlas.size + chart.x + i as u32,
            part: patch as u32,
            position: p.point,
            normal: n.map(|c| c as f32),
            area: (vector::length(vector::cross(p.du, p.dv)) * cell) as f32,
        })
    };
    Ok(partials.iter().zip(&normals).enumerate().filter_map(texel).collect())
}
