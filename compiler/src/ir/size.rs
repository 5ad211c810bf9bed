//! Limits of a program's size, which lowering, inlining and differentiation keep.

use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;

/// Bounds on the size of a program.
#[derive(Clone, Copy, Debug)]
pub struct SizeLimits {
    /// Most nodes of all functions together.
    pub nodes: usize,
    /// Deepest nesting of branches and loops.
    pub nesting: usize,
}

impl Default for SizeLimits {
    fn default() -> SizeLimits {
        SizeLimits { nodes: 400_000, nesting: 100 }
    }
}

/// A program outgrows its limits.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SizeError {
    /// It would have more nodes than the limit.
    #[error("the program is too large: '{function}' calls for more than {limit} operations in all")]
    TooLarge {
        /// The function in which the limit was exceeded.
        function: String,
        /// The call there.
        span: Span,
        /// The limit.
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
            SizeError::TooLarge { .. } => error.hint("the limit can be raised: --limit operations=N"),
            SizeError::TooDeep { .. } => error,
        }
    }
}
