//! Detects changes of the files that were read.

use std::collections::BTreeMap;
use std::time::SystemTime;

/// Time of the last change of a file, and its size; none if it does not exist.
type State = Option<(SystemTime, u64)>;

/// The files as they were when they were read.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    files: BTreeMap<String, State>,
}

impl Watch {
    /// Watches these files; the state of those that are watched already is kept.
    pub(crate) fn files(&mut self, names: &[String]) {
        self.files.retain(|name, _| names.contains(name));
        for name in names {
            self.files.entry(name.clone()).or_insert_with(|| state(name));
        }
    }

    /// The first file that has changed.
    pub(crate) fn changed(&self) -> Option<String> {
        self.files.iter().find(|(name, before)| state(name) != **before).map(|(name, _)| name.clone())
    }

    /// Takes the current state of all files.
    pub(crate) fn update(&mut self) {
        for (name, before) in &mut self.files {
            *before = state(name);
        }
    }
}

fn state(name: &str) -> State {
    let data = std::fs::metadata(name).ok()?;
    Some((data.modified().ok()?, data.len()))
}
