//! Makes the nodes of the tree for the grammar's actions.
//!
//! Every node is built with its depth. One that would lie deeper than [`NESTING_LIMIT`] is replaced by an error node,
//! so that walking, printing and dropping a tree may recurse.

mod expressions;
mod items;
mod types;

use super::ast::{Expr, ExprKind, Ident, Item, TypeExpr, TypeKind};
use super::layout::too_deep;
use super::{NESTING_LIMIT, literal, spanned};
use crate::diagnostic::{Diagnostic, Edit};
use crate::source::{FileId, Span};

/// What the actions know and find.
pub(in crate::syntax) struct Builder<'t> {
    file: FileId,
    source: &'t str,
    /// What is well-formed but wrong.
    pub(in crate::syntax) diagnostics: Vec<Diagnostic>,
    reported_depth: bool,
}

/// A part of the tree with the number of levels in it.
pub(in crate::syntax) struct Deep<T> {
    pub(in crate::syntax) node: T,
    pub(in crate::syntax) depth: u32,
}

impl<T> Deep<T> {
    pub(in crate::syntax) fn flat(node: T) -> Deep<T> {
        Deep { node, depth: 1 }
    }

    pub(in crate::syntax) fn map<U>(self, f: impl FnOnce(T) -> U) -> Deep<U> {
        Deep { node: f(self.node), depth: self.depth }
    }

    fn split(self) -> (T, u32) {
        (self.node, self.depth)
    }
}

/// A line of a block.
pub(in crate::syntax) enum Statement {
    Item(Deep<Item>),
    Expr(Deep<Expr>),
    Bad(Span),
}

/// A type that may become the left side of `->`, where parentheses list arguments.
pub(in crate::syntax) enum TypeAtom {
    Plain(Deep<TypeExpr>),
    Paren(Vec<TypeExpr>, Span, u32),
}

/// The nodes and the greatest depth among them.
fn split_all<T>(list: Vec<Deep<T>>) -> (Vec<T>, u32) {
    let depth = list.iter().map(|d| d.depth).max().unwrap_or(0);
    (list.into_iter().map(|d| d.node).collect(), depth)
}

fn split_option<T>(option: Option<Deep<T>>) -> (Option<T>, u32) {
    option.map_or((None, 0), |d| (Some(d.node), d.depth))
}

impl<'t> Builder<'t> {
    pub(in crate::syntax) fn new(file: FileId, source: &'t str) -> Builder<'t> {
        Builder { file, source, diagnostics: Vec::new(), reported_depth: false }
    }

    pub(in crate::syntax) fn span(&self, start: u32, end: u32) -> Span {
        spanned(self.file, start, end)
    }

    fn slice(&self, start: u32, end: u32) -> &'t str {
        self.source.get(start as usize..end as usize).unwrap_or("")
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Whether a node above nodes of that depth is still allowed; the first that is not is reported.
    fn fits(&mut self, span: Span, below: u32) -> bool {
        if below < NESTING_LIMIT {
            return true;
        }
        if !self.reported_depth {
            self.reported_depth = true;
            self.report(too_deep(self.file, span.start, span.end));
        }
        false
    }

    fn expr(&mut self, span: Span, kind: ExprKind, below: u32) -> Deep<Expr> {
        if self.fits(span, below) {
            Deep { node: Expr { span, kind }, depth: below + 1 }
        } else {
            Deep::flat(Expr { span, kind: ExprKind::Error })
        }
    }

    fn ty(&mut self, span: Span, kind: TypeKind, below: u32) -> Deep<TypeExpr> {
        if self.fits(span, below) {
            Deep { node: TypeExpr { span, kind }, depth: below + 1 }
        } else {
            Deep::flat(TypeExpr { span, kind: TypeKind::Error })
        }
    }
}

// Leaves.
impl Builder<'_> {
    pub(in crate::syntax) fn ident(&mut self, l: u32, r: u32) -> Ident {
        Ident { text: self.slice(l, r).to_owned(), span: self.span(l, r) }
    }

    pub(in crate::syntax) fn text(&mut self, l: u32, r: u32) -> String {
        let span = self.span(l, r);
        literal::text(span, self.slice(l, r), &mut self.diagnostics)
    }

    pub(in crate::syntax) fn doc(&mut self, l: u32, r: u32) -> String {
        literal::doc(self.slice(l, r))
    }

    pub(in crate::syntax) fn number(&mut self, l: u32, r: u32) -> Deep<Expr> {
        let span = self.span(l, r);
        let kind = literal::number(span, self.slice(l, r)).unwrap_or_else(|diagnostic| {
            let diagnostic = self.product_meant(*diagnostic);
            self.report(diagnostic);
            ExprKind::Error
        });
        Deep::flat(Expr { span, kind })
    }

    /// `2x` is a product where x is a name of the script.
    fn product_meant(&self, diagnostic: Diagnostic) -> Diagnostic {
        let text = self.slice(diagnostic.span.start, diagnostic.span.end);
        let (number, name) = text.split_at(text.find(char::is_alphabetic).unwrap_or(text.len()));
        let other = |c: Option<char>| c.is_none_or(|c| !c.is_alphanumeric() && c != '_');
        // Looking through the whole text takes time, so not for each of very many.
        let known = !name.is_empty()
            && self.diagnostics.len() < 20
            && self.source.match_indices(name).any(|(at, _)| {
                other(self.source[..at].chars().next_back()) && other(self.source[at + name.len()..].chars().next())
            });
        if !known || !diagnostic.suggestions.is_empty() {
            return diagnostic;
        }
        let gap = Span { start: diagnostic.span.start + number.len() as u32, ..diagnostic.span };
        let gap = Span { end: gap.start, ..gap };
        let message = format!("'{name}' is no unit; a product needs its sign");
        Diagnostic::new(diagnostic.code, diagnostic.span, message)
            .suggest(format!("write '{number} * {name}'"), [Edit::replace(gap, " * ")])
    }

    pub(in crate::syntax) fn leaf(&mut self, l: u32, kind: ExprKind, r: u32) -> Deep<Expr> {
        Deep::flat(Expr { span: self.span(l, r), kind })
    }
}
