//! The area of a model's surface: of several explanations of a scan the one with the least surface counts.

use crate::fit::problem::coverage::patch_area;
use crate::fit::problem::level::Level;
use crate::fit::problem::parameterization::Estimate;

/// The area of some patches, in square millimetres, exact to some percent. None where the model does not exist.
pub(crate) fn area(level: &Level, at: &Estimate, of_patch: impl Fn(usize) -> bool) -> Option<f64> {
    let model = level.problem.model;
    let instance = model.instantiate(&level.space.x(&at.z)?).ok()?;
    let patches = (0..model.parts().len()).filter(|patch| of_patch(*patch));
    Some(patches.filter_map(|patch| patch_area(model, &*instance, patch)).sum())
}
