//! The documents: X3D, pictures, meshes, report.

pub mod atomic;
pub mod colormap;
pub mod escape;
pub mod json;
pub mod obj;
pub mod ply;
pub mod stl;
pub mod x3d;
