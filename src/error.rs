//! Errors of the command, and their exit status.

use gml_compiler::program::Failed;

/// Why a command could not do its work.
#[derive(Debug)]
pub(crate) enum CommandError {
    /// Something is wrong with a file or a result: exit status 1.
    Failed(String),
    /// A result cannot be written, whatever it is of: exit status 1.
    Unwritable(String),
    /// The command line is wrong: exit status 2.
    Usage(String),
    /// The script has errors: exit status 1.
    Script(Box<Failed>),
    /// Something is wrong and has been reported: exit status 1.
    Reported,
    /// Everything was done, and parts do not conform to their tolerances; a line for each of them and for each part of
    /// which that is undecided: exit status 3.
    DoesNotConform(Vec<String>),
    /// Everything was done, and the measurement does not tell whether parts conform, with a line each: exit status 4.
    Undecided(Vec<String>),
    /// Everything was done, and the fit cannot be relied on, for this reason: exit status 4.
    Unreliable(String),
}

impl From<Failed> for CommandError {
    fn from(failed: Failed) -> Self {
        Self::Script(Box::new(failed))
    }
}

impl CommandError {
    /// The text where the user ended the work.
    pub(crate) const INTERRUPTED: &str = "interrupted";

    /// The process's exit status.
    pub(crate) fn status(&self) -> u8 {
        match self {
            Self::Failed(_) | Self::Unwritable(_) | Self::Script(_) | Self::Reported => 1,
            Self::Usage(_) => 2,
            Self::DoesNotConform(_) => 3,
            Self::Undecided(_) | Self::Unreliable(_) => 4,
        }
    }

    /// Prints the error to standard error.
    pub(crate) fn print(&self) {
        match self {
            Self::Failed(message) | Self::Unwritable(message) | Self::Usage(message) => eprintln!("error: {message}"),
            Self::Script(errors) => crate::diagnostics::print(&errors.diagnostics, &errors.sources),
            Self::DoesNotConform(lines) | Self::Undecided(lines) => lines.iter().for_each(|line| eprintln!("{line}")),
            Self::Unreliable(reason) => eprintln!("unreliable fit: {reason}"),
            Self::Reported => {}
        }
    }

    /// The reason in one line.
    pub(crate) fn reason(&self) -> String {
        match self {
            Self::Failed(message) | Self::Unwritable(message) | Self::Usage(message) | Self::Unreliable(message) => {
                message.clone()
            }
            Self::Script(errors) => errors.diagnostics.first().map(|d| d.message.clone()).unwrap_or_default(),
            Self::DoesNotConform(_) | Self::Undecided(_) | Self::Reported => String::new(),
        }
    }

    /// The user ended the work.
    pub(crate) fn interrupted() -> Self {
        Self::Failed(Self::INTERRUPTED.into())
    }

    /// A failure from anything that has a message.
    pub(crate) fn failed(error: impl std::fmt::Display) -> Self {
        Self::Failed(error.to_string())
    }

    /// Wrong use of the command line.
    pub(crate) fn usage(error: impl std::fmt::Display) -> Self {
        Self::Usage(error.to_string())
    }
}
