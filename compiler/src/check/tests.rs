//! Tests of the checker: diagnostics as a user sees them, types, and the values of typed trees.

mod cup;
mod hostile;
mod library;
mod mistakes;
mod models;
mod support;
mod types;
