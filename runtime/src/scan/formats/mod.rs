//! One reader a format. Those of meshes have the whole file in memory; those of clouds hand their points on in batches.

mod batch;
#[cfg(test)]
pub(crate) mod collected;
pub(super) mod e57;
pub(super) mod gltf;
pub(super) mod las;
pub(super) mod obj;
pub(super) mod off;
pub(super) mod pcd;
pub(super) mod ply;
pub(super) mod pts;
pub(super) mod ptx;
mod raster;
pub(super) mod stl;
pub(super) mod table;
mod text;
pub(super) mod threemf;
