//! The documents: X3D, pictures, meshes, report.
