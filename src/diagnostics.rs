//! Diagnostics for people: the source underlined, what is wrong beside it, and how to mend it.

use ariadne::{CharSet, Color, Config, IndexType, Label, Report, ReportKind};
use gml_compiler::diagnostic::{Diagnostic, Severity};
use gml_compiler::source::{FileId, Sources, Span};
use std::collections::HashMap;
use std::fmt;
use std::io::IsTerminal;

/// The sources as ariadne wants them.
struct Cache<'a> {
    sources: &'a Sources,
    split: HashMap<FileId, ariadne::Source<&'a str>>,
}

impl<'a> ariadne::Cache<FileId> for Cache<'a> {
    type Storage = &'a str;

    fn fetch(&mut self, id: &FileId) -> Result<&ariadne::Source<&'a str>, impl fmt::Debug> {
        let text = self.sources.get(*id).map(|f| f.text.as_str()).ok_or("no such file")?;
        Ok::<_, &str>(self.split.entry(*id).or_insert_with(|| ariadne::Source::from(text)))
    }

    fn display<'b>(&self, id: &'b FileId) -> Option<impl fmt::Display + 'b> {
        self.sources.get(*id).map(|f| f.name.clone())
    }
}

/// Prints all to standard error, in colour where that is a terminal.
pub(crate) fn print(diagnostics: &[Diagnostic], sources: &Sources) {
    let colour = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    eprint!("{}", render(diagnostics, sources, colour));
}

/// All as text, with a last line that counts.
pub(crate) fn render(diagnostics: &[Diagnostic], sources: &Sources, colour: bool) -> String {
    let mut text = Vec::new();
    for d in diagnostics {
        render_one(d, sources, colour, &mut text);
    }
    let count = |severity| diagnostics.iter().filter(|d| d.severity == severity).count();
    let plural = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let mut text = String::from_utf8_lossy(&text).into_owned();
    let totals: Vec<String> = [(Severity::Error, "error"), (Severity::Warning, "warning")]
        .iter()
        .filter(|(s, _)| count(*s) > 0)
        .map(|(s, what)| plural(count(*s), what))
        .collect();
    if !totals.is_empty() {
        text.push_str(&totals.join(", "));
        text.push('\n');
    }
    text
}

fn render_one(d: &Diagnostic, sources: &Sources, colour: bool, out: &mut Vec<u8>) {
    let (kind, main) = match d.severity {
        Severity::Error => (ReportKind::Error, Color::Red),
        Severity::Warning => (ReportKind::Warning, Color::Yellow),
    };
    let range = |s: Span| (s.file, s.start as usize..(s.end.max(s.start)) as usize);
    let config = Config::default().with_color(colour).with_char_set(CharSet::Unicode).with_index_type(IndexType::Byte);
    let label = if d.label.is_empty() { "here" } else { &d.label };
    let mut report = Report::build(kind, range(d.span))
        .with_config(config)
        .with_code(&d.code)
        .with_message(&d.message)
        .with_label(Label::new(range(d.span)).with_message(label).with_color(main));
    for (span, text) in &d.related {
        report = report.with_label(Label::new(range(*span)).with_message(text).with_color(Color::Cyan));
    }
    if let Some(hint) = &d.hint {
        report = report.with_help(hint);
    }
    let cache = Cache { sources, split: HashMap::new() };
    if report.finish().write(cache, &mut *out).is_err() {
        // A vector takes everything that is written; only a span outside of its file can bring us here.
        out.extend_from_slice(format!("{}: {}\n", d.code, d.message).as_bytes());
    }
}
