//! Text to raw tokens. Characters that are no token, and operators of other languages, are reported, and replaced by
//! the token that was meant where that is clear, so that one slip gives one message.

use super::layout::Lexeme;
use super::spanned;
use super::token::Token;
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::{FileId, Span};
use logos::Logos;

/// The tokens of a text; white space is left out.
pub(super) fn lex(file: FileId, text: &str) -> (Vec<Lexeme>, Vec<Diagnostic>) {
    let mut lexer = Lexer { file, text, raw: Vec::new(), diagnostics: Vec::new(), unknown: None, next: 0 };
    for (result, range) in Token::lexer(text).spanned() {
        let lexeme = Lexeme { token: result.unwrap_or(Token::Error), start: range.start as u32, end: range.end as u32 };
        if lexeme.start < lexer.next {
            continue;
        }
        if lexeme.token == Token::Error {
            lexer.reject(lexeme);
        } else {
            lexer.report_unknown();
            lexer.take(lexeme);
        }
    }
    lexer.report_unknown();
    (lexer.raw, lexer.diagnostics)
}

struct Lexer<'t> {
    file: FileId,
    text: &'t str,
    raw: Vec<Lexeme>,
    diagnostics: Vec<Diagnostic>,
    /// The run of unknown characters that ends here; not reported yet.
    unknown: Option<Lexeme>,
    /// Tokens that begin before this byte are part of something that was reported.
    next: u32,
}

/// Bytes of a line that are searched for the end of a slip: the time per slip is bounded.
const WINDOW: usize = 4096;

/// Unknown characters that stand for an operator: how it is written here, its token, and the help.
const CHARACTERS: [(&str, &str, Token, &str); 12] = [
    ("×", "*", Token::Star, "a product is written with '*'"),
    ("·", "*", Token::Star, "a product is written with '*'"),
    ("÷", "/", Token::Slash, "a quotient is written with '/'"),
    ("−", "-", Token::Minus, "a minus sign is written '-'"),
    ("–", "-", Token::Minus, "a minus sign is written '-'"),
    ("—", "-", Token::Minus, "a minus sign is written '-'"),
    ("≤", "<=", Token::LessEq, "'less or equal' is written '<='"),
    ("≥", ">=", Token::GreaterEq, "'greater or equal' is written '>='"),
    ("≠", "!=", Token::NotEq, "'not equal' is written '!='"),
    ("→", "->", Token::Arrow, "an arrow is written '->'"),
    ("…", "..", Token::DotDot, "a range is written 'from..to'"),
    ("!", "not ", Token::Not, "a condition is negated with 'not'"),
];

/// Operators of other languages that begin with a token of this one, likewise.
const OPERATORS: [(&str, &str, Token, &str); 6] = [
    ("&&", "and", Token::And, "conditions are joined with 'and'"),
    ("**", "^", Token::Caret, "a power is written 'a ^ b'"),
    ("||", "or", Token::Or, "conditions are joined with 'or'"),
    (":=", "=", Token::Equals, "write '=' to give a value a name"),
    ("===", "==", Token::EqEq, "write '==' to compare two values"),
    ("<>", "!=", Token::NotEq, "'not equal' is written '!='"),
];

impl<'t> Lexer<'t> {
    fn span(&self, start: u32, end: u32) -> Span {
        spanned(self.file, start, end)
    }

    fn slice(&self, start: u32, end: u32) -> &'t str {
        self.text.get(start as usize..end as usize).unwrap_or("")
    }

    /// The rest of the line from this byte, at most [`WINDOW`] bytes.
    fn line_from(&self, start: u32) -> &'t str {
        let rest = &self.text[start as usize..];
        rest[..rest.floor_char_boundary(WINDOW)].lines().next().unwrap_or("")
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// A token that stands for something that was reported.
    fn push_error(&mut self, start: u32, end: u32) {
        self.raw.push(Lexeme { token: Token::Error, start, end });
        self.next = self.next.max(end);
    }

    /// Characters that are no token: quotes and comments of other languages are reported at once, others when their run
    /// ends.
    fn reject(&mut self, lexeme: Lexeme) {
        let rest = self.line_from(lexeme.start);
        match rest.chars().next() {
            Some('"') => self.unclosed_text(lexeme),
            Some('#') if self.unknown.is_none_or(|r| r.end < lexeme.start) => {
                self.report_unknown();
                let end = lexeme.start + rest.trim_end().len() as u32;
                let sign = self.span(lexeme.start, lexeme.start + 1);
                self.report(
                    Diagnostic::new(Code::UnknownCharacter, sign, "'#' does not begin a comment")
                        .suggest("a comment begins with '//'", [Edit::replace(sign, "//")]),
                );
                self.next = end;
            }
            Some(quote @ ('“' | '”' | '„' | '‘' | '’' | '«')) => self.smart_quotes(lexeme.start, quote),
            Some('°') if self.raw.last().is_some_and(|l| l.token == Token::Number && l.end == lexeme.start) => {
                // The number's unit is judged later.
                if let Some(number) = self.raw.last_mut() {
                    number.end = lexeme.end;
                }
            }
            _ => match &mut self.unknown {
                Some(run) if run.end == lexeme.start => run.end = lexeme.end,
                _ => {
                    self.report_unknown();
                    self.unknown = Some(lexeme);
                }
            },
        }
    }

    fn report_unknown(&mut self) {
        let Some(Lexeme { start, end, .. }) = self.unknown.take() else { return };
        let (span, text) = (self.span(start, end), self.slice(start, end));
        let after_value = self.raw.last().is_some_and(|l| l.end == start && ends_a_value(*l));
        let sign =
            CHARACTERS.iter().filter(|(sign, ..)| !(*sign == "!" && after_value)).find(|(sign, ..)| *sign == text);
        if let Some((_, ours, token, hint)) = sign {
            let spaced = ours.chars().all(char::is_alphabetic) && !self.text[end as usize..].starts_with(' ');
            let replacement = if spaced { format!("{ours} ") } else { (*ours).to_owned() };
            self.report(
                Diagnostic::new(Code::UnknownCharacter, span, format!("unexpected '{text}'"))
                    .suggest(*hint, [Edit::replace(span, replacement)]),
            );
            self.raw.push(Lexeme { token: *token, start, end });
            return;
        }
        let mut shown = String::new();
        for c in text.chars().take(8) {
            if c.is_control() { shown.extend(c.escape_unicode()) } else { shown.push(c) }
        }
        let diagnostic = Diagnostic::new(Code::UnknownCharacter, span, format!("unexpected '{shown}'"));
        let power = match text {
            "²" => Some("^ 2"),
            "³" => Some("^ 3"),
            _ => None,
        };
        let at_end = self.line_from(end).trim().is_empty();
        self.report(match (text.chars().next(), power) {
            (_, Some(power)) => diagnostic
                .suggest(format!("a power is written 'a {power}'"), [Edit::replace(span, format!(" {power}"))]),
            (Some('?'), _) => diagnostic.hint("to choose between values, write 'if c { a } else { b }'"),
            (Some('$'), _) if self.text[end as usize..].starts_with('f') => {
                diagnostic.hint("surfaces are exact; the fineness of a mesh is an option: gmlc mesh --chord 0.1mm")
            }
            (Some('√'), _) => diagnostic.hint("a square root is written 'sqrt(x)'"),
            (Some('\\'), _) if at_end => diagnostic
                .suggest("remove it: a line that ends with an operator continues on the next", [Edit::remove(span)]),
            _ => diagnostic,
        });
        if !(text == "\\" && at_end) {
            self.push_error(start, end);
        }
    }

    /// A text without a closing quote on its line. If there is one a few lines below, the text goes up to that.
    fn unclosed_text(&mut self, lexeme: Lexeme) {
        self.report_unknown();
        let line = self.line_from(lexeme.start).trim_end();
        let end = lexeme.start + line.len() as u32;
        let span = self.span(lexeme.start, end);
        let below = self.text[end as usize..].lines().skip(1).take(5);
        let mut offset = self.text[end as usize..].find('\n').map_or(0, |n| n + 1);
        for line in below {
            if line.matches('"').count() % 2 == 1 {
                let last = end + (offset + line.find('"').unwrap_or(0)) as u32 + 1;
                let message = "a text must end on the line on which it begins";
                self.report(Diagnostic::new(Code::UnclosedText, span, message).hint(r"write \n for a line break"));
                return self.push_error(lexeme.start, last);
            }
            offset += line.len() + 1;
        }
        // The missing quote most likely belongs after the ending of a path, or else at the end of the line.
        let length = line.find(".gml").map_or(line.len(), |at| at + 4) as u32;
        let place = self.span(lexeme.start, lexeme.start + length);
        let error = Diagnostic::new(Code::UnclosedText, span, "this text has no closing quote");
        let number = self.raw.last().filter(|l| l.token == Token::Number && l.end == lexeme.start);
        self.report(match number {
            Some(_) => error
                .suggest("inches are written '3in'", [Edit::replace(self.span(lexeme.start, lexeme.start + 1), "in")]),
            None => error.suggest("add the closing quote", [Edit::after(place, "\"")]),
        });
        self.push_error(lexeme.start, end);
    }

    /// A text in typographic quotes.
    fn smart_quotes(&mut self, start: u32, quote: char) {
        self.report_unknown();
        let line = self.line_from(start);
        let first = quote.len_utf8();
        let close = line[first..].find(['”', '“', '’', '»', '"']).map(|at| at + first);
        let length = close.map_or(first, |at| at + line[at..].chars().next().map_or(0, char::len_utf8));
        let end = start + length as u32;
        let span = self.span(start, end);
        let diagnostic = Diagnostic::new(Code::UnknownCharacter, span, "a text is written in straight double quotes");
        let opening = self.span(start, start + first as u32);
        self.report(match close {
            Some(at) => {
                let closing = self.span(start + at as u32, end);
                let edits = [Edit::replace(opening, "\""), Edit::replace(closing, "\"")];
                diagnostic.suggest("use straight quotes", edits)
            }
            None => diagnostic,
        });
        self.push_error(start, end);
    }

    /// A token of the language, unless it begins an operator or a comment of another one.
    fn take(&mut self, mut lexeme: Lexeme) {
        let (here, rest) = (&self.text[lexeme.start as usize..], &self.text[lexeme.end as usize..]);
        let last = self.raw.last().copied();
        let adjacent = last.filter(|l| l.end == lexeme.start);
        let is_foreign = |theirs: &str| here.starts_with(theirs) && (theirs != "||" || last.is_some_and(ends_a_value));
        if let Some((theirs, ours, token, hint)) = OPERATORS.iter().find(|(theirs, ..)| is_foreign(theirs)) {
            lexeme = Lexeme { token: *token, end: lexeme.start + theirs.len() as u32, ..lexeme };
            let span = self.span(lexeme.start, lexeme.end);
            let message = format!("there is no operator '{theirs}'");
            self.report(Diagnostic::new(Code::Syntax, span, message).suggest(*hint, [Edit::replace(span, *ours)]));
        }
        let span = self.span(lexeme.start, lexeme.end);
        match lexeme.token {
            Token::Prime | Token::PrimeName if !adjacent.is_some_and(can_be_primed) => return self.stray_prime(lexeme),
            Token::Slash if rest.starts_with('*') => return self.block_comment(lexeme.start),
            Token::Dot if adjacent.is_some_and(|l| l.token == Token::DotDot) => {
                let diagnostic = Diagnostic::new(Code::Syntax, span, "a range is written with two dots");
                return self.report(diagnostic.suggest("remove the third dot", [Edit::remove(span)]));
            }
            Token::Dot if rest.starts_with(|c: char| c.is_ascii_digit()) && !adjacent.is_some_and(ends_a_value) => {
                let diagnostic = Diagnostic::new(Code::BadNumber, span, "a number must begin with a digit");
                return self.report(diagnostic.suggest("write a 0 before the point", [Edit::before(span, "0")]));
            }
            Token::Dot
                if adjacent.is_some_and(|l| l.token == Token::Number)
                    && !rest.trim_start().starts_with(|c: char| c.is_alphabetic() || c == '_') =>
            {
                let diagnostic = Diagnostic::new(Code::BadNumber, span, "a number cannot end with a point");
                let hint = "write a 0 after the point, or remove the point";
                return self.report(diagnostic.suggest(hint, [Edit::after(span, "0")]));
            }
            Token::Plus | Token::Minus | Token::Star | Token::Slash
                if rest.starts_with('=') && !rest.starts_with("==") =>
            {
                let (start, end) = (lexeme.start, lexeme.end + 1);
                let message = format!("there is no '{}': values cannot be changed", self.slice(start, end));
                let hint = "give the new value a name with 'let'; to add values up, use sum(xs) or fold(init, xs, f)";
                self.report(Diagnostic::new(Code::Syntax, self.span(start, end), message).hint(hint));
                return self.push_error(start, end);
            }
            _ => {}
        }
        self.next = self.next.max(lexeme.end);
        self.raw.push(lexeme);
    }

    fn stray_prime(&mut self, lexeme: Lexeme) {
        let line = self.line_from(lexeme.start);
        if let Some(close) = line[1..].find('\'').map(|at| at as u32 + 1) {
            let (start, end) = (lexeme.start, lexeme.start + close + 1);
            let quotes = [self.span(start, start + 1), self.span(end - 1, end)].map(|s| Edit::replace(s, "\""));
            let message = "a text is written in double quotes";
            let diagnostic = Diagnostic::new(Code::StrayPrime, self.span(start, end), message);
            self.report(diagnostic.suggest("use double quotes", quotes));
            return self.push_error(start, end);
        }
        let message = "a prime must directly follow what it differentiates, as in f' or s'u";
        let hint = "a text is written in double quotes";
        self.report(Diagnostic::new(Code::StrayPrime, self.span(lexeme.start, lexeme.end), message).hint(hint));
        self.push_error(lexeme.start, lexeme.end);
    }

    /// A comment as in C: reported, and skipped.
    fn block_comment(&mut self, start: u32) {
        let rest = &self.text[start as usize..];
        let end = rest.find("*/").map_or(rest.len(), |at| at + 2);
        let span = self.span(start, start + rest.lines().next().unwrap_or("").len().min(end) as u32);
        let message = "'/*' does not begin a comment";
        self.report(
            Diagnostic::new(Code::Syntax, span, message)
                .hint("a comment begins with '//' and ends at the end of its line"),
        );
        self.next = start + end as u32;
    }
}

fn can_be_primed(last: Lexeme) -> bool {
    use Token::{BraceClose, BracketClose, Name, ParenClose, Prime, PrimeName};
    matches!(last.token, Name | ParenClose | BracketClose | BraceClose | Prime | PrimeName)
}

fn ends_a_value(last: Lexeme) -> bool {
    can_be_primed(last) || matches!(last.token, Token::Number | Token::Text | Token::True | Token::False)
}
