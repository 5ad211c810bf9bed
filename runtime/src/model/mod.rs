//! A model as evaluable surface patches; their breaks, its tessellation, charts and texels.

mod atlas;
mod breaks;
mod classes;
mod closed;
mod ends;
mod material;
mod motion;
mod packing;
mod passages;
mod program;
mod raster;
mod reference;
mod sensitivities;
mod sensitivity_maps;
mod spacing;
mod surface;
mod tessellation;
mod texels;
mod winding;

pub use atlas::{Atlas, AtlasError, Chart, LARGEST, SMALLEST};
pub(crate) use breaks::spans;
pub use breaks::{Break, BreakKind, Breaks};
pub use closed::{Closedness, OpenBorder};
pub use gml_compiler::program::{EvaluationError, Order, Sites};
pub use material::{Material, Standing};
pub use motion::Motion;
pub use passages::Passages;
pub use reference::{ReferenceError, ReferenceSurface};
pub use sensitivities::{PartSensitivities, Sensitivities};
pub use sensitivity_maps::{SensitivityMap, SensitivityMaps};
pub use spacing::Spacing;
pub use surface::{Instance, Model, Partials, SecondPartials};
pub(crate) use tessellation::unit_normals;
pub use tessellation::{Fineness, SurfacePoint, Tessellation};
pub use texels::Texels;
pub(crate) use winding::Winding;
