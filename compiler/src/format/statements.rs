//! Statements: the lines of files, models and blocks.

use super::document::DocId;
use super::writer::Writer;
use crate::source::Span;
use crate::syntax::ast::{Expr, Item};
use crate::syntax::token::Token;

/// A line of a block.
#[derive(Clone, Copy)]
pub(super) enum Statement<'a> {
    Item(&'a Item),
    Value(&'a Expr),
}

impl Statement<'_> {
    fn span(self) -> Span {
        match self {
            Statement::Item(item) => item.span,
            Statement::Value(expr) => expr.span,
        }
    }
}

/// A block in braces.
pub(super) struct Block {
    /// A group.
    pub(super) doc: DocId,
    /// Whether it may stand on one line.
    pub(super) inline: bool,
}

impl Writer<'_> {
    /// Items and the value of a block, from its brace on.
    pub(super) fn block(&mut self, items: &[Item], value: Option<&Expr>) -> Block {
        let brace = self.cursor.start();
        let open = self.token();
        let lines: Vec<Statement> =
            items.iter().map(Statement::Item).chain(value.into_iter().map(Statement::Value)).collect();
        // A block stays open if the author ended the line after its brace.
        let opened = !lines.is_empty() && self.cursor.line_ends(brace, self.cursor.start());
        let mut within = Vec::new();
        if opened {
            within.push(self.docs.force());
        }
        let body = self.statements(&lines);
        if !body.is_empty() {
            within.push(self.docs.line(" "));
            within.extend(body);
        }
        let end = if within.is_empty() { "" } else { " " };
        let within = self.docs.nest(within);
        let line = self.docs.line(end);
        let close = self.token();
        let doc = self.docs.group(vec![open, within, line, close]);
        Block { doc, inline: !self.docs.forced(doc) }
    }

    /// Statements up to the end of their block or file, with the comments between and after them.
    pub(super) fn statements(&mut self, statements: &[Statement]) -> Vec<DocId> {
        let mut lines = Vec::new();
        // The statements of one line, joined by semicolons.
        let mut run = Vec::new();
        for (i, statement) in statements.iter().enumerate() {
            let joined = i > 0 && !self.cursor.line_ends(self.cursor.end(), self.cursor.start());
            // Without a semicolon, a line that begins with a minus would continue the one before.
            let negative = self.cursor.at(Token::Minus);
            if joined {
                run.push(if negative { self.docs.line(" ") } else { self.docs.line("; ") });
            } else {
                self.end_run(&mut run, &mut lines);
                self.begin_line(&mut lines, i == 0);
            }
            run.push(self.statement(*statement));
            if i + 1 < statements.len() && self.cursor.at(Token::Minus) {
                run.push(self.docs.text(";"));
            }
            if let Some(comment) = self.comment_after() {
                self.end_run(&mut run, &mut lines);
                lines.push(comment);
            }
        }
        self.end_run(&mut run, &mut lines);
        self.own_lines(&mut lines, statements.is_empty());
        lines
    }

    fn end_run(&mut self, run: &mut Vec<DocId>, lines: &mut Vec<DocId>) {
        if !run.is_empty() {
            lines.push(self.docs.group(std::mem::take(run)));
        }
    }

    /// The line end before a statement and the comments above it.
    fn begin_line(&mut self, lines: &mut Vec<DocId>, first: bool) {
        let end = self.own_lines(lines, first);
        if !lines.is_empty() {
            if self.cursor.blank_between(end, self.cursor.start()) {
                lines.push(self.docs.blank());
            }
            lines.push(self.docs.newline());
        }
    }

    /// The comments above the next token, each on its line; returns the end of the last token or comment before it.
    fn own_lines(&mut self, lines: &mut Vec<DocId>, first: bool) -> u32 {
        let mut end = self.cursor.end();
        let mut first = first;
        while let Some(comment) = self.cursor.comment_before() {
            if !first {
                if self.cursor.blank_between(end, comment.start) {
                    lines.push(self.docs.blank());
                }
                lines.push(self.docs.newline());
            }
            lines.push(self.docs.own_comment(comment.text));
            end = comment.start + comment.text.len() as u32;
            first = false;
        }
        end
    }

    fn statement(&mut self, statement: Statement) -> DocId {
        self.ends.push(statement.span().end);
        let doc = match statement {
            Statement::Item(item) => self.item(item),
            Statement::Value(expr) => self.expr(expr).doc,
        };
        self.ends.pop();
        doc
    }
}
