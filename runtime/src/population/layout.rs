//! One texture for all objects: the same place of it is the same place of the surface.

use crate::model::{Atlas, AtlasError, Fineness, Model, Tessellation, Texels};
use crate::variance::Resolution;
use std::sync::Arc;

/// Longest edge of the drawn surface, as a fraction of its diagonal.
const EDGE: f64 = 1.0 / 150.0;

/// The surface at values of the parameters that stand for all objects, with the texture that all of them share.
#[derive(Clone, Debug)]
pub struct CommonTexture {
    /// The places of the patches on the texture.
    pub atlas: Arc<Atlas>,
    /// The texels there.
    pub texels: Texels,
    /// The surface, for pictures.
    pub tessellation: Tessellation,
}

impl CommonTexture {
    /// The texture of a model, laid out at `x`, by the resolution of its measurements.
    ///
    /// # Errors
    /// If the surface cannot be evaluated there, or the texture is too small or too large.
    pub fn of(model: &dyn Model, x: &[f64], resolution: Resolution) -> Result<Self, AtlasError> {
        let instance = model.instantiate(x)?;
        let atlas = resolution.layout(model, &*instance)?;
        let texels = Texels::of_model(model, &*instance, &atlas)?;
        let size = Tessellation::rough_diagonal(model, &*instance, 8)?;
        let edge = if size > 0.0 { EDGE * size } else { f64::INFINITY };
        let fineness = Fineness { edge, ..Fineness::default() };
        let tessellation = Tessellation::new(model, &*instance, fineness)?.with_atlas(&atlas);
        Ok(Self { atlas: Arc::new(atlas), texels, tessellation })
    }
}
