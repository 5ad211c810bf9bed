//! The writer: tokens and comments become documents in the order of the text.

use super::cursor::Cursor;
use super::document::{DocId, Docs};
use super::render::render;
use super::statements::Statement;
use crate::source::FileId;
use crate::syntax::ast::File;
use crate::syntax::token::Token;

/// A part of the text as a document.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) doc: DocId,
    /// Whether it is broken at its brackets, so that what is around it need not be.
    pub(super) strong: bool,
}

impl Piece {
    pub(super) fn weak(doc: DocId) -> Piece {
        Piece { doc, strong: false }
    }
}

pub(super) struct Writer<'t> {
    pub(super) cursor: Cursor<'t>,
    pub(super) docs: Docs<'t>,
    /// The ends of the statements and elements that are being written: a comment after such an end belongs to the list.
    pub(super) ends: Vec<u32>,
}

impl<'t> Writer<'t> {
    pub(super) fn new(file: FileId, text: &'t str) -> Writer<'t> {
        Writer { cursor: Cursor::new(file, text), docs: Docs::default(), ends: Vec::new() }
    }

    /// The whole file as text.
    pub(super) fn file(mut self, tree: &File, width: usize) -> String {
        let items: Vec<Statement> = tree.items.iter().map(Statement::Item).collect();
        let lines = self.statements(&items);
        let root = self.docs.concat(lines);
        render(&self.docs, root, width)
    }

    /// The next token, with the comments that belong to it.
    pub(super) fn token(&mut self) -> DocId {
        let mut docs = self.comments_before();
        let Some((lexeme, text)) = self.cursor.take() else { return self.docs.concat(docs) };
        let token = self.docs.text(text);
        if docs.is_empty() && self.ends.last() == Some(&lexeme.end) {
            return token;
        }
        docs.push(token);
        if self.ends.last() != Some(&lexeme.end) {
            docs.extend(self.comment_after());
        }
        if docs.len() == 1 { token } else { self.docs.concat(docs) }
    }

    /// The next token with texts around it.
    pub(super) fn token_between(&mut self, before: &'static str, after: &'static str) -> DocId {
        let before = self.docs.text(before);
        let token = self.token();
        let after = self.docs.text(after);
        self.docs.concat(vec![before, token, after])
    }

    /// The comments before the next token, each on its line.
    pub(super) fn comments_before(&mut self) -> Vec<DocId> {
        let mut docs = Vec::new();
        while let Some(comment) = self.cursor.comment_before() {
            docs.push(self.docs.own_comment(comment.text));
        }
        docs
    }

    /// The comment that follows the last token on its line.
    pub(super) fn comment_after(&mut self) -> Option<DocId> {
        let comment = self.cursor.comment_after()?;
        Some(self.docs.trailing_comment(comment.text))
    }

    /// The tokens up to a place: types, patterns and paths, which are never broken.
    pub(super) fn plain(&mut self, end: u32) -> DocId {
        let mut docs = Vec::new();
        while self.cursor.start() < end {
            let token = self.cursor.peek(0).map(|l| l.token);
            let next = self.cursor.peek(1).map(|l| l.token);
            let last = matches!(next, Some(Token::ParenClose | Token::BracketClose | Token::Semicolon | Token::Bar));
            match token {
                Some(Token::Comma) if last => {
                    // A comma after the last element is left out.
                    docs.append(&mut self.comments_before());
                    self.cursor.take();
                }
                Some(Token::Comma | Token::Semicolon | Token::Colon) => docs.push(self.token_between("", " ")),
                Some(Token::Arrow | Token::Caret) => docs.push(self.token_between(" ", " ")),
                _ => docs.push(self.token()),
            }
        }
        self.docs.concat(docs)
    }
}
