//! Which commands know parts that are trimmed.

use super::{EvaluationError, Model};

/// Refuses a model with trimmed parts, where the whole surface of every part would be taken for what is there.
///
/// # Errors
/// The first part that is trimmed.
pub(crate) fn require_whole(model: &dyn Model) -> Result<(), EvaluationError> {
    match (0..model.parts().len()).find(|part| model.keep(*part).is_some()) {
        Some(part) => Err(EvaluationError::new(format!(
            "part {} is trimmed (by `+`, `-`, `&` or `keep`): such parts have meshes, pictures and virtual scans, but \
             fits and measurements do not know them yet",
            model.parts()[part].name
        ))),
        None => Ok(()),
    }
}
