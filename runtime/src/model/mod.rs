//! A model as evaluable surface patches; its tessellation, charts and texels.

mod surface;

pub use surface::{EvaluationError, Instance, Model, Partials, SecondPartials};
