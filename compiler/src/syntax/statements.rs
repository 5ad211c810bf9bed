//! Text that is entered into a session: items and expressions, each on lines of its own.

use super::ast::{Expr, ExprKind, Item};
use super::builder::Builder;
use super::layout::{self, Lexeme};
use super::recover::{parse_range, parse_tokens, read_expression, read_file, too_long};
use super::token::Token;
use crate::diagnostic::Diagnostic;
use crate::source::FileId;
use lalrpop_util::ParseError;

/// An item or expression of a session.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// A declaration.
    Item(Item),
    /// An expression, whose value is to be shown.
    Expression(Expr),
}

/// The items and expressions of a text, and its diagnostics. Statements that could not be parsed are left out.
#[must_use]
pub fn parse_entries(file: FileId, text: &str) -> (Vec<Entry>, Vec<Diagnostic>) {
    if let Some(diagnostic) = too_long(file, text) {
        return (Vec::new(), vec![diagnostic]);
    }
    let (tokens, mut diagnostics) = layout::layout(file, text);
    let mut entries = Vec::new();
    for (from, to) in statements(&tokens) {
        if is_item(&tokens[from..to]) {
            let tree = parse_tokens(file, text, tokens[from..to].to_vec(), &mut diagnostics);
            entries.extend(tree.items.into_iter().map(Entry::Item));
            continue;
        }
        let expr = parse_range(file, text, &tokens, from..to, &mut diagnostics);
        entries.extend(expr.map(Entry::Expression));
    }
    diagnostics.sort_by_key(|d| (d.span.start, d.span.end));
    (entries, diagnostics)
}

/// Whether a text needs more lines: a bracket is open, the last line ends with an operator, or a declaration is
/// unfinished. A text with an error is complete.
#[must_use]
pub fn is_incomplete(text: &str) -> bool {
    let file = FileId::default();
    if too_long(file, text).is_some() {
        return false;
    }
    let end = layout::end(text);
    if end.wrong {
        return false;
    }
    if end.open || end.doc {
        return true;
    }
    let (tokens, _) = layout::layout(file, text);
    if tokens.last().is_some_and(|l| l.token.continues_after() && !ends_lambda(&tokens)) {
        return true;
    }
    let Some((from, to)) = statements(&tokens).pop() else { return false };
    let last = &tokens[from..to];
    let mut builder = Builder::new(file, text);
    if is_item(last) {
        return matches!(read_file(&mut builder, last), Err(ParseError::UnrecognizedEof { .. }));
    }
    match read_expression(&mut builder, last) {
        Ok(expr) => wants_else(&expr),
        Err(error) => matches!(error, ParseError::UnrecognizedEof { .. }),
    }
}

/// `||` at the end is an error, not a line that continues.
fn ends_lambda(tokens: &[Lexeme]) -> bool {
    matches!(tokens, [.., Lexeme { token: Token::Bar, .. }, Lexeme { token: Token::Bar, .. }])
}

/// An `if` expression without `else`.
fn wants_else(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::If(_, _, None) => true,
        ExprKind::If(_, _, Some(otherwise)) => wants_else(otherwise),
        _ => false,
    }
}

fn is_item(tokens: &[Lexeme]) -> bool {
    tokens.first().is_some_and(|l| l.token == Token::Doc || l.token.begins_item())
}

/// The statements outside of all brackets, as ranges of tokens.
fn statements(tokens: &[Lexeme]) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let (mut from, mut depth) = (0, 0);
    for (i, lexeme) in tokens.iter().enumerate() {
        if lexeme.token.closer().is_some() {
            depth += 1;
        } else if lexeme.token.is_closer() {
            depth -= 1;
        } else if lexeme.token == Token::Separator && depth == 0 {
            found.push((from, i));
            from = i + 1;
        }
    }
    found.push((from, tokens.len()));
    found.retain(|(from, to)| from < to);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> String {
        let (entries, diagnostics) = parse_entries(FileId::default(), text);
        let mut kinds: String = entries.iter().map(|e| if matches!(e, Entry::Item(_)) { 'i' } else { 'e' }).collect();
        diagnostics.iter().for_each(|d| kinds.push_str(&format!(" {}", d.code)));
        kinds
    }

    #[test]
    fn items_and_expressions_follow_one_another() {
        assert_eq!(kinds("let a = 1\na + 1; a\nfn f(x) {\n  let y = x\n  y\n}\nf(2)"), "ieeie");
        assert_eq!(kinds("/// doc\nlet a = 1 // = 1\n\n{x: 1}\n(1,\n 2)"), "iee");
        assert_eq!(kinds(""), "");
    }

    #[test]
    fn one_wrong_line_leaves_the_others() {
        assert_eq!(kinds("1 +* 2\nlet a = 3\na b\na"), "ie syntax syntax");
        assert_eq!(kinds("let = 3\n4"), "ie syntax");
    }

    #[test]
    fn incomplete_texts_are_told_from_wrong_ones() {
        for text in [
            "(",
            "model cup {",
            "f(1,",
            "1 +",
            "let a =",
            "fn f(x) {\n let y = x",
            "[1,\n2",
            "/// a doc comment",
            "if a { 1 }",
            "if a { 1 } else",
            "fn f(x)",
            "model cup",
            "use std.curve (",
            "|t|",
            "1\n(2",
            "let a",
            "a and",
        ] {
            assert!(is_incomplete(text), "{text}");
        }
        for text in [
            "",
            "1",
            "let a = 1",
            ")",
            "(1]",
            "1 + * 2",
            "// comment",
            "if a { 1 } else { 2 }",
            "\"open",
            "f(1)\n",
            "fn f(x) = x",
            "a b",
            "{x: 1}",
            "#",
        ] {
            assert!(!is_incomplete(text), "{text}");
        }
    }
}
