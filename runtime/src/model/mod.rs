//! A model as evaluable surface patches; its tessellation, charts and texels.

mod surface;
mod tessellation;
mod texels;

pub use surface::{EvaluationError, Instance, Model, Partials, SecondPartials};
pub use tessellation::{SurfacePoint, Tessellation};
pub use texels::Texels;
