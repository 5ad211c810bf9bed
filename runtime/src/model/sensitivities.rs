//! How the surface moves where the parameters change.

use super::{Atlas, EvaluationError, Instance, Model, Motion, Texels};
use gml_compiler::program::Quantity;

/// Texels of a part at most: what is estimated from them needs no more.
const SAMPLES: usize = 2000;

/// dS/dx at a sample of texels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sensitivities {
    /// Of each part.
    pub parts: Vec<PartSensitivities>,
    /// Names of the parameters, and what they measure.
    pub parameters: Vec<(String, Quantity)>,
}

/// Of one part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartSensitivities {
    /// Places of the sampled texels in the arrays of [`Texels`], evenly spread.
    pub texels: Vec<usize>,
    /// The parameters that the part depends on.
    pub active: Vec<usize>,
    /// The surface's own unit normal at every one of them, whatever direction the texels come to look in.
    pub normals: Vec<[f64; 3]>,
    /// For every texel, for every active parameter: the derivative of the point. Millimetres per unit of the parameter.
    pub derivatives: Vec<[f64; 3]>,
}

impl Sensitivities {
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
    ) -> Result<Sensitivities, EvaluationError> {
        let mut parts = Vec::new();
        for (patch, (part, sample)) in model.parts().iter().zip(texels.samples_of_parts(SAMPLES)).enumerate() {
            let chart = &atlas.charts[patch];
            let parameters = |i: &usize| {
                let [x, y] = texels.place(*i);
                chart.parameters(x - chart.x, y - chart.y)
            };
            let (u, v): (Vec<f64>, Vec<f64>) = sample.iter().map(parameters).unzip();
            let mut jacobian = vec![0.0; 3 * part.active.len() * u.len()];
            instance.jacobian(patch, &u, &v, &mut jacobian)?;
            let derivatives = jacobian.chunks_exact(3).map(|d| motion.direction([d[0], d[1], d[2]])).collect();
            let active = part.active.iter().map(|p| *p as usize).collect();
            let normals = sample.iter().map(|i| texels.normal[*i].map(f64::from)).collect();
            parts.push(PartSensitivities { texels: sample, active, normals, derivatives });
        }
        let parameters = model.parameters().iter().map(|p| (p.name.clone(), p.quantity)).collect();
        Ok(Sensitivities { parts, parameters })
    }
}
