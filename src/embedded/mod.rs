//! gmlc for programs that embed it, such as the Python package: models, fits, measurements and inspections on plain
//! data, with the options of the command.
//!
//! Options are words as on a command line (`--unit`, `m`), so that their names, values and errors are the command's.

mod batch;
mod error;
mod model;
mod work;

pub use crate::values::positive_length;
pub use batch::{BatchJobs, batch_jobs, batch_work};
pub use error::{EmbeddedError, ErrorKind};
pub use model::Model;
pub use work::{
    Measured, OptionName, fit, inspect, measure, names_of_options, read_scan, scan_of_points, truth_of_scan,
    virtual_scan,
};
