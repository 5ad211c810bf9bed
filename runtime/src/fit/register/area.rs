//! The area of a model's surface: of several explanations of a scan the one with the least surface counts.

use crate::fit::problem::level::Level;
use crate::fit::problem::parameterization::Estimate;
use crate::fit::sampling::cell_centres;
use crate::fit::tuning::AREA_SAMPLES;
use crate::model::Partials;
use glam::DVec3;

/// The area of some patches, in square millimetres, exact to some percent. None where the model does not exist.
pub(crate) fn area(level: &Level, at: &Estimate, of_patch: impl Fn(usize) -> bool) -> Option<f64> {
    let model = level.problem.model;
    let instance = model.instantiate(&level.space.x(&at.z)?).ok()?;
    let [u, v] = cell_centres([AREA_SAMPLES; 2]);
    let mut partials = vec![Partials::default(); u.len()];
    let mut sum = 0.0;
    for patch in (0..model.parts().len()).filter(|patch| of_patch(*patch)) {
        if instance.partials(patch, &u, &v, &mut partials).is_ok() {
            let size = |p: &Partials| DVec3::from_array(p.du).cross(DVec3::from_array(p.dv)).length();
            sum += partials.iter().map(size).sum::<f64>() / u.len() as f64;
        }
    }
    sum.is_finite().then_some(sum)
}
