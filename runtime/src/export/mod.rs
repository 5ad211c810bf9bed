//! The documents: X3D, pictures, meshes, report.

pub mod atomic;
pub mod colormap;
pub mod escape;
mod glyphs;
pub mod json;
pub mod obj;
pub mod picture;
pub mod ply;
pub mod raster;
pub mod render;
pub mod report;
pub mod stl;
pub mod x3d;
