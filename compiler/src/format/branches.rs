//! `if`: on one line, one branch a line, or with open blocks.

use super::document::{DocId, Docs, Fit};
use super::statements::Block;
use super::writer::Writer;
use crate::syntax::ast::{Expr, ExprKind};
use crate::syntax::token::Token;

/// The blocks of an `if`, each with its head (`if c `, `else if c `, `else `).
#[derive(Default)]
pub(super) struct Branches {
    branches: Vec<(DocId, Block)>,
    /// The author began a line with `else`.
    below: bool,
}

impl Branches {
    pub(super) fn push(&mut self, head: DocId, block: Block) {
        self.branches.push((head, block));
    }
}

/// The layouts of an `if`.
pub(super) struct Layouts {
    flat: Option<DocId>,
    chain: Option<DocId>,
    open: DocId,
}

impl Layouts {
    /// The document in the middle of a line.
    pub(super) fn here(&self, docs: &mut Docs) -> DocId {
        let mut layouts = Vec::new();
        layouts.extend(self.flat.map(|d| (Fit::Flat, d)));
        layouts.extend(self.chain.map(|d| (Fit::Whole, d)));
        self.choice(layouts, docs, self.open)
    }

    /// The document after `=` or `|x|`: a chain begins on the next line.
    pub(super) fn after(&self, docs: &mut Docs) -> DocId {
        let mut layouts = Vec::new();
        if let Some(flat) = self.flat {
            layouts.push((Fit::Flat, docs.spaced(flat)));
        }
        if let Some(chain) = self.chain {
            layouts.push((Fit::Whole, docs.below(chain)));
        }
        let open = docs.spaced(self.open);
        self.choice(layouts, docs, open)
    }

    fn choice(&self, mut layouts: Vec<(Fit, DocId)>, docs: &mut Docs, last: DocId) -> DocId {
        layouts.push((Fit::Always, last));
        let choice = docs.choice(layouts);
        if self.flat.is_some() {
            return choice;
        }
        let force = docs.force();
        docs.concat(vec![force, choice])
    }
}

impl Writer<'_> {
    /// `if condition `, after `else ` if there is one.
    pub(super) fn if_head(&mut self, word: Option<DocId>, condition: &Expr) -> DocId {
        let mut docs: Vec<DocId> = word.into_iter().collect();
        docs.push(self.token_between("", " "));
        docs.push(self.expr(condition).doc);
        docs.push(self.docs.text(" "));
        self.docs.concat(docs)
    }

    /// `else `
    pub(super) fn else_word(&mut self, branches: &mut Branches) -> DocId {
        branches.below |= self.cursor.line_ends(self.cursor.end(), self.cursor.start());
        self.token_between("", " ")
    }

    /// An `if` that is an expression.
    pub(super) fn if_expr(&mut self, condition: &Expr, then: &Expr, otherwise: Option<&Expr>) -> Layouts {
        let mut branches = Branches::default();
        let (mut condition, mut then, mut otherwise, mut word) = (condition, then, otherwise, None);
        loop {
            let head = self.if_head(word, condition);
            branches.push(head, self.block_expr(then));
            let Some(other) = otherwise else { break };
            let before = self.else_word(&mut branches);
            match &other.kind {
                ExprKind::If(c, a, b) if self.cursor.at(Token::If) => {
                    (condition, then, otherwise, word) = (c, a, b.as_deref(), Some(before));
                }
                _ => {
                    branches.push(before, self.block_expr(other));
                    break;
                }
            }
        }
        self.branches(&branches)
    }

    /// A block that is an expression; there are no others after conditions.
    pub(super) fn block_expr(&mut self, expr: &Expr) -> Block {
        match &expr.kind {
            ExprKind::Block(items, value) => self.block(items, value.as_deref()),
            _ => Block { doc: self.expr(expr).doc, inline: false },
        }
    }

    pub(super) fn branches(&mut self, branches: &Branches) -> Layouts {
        let docs = &mut self.docs;
        let space = docs.text(" ");
        let (mut flat, mut chain, mut open) = (Vec::new(), Vec::new(), Vec::new());
        let mut inline = true;
        for (head, block) in &branches.branches {
            inline &= block.inline && !docs.forced(*head);
            let branch = docs.concat(vec![*head, block.doc]);
            let line = docs.flat(branch);
            if flat.is_empty() {
                chain.push(line);
            } else {
                flat.push(space);
                open.push(space);
                chain.push(docs.under(line));
            }
            flat.push(line);
            open.push(*head);
            open.push(docs.broken(block.doc));
        }
        let chained = inline && branches.branches.len() > 1;
        Layouts {
            flat: (inline && !branches.below).then(|| docs.concat(flat)),
            chain: chained.then(|| docs.concat(chain)),
            open: docs.concat(open),
        }
    }
}
