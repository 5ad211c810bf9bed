//! The sensitivity of the surface to the parameters, at a sample of texels.

use super::{Atlas, EvaluationError, Instance, Model, Motion, Texels};
use gml_compiler::program::Quantity;

/// The most texels of a part: the estimates that are made from them need no more.
const SAMPLES: usize = 2000;

/// dS/dx at a sample of texels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sensitivities {
    /// The sensitivities of each part.
    pub parts: Vec<PartSensitivities>,
    /// Names and quantities of the parameters.
    pub parameters: Vec<(String, Quantity)>,
}

/// The sensitivities of one part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartSensitivities {
    /// Places of the sampled texels in the arrays of [`Texels`], evenly spread.
    pub texels: Vec<usize>,
    /// The parameters that the part depends on.
    pub active: Vec<usize>,
    /// The surface's own unit normal at each of these texels, in whatever direction the texel's distance is measured.
    pub normals: Vec<[f64; 3]>,
    /// For every texel, for every active parameter: the derivative of the point. Millimetres per unit of the parameter.
    pub derivatives: Vec<[f64; 3]>,
}

impl Sensitivities {
    /// The sensitivities at texels of `atlas`, which have been moved by `motion`.
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
        let mut parts = Vec::new();
        for (patch, (part, sample)) in model.parts().iter().zip(texels.samples_of_parts(SAMPLES)).enumerate() {
            let places: Vec<[u32; 2]> = sample.iter().map(|i| texels.place(*i)).collect();
            let derivatives = derivatives(instance, atlas, patch, part.active.len(), &places, motion)?;
            let active = part.active.iter().map(|p| *p as usize).collect();
            let normals = sample.iter().map(|i| texels.normal[*i].map(f64::from)).collect();
            parts.push(PartSensitivities { texels: sample, active, normals, derivatives });
        }
        let parameters = model.parameters().iter().map(|p| (p.name.clone(), p.quantity)).collect();
        Ok(Self { parts, parameters })
    }
}

/// dS/dx of a moved patch at texels, given by column and row of the texture: for every texel, for every one of the
/// parameters on which the patch depends, of which there are `active`.
pub(super) fn derivatives(
    instance: &dyn Instance,
    atlas: &Atlas,
    patch: usize,
    active: usize,
    texels: &[[u32; 2]],
    motion: &Motion,
) -> Result<Vec<[f64; 3]>, EvaluationError> {
    let chart = &atlas.charts[patch];
    let parameters = texels.iter().map(|[x, y]| atlas.parameters(patch, x - chart.x, y - chart.y));
    let (u, v): (Vec<f64>, Vec<f64>) = parameters.unzip();
    let mut jacobian = vec![0.0; 3 * active * texels.len()];
    instance.jacobian(patch, &u, &v, &mut jacobian)?;
    Ok(jacobian.as_chunks().0.iter().map(|derivative| motion.direction(*derivative)).collect())
}
