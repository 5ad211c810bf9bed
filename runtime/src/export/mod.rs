//! The documents: X3D, pictures, meshes, report.

pub mod escape;
pub mod x3d;
