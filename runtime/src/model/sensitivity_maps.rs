//! How much the surface moves along its normal where a parameter changes, all over the texture.

use super::{Atlas, EvaluationError, Instance, Model, Motion, Texels, vector};
use gml_compiler::program::Quantity;
use rayon::prelude::*;

/// Values kept at most, of all parameters together: beyond that every second row and column is left out, and so on.
const MOST: usize = 1 << 26;

/// Texels that are evaluated at once.
const BATCH: usize = 4096;

/// n . dS/dx at texels, for every parameter x.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensitivityMaps {
    /// Of so many rows and columns of the texture one is kept.
    pub step: u32,
    /// Places, in the arrays of [`Texels`], of those that are kept, ascending.
    pub texels: Vec<u32>,
    /// Of each parameter that any part depends on.
    pub maps: Vec<SensitivityMap>,
}

/// Of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct SensitivityMap {
    /// Its name.
    pub parameter: String,
    /// What it measures.
    pub quantity: Quantity,
    /// For every kept texel how far the surface moves outwards for a unit of the parameter, in millimetres; NaN on parts that do not
    /// depend on it.
    pub values: Vec<f32>,
}

impl SensitivityMaps {
    /// At texels of `atlas`, which have been moved by `motion`.
    ///
    /// # Errors
    /// Where the derivatives cannot be evaluated.
    pub fn new(
        model: &dyn Model,
        instance: &dyn Instance,
        atlas: &Atlas,
        texels: &Texels,
        motion: &Motion,
    ) -> Result<SensitivityMaps, EvaluationError> {
        let parts = model.parts();
        let mut active: Vec<u32> = parts.iter().flat_map(|p| p.active.iter().copied()).collect();
        active.sort_unstable();
        active.dedup();
        let step = (0..).map(|k| 1u32 << k).find(|s| texels.len() * active.len() / (*s as usize).pow(2) <= MOST);
        let step = step.unwrap_or(1);
        let kept: Vec<u32> = (0..texels.len() as u32)
            .filter(|i| {
                let [x, y] = texels.place(*i as usize);
                x % step == 0 && y % step == 0
            })
            .collect();
        let mut of_part: Vec<Vec<u32>> = vec![Vec::new(); parts.len()];
        for (k, i) in kept.iter().enumerate() {
            of_part[texels.part[*i as usize] as usize].push(k as u32);
        }
        let mut values = vec![vec![f32::NAN; kept.len()]; active.len()];
        for (patch, members) in of_part.iter().enumerate().filter(|(patch, _)| !parts[*patch].active.is_empty()) {
            let chart = &atlas.charts[patch];
            let batch = |batch: &[u32]| {
                let parameters = batch.iter().map(|k| {
                    let [x, y] = texels.place(kept[*k as usize] as usize);
                    chart.parameters(x - chart.x, y - chart.y)
                });
                let (u, v): (Vec<f64>, Vec<f64>) = parameters.unzip();
                let mut jacobian = vec![0.0; 3 * parts[patch].active.len() * u.len()];
                instance.jacobian(patch, &u, &v, &mut jacobian)?;
                let own = parts[patch].active.len();
                let along = |(j, d): (usize, &[f64])| {
                    let normal = texels.normal[kept[batch[j / own] as usize] as usize].map(f64::from);
                    vector::dot(normal, motion.direction([d[0], d[1], d[2]])) as f32
                };
                Ok(jacobian.chunks_exact(3).enumerate().map(along).collect())
            };
            let found: Vec<Vec<f32>> = members.par_chunks(BATCH).map(batch).collect::<Result<_, EvaluationError>>()?;
            let own = &parts[patch].active;
            for (members, found) in members.chunks(BATCH).zip(found) {
                for (k, row) in members.iter().zip(found.chunks_exact(own.len())) {
                    for (parameter, value) in own.iter().zip(row) {
                        if let Ok(map) = active.binary_search(parameter) {
                            values[map][*k as usize] = *value;
                        }
                    }
                }
            }
        }
        let named = active.iter().zip(values).map(|(parameter, values)| {
            let parameter = &model.parameters()[*parameter as usize];
            SensitivityMap { parameter: parameter.name.clone(), quantity: parameter.quantity, values }
        });
        let maps = named.collect();
        Ok(SensitivityMaps { step, texels: kept, maps })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gml_compiler::program::{Options, compile};
    use gml_compiler::source::{NoFiles, SourceFile};

    #[test]
    fn a_radius_moves_the_side_and_a_height_the_lid() {
        let text = "use std.surface (cylinder, disc)\nmodel can { param r: length = 20mm; param h: length = 50mm; param x: length = 0mm\n\
                    part side = |u, v| cylinder(r, h)(u, v) + (x, 0mm, 0mm)\n\
                    part lid = |u, v| disc(r)(u, v) + (x, 0mm, h) }";
        let script = SourceFile { name: "can.gml".to_owned(), text: text.to_owned() };
        let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
        let instance = Model::instantiate(&program, &[20.0, 50.0, 3.0]).expect("it exists");
        let atlas = Atlas::new(&program, &*instance, 64).expect("it fits");
        let mut texels = Texels::of_model(&program, &*instance, &atlas).expect("it is finite");
        let motion =
            Motion { rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], translation: [5.0, 7.0, -3.0] };
        let before = texels.clone();
        motion.move_texels(&mut texels);
        let maps = SensitivityMaps::new(&program, &*instance, &atlas, &texels, &motion).expect("it is smooth");
        assert_eq!(maps.maps.iter().map(|m| m.parameter.as_str()).collect::<Vec<_>>(), ["r", "h", "x"]);
        assert_eq!((maps.step, maps.texels.len()), (1, texels.len()));
        let expected = |map: usize, i: usize| match (map, texels.part[i]) {
            (0, 0) | (1, 1) => 1.0,
            (2, _) => before.normal[i][0],
            _ => 0.0,
        };
        for (map, SensitivityMap { values, .. }) in maps.maps.iter().enumerate() {
            for (i, value) in values.iter().enumerate() {
                assert!((value - expected(map, i)).abs() < 1e-6, "{map} {i} {value}");
            }
        }
    }
}
