//! The words of the command that runs, for the records of results.

use std::ffi::OsString;
use std::sync::{Mutex, PoisonError};

/// Of the process, which runs one command after the other, as the Python package does.
static WORDS: Mutex<Vec<OsString>> = Mutex::new(Vec::new());

/// Keeps the words of the command that begins.
pub(crate) fn keep(words: &[OsString]) {
    words.clone_into(&mut WORDS.lock().unwrap_or_else(PoisonError::into_inner));
}

/// The words, with the program's name first; none where no command runs.
pub(crate) fn words() -> Vec<OsString> {
    WORDS.lock().unwrap_or_else(PoisonError::into_inner).clone()
}
