//! Limits of a program's size, which lowering, inlining and differentiation keep.

use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;

/// Bounds on the size of a program.
#[derive(Clone, Copy, Debug)]
pub struct SizeLimits {
    /// Most nodes of all functions together. By default somewhat more than a box with fillets on its twelve edges has
    /// (some 650,000: 4 s until it is compiled, and 0.9 GB with all derivatives).
    pub nodes: usize,
    /// Deepest nesting of branches and loops.
    pub nesting: usize,
}

impl SizeLimits {
    /// Most nodes of what is lowered. Inlining drops unused nodes: before it there may be more.
    pub(super) fn lowered_nodes(&self) -> usize {
        self.nodes / 2 * 5
    }
}

impl Default for SizeLimits {
    fn default() -> SizeLimits {
        SizeLimits { nodes: 800_000, nesting: 100 }
    }
}

/// A program outgrows its limits.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SizeError {
    /// It would have more nodes than the limit.
    #[error("the program is too large: '{function}' calls for more than {most} operations in all")]
    TooLarge {
        /// The function in which the limit was exceeded.
        function: String,
        /// The call there.
        span: Span,
        /// The number of operations that was exceeded: as many as `limit`, or more before unused ones are dropped.
        most: usize,
        /// The limit: [`SizeLimits::nodes`].
        limit: usize,
    },
    /// Its branches and loops would be nested deeper than the limit.
    #[error("the program is too deep: '{function}' nests more than {limit} branches and loops")]
    TooDeep {
        /// The function in which the limit was exceeded.
        function: String,
        /// The branch or loop there.
        span: Span,
        /// The limit.
        limit: usize,
    },
}

impl SizeError {
    /// More operations than the limit, none of which is to be dropped.
    pub(crate) fn too_large(function: String, span: Span, limit: usize) -> SizeError {
        SizeError::TooLarge { function, span, most: limit, limit }
    }

    /// The place in the source.
    #[must_use]
    pub fn span(&self) -> Span {
        match self {
            SizeError::TooLarge { span, .. } | SizeError::TooDeep { span, .. } => *span,
        }
    }

    /// For the user.
    #[must_use]
    pub fn diagnostic(&self) -> Diagnostic {
        let error = Diagnostic::new(Code::TooLarge, self.span(), self.to_string());
        match self {
            SizeError::TooLarge { most, limit, .. } => {
                let lowered = if most > limit { " (5/2 of it before unused operations are dropped)" } else { "" };
                let raised = limit.saturating_mul(2);
                error.hint(format!(
                    "the limit 'operations' is {limit}{lowered}; raise it, for example with --limit operations={raised}"
                ))
            }
            SizeError::TooDeep { .. } => error,
        }
    }
}
