//! The documents: X3D, pictures, meshes, report.

pub mod colormap;
