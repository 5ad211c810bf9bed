//! The words that the process was started with, for the records of results.

use std::ffi::OsString;
use std::sync::OnceLock;

/// Of the process, which has one command line.
static WORDS: OnceLock<Vec<OsString>> = OnceLock::new();

/// Keeps the words; the first ones stay.
pub(crate) fn keep(words: Vec<OsString>) -> &'static [OsString] {
    WORDS.get_or_init(|| words)
}

/// The words, with the program's name first; none where no command runs.
pub(crate) fn words() -> &'static [OsString] {
    WORDS.get().map_or(&[], Vec::as_slice)
}
