//! Runs the grammar over a file; broken statements are taken out one by one.

use super::LENGTH_LIMIT;
use super::ast::{Expr, File, Item};
use super::builder::{Builder, Input};
use super::grammar::InputParser;
use super::layout::{Lexeme, layout};
use super::messages::{Place, unexpected};
use super::spanned;
use super::token::Token;
use crate::diagnostic::{Code, Diagnostic};
use crate::source::FileId;
use lalrpop_util::ParseError;
use std::iter;
use std::ops::Range;

/// Broken statements after which the rest of a file is not read: most likely it would be misread.
const ERROR_LIMIT: usize = 20;

/// Bytes that are parsed again because of broken statements, in all, after the first two passes.
const PASSED_BYTES: usize = 8 << 20;

/// The tree of a file, and its diagnostics in the order of the text. Statements that could not be parsed are error
/// nodes.
#[must_use]
pub fn parse(file: FileId, text: &str) -> (File, Vec<Diagnostic>) {
    if let Some(diagnostic) = too_long(file, text) {
        return (File::default(), vec![diagnostic]);
    }
    let (tokens, mut diagnostics) = layout(file, text);
    let tree = parse_tokens(file, text, tokens, &mut diagnostics);
    diagnostics.sort_by_key(|d| (d.span.start, d.span.end));
    (tree, diagnostics)
}

/// The tree of these tokens of a file.
pub(super) fn parse_tokens(
    file: FileId,
    text: &str,
    mut tokens: Vec<Lexeme>,
    diagnostics: &mut Vec<Diagnostic>,
) -> File {
    // Each broken statement costs another pass, of which a very long file gets fewer.
    let passes = (PASSED_BYTES / text.len().max(1)).clamp(2, ERROR_LIMIT);
    let mut unread = Vec::new();
    for _ in 0..passes {
        let mut builder = Builder::new(file, text);
        match read_file(&mut builder, &tokens) {
            Ok(items) => {
                diagnostics.append(&mut builder.diagnostics);
                return File { items, unread };
            }
            Err(error) => {
                let stop = Stop::new(error, &tokens, text);
                diagnostics.extend(stop.diagnostic(file, text, &tokens));
                let cut = cut_statement(&mut tokens, stop.index);
                unread.extend(declared(&cut).map(|l| text[l.start as usize..l.end as usize].to_owned()));
            }
        }
    }
    let end = text.len() as u32;
    diagnostics.push(Diagnostic::new(
        Code::TooManyErrors,
        spanned(file, end, end),
        "too many syntax errors: the rest of the file was not read",
    ));
    File::default()
}

/// The expression of a range of tokens; `None`, with a diagnostic, if there is none.
pub(super) fn parse_range(
    file: FileId,
    text: &str,
    tokens: &[Lexeme],
    range: Range<usize>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Expr> {
    let mut builder = Builder::new(file, text);
    match read_expression(&mut builder, &tokens[range.clone()]) {
        Ok(expr) => {
            diagnostics.append(&mut builder.diagnostics);
            Some(expr)
        }
        Err(error) => {
            let mut stop = Stop::new(error, &tokens[range.clone()], text);
            stop.index += range.start;
            diagnostics.extend(stop.diagnostic(file, text, tokens));
            None
        }
    }
}

pub(super) fn too_long(file: FileId, text: &str) -> Option<Diagnostic> {
    let message = format!("this file is longer than {} MiB", LENGTH_LIMIT >> 20);
    (text.len() > LENGTH_LIMIT).then(|| Diagnostic::new(Code::TooLong, spanned(file, 0, 0), message))
}

pub(super) type ReadError = ParseError<u32, Token, ()>;

pub(super) fn read_file(builder: &mut Builder<'_>, tokens: &[Lexeme]) -> Result<Vec<Item>, ReadError> {
    match read(builder, Token::FileStart, tokens)? {
        Input::File(items) => Ok(items),
        Input::Expression(_) => unreachable!("the first token is that of a file"),
    }
}

pub(super) fn read_expression(builder: &mut Builder<'_>, tokens: &[Lexeme]) -> Result<Expr, ReadError> {
    match read(builder, Token::ExpressionStart, tokens)? {
        Input::Expression(expr) => Ok(expr),
        Input::File(_) => unreachable!("the first token is that of an expression"),
    }
}

fn read(builder: &mut Builder<'_>, first: Token, tokens: &[Lexeme]) -> Result<Input, ReadError> {
    let first = Lexeme { token: first, start: 0, end: 0 };
    InputParser::new().parse(builder, iter::once(&first).chain(tokens).map(|l| Ok((l.start, l.token, l.end))))
}

/// The place at which the grammar stopped, and the terminals that it expected there.
struct Stop {
    /// The index of the token that it did not expect; the number of tokens at the end of the file.
    index: usize,
    start: u32,
    end: u32,
    expected: Vec<String>,
}

impl Stop {
    fn new(error: ReadError, tokens: &[Lexeme], text: &str) -> Self {
        let eof = text.trim_end().len() as u32;
        let (start, end, expected) = match error {
            ParseError::UnrecognizedToken { token: (start, _, end), expected } => (start, end, expected),
            ParseError::ExtraToken { token: (start, _, end) } => (start, end, Vec::new()),
            ParseError::UnrecognizedEof { expected, .. } => (u32::MAX, eof, expected),
            ParseError::InvalidToken { .. } | ParseError::User { .. } => (u32::MAX, eof, Vec::new()),
        };
        // Several tokens may begin where an empty one does; all but the last of them are empty.
        let index = tokens.partition_point(|t| (t.start, t.end) < (start, end));
        Self { index, start: start.min(eof), end, expected }
    }

    /// The diagnostic; `None` if the token or its statement contains an error that was reported already.
    fn diagnostic(&self, file: FileId, text: &str, tokens: &[Lexeme]) -> Option<Diagnostic> {
        let token = tokens.get(self.index).map(|l| l.token);
        let made_up = token.is_some() && self.start == self.end;
        if made_up || matches!(token, Some(Token::Error | Token::BadStatement)) {
            return None;
        }
        // Tokens after a reported error are most likely misread.
        let statement = statement_around(tokens, self.index);
        let reported = |l: &Lexeme| l.token == Token::Error || (l.start == l.end && l.token.is_closer());
        if tokens[statement.from..self.index].iter().any(reported) {
            return None;
        }
        let place = Place { file, text, tokens, index: self.index, start: self.start, end: self.end };
        Some(unexpected(&place, &self.expected))
    }
}

/// Replaces the innermost statement around a token by a broken statement, or the one around that if nothing is left of
/// it. Returns the replaced tokens.
fn cut_statement(tokens: &mut Vec<Lexeme>, mut index: usize) -> Vec<Lexeme> {
    loop {
        let Statement { from, to, opener } = statement_around(tokens, index);
        let spent = from >= to || (to - from == 1 && tokens[from].token == Token::BadStatement);
        match opener {
            Some(opener) if spent => index = opener,
            None if spent => return std::mem::take(tokens),
            _ => {
                let bad = Lexeme { token: Token::BadStatement, start: tokens[from].start, end: tokens[to - 1].end };
                return tokens.splice(from..to, [bad]).collect();
            }
        }
    }
}

/// The names that a broken statement most likely declares: those before its first `=`, and those after a keyword.
fn declared(tokens: &[Lexeme]) -> impl Iterator<Item = &Lexeme> {
    let first = tokens.iter().position(|l| l.token == Token::Equals).unwrap_or(tokens.len());
    tokens.iter().enumerate().filter_map(move |(i, lexeme)| {
        let declares = i.checked_sub(1).is_some_and(|before| tokens[before].token.begins_item());
        (lexeme.token == Token::Name && (i < first || declares)).then_some(lexeme)
    })
}

/// A statement's tokens and the index of the brace that opens the block around it.
pub(super) struct Statement {
    pub(super) from: usize,
    pub(super) to: usize,
    opener: Option<usize>,
}

/// The innermost statement that contains the token, or that ends with it.
pub(super) fn statement_around(tokens: &[Lexeme], index: usize) -> Statement {
    let (mut from, mut depth, mut crossed, mut opener) = (index, 0, 0, None);
    while from > 0 {
        let token = tokens[from - 1].token;
        if token.is_closer() {
            depth += 1;
        } else if token.closer().is_some() && depth > 0 {
            depth -= 1;
        } else if token == Token::BraceOpen {
            opener = Some(from - 1);
            break;
        } else if token.closer().is_some() {
            crossed += 1;
        } else if token == Token::Separator && depth == 0 {
            break;
        }
        from -= 1;
    }
    let (mut to, mut depth) = (index, crossed);
    while let Some(lexeme) = tokens.get(to) {
        if lexeme.token.closer().is_some() {
            depth += 1;
        } else if lexeme.token.is_closer() {
            if depth == 0 {
                break;
            }
            depth -= 1;
        } else if lexeme.token == Token::Separator && depth == 0 {
            break;
        }
        to += 1;
    }
    Statement { from, to, opener }
}
