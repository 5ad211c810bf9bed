//! The documents: X3D, pictures, meshes, report.

pub mod atomic;
pub mod colormap;
pub mod obj;
pub mod ply;
pub mod stl;
