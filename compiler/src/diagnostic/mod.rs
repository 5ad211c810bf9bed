//! Diagnostics: what is wrong, where, and how to correct it. Each kind of mistake has a [`Code`], which explains it at
//! length.

mod code;

pub use code::Code;

use crate::source::Span;
use serde::{Deserialize, Serialize};

/// Whether a mistake keeps the script from compiling.
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
    /// That of the code, or less where the mistake was not made just now.
    pub severity: Severity,
    /// The kind of mistake.
    pub code: Code,
    /// One sentence in the user's words, without a full stop.
    pub message: String,
    /// The place to underline.
    pub span: Span,
    /// A short text beside the underlined source; may be empty.
    pub label: String,
    /// Other places that explain it (`defined here`), with their texts.
    pub related: Vec<(Span, String)>,
    /// The calls that led there, the innermost first: each with the name of what was called.
    pub call_stack: Vec<(Span, String)>,
    /// The way to correct it.
    pub hint: Option<String>,
    /// Corrections that replace text; the first is that of the hint, if there is any.
    pub suggestions: Vec<Suggestion>,
}

/// A correction that an editor can make.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Suggestion {
    /// The change in words, or the question whether it was meant.
    pub message: String,
    /// The edits, in the order of the text and without overlap.
    pub edits: Vec<Edit>,
}

/// Text in the place of other text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Edit {
    /// The replaced text; empty for an insertion.
    pub span: Span,
    /// The new text.
    pub replacement: String,
}

impl Edit {
    /// The text under the span becomes the replacement.
    #[must_use]
    pub fn replace(span: Span, replacement: impl Into<String>) -> Self {
        Self { span, replacement: replacement.into() }
    }

    /// Text before the span.
    #[must_use]
    pub fn before(span: Span, text: impl Into<String>) -> Self {
        Self::replace(Span { end: span.start, ..span }, text)
    }

    /// Text after the span.
    #[must_use]
    pub fn after(span: Span, text: impl Into<String>) -> Self {
        Self::replace(Span { start: span.end, ..span }, text)
    }

    /// Nothing is left of the span.
    #[must_use]
    pub fn remove(span: Span) -> Self {
        Self::replace(span, "")
    }
}

impl Diagnostic {
    /// An error or a warning, as the code has it.
    pub fn new(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self {
            severity: code.severity(),
            code,
            message: message.into(),
            span,
            label: String::new(),
            related: Vec::new(),
            call_stack: Vec::new(),
            hint: None,
            suggestions: Vec::new(),
        }
    }

    /// Adds the text beside the underlined source.
    #[must_use]
    pub fn label(mut self, text: impl Into<String>) -> Self {
        self.label = text.into();
        self
    }

    /// Adds the way to correct it.
    #[must_use]
    pub fn hint(mut self, text: impl Into<String>) -> Self {
        self.hint = Some(text.into());
        self
    }

    /// Adds the way to correct it, together with the edits that do so.
    #[must_use]
    pub fn suggest(mut self, text: impl Into<String>, edits: impl IntoIterator<Item = Edit>) -> Self {
        let message = text.into();
        self.hint.get_or_insert_with(|| message.clone());
        self.suggestions.push(Suggestion { message, edits: edits.into_iter().collect() });
        self
    }

    /// Adds a suggestion if there is one; one without edits is a hint only.
    #[must_use]
    pub fn suggestion(self, suggestion: Option<Suggestion>) -> Self {
        match suggestion {
            None => self,
            Some(Suggestion { message, edits }) if edits.is_empty() => self.hint(message),
            Some(Suggestion { message, edits }) => self.suggest(message, edits),
        }
    }

    /// Asks whether another name was meant in the place of the one under `span`.
    #[must_use]
    pub fn did_you_mean(self, span: Span, name: &str) -> Self {
        self.suggest(format!("did you mean '{name}'?"), [Edit::replace(span, name)])
    }

    /// Adds another place that explains it.
    #[must_use]
    pub fn related(mut self, span: Span, text: impl Into<String>) -> Self {
        self.related.push((span, text.into()));
        self
    }
}
