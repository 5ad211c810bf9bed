//! How a command ends other than well.

use gml_compiler::diagnostic::Diagnostic;
use gml_compiler::program::Failed;
use gml_compiler::source::Sources;

/// Why a command could not do its work.
#[derive(Debug)]
pub(crate) enum CommandError {
    /// Something is wrong with a file or a result: exit status 1.
    Failed(String),
    /// The command line is wrong: exit status 2.
    Usage(String),
    /// The script has errors: exit status 1.
    Script(Box<ScriptErrors>),
    /// Something is wrong, and was said already: exit status 1.
    Said,
    /// Everything was done, and deviations exceed the tolerance, as these lines say: exit status 3.
    OutOfTolerance(Vec<String>),
}

impl From<Failed> for CommandError {
    fn from(failed: Failed) -> CommandError {
        let Failed { diagnostics, sources } = failed;
        CommandError::Script(Box::new(ScriptErrors { diagnostics, sources }))
    }
}

/// Diagnostics with the sources that they point into.
#[derive(Debug)]
pub(crate) struct ScriptErrors {
    /// The diagnostics.
    pub(crate) diagnostics: Vec<Diagnostic>,
    /// The sources.
    pub(crate) sources: Sources,
}

impl CommandError {
    /// The process's exit status.
    pub(crate) fn status(&self) -> u8 {
        match self {
            CommandError::Failed(_) | CommandError::Script(_) | CommandError::Said => 1,
            CommandError::Usage(_) => 2,
            CommandError::OutOfTolerance(_) => 3,
        }
    }

    /// Says what went wrong on standard error.
    pub(crate) fn print(&self) {
        match self {
            CommandError::Failed(message) | CommandError::Usage(message) => eprintln!("error: {message}"),
            CommandError::Script(errors) => crate::diagnostics::print(&errors.diagnostics, &errors.sources),
            CommandError::OutOfTolerance(lines) => lines.iter().for_each(|line| eprintln!("out of tolerance: {line}")),
            CommandError::Said => {}
        }
    }

    /// A failure from anything that has a message.
    pub(crate) fn failed(error: impl std::fmt::Display) -> CommandError {
        CommandError::Failed(error.to_string())
    }

    /// Wrong use of the command line.
    pub(crate) fn usage(error: impl std::fmt::Display) -> CommandError {
        CommandError::Usage(error.to_string())
    }
}
