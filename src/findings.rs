//! Diagnostics for programs: the JSON of `gmlc check --format json`, described in docs/diagnostics.md.

use gml_compiler::diagnostic::{Diagnostic, Suggestion};
use gml_compiler::source::{Sources, Span};
use serde_json::{Value, json};

/// All diagnostics as an array.
pub(crate) fn array(diagnostics: &[Diagnostic], sources: &Sources) -> Value {
    diagnostics.iter().map(|d| diagnostic(d, sources)).collect()
}

fn diagnostic(d: &Diagnostic, sources: &Sources) -> Value {
    let places = |list: &[(Span, String)]| -> Value {
        list.iter().map(|(span, text)| place(*span, sources, &json!({ "text": text }))).collect()
    };
    let suggestions: Value = d.suggestions.iter().map(|s| suggestion(s, sources)).collect();
    let rest = json!({
        "severity": d.severity, "code": d.code, "message": d.message, "label": d.label,
        "labels": places(&d.related), "trail": places(&d.call_stack),
        "hints": hints(d), "suggestions": suggestions,
    });
    place(d.span, sources, &rest)
}

/// The hint, and the messages of the suggestions.
fn hints(d: &Diagnostic) -> Vec<&str> {
    let mut hints: Vec<&str> = d.hint.iter().map(String::as_str).collect();
    for s in &d.suggestions {
        if !hints.contains(&s.message.as_str()) {
            hints.push(&s.message);
        }
    }
    hints
}

fn suggestion(s: &Suggestion, sources: &Sources) -> Value {
    let edits: Value =
        s.edits.iter().map(|e| place(e.span, sources, &json!({ "replacement": e.replacement }))).collect();
    json!({ "message": s.message, "edits": edits })
}

/// A span and more fields: lines and columns from 1, in characters; `start` and `end` in bytes. Ends lie one past the
/// last character.
fn place(span: Span, sources: &Sources, more: &Value) -> Value {
    let (line, column) = sources.line_column(span);
    let (end_line, end_column) = sources.line_column(Span { start: span.end, ..span });
    let mut value = json!({
        "file": sources.get(span.file).map_or("", |f| f.name.as_str()),
        "line": line, "column": column, "end_line": end_line, "end_column": end_column,
        "start": span.start, "end": span.end,
    });
    if let (Some(value), Some(more)) = (value.as_object_mut(), more.as_object()) {
        value.extend(more.clone());
    }
    value
}
