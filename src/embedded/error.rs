//! Errors as callers tell them apart.

use crate::diagnostics;
use crate::error::CommandError;

/// What an error is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// Options, or arguments that do not belong together.
    Usage,
    /// The script.
    Script,
    /// A file, a scan, or the work.
    Failed,
    /// The work was ended by its caller.
    Interrupted,
}

/// Why something cannot be done, with the text that the command prints.
#[derive(Clone, Debug)]
pub struct EmbeddedError {
    /// What it is about.
    pub kind: ErrorKind,
    /// The text; of a script its diagnostics.
    pub text: String,
}

impl From<CommandError> for EmbeddedError {
    fn from(error: CommandError) -> Self {
        let (kind, text) = match error {
            CommandError::Usage(text) => (ErrorKind::Usage, text),
            CommandError::Script(failed) => {
                (ErrorKind::Script, diagnostics::render(&failed.diagnostics, &failed.sources, false))
            }
            CommandError::Failed(text) if text == CommandError::INTERRUPTED => (ErrorKind::Interrupted, text),
            error => (ErrorKind::Failed, error.reason()),
        };
        Self { kind, text }
    }
}

impl EmbeddedError {
    /// An error of the work, from anything that has a message.
    pub(super) fn failed(error: impl std::fmt::Display) -> Self {
        Self { kind: ErrorKind::Failed, text: error.to_string() }
    }
}
