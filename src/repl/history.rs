//! The file of the history.

use std::path::PathBuf;

/// Number of lines that are kept.
pub(crate) const LINES: usize = 2000;

/// `gmlc/history` in the user's state folder: $XDG_STATE_HOME, or .local/state in the home folder. None if neither is
/// set.
pub(crate) fn path() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let state = set("XDG_STATE_HOME").filter(|p| p.is_absolute());
    let state = state.or_else(|| set("HOME").map(|home| home.join(".local").join("state")));
    Some(state?.join("gmlc").join("history"))
}
