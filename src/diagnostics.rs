//! Diagnostics for people: the source underlined, the error beside it, and suggested fixes.

use crate::{print, verbosity};
use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Patch, Renderer, Snippet};
use gml_compiler::diagnostic::{Diagnostic, Edit, Severity, Suggestion};
use gml_compiler::source::{FileId, Sources, Span};
use std::io::IsTerminal;
use std::ops::Range;

/// The number of diagnostics that are shown in full.
const SHOWN: usize = 30;
/// Source lines are cut to this number of columns around the underlined text.
const WIDTH: usize = 120;

/// Prints diagnostics to standard error, in colour if that is a terminal.
pub(crate) fn print(diagnostics: &[Diagnostic], sources: &Sources) {
    let colour = std::io::stderr().is_terminal() && verbosity::allows_colour();
    print::styled(&render(diagnostics, sources, colour));
}

/// Renders diagnostics as text, with a last line of totals.
pub(crate) fn render(diagnostics: &[Diagnostic], sources: &Sources, colour: bool) -> String {
    let renderer = if colour { Renderer::styled() } else { Renderer::plain() }.term_width(WIDTH);
    let mut text = String::new();
    // If there are many diagnostics, errors go first.
    let few = diagnostics.len() <= SHOWN;
    let errors = diagnostics.iter().filter(|d| few || d.severity == Severity::Error);
    let warnings = diagnostics.iter().filter(|d| !few && d.severity == Severity::Warning);
    for d in errors.chain(warnings).take(SHOWN) {
        text.push_str(&renderer.render(&report(d, sources)));
        text.push_str("\n\n");
    }
    if !diagnostics.is_empty() {
        text.push_str(&totals(diagnostics));
        text.push('\n');
    }
    without_c1(&text)
}

/// The text without the control characters that terminals take for the beginning of a command, as they do ESC [, and
/// that the renderer leaves (U+0080 to U+009F).
fn without_c1(text: &str) -> String {
    text.chars().map(|c| if ('\u{80}'..='\u{9f}').contains(&c) { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

/// `2 errors, 1 warning`.
fn totals(diagnostics: &[Diagnostic]) -> String {
    let count = |severity| diagnostics.iter().filter(|d| d.severity == severity).count();
    let named = [(count(Severity::Error), "error"), (count(Severity::Warning), "warning")];
    let totals: Vec<String> = named
        .iter()
        .filter(|(n, _)| *n > 0)
        .map(|(n, what)| format!("{n} {what}{}", if *n == 1 { "" } else { "s" }))
        .collect();
    match diagnostics.len().checked_sub(SHOWN) {
        Some(more) if more > 0 => format!("... and {more} more: {} in all", totals.join(", ")),
        _ => totals.join(", "),
    }
}

/// A diagnostic: its source, related places, and a group for every suggestion.
fn report<'d>(d: &'d Diagnostic, sources: &'d Sources) -> Vec<Group<'d>> {
    let level = match d.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let mut group = Group::with_title(level.primary_title(d.message.as_str()).id(d.code.text()));
    for snippet in snippets(d, sources) {
        group = group.element(snippet);
    }
    if let Some(hint) = d.hint.as_deref().filter(|hint| d.suggestions.iter().all(|s| s.message != *hint)) {
        group = group.element(Level::HELP.message(hint));
    }
    let mut groups = vec![group];
    groups.extend(d.suggestions.iter().filter_map(|s| fix(s, sources)));
    groups
}

/// The places of a diagnostic, one snippet per file, its own first.
fn snippets<'d>(d: &'d Diagnostic, sources: &'d Sources) -> Vec<Snippet<'d, Annotation<'d>>> {
    let mut places: Vec<(Span, AnnotationKind, Option<&str>)> =
        vec![(d.span, AnnotationKind::Primary, Some(d.label.as_str()).filter(|l| !l.is_empty()))];
    let others = d.related.iter().chain(&d.call_stack);
    places.extend(others.map(|(span, text)| (*span, AnnotationKind::Context, Some(text.as_str()))));
    let mut files: Vec<FileId> = Vec::new();
    for (span, ..) in &places {
        if !files.contains(&span.file) {
            files.push(span.file);
        }
    }
    let snippet = |file: FileId| {
        let source = sources.get(file)?;
        let here = places.iter().filter(|(span, ..)| span.file == file);
        let annotations = here.map(|(span, kind, label)| kind.span(range(&source.text, *span)).label(*label));
        Some(Snippet::source(source.text.as_str()).path(source.name.as_str()).annotations(annotations))
    };
    files.into_iter().filter_map(snippet).collect()
}

/// A suggestion as a change of the source; none if it has no edits.
fn fix<'d>(suggestion: &'d Suggestion, sources: &'d Sources) -> Option<Group<'d>> {
    let file = suggestion.edits.first()?.span.file;
    let source = sources.get(file)?;
    let patch = |edit: &'d Edit| Patch::new(range(&source.text, edit.span), edit.replacement.as_str());
    let snippet = Snippet::source(source.text.as_str()).patches(suggestion.edits.iter().map(patch));
    Some(Group::with_title(Level::HELP.secondary_title(suggestion.message.as_str())).element(snippet))
}

/// The bytes of a span, rounded outwards to characters.
fn range(text: &str, span: Span) -> Range<usize> {
    let start = text.floor_char_boundary(span.start as usize);
    start..text.ceil_char_boundary(span.end as usize).max(start)
}
