//! Which of the files that were read have changed since.

use std::collections::BTreeMap;
use std::time::SystemTime;

/// When a file was last changed, and its size; nothing where it is not there.
type State = Option<(SystemTime, u64)>;

/// The files as they were when they were read.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    files: BTreeMap<String, State>,
}

impl Watch {
    /// Watches these files from now on; those that are watched already stay as they were.
    pub(crate) fn files(&mut self, names: &[String]) {
        self.files.retain(|name, _| names.contains(name));
        for name in names {
            self.files.entry(name.clone()).or_insert_with(|| state(name));
        }
    }

    /// The first file that is not as it was.
    pub(crate) fn changed(&self) -> Option<String> {
        self.files.iter().find(|(name, before)| state(name) != **before).map(|(name, _)| name.clone())
    }

    /// Takes all files to be as they are.
    pub(crate) fn seen(&mut self) {
        for (name, before) in &mut self.files {
            *before = state(name);
        }
    }
}

fn state(name: &str) -> State {
    let data = std::fs::metadata(name).ok()?;
    Some((data.modified().ok()?, data.len()))
}
