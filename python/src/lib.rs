//! `_gmlc`, the compiled half of the Python package: models, scans, fits and measurements as plain data and numpy
//! arrays. The other half, in python/gmlc, makes of them what people use.

mod arrays;
mod deviations;
mod errors;
mod model;
mod processes;
mod scan;
mod work;

use pyo3::prelude::*;

/// The compiled half of gmlc; use the package `gmlc`.
#[pymodule]
mod _gmlc {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::deviations::Deviations;
    #[pymodule_export]
    use super::errors::{Error, FitError, Interrupted, ScriptError, UsageError};
    #[pymodule_export]
    use super::model::Program;
    #[pymodule_export]
    use super::scan::{Scan, virtual_scan};
    #[pymodule_export]
    use super::work::{batch_jobs, batch_work, command, fit, inspect, measure, option_names, shortcoming};

    #[pymodule_init]
    fn init(_module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::processes::imported();
        Ok(())
    }

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
