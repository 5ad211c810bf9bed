//! The formatter: every script has one layout.
//!
//! [`format()`] changes only line ends, spaces, commas before closing brackets and semicolons at line ends. It builds a
//! document (`document`) from the tree, whose leaves are the tokens and comments of the text in their order (`cursor`),
//! and breaks its lines (`render`). Documents of blocks and models are made in `statements`, those of items in `items`,
//! those of expressions in `expressions`, `postfix`, `branches` and `lists`. At the end the tokens and comments of the
//! result are compared with those of the text.
//!
//! The author chooses between layouts that are equally good: an empty line stays (one of several), statements joined by
//! `;` stay joined while they fit, a block whose first line ends after its brace stays open, and a list with a comma
//! before its closing bracket has one element a line.

mod branches;
mod cursor;
mod document;
mod expressions;
mod items;
mod lists;
mod postfix;
mod render;
mod statements;
mod writer;

#[cfg(test)]
mod tests;

use crate::diagnostic::Diagnostic;
use crate::source::FileId;
use crate::syntax::token::Token;
use crate::syntax::{self, LENGTH_LIMIT, layout, literal};
use std::borrow::Cow;
use thiserror::Error;

/// The greatest width of a line, where there is a choice. Comments may be longer.
pub const WIDTH: usize = 110;

/// Spaces a level.
const INDENT: usize = 2;

/// The greatest indentation.
const INDENT_LIMIT: usize = 60;

/// The reason why a text is not formatted.
#[derive(Clone, Debug, Error)]
pub enum FormatError {
    /// It cannot be read.
    #[error("the script has errors")]
    Syntax(Vec<Diagnostic>),
    /// The result would be longer than a script may be.
    #[error("the formatted script would be longer than {} MiB", LENGTH_LIMIT >> 20)]
    TooLong,
    /// The result would have other tokens or comments. This is a defect of the formatter.
    #[error("the formatted script would not mean the same: this is a defect of gmlc; the script is left as it is")]
    Unfaithful,
}

/// The text of a file in its one layout. Formatting it again changes nothing.
///
/// # Errors
/// If the text has syntax errors, or the result would be too long.
pub fn format(file: FileId, text: &str) -> Result<String, FormatError> {
    format_within(file, text, WIDTH)
}

/// The text in its one layout for another width.
fn format_within(file: FileId, text: &str, width: usize) -> Result<String, FormatError> {
    let (tree, diagnostics) = syntax::parse(file, text);
    if !diagnostics.is_empty() {
        return Err(FormatError::Syntax(diagnostics));
    }
    let formatted = writer::Writer::new(file, text).file(&tree, width);
    if formatted.len() > LENGTH_LIMIT {
        return Err(FormatError::TooLong);
    }
    if essence(file, text) == essence(file, &formatted) { Ok(formatted) } else { Err(FormatError::Unfaithful) }
}

/// The tokens with their texts, and the comments: formatting must not change them.
fn essence(file: FileId, text: &str) -> (Vec<(Token, Cow<'_, str>)>, Vec<&str>) {
    let (lexemes, _) = layout::layout(file, text);
    let mut tokens: Vec<(Token, Cow<'_, str>)> = Vec::with_capacity(lexemes.len());
    for lexeme in &lexemes {
        if lexeme.token.is_closer() || lexeme.token == Token::Bar || lexeme.token == Token::Semicolon {
            // The comma after the last element is optional.
            tokens.pop_if(|(token, _)| *token == Token::Comma);
        }
        if lexeme.token == Token::BraceOpen {
            // The brace may be on a line of its own.
            tokens.pop_if(|(token, _)| *token == Token::Separator);
        }
        let written = &text[lexeme.start as usize..lexeme.end as usize];
        let shown = match lexeme.token {
            Token::Separator => Cow::Borrowed(""),
            Token::Doc => Cow::Owned(literal::doc(written)),
            _ => Cow::Borrowed(written),
        };
        tokens.push((lexeme.token, shown));
    }
    (tokens, cursor::comments(text).map(|c| c.text).collect())
}
