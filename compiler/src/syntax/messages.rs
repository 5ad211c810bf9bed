//! The message for a token that the grammar did not expect, with a suggestion where the intention can be guessed.

use super::foreign::{alias, foreign};
use super::layout::Lexeme;
use super::spanned;
use super::token::Token;
use crate::diagnostic::{Code, Diagnostic};
use crate::source::{FileId, Span};
use crate::suggest::nearest;

/// The place at which the grammar stopped: the tokens of the file and the index of the unexpected one.
pub(super) struct Place<'t> {
    pub(super) file: FileId,
    pub(super) text: &'t str,
    pub(super) tokens: &'t [Lexeme],
    pub(super) index: usize,
    /// The bytes of the unexpected token.
    pub(super) start: u32,
    pub(super) end: u32,
}

/// The diagnostic for an unexpected token.
pub(super) fn unexpected(place: &Place<'_>, expected: &[String]) -> Diagnostic {
    let expected = Expected(expected);
    let found = place.found();
    if let Some(keyword) = place.keyword()
        && expected.has("name")
        && !expected.value()
    {
        let message = format!("'{keyword}' is a keyword and cannot be a name");
        return Diagnostic::new(Code::ReservedWord, place.span(), message);
    }
    if let Some(diagnostic) = foreign(place, &expected) {
        return diagnostic;
    }
    let wanted = expected.describe();
    let message =
        if wanted.is_empty() { format!("unexpected {found}") } else { format!("expected {wanted}, found {found}") };
    let diagnostic = Diagnostic::new(Code::Syntax, place.span(), message);
    match hint(place, &expected) {
        Some(hint) => diagnostic.hint(hint),
        None => diagnostic,
    }
}

impl Place<'_> {
    pub(super) fn token(&self) -> Option<Token> {
        self.tokens.get(self.index).map(|l| l.token)
    }

    fn before(&self, back: usize) -> Option<Token> {
        Some(self.tokens[self.index.checked_sub(back)?].token)
    }

    pub(super) fn slice(&self, index: usize) -> &str {
        self.tokens.get(index).map_or("", |l| &self.text[l.start as usize..l.end as usize])
    }

    /// The place to underline: the token, or the end of the one before it if the token is invisible.
    fn span(&self) -> Span {
        match self.token() {
            // A line end.
            Some(Token::Separator) | None => {
                let last = self.index.checked_sub(1).map_or(0, |i| self.tokens[i].end);
                spanned(self.file, last, last)
            }
            _ => spanned(self.file, self.start, self.end),
        }
    }

    fn found(&self) -> String {
        let text = self.slice(self.index);
        match self.token() {
            None => "the end of the file".to_owned(),
            Some(Token::Separator) if text.contains(';') => "';'".to_owned(),
            Some(Token::Separator) => "the end of the line".to_owned(),
            Some(Token::Doc) => "a doc comment".to_owned(),
            Some(Token::Text) => "a text".to_owned(),
            Some(_) => {
                let shown: String = text.chars().take(40).collect();
                format!("'{shown}'")
            }
        }
    }

    fn keyword(&self) -> Option<&str> {
        let text = self.slice(self.index);
        KEYWORDS.contains(&text).then_some(text)
    }
}

const KEYWORDS: [&str; 18] = [
    "use", "fn", "deriv", "let", "model", "param", "input", "part", "require", "for", "in", "if", "else", "true",
    "false", "and", "or", "not",
];

/// The terminals that the grammar would have accepted, by their names in the grammar.
pub(super) struct Expected<'e>(&'e [String]);

impl Expected<'_> {
    pub(super) fn has(&self, terminal: &str) -> bool {
        self.0.iter().any(|t| t.trim_matches('"') == terminal)
    }

    pub(super) fn value(&self) -> bool {
        self.has("number") && self.has("true")
    }

    pub(super) fn item(&self) -> bool {
        self.has("let")
    }

    pub(super) fn operator(&self) -> bool {
        self.has("+") && self.has("*")
    }

    fn describe(&self) -> String {
        let mut wanted: Vec<String> = Vec::new();
        if self.item() {
            wanted.push("a declaration ('let', 'param', 'part', ...)".to_owned());
        }
        if self.value() {
            wanted.push("a value".to_owned());
        } else if self.has("name") {
            wanted.push(if self.has("[") { "a type" } else { "a name" }.to_owned());
        } else if self.has("number") {
            wanted.push("a whole number".to_owned());
        }
        if self.has("text") && !self.value() {
            wanted.push("a text in double quotes".to_owned());
        }
        // If a value or type is expected, the brackets and signs that begin one are expected with it.
        let begins = self.value() || self.has("name");
        for punctuation in ["(", ",", ":", "in", "=", "->", "..", ";", "|", ")", "]"] {
            let of_operand = match punctuation {
                "(" | "->" => self.operator(),
                ".." => self.operator() || self.has("separator") || self.has("{") || self.has(","),
                _ => false,
            };
            if self.has(punctuation) && !(begins && matches!(punctuation, "(" | "|")) && !of_operand {
                wanted.push(format!("'{punctuation}'"));
            }
        }
        if self.has("{") && !self.value() {
            wanted.push("'{'".to_owned());
        }
        if self.operator() && wanted.is_empty() {
            wanted.push("an operator".to_owned());
        }
        if self.has("separator") && !begins && !self.has("{") {
            wanted.push("the end of the line".to_owned());
        }
        if self.has("}") && !self.has("separator") && !self.item() {
            wanted.push("'}'".to_owned());
        }
        join_or(&wanted)
    }
}

fn join_or(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

fn hint(place: &Place<'_>, expected: &Expected<'_>) -> Option<String> {
    match place.token()? {
        Token::Name if place.before(1) == Some(Token::Name) && expected.operator() => {
            nearest_keyword(place.slice(place.index - 1)).map(|word| format!("did you mean '{word}'?"))
        }
        _ => None,
    }
}

/// The keyword that was probably meant.
pub(super) fn nearest_keyword(word: &str) -> Option<&'static str> {
    alias(word).or_else(|| nearest(word, KEYWORDS.into_iter().chain(["measure"]).filter(|k| k.len() > 2)))
}
