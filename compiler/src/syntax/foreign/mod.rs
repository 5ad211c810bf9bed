//! Constructs of other languages, and common slips: they are recognised where the grammar stops, and the message says
//! what to write instead.

mod shapes;
mod signs;
mod words;

use super::layout::Lexeme;
use super::messages::{Expected, Place};
use super::recover::statement_around;
use super::token::Token;
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::Span;

/// The message for a known slip; it goes before that of the expected terminals.
pub(super) fn foreign(place: &Place<'_>, expected: &Expected<'_>) -> Option<Diagnostic> {
    let found = place.token();
    let start = statement_around(place.tokens, place.index.min(place.tokens.len())).from;
    let slip = Slip { place, expected, start };
    let by_token = match found {
        Some(Token::Equals) => slip.equals(),
        Some(Token::EqEq) => slip.double_equals(),
        Some(Token::Greater) => slip.fat_arrow_of_function(),
        Some(Token::In) => slip.range_in_the_wrong_place(),
        Some(Token::For) => slip.comprehension_at_the_end(),
        Some(Token::Arrow) => slip.arrow_of_lambda(),
        Some(Token::Colon) => slip.colon(),
        Some(Token::Comma) => slip.comma(),
        Some(Token::DotDot) => slip.step_of_range(),
        Some(Token::ParenOpen) => slip.parameters_of_model(),
        Some(Token::ParenClose) => slip.tangents_without_semicolon(),
        Some(Token::Plus) => slip.two_pluses().or_else(|| slip.leading_plus()),
        Some(Token::Name) => slip.name(),
        Some(Token::Text) => slip.quoted_name(),
        Some(Token::Separator | Token::BraceClose) | None => slip.part_without_shape(),
        _ => None,
    };
    let by_token = by_token.or_else(|| slip.value_after_arrow());
    by_token.or_else(|| slip.first_word()).or_else(|| slip.no_braces()).or_else(|| slip.comma_forgotten())
}

struct Slip<'p, 'e> {
    place: &'p Place<'p>,
    expected: &'p Expected<'e>,
    /// The first token of the statement.
    start: usize,
}

/// Words of other languages and the keywords with the same use.
const ALIASES: [(&str, &str); 17] = [
    ("module", "model"),
    ("function", "fn"),
    ("func", "fn"),
    ("fun", "fn"),
    ("def", "fn"),
    ("var", "let"),
    ("const", "let"),
    ("val", "let"),
    ("auto", "let"),
    ("import", "use"),
    ("include", "use"),
    ("require_that", "require"),
    ("assert", "require"),
    ("parameter", "param"),
    ("var_param", "param"),
    ("object", "model"),
    ("class", "model"),
];

/// The keyword for a word of another language.
pub(super) fn alias(word: &str) -> Option<&'static str> {
    ALIASES.iter().find(|(alias, _)| *alias == word).map(|(_, ours)| *ours)
}

impl Slip<'_, '_> {
    fn token(&self, index: usize) -> Option<Token> {
        self.place.tokens.get(index).map(|l| l.token)
    }

    fn text(&self, index: usize) -> &str {
        self.place.slice(index)
    }

    fn lexeme(&self, index: usize) -> Option<Lexeme> {
        self.place.tokens.get(index).copied()
    }

    fn span(&self, index: usize) -> Span {
        self.lexeme(index).map_or(Span::default(), |l| super::spanned(self.place.file, l.start, l.end))
    }

    /// From one token to another.
    fn spans(&self, from: usize, to: usize) -> Span {
        self.span(from).to(self.span(to))
    }

    /// The index of the token `count` places before the unexpected one.
    fn back(&self, count: usize) -> Option<usize> {
        self.place.index.checked_sub(count)
    }

    fn before(&self, count: usize) -> Option<Token> {
        self.token(self.back(count)?)
    }

    fn here(&self) -> usize {
        self.place.index
    }

    /// Whether a token directly follows the one before it.
    fn glued(&self, index: usize) -> bool {
        match (index.checked_sub(1).and_then(|i| self.lexeme(i)), self.lexeme(index)) {
            (Some(a), Some(b)) => a.end == b.start,
            _ => false,
        }
    }

    fn error(&self, span: Span, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Code::Syntax, span, message)
    }

    fn at_start(&self, back: usize) -> bool {
        self.back(back) == Some(self.start)
    }

    /// The bracket that opens what the one at `index` closes.
    fn opening(&self, index: usize) -> Option<usize> {
        let mut depth = 0;
        for i in (0..=index).rev() {
            let token = self.token(i)?;
            if token.is_closer() {
                depth += 1;
            } else if token.closer().is_some() {
                depth -= 1;
                if depth == 0 {
                    return Some(i);
                }
            }
        }
        None
    }

    fn in_condition(&self) -> bool {
        let require = self.token(self.start) == Some(Token::Require);
        require
            || (self.start..self.here())
                .any(|i| matches!(self.token(i), Some(Token::If | Token::And | Token::Or | Token::Not)))
    }

    /// `if c 1 else 2`, `if c then 1 else 2`.
    fn no_braces(&self) -> Option<Diagnostic> {
        let begins_value = matches!(
            self.place.token()?,
            Token::Name | Token::Number | Token::Text | Token::True | Token::False | Token::Minus
        );
        let chosen =
            (self.start..self.here()).rev().find(|i| matches!(self.token(*i), Some(Token::If | Token::For)))?;
        if !self.expected.has("{") || self.expected.value() || !begins_value {
            return None;
        }
        Some(if self.token(chosen) == Some(Token::If) {
            self.error(self.span(self.here()), "the branches of an 'if' must be in braces")
                .hint("write 'if c { a } else { b }'")
        } else {
            self.error(self.span(self.here()), "the body of a 'for' must be in braces")
                .hint("write 'for x in xs { ... }'")
        })
    }

    fn comma_forgotten(&self) -> Option<Diagnostic> {
        let token = self.place.token()?;
        let begins_value = matches!(token, Token::Name | Token::Number | Token::Text | Token::True | Token::False);
        let in_list = self.expected.has(",") && (self.expected.has(")") || self.expected.has("]"));
        if !begins_value || !in_list || !self.expected.operator() {
            return None;
        }
        let span = self.span(self.here() - 1);
        let diagnostic = self.error(self.span(self.here()), "a comma is missing before this");
        Some(diagnostic.suggest("add a comma", [Edit::after(span, ",")]))
    }
}
