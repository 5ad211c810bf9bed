//! Work in processes that were forked. A child has none of its parent's threads, on which work of Rayon's global pool
//! would wait for ever: it works on threads of its own.

use pyo3::marker::Ungil;
use pyo3::prelude::*;
use rayon::ThreadPoolBuilder;
use std::sync::OnceLock;

/// The process that imported the package.
static IMPORTED_BY: OnceLock<u32> = OnceLock::new();

/// Notes the process that imports the package.
pub(crate) fn imported() {
    IMPORTED_BY.get_or_init(std::process::id);
}

/// Works without the interpreter's lock.
pub(crate) fn detached<T: Ungil + Send>(py: Python<'_>, work: impl FnOnce() -> T + Ungil + Send) -> T {
    py.detach(|| on_own_threads(work))
}

/// Works on threads that this process has.
pub(crate) fn on_own_threads<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let is_forked = IMPORTED_BY.get().is_some_and(|id| *id != std::process::id());
    match is_forked.then(|| ThreadPoolBuilder::new().build()) {
        Some(Ok(pool)) => pool.install(work),
        _ => work(),
    }
}
