//! Fits generative models to laser scans and measures the deviations (\[VA\]: Schinko, Ullrich, Schiffer and Fellner,
//! *Variance Analysis and Comparison in Computer-Aided Design*). Models are compiled by `gml_compiler`. This crate
//! parses no arguments and prints nothing.
//!
//! # Example
//!
//! A script, a scan, and what [`inspect()`] finds: the parameters of the scanned can, and the deviations from the
//! fitted model.
//!
//! ```
//! use gml_compiler::{NoFiles, Options, SourceFile, compile};
//! use gml_runtime::{
//!     Fineness, FitOptions, MeasureOptions, Model, Resolution, Scanner, Silent, Tessellation, inspect, scan, simulate,
//! };
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = "
//!     use std.solid (capped_cylinder)
//!     model tin {
//!         param r: length in 15mm..25mm = 20mm
//!         param h: length in 30mm..70mm = 50mm
//!         part can = capped_cylinder(radius: r, height: h)
//!     }";
//! let script = SourceFile { name: "can.gml".to_owned(), text: text.to_owned() };
//! let program = compile(script, &NoFiles, &Options::default())?.program;
//!
//! // `scan::read` reads a file; here the virtual scanner scans a can with a radius of 21 mm and a height of 52 mm.
//! let instance = Model::instantiate(&program, &[21.0, 52.0])?;
//! let real = Tessellation::new(&program, &*instance, Fineness::default())?;
//! let scanner = Scanner { spacing: 1.5, noise: 0.05, ..Scanner::default() };
//! let scan = scan::from_mesh(simulate::scan(&real.mesh, &scanner, &Silent)?.mesh, "can.ply")?;
//!
//! let mut options = MeasureOptions::default();
//! options.resolution = Resolution::Side(128);
//! let inspection = inspect(&program, &scan, &FitOptions::default(), &options, &Silent)?;
//! let [r, h] = [0, 1].map(|i| inspection.fit.parameters[i].value);
//! assert!((r - 21.0).abs() < 0.05 && (h - 52.0).abs() < 0.1);
//! let deviations = &inspection.measurement.report.overall;
//! assert!(deviations.coverage > 0.8 && deviations.weighted.percentiles.p95 < 0.15);
//! # Ok(())
//! # }
//! ```
//!
//! # Modules
//!
//! - [`mesh`]: triangle meshes, the plain data that stages exchange.
//! - [`scan`]: reading and cleaning scans, normals, noise.
//! - [`simulate`]: the virtual laser scanner.
//! - [`model`]: a model as evaluable surface patches; tessellation, charts and texels.
//! - [`bvh`]: nearest hits of rays and closest points on a triangle mesh.
//! - [`mod@fit`]: parameters and pose from a scan; search over discrete inputs.
//! - [`variance`]: distances from every texel of the model's surface to the scan; statistics.
//! - [`mod@compare`]: where two surfaces differ, and by which parameters.
//! - [`export`]: the documents: X3D, pictures, meshes, report.
//! - [`mod@inspect`]: fit, measure and document.
//! - [`population`]: what the fits of many objects say together.
//! - [`record`]: what a result was made with.
//! - [`workers`]: threads for the compiler's work.
//!
//! `fit` and `variance` use `model`, `scan`, `bvh` and foot points, and not each other; `simulate` uses `model` and
//! `bvh`; `export` reads all results; `compare` uses `variance` and foot points; `inspect`
//! calls `fit`, `variance` and `export`.

pub mod bvh;
pub mod compare;
mod disjoint_sets;
mod eigen;
pub mod export;
mod feet;
pub mod figures;
pub mod fit;
pub mod inspect;
pub mod mesh;
pub mod model;
mod morton;
pub mod population;
pub mod progress;
pub mod reason;
pub mod record;
#[cfg(test)]
mod repeats;
mod rims;
mod robust;
mod sampling;
pub mod scan;
pub mod simulate;
mod spread;
pub mod variance;
pub mod workers;

pub use fit::{FitOptions, FitResult, fit};
pub use inspect::{Inspection, inspect};
pub use model::{Fineness, Model, Motion, Tessellation};
pub use progress::{Progress, Silent};
pub use scan::Scan;
pub use simulate::Scanner;
pub use variance::{MeasureOptions, Measurement, Reference, Resolution, measure};
