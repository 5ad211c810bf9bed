//! The sensitivity of the surface along its normal to the parameters, all over the texture.

use super::sensitivities::derivatives;
use super::{Atlas, EvaluationError, Instance, Model, Motion, Texels};
use glam::DVec3;
use gml_compiler::program::Quantity;
use rayon::prelude::*;

/// The most values, of all parameters together: beyond that every second row and column is left out, and so on.
const MOST: usize = 1 << 26;

/// The number of texels that are evaluated at once.
const BATCH: usize = 4096;

/// n . dS/dx at texels, for every parameter x.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensitivityMaps {
    /// One of this many rows and columns of the texture is sampled.
    pub step: u32,
    /// The sampled texels: indices into the arrays of [`Texels`], ascending.
    pub texels: Vec<u32>,
    /// The map of each parameter that any part depends on.
    pub maps: Vec<SensitivityMap>,
}

/// The map of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct SensitivityMap {
    /// The parameter's name.
    pub parameter: String,
    /// The parameter's quantity.
    pub quantity: Quantity,
    /// For every sampled texel the distance by which the surface moves outwards for a unit of the parameter, in
    /// millimetres; NaN on parts that do not depend on it.
    pub values: Vec<f32>,
}

impl SensitivityMaps {
    /// The maps at texels of `atlas`, which have been moved by `motion`.
    ///
    /// # Errors
    /// The derivatives cannot be evaluated.
    pub fn new(
        model: &dyn Model,
        instance: &dyn Instance,
        atlas: &Atlas,
        texels: &Texels,
        motion: &Motion,
    ) -> Result<Self, EvaluationError> {
        let parts = model.parts();
        let mut active: Vec<u32> = parts.iter().flat_map(|p| p.active.iter().copied()).collect();
        active.sort_unstable();
        active.dedup();
        let step = (0..).map(|k| 1u32 << k).find(|s| texels.len() * active.len() / (*s as usize).pow(2) <= MOST);
        let step = step.unwrap_or(1);
        let on_step = |i: &u32| texels.place(*i as usize).iter().all(|n| n % step == 0);
        let sampled: Vec<u32> = (0..texels.len() as u32).filter(on_step).collect();
        let mut of_part: Vec<Vec<usize>> = vec![Vec::new(); parts.len()];
        for (k, i) in sampled.iter().enumerate() {
            of_part[texels.part[*i as usize] as usize].push(k);
        }
        let mut values = vec![vec![f32::NAN; sampled.len()]; active.len()];
        for (patch, members) in of_part.iter().enumerate().filter(|(patch, _)| !parts[*patch].active.is_empty()) {
            let count = parts[patch].active.len();
            let batch = |batch: &[usize]| {
                let texel = |k: &usize| sampled[*k] as usize;
                let places: Vec<[u32; 2]> = batch.iter().map(|k| texels.place(texel(k))).collect();
                let derivatives = derivatives(instance, atlas, patch, count, &places, motion)?;
                let rows = batch.iter().zip(derivatives.chunks_exact(count));
                let along_normal = rows.flat_map(|(k, row)| {
                    let normal = DVec3::from_array(texels.normal[texel(k)].map(f64::from));
                    row.iter().map(move |d| normal.dot(DVec3::from_array(*d)) as f32)
                });
                Ok(along_normal.collect())
            };
            let batches: Vec<Vec<f32>> =
                members.par_chunks(BATCH).map(batch).collect::<Result<_, EvaluationError>>()?;
            for (k, row) in members.iter().zip(batches.concat().chunks_exact(count)) {
                for (parameter, value) in parts[patch].active.iter().zip(row) {
                    if let Ok(map) = active.binary_search(parameter) {
                        values[map][*k] = *value;
                    }
                }
            }
        }
        let map = |(parameter, values): (&u32, Vec<f32>)| {
            let parameter = &model.parameters()[*parameter as usize];
            SensitivityMap { parameter: parameter.name.clone(), quantity: parameter.quantity, values }
        };
        let maps = active.iter().zip(values).map(map).collect();
        Ok(Self { step, texels: sampled, maps })
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
