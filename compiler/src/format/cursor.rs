//! The tokens and comments of a file, in their order.

use crate::source::FileId;
use crate::syntax::layout::{Lexeme, layout};
use crate::syntax::token::Token;
use logos::Logos;

/// A comment, its slashes included, without space at its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Comment<'t> {
    pub(super) start: u32,
    pub(super) text: &'t str,
}

/// The comments of a text.
pub(super) fn comments(text: &str) -> impl Iterator<Item = Comment<'_>> {
    let raw = Token::lexer(text).spanned().filter(|(token, _)| *token == Ok(Token::Comment));
    raw.map(|(_, range)| Comment { start: range.start as u32, text: text[range].trim_end() })
}

/// The tokens and comments of a file that have not been taken yet.
#[derive(Debug)]
pub(super) struct Cursor<'t> {
    pub(super) text: &'t str,
    /// The tokens that have a text.
    tokens: Vec<Lexeme>,
    comments: Vec<Comment<'t>>,
    next_token: usize,
    next_comment: usize,
}

impl<'t> Cursor<'t> {
    pub(super) fn new(file: FileId, text: &'t str) -> Cursor<'t> {
        let (mut tokens, _) = layout(file, text);
        tokens.retain(|l| !matches!(l.token, Token::Separator | Token::Doc));
        Cursor { text, tokens, comments: comments(text).collect(), next_token: 0, next_comment: 0 }
    }

    /// The next token, `ahead` tokens further on.
    pub(super) fn peek(&self, ahead: usize) -> Option<Lexeme> {
        self.tokens.get(self.next_token + ahead).copied()
    }

    /// Whether the next token is this one.
    pub(super) fn at(&self, token: Token) -> bool {
        self.peek(0).is_some_and(|l| l.token == token)
    }

    /// The start of the next token; the end of the file after the last.
    pub(super) fn start(&self) -> u32 {
        self.peek(0).map_or(self.text.len() as u32, |l| l.start)
    }

    /// The end of the token before the next; 0 before the first.
    pub(super) fn end(&self) -> u32 {
        self.next_token.checked_sub(1).map_or(0, |i| self.tokens[i].end)
    }

    /// Takes the next token.
    pub(super) fn take(&mut self) -> Option<(Lexeme, &'t str)> {
        let lexeme = self.peek(0)?;
        self.next_token += 1;
        Some((lexeme, &self.text[lexeme.start as usize..lexeme.end as usize]))
    }

    /// Takes the next comment that stands before the next token.
    pub(super) fn comment_before(&mut self) -> Option<Comment<'t>> {
        let comment = self.comments.get(self.next_comment).copied().filter(|c| c.start < self.start())?;
        self.next_comment += 1;
        Some(comment)
    }

    /// Takes the comment that follows the last token on its line.
    pub(super) fn comment_after(&mut self) -> Option<Comment<'t>> {
        let comment = self.comments.get(self.next_comment).copied()?;
        let same_line =
            self.next_token > 0 && comment.start < self.start() && !self.line_ends(self.end(), comment.start);
        self.next_comment += usize::from(same_line);
        same_line.then_some(comment)
    }

    /// Whether two places are on different lines.
    pub(super) fn line_ends(&self, from: u32, to: u32) -> bool {
        self.text[from as usize..to as usize].contains('\n')
    }

    /// Whether there is an empty line between two places.
    pub(super) fn blank_between(&self, from: u32, to: u32) -> bool {
        let mut lines = self.text[from as usize..to as usize].split('\n').skip(1);
        // The last piece is the beginning of the line that `to` is in.
        let count = lines.clone().count();
        lines.by_ref().take(count.saturating_sub(1)).any(|line| line.trim().is_empty())
    }
}
