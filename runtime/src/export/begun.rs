//! What this process has begun to write and has not put into its place yet. Whoever must end the process at once takes
//! it away first.
//!
//! One list for the whole process, since a signal ends all of it. It is held while something is begun or put into its
//! place, which takes microseconds: in between, all is either listed or in its place.

use super::folder;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Temporary files, and folders of results with the folders that they are for.
static BEGUN: Mutex<BTreeMap<PathBuf, Option<PathBuf>>> = Mutex::new(BTreeMap::new());

/// The list, held.
pub(super) struct Begun(MutexGuard<'static, BTreeMap<PathBuf, Option<PathBuf>>>);

/// Holds the list; waits for ever where the process ends.
pub(super) fn hold() -> Begun {
    // It is whole after every statement.
    Begun(BEGUN.lock().unwrap_or_else(PoisonError::into_inner))
}

impl Begun {
    /// A temporary file was made.
    pub(super) fn file(&mut self, path: &Path) {
        self.0.insert(path.to_owned(), None);
    }

    /// A folder was made for the results that a folder is to get.
    pub(super) fn folder(&mut self, staged: &Path, target: &Path) {
        self.0.insert(staged.to_owned(), Some(target.to_owned()));
    }

    /// It is in its place, or was removed.
    pub(super) fn is_done(&mut self, path: &Path) {
        self.0.remove(path);
    }
}

/// Removes what was begun, but for fits that are whole: these are kept as
/// [`ResultFolder::keep_fit`](folder::ResultFolder::keep_fit) keeps them. Returns where they are. Afterwards nothing is
/// written any more: the process is to end.
#[must_use]
pub fn abandon() -> Vec<PathBuf> {
    let Begun(list) = hold();
    let mut kept = Vec::new();
    for (path, target) in &*list {
        // What cannot be removed now is swept by the next run.
        match target {
            None => _ = fs::remove_file(path),
            Some(target) => {
                if path.join(folder::FIT).exists() {
                    kept.extend(folder::keep_fit(path, target));
                }
                _ = fs::remove_dir_all(path);
            }
        }
    }
    // Who waits for the list would begin something.
    std::mem::forget(list);
    kept
}
