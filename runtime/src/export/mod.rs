//! The documents: X3D, pictures, meshes, report.

pub mod atomic;
pub mod colormap;
mod glyphs;
pub mod obj;
pub mod picture;
pub mod ply;
pub mod raster;
pub mod stl;
