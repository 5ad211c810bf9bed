//! Diagnostics: what is wrong, where, and how to mend it.
//!
//! What a code stands for is told at length in docs/diagnostics.md, which [`explanations`] reads.

mod explanations;

pub use explanations::{Explanation, explanation, explanations};

use crate::source::Span;
use serde::{Deserialize, Serialize};

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The script still compiles.
    Warning,
    /// It does not.
    Error,
}

/// One finding. Rendering (with underlined source) is the command's business.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// A stable name for the kind of mistake, such as `unknown-name` or `dimension-mismatch`.
    pub code: String,
    /// One sentence in the user's words, without a full stop.
    pub message: String,
    /// What to underline.
    pub span: Span,
    /// A short text beside the underlined source; may be empty.
    pub label: String,
    /// Other places that explain it (`defined here`), with their texts.
    pub related: Vec<(Span, String)>,
    /// The calls that led there, the nearest first: each with the name of what was called.
    pub trail: Vec<(Span, String)>,
    /// How to mend it.
    pub hint: Option<String>,
    /// Mends that can be made by replacing text; the first of them is the hint's, if there is any.
    pub suggestions: Vec<Suggestion>,
}

/// A mend that an editor can make.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Suggestion {
    /// What it does, or the question whether that was meant.
    pub message: String,
    /// What to replace, in the order of the text and without overlap.
    pub edits: Vec<Edit>,
}

/// Text in the place of other text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Edit {
    /// What is replaced; empty where something is inserted.
    pub span: Span,
    /// What comes there.
    pub replacement: String,
}

impl Edit {
    /// The text under the span becomes the replacement.
    #[must_use]
    pub fn replace(span: Span, replacement: impl Into<String>) -> Edit {
        Edit { span, replacement: replacement.into() }
    }

    /// Text before the span.
    #[must_use]
    pub fn before(span: Span, text: impl Into<String>) -> Edit {
        Edit::replace(Span { end: span.start, ..span }, text)
    }

    /// Text after the span.
    #[must_use]
    pub fn after(span: Span, text: impl Into<String>) -> Edit {
        Edit::replace(Span { start: span.end, ..span }, text)
    }

    /// Nothing is left of the span.
    #[must_use]
    pub fn remove(span: Span) -> Edit {
        Edit::replace(span, "")
    }
}

impl Diagnostic {
    /// An error.
    pub fn error(code: &str, span: Span, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Severity::Error, code, span, message)
    }

    /// A warning.
    pub fn warning(code: &str, span: Span, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Severity::Warning, code, span, message)
    }

    fn new(severity: Severity, code: &str, span: Span, message: impl Into<String>) -> Diagnostic {
        Diagnostic {
            severity,
            code: code.to_owned(),
            message: message.into(),
            span,
            label: String::new(),
            related: Vec::new(),
            trail: Vec::new(),
            hint: None,
            suggestions: Vec::new(),
        }
    }

    /// Adds the text beside the underlined source.
    #[must_use]
    pub fn label(mut self, text: impl Into<String>) -> Diagnostic {
        self.label = text.into();
        self
    }

    /// Adds the way to mend it.
    #[must_use]
    pub fn hint(mut self, text: impl Into<String>) -> Diagnostic {
        self.hint = Some(text.into());
        self
    }

    /// Adds the way to mend it, together with the edits that do so.
    #[must_use]
    pub fn suggest(mut self, text: impl Into<String>, edits: impl IntoIterator<Item = Edit>) -> Diagnostic {
        let message = text.into();
        self.hint.get_or_insert_with(|| message.clone());
        self.suggestions.push(Suggestion { message, edits: edits.into_iter().collect() });
        self
    }

    /// Adds a mend if there is one; one without edits is a hint only.
    #[must_use]
    pub fn mend(self, mend: Option<Suggestion>) -> Diagnostic {
        match mend {
            None => self,
            Some(Suggestion { message, edits }) if edits.is_empty() => self.hint(message),
            Some(Suggestion { message, edits }) => self.suggest(message, edits),
        }
    }

    /// Asks whether another name was meant in the place of the one under `span`.
    #[must_use]
    pub fn did_you_mean(self, span: Span, name: &str) -> Diagnostic {
        self.suggest(format!("did you mean '{name}'?"), [Edit::replace(span, name)])
    }

    /// Adds another place that explains it.
    #[must_use]
    pub fn related(mut self, span: Span, text: impl Into<String>) -> Diagnostic {
        self.related.push((span, text.into()));
        self
    }
}
