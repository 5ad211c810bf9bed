//! What a compiled model is for: scans are read and made, the model is fitted to them, the deviations are measured
//! and documented. No argument parsing, no printing.
//!
//! - [`mesh`]: triangle meshes, the plain data that stages exchange.
//! - [`scan`]: reading and cleaning scans, normals, noise.
//! - [`simulate`]: the virtual laser scanner.
//! - [`model`]: a model as evaluable surface patches; tessellation, charts and texels.
//! - [`bvh`]: nearest hits of rays and closest points on a triangle mesh.
//! - [`fit`]: parameters and pose from a scan.
//! - [`variance`]: distances from every texel of the model's surface to the scan; statistics.
//! - [`export`]: the documents: X3D, pictures, meshes, report.
//! - [`workers`]: threads for the compiler's work.
//!
//! `fit` and `variance` use `model`, `scan` and `bvh`, and not each other; `simulate` uses `bvh`; `export` reads all
//! results.

pub mod bvh;
pub mod export;
pub mod fit;
pub mod inspect;
pub mod mesh;
pub mod model;
pub mod progress;
mod robust;
pub mod scan;
pub mod simulate;
pub mod variance;
pub mod workers;
