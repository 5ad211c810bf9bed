//! What to say where the grammar did not expect a token: in the user's words, with the mend where it can be guessed.

use super::layout::Lexeme;
use super::spanned;
use super::token::Token;
use crate::diagnostic::Diagnostic;
use crate::source::{FileId, Span};

/// Where the grammar stopped: the tokens of the file and the index of the one that it did not expect.
pub(super) struct Place<'t> {
    pub(super) file: FileId,
    pub(super) text: &'t str,
    pub(super) tokens: &'t [Lexeme],
    pub(super) index: usize,
    /// The bytes of the unexpected token.
    pub(super) start: u32,
    pub(super) end: u32,
}

/// The diagnostic; `expected` are terminals as the grammar names them.
pub(super) fn unexpected(place: &Place<'_>, expected: &[String]) -> Diagnostic {
    let expected = Expected(expected);
    let found = place.found();
    if let Some(keyword) = place.keyword()
        && expected.has("name")
        && !expected.value()
    {
        let message = format!("'{keyword}' is a word of the language and cannot be a name");
        return Diagnostic::error("reserved-word", place.span(), message);
    }
    let wanted = expected.describe();
    let message =
        if wanted.is_empty() { format!("did not expect {found}") } else { format!("expected {wanted}, found {found}") };
    let diagnostic = Diagnostic::error("syntax", place.span(), message);
    match hint(place, &expected) {
        Some(hint) => diagnostic.hint(hint),
        None => diagnostic,
    }
}

impl Place<'_> {
    fn token(&self) -> Option<Token> {
        self.tokens.get(self.index).map(|l| l.token)
    }

    fn after(&self) -> Option<Token> {
        self.tokens.get(self.index + 1).map(|l| l.token)
    }

    fn before(&self, back: usize) -> Option<Token> {
        Some(self.tokens[self.index.checked_sub(back)?].token)
    }

    fn slice(&self, index: usize) -> &str {
        self.tokens.get(index).map_or("", |l| &self.text[l.start as usize..l.end as usize])
    }

    /// What to underline: the token, or where it would be for one that cannot be seen.
    fn span(&self) -> Span {
        match self.token() {
            // A line end is underlined as the place after the last token.
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

    /// Whether the token begins a statement.
    fn begins(&self) -> bool {
        matches!(self.before(1), None | Some(Token::Separator | Token::BraceOpen | Token::Doc))
    }
}

const KEYWORDS: [&str; 18] = [
    "use", "fn", "deriv", "let", "model", "param", "input", "part", "require", "for", "in", "if", "else", "true",
    "false", "and", "or", "not",
];

/// The words of other languages for what is called otherwise here.
const ALIASES: [(&str, &str); 12] = [
    ("module", "model"),
    ("function", "fn"),
    ("func", "fn"),
    ("def", "fn"),
    ("var", "let"),
    ("const", "let"),
    ("val", "let"),
    ("import", "use"),
    ("include", "use"),
    ("assert", "require"),
    ("parameter", "param"),
    ("elif", "else if"),
];

/// The terminals that would have been right.
struct Expected<'e>(&'e [String]);

impl Expected<'_> {
    fn has(&self, terminal: &str) -> bool {
        self.0.iter().any(|t| t.trim_matches('"') == terminal)
    }

    fn value(&self) -> bool {
        self.has("number") && self.has("true")
    }

    fn item(&self) -> bool {
        self.has("let")
    }

    fn operator(&self) -> bool {
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
        // Where values or types go on, so do brackets and signs that begin them.
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
    let text = place.slice(place.index);
    match place.token()? {
        Token::Name if place.begins() && expected.item() => Some(item_hint(place, text)),
        Token::Name if place.before(1) == Some(Token::Number) => {
            let number = place.slice(place.index - 1);
            Some(match text {
                "mm" | "cm" | "m" | "deg" | "rad" | "turn" => {
                    format!("a unit is glued to its number: '{number}{text}'")
                }
                _ => format!("a product is written '{number} * {text}'"),
            })
        }
        Token::Name if place.before(1) == Some(Token::Name) && expected.operator() => {
            nearest_keyword(place.slice(place.index - 1)).map(|word| format!("did you mean '{word}'?"))
        }
        Token::Equals if place.before(1) == Some(Token::Name) && starts_at(place, 2) => {
            Some(format!("'let {} = ...' names a value", place.slice(place.index - 1)))
        }
        Token::Equals if expected.has("{") || expected.has("separator") => Some("'==' compares two values".to_owned()),
        Token::Bar if expected.operator() && place.after() == Some(Token::Bar) => {
            Some("'or' joins two conditions".to_owned())
        }
        Token::Star if place.before(1) == Some(Token::Star) => Some("a power is written 'a ^ b'".to_owned()),
        Token::Dot if place.after() == Some(Token::Number) && expected.value() => {
            Some(format!("a number begins with a digit: '0.{}'", place.slice(place.index + 1)))
        }
        Token::Separator | Token::BraceClose if expected.has("=") && place.before(2) == Some(Token::Part) => {
            Some(format!("'part {} = ...' gives it a shape", place.slice(place.index - 1)))
        }
        _ => None,
    }
}

/// Whether the token so many places back begins a statement.
fn starts_at(place: &Place<'_>, back: usize) -> bool {
    matches!(place.before(back), None | Some(Token::Separator | Token::BraceOpen))
}

fn item_hint(place: &Place<'_>, word: &str) -> String {
    if place.after() == Some(Token::Equals) {
        return format!("'let {word} = ...' names a value");
    }
    if let Some(keyword) = nearest_keyword(word) {
        return format!("did you mean '{keyword}'?");
    }
    "a shape gets a name: 'part NAME = ...'".to_owned()
}

/// The word of the language that was probably meant.
fn nearest_keyword(word: &str) -> Option<&'static str> {
    if let Some((_, keyword)) = ALIASES.iter().find(|(alias, _)| *alias == word) {
        return Some(keyword);
    }
    if word.len() < 3 || word.len() > 12 {
        return None;
    }
    let near = KEYWORDS.iter().filter(|k| k.len() > 2).map(|k| (edit_distance(word, k), *k)).min()?;
    (near.0 <= 1 + usize::from(word.len() > 4)).then_some(near.1)
}

/// The number of letters to insert, remove, change or swap with their neighbour (optimal string alignment distance).
pub(crate) fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows = vec![(0..=b.len()).collect::<Vec<usize>>()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let change = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut best = change.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 1);
            }
            row.push(best);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}
