//! The places from which distances are measured.

use super::atlas::{Atlas, Chart, Line};
use super::breaks::{Breaks, move_off};
use super::tessellation::{normal, unit_normals};
use super::{EvaluationError, Instance, Model, Partials};
use crate::mesh::retain_marked;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::BTreeMap;

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
    /// The longer side of that piece of the surface. Millimetres.
    pub side: Vec<f32>,
    /// Names of the parts.
    pub part_names: Vec<String>,
}

impl Texels {
    /// The mean width of a texel on the surface, which is the mean distance between neighbours, in millimetres; 0 where
    /// there are none.
    #[must_use]
    pub fn width_on_the_surface(&self) -> f64 {
        let area: f64 = self.area.iter().map(|area| f64::from(*area).max(0.0)).sum();
        (area / self.area.len().max(1) as f64).sqrt()
    }

    /// Samples every chart's texels on the exact surface. A texel stands for the area `|du x dv|` at its centre times
    /// its extent in (u, v); one where the surface has no area, or where it is trimmed away, is left out. A centre on a
    /// break counts to one side.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn of_model(model: &dyn Model, instance: &dyn Instance, atlas: &Atlas) -> Result<Self, EvaluationError> {
        let mut rows: Vec<Row> = atlas
            .charts
            .iter()
            .enumerate()
            .flat_map(|(patch, c)| {
                (0..c.height).map(move |j| Row { patch, i: 0, j, first: (c.y + j) * atlas.size + c.x })
            })
            .collect();
        // Charts do not overlap, so that rows in this order give ascending indices.
        rows.sort_unstable_by_key(|row| row.first);
        let count = rows.iter().map(|row| atlas.charts[row.patch].width as usize).sum();
        let mut texels = Self {
            width: atlas.size,
            height: atlas.size,
            index: vec![0; count],
            part: vec![0; count],
            position: vec![[0.0; 3]; count],
            normal: vec![[0.0; 3]; count],
            area: vec![0.0; count],
            side: vec![0.0; count],
            part_names: model.parts().iter().map(|p| p.name.clone()).collect(),
        };
        let mut rest = texels.places();
        let mut blocks: BTreeMap<(usize, u32, u32), Vec<(Row, Places<'_>)>> = BTreeMap::new();
        for row in rows {
            let chart = &atlas.charts[row.patch];
            let (high, wide) = block_of(chart);
            for i in (0..chart.width).step_by(wide as usize) {
                let places;
                (places, rest) = rest.split_at(wide.min(chart.width - i) as usize);
                let piece = Row { i, first: row.first + i, ..row };
                blocks.entry((row.patch, row.j / high, i / wide)).or_default().push((piece, places));
            }
        }
        // Where breaks cannot be looked for, partial derivatives may still exist.
        let breaks = (0..atlas.charts.len()).into_par_iter().map(|p| Breaks::of_patch(instance, p).unwrap_or_default());
        let patches: Vec<Patch<'_>> = atlas
            .charts
            .iter()
            .zip(breaks.collect::<Vec<_>>())
            .enumerate()
            .map(|(patch, (chart, breaks))| {
                let (lines, keep) = (atlas.lines(patch), model.keep(patch));
                Patch { chart, lines, breaks, keep }
            })
            .collect();
        let blocks: Vec<_> = blocks.into_iter().collect();
        blocks
            .into_par_iter()
            .try_for_each(|((patch, ..), block)| sample_block(instance, &patches[patch], patch, block))?;
        texels.drop_absent();
        Ok(texels)
    }

    /// The places of all texels.
    fn places(&mut self) -> Places<'_> {
        Places {
            index: &mut self.index,
            part: &mut self.part,
            position: &mut self.position,
            normal: &mut self.normal,
            area: &mut self.area,
            side: &mut self.side,
        }
    }

    /// Removes texels whose area is `ABSENT`.
    fn drop_absent(&mut self) {
        if !self.area.contains(&ABSENT) {
            return;
        }
        let present: Vec<bool> = self.area.iter().map(|&a| a != ABSENT).collect();
        retain_marked(&mut self.index, &present);
        retain_marked(&mut self.part, &present);
        retain_marked(&mut self.position, &present);
        retain_marked(&mut self.normal, &present);
        retain_marked(&mut self.area, &present);
        retain_marked(&mut self.side, &present);
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

/// A piece of a row of a chart's texels: of patch `patch`, from column i of the chart's row j on, which is the texel
/// `first` of the texture.
#[derive(Clone, Copy)]
struct Row {
    patch: usize,
    i: u32,
    j: u32,
    first: u32,
}

/// Rows and columns of texels of a chart that are evaluated at once, as a grid: they stay in a core's own cache. The
/// values that a model computes from u are kept from grid to grid while these stay the same: those of a whole row, or
/// of some rows where the chart is turned.
fn block_of(chart: &Chart) -> (u32, u32) {
    if chart.transposed { (16, 256) } else { ((4096 / chart.width.max(1)).clamp(1, 16), chart.width.max(1)) }
}

/// The area of a texel without surface.
const ABSENT: f32 = -1.0;

/// The places of consecutive texels in all arrays.
struct Places<'a> {
    index: &'a mut [u32],
    part: &'a mut [u32],
    position: &'a mut [[f64; 3]],
    normal: &'a mut [[f32; 3]],
    area: &'a mut [f32],
    side: &'a mut [f32],
}

impl<'a> Places<'a> {
    fn split_at(self, count: usize) -> (Places<'a>, Places<'a>) {
        let (index, index_rest) = self.index.split_at_mut(count);
        let (part, part_rest) = self.part.split_at_mut(count);
        let (position, position_rest) = self.position.split_at_mut(count);
        let (normal, normal_rest) = self.normal.split_at_mut(count);
        let (area, area_rest) = self.area.split_at_mut(count);
        let (side, side_rest) = self.side.split_at_mut(count);
        (
            Places { index, part, position, normal, area, side },
            Places {
                index: index_rest,
                part: part_rest,
                position: position_rest,
                normal: normal_rest,
                area: area_rest,
                side: side_rest,
            },
        )
    }
}

/// A patch's chart, its lines of texels along u and along v, its breaks, and the patch of the function that is positive
/// where it is there, if it is trimmed.
struct Patch<'a> {
    chart: &'a Chart,
    lines: [Vec<Line>; 2],
    breaks: Breaks,
    keep: Option<usize>,
}

/// Samples a block of one chart's texels at once.
fn sample_block(
    instance: &dyn Instance,
    Patch { chart, lines, breaks, keep }: &Patch<'_>,
    patch: usize,
    mut block: Vec<(Row, Places<'_>)>,
) -> Result<(), EvaluationError> {
    let Some((Row { i: left, j: top, .. }, places)) = block.first() else { return Ok(()) };
    let (width, height) = (places.index.len(), block.len());
    // Rows of texels are those of the grid, or its columns.
    let [(of_u, mut u), (of_v, mut v)] = [0, 1].map(|axis| {
        let along = axis == usize::from(chart.transposed);
        let line = |i: u32, j: u32| lines[axis][chart.lines(i, j)[axis]];
        let lines: Vec<Line> = match along {
            true => (0..width as u32).map(|i| line(left + i, *top)).collect(),
            false => block.iter().map(|(row, _)| line(*left, row.j)).collect(),
        };
        let values: Vec<f64> = lines.iter().map(|line| line.value).collect();
        (lines, values)
    });
    move_off(&breaks.u, &mut u);
    move_off(&breaks.v, &mut v);
    let mut grid = vec![Partials::default(); width * height];
    instance.partials_grid(patch, &u, &v, &mut grid)?;
    let place = |k: usize, i: usize| if chart.transposed { i * height + k } else { k * width + i };
    let steps = |k: usize, i: usize| {
        let [u, v] = if chart.transposed { [k, i] } else { [i, k] };
        [of_u[u].width, of_v[v].width]
    };
    let mut poles = Vec::new();
    for (k, (row, places)) in block.iter_mut().enumerate() {
        write_row(*row, |i| (&grid[place(k, i)], steps(k, i)), places, |i| poles.push((k, i)));
    }
    let at = |&(k, i): &(usize, usize)| if chart.transposed { (u[k], v[i]) } else { (u[i], v[k]) };
    let (at_u, at_v): (Vec<f64>, Vec<f64>) = poles.iter().map(at).unzip();
    let partials: Vec<Partials> = poles.iter().map(|(k, i)| grid[place(*k, *i)]).collect();
    let normals = unit_normals(instance, patch, &at_u, &at_v, &partials)?;
    for ((k, i), normal) in poles.into_iter().zip(normals) {
        let (p, places) = (&grid[place(k, i)], &mut block[k].1);
        if let Some(n) = normal {
            let size = DVec3::from_array(p.du).cross(DVec3::from_array(p.dv)).length();
            let [of_u, of_v] = steps(k, i);
            (places.normal[i], places.area[i]) = (n.as_vec3().to_array(), (size * of_u * of_v) as f32);
            places.side[i] = longer_side(p, [of_u, of_v]);
        }
    }
    if let Some(keep) = *keep {
        let mut keeps = vec![[0.0; 3]; width * height];
        instance.points_grid(keep, &u, &v, &mut keeps)?;
        for (k, (_, places)) in block.iter_mut().enumerate() {
            (0..width).filter(|i| keeps[place(k, *i)][0] <= 0.0).for_each(|i| places.area[i] = ABSENT);
        }
    }
    Ok(())
}

/// Writes a piece of a row, whose partial derivatives `partials` gives, with the steps of u and of v; calls `without`
/// for the texels that have no normal of their own.
fn write_row<'p>(
    row: Row,
    partials: impl Fn(usize) -> (&'p Partials, [f64; 2]),
    places: &mut Places<'_>,
    mut without: impl FnMut(usize),
) {
    places.part.fill(row.patch as u32);
    for i in 0..places.index.len() {
        let (p, steps) = partials(i);
        places.index[i] = row.first + i as u32;
        places.position[i] = p.point;
        (places.normal[i], places.area[i]) = match normal(p) {
            Some((n, size)) => (n.as_vec3().to_array(), (size * steps[0] * steps[1]) as f32),
            None => {
                without(i);
                ([0.0; 3], ABSENT)
            }
        };
        places.side[i] = longer_side(p, steps);
    }
}

/// The longer side of the parallelogram that steps of u and of v make on the surface. Millimetres.
fn longer_side(p: &Partials, [of_u, of_v]: [f64; 2]) -> f32 {
    let [along, across] = [(p.du, of_u), (p.dv, of_v)].map(|(d, step)| DVec3::from_array(d).length() * step);
    along.max(across) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use gml_compiler::program::{Options, compile};
    use gml_compiler::source::{NoFiles, SourceFile};

    #[test]
    fn texels_on_a_ridge_have_the_normal_of_one_side() {
        // The centres of the middle column lie on u = 1/2, where the derivative of abs is that of neither side.
        let surface = "(u * 40mm, v * 10mm, abs(u - 0.5) * 40mm)";
        let text = format!("model roof {{ part a = |u: real, v: real| {surface} }}");
        let script = SourceFile { name: "roof.gml".to_owned(), text };
        let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
        let instance = Model::instantiate(&program, &[]).expect("it exists");
        for transposed in [false, true] {
            let chart = Chart { x: 0, y: 0, width: 33, height: 33, transposed };
            let atlas = Atlas { size: 64, charts: vec![chart], spacings: vec![Default::default()] };
            let texels = Texels::of_model(&program, &*instance, &atlas).expect("it is finite");
            assert_eq!(texels.len(), 33 * 33);
            for (n, area) in texels.normal.iter().zip(&texels.area) {
                // Single precision.
                let side = f32::sqrt(0.5);
                assert!((n[0].abs() - side).abs() < 1e-6 && n[1] == 0.0 && (n[2] - side).abs() < 1e-6, "{n:?}");
                assert!((area * 33.0 * 33.0 - 400.0 / side).abs() < 1e-3, "{area}");
            }
        }
    }
}
