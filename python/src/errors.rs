//! Errors as exceptions.

use gmlc::embedded::{EmbeddedError, ErrorKind};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;

create_exception!(gmlc, Error, PyException, "What gmlc cannot do; the text is the command's.");
create_exception!(gmlc, ScriptError, Error, "A script has errors; the text is its diagnostics.");
create_exception!(gmlc, FitError, Error, "A scan cannot be read, fitted or measured.");
create_exception!(gmlc, UsageError, Error, "Options are wrong or do not belong together.");
create_exception!(gmlc, Interrupted, Error, "The caller ended the work.");

/// The exception of an error.
pub(crate) fn raised(error: EmbeddedError) -> PyErr {
    let text = error.text.trim_end().to_owned();
    match error.kind {
        ErrorKind::Usage => UsageError::new_err(text),
        ErrorKind::Script => ScriptError::new_err(text),
        ErrorKind::Failed => FitError::new_err(text),
        ErrorKind::Interrupted => Interrupted::new_err(text),
    }
}

/// A wrong argument.
pub(crate) fn wrong(text: impl Into<String>) -> PyErr {
    PyValueError::new_err(text.into())
}
