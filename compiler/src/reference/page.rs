//! A page under construction: headings, paragraphs, tables, definitions.

use super::harmless::{block, cell, code, inline, without_html};
use crate::source::Span;
use crate::syntax::ast::{FunctionDecl, Item, ItemKind};
use std::fmt::Write;

/// The page so far, and the script that it describes.
pub(super) struct Page<'t> {
    text: &'t str,
    out: String,
}

impl<'t> Page<'t> {
    pub(super) fn new(text: &'t str) -> Page<'t> {
        Page { text, out: String::new() }
    }

    pub(super) fn finish(self) -> String {
        format!("{}\n", self.out.trim_end())
    }

    pub(super) fn heading(&mut self, level: usize, text: &str) {
        let _ = writeln!(self.out, "{} {}\n", "#".repeat(level), inline(text));
    }

    /// A text, which may be empty, with an empty line after it.
    pub(super) fn paragraph(&mut self, text: &str) {
        if !text.trim().is_empty() {
            let _ = writeln!(self.out, "{}\n", without_html(text.trim_end()));
        }
    }

    /// The comment at the head of the file, where an empty line sets it apart from what follows.
    pub(super) fn introduction(&mut self) {
        let text = introduction(self.text);
        self.paragraph(&text);
    }

    /// The text of a span on one line.
    pub(super) fn written(&self, span: Span) -> String {
        let text = self.text.get(span.start as usize..span.end as usize).unwrap_or("");
        text.lines().map(str::trim).collect::<Vec<_>>().join(" ")
    }

    /// The text of a span as code; empty without a span.
    pub(super) fn code(&self, span: Option<Span>) -> String {
        span.map(|s| code(&self.written(s))).unwrap_or_default()
    }

    pub(super) fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let head: Vec<String> = head.iter().map(|h| (*h).to_owned()).collect();
        self.out.push_str(&line(&head));
        let _ = writeln!(self.out, "|{}", "---|".repeat(head.len()));
        for row in rows {
            let cells: Vec<String> = row.iter().map(|text| cell(text)).collect();
            self.out.push_str(&line(&cells));
        }
        self.out.push('\n');
    }

    pub(super) fn list(&mut self, lines: &[String]) {
        for line in lines {
            let _ = writeln!(self.out, "- {}", inline(line));
        }
        self.out.push('\n');
    }

    /// Constants and functions, those that are not private.
    pub(super) fn definitions(&mut self, level: usize, items: &[Item]) {
        let constants: Vec<&Item> = items.iter().filter(|i| is_constant(i)).collect();
        if !constants.is_empty() {
            self.heading(level, "Values");
            for item in constants {
                self.definition(level + 1, item);
            }
        }
        let functions: Vec<&Item> = items.iter().filter(|i| is_function(i)).collect();
        if !functions.is_empty() {
            self.heading(level, "Functions");
            for item in functions {
                self.definition(level + 1, item);
            }
        }
    }

    /// A constant or function: its name, its header, its doc comment.
    pub(super) fn definition(&mut self, level: usize, item: &Item) {
        let Some(name) = public_name(item) else { return };
        self.heading(level, name);
        let signature = match &item.kind {
            ItemKind::Function(decl) => self.signature(item, decl),
            _ => self.text.get(item.span.start as usize..item.span.end as usize).unwrap_or("").to_owned(),
        };
        let _ = writeln!(self.out, "{}\n", block(&signature));
        self.paragraph(&item.doc);
    }

    /// A function's header as it is written.
    fn signature(&self, item: &Item, decl: &FunctionDecl) -> String {
        let header = self.text.get(item.span.start as usize..decl.body.span.start as usize).unwrap_or("");
        let header = header.trim_end();
        header.strip_suffix('=').unwrap_or(header).trim_end().to_owned()
    }
}

/// The comment at the head of a file, where an empty line sets it apart from what follows.
pub(super) fn introduction(text: &str) -> String {
    let lines: Vec<&str> = text.lines().take_while(|l| l.starts_with("//") && !l.starts_with("///")).collect();
    let apart = text.lines().nth(lines.len()).is_none_or(|l| l.trim().is_empty());
    if !apart {
        return String::new();
    }
    lines.iter().map(|l| l.trim_start_matches('/').trim()).collect::<Vec<_>>().join("\n")
}

/// The name of a function, constant or model that is not private.
pub(super) fn public_name(item: &Item) -> Option<&str> {
    let name = match &item.kind {
        ItemKind::Model(model) => &model.name.text,
        ItemKind::Function(decl) => &decl.name.text,
        ItemKind::Let(decl) => &decl.pattern.name()?.text,
        _ => return None,
    };
    (!name.starts_with('_')).then_some(name)
}

fn is_function(item: &Item) -> bool {
    matches!(item.kind, ItemKind::Function(_)) && public_name(item).is_some()
}

/// A value without a doc comment is an intermediate result.
fn is_constant(item: &Item) -> bool {
    matches!(item.kind, ItemKind::Let(_)) && public_name(item).is_some() && !item.doc.is_empty()
}

/// The first sentence of a doc comment.
pub(super) fn summary(doc: &str) -> String {
    let paragraph: Vec<&str> = doc.lines().take_while(|l| !l.trim().is_empty() && !l.starts_with("```")).collect();
    let text = paragraph.join(" ");
    let end = text.match_indices(['.', ':']).map(|(i, _)| i).find(|i| {
        let rest = &text[i + 1..];
        // A point within a name, a number or a pair of brackets ends no sentence.
        let open = text[..*i].matches('(').count() > text[..*i].matches(')').count();
        (rest.is_empty() || rest.starts_with(' ')) && !open
    });
    end.map_or_else(|| text.clone(), |end| format!("{}.", &text[..end]))
}
