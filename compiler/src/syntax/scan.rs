//! Text to raw tokens. What the lexer rejects, and what other languages write that means nothing here, is reported, and
//! replaced by what was meant where that is clear, so that one slip gives one message.

use super::layout::Lexeme;
use super::spanned;
use super::token::Token;
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::{FileId, Span};
use logos::Logos;

/// The tokens of a text, white space left out.
pub(super) fn scan(file: FileId, text: &str) -> (Vec<Lexeme>, Vec<Diagnostic>) {
    let mut scan = Scan { file, text, raw: Vec::new(), diagnostics: Vec::new(), rubbish: None, next: 0 };
    for (result, range) in Token::lexer(text).spanned() {
        let lexeme = Lexeme { token: result.unwrap_or(Token::Error), start: range.start as u32, end: range.end as u32 };
        if lexeme.start < scan.next {
            continue;
        }
        if lexeme.token == Token::Error {
            scan.reject(lexeme);
        } else {
            scan.report_rubbish();
            scan.take(lexeme);
        }
    }
    scan.report_rubbish();
    (scan.raw, scan.diagnostics)
}

struct Scan<'t> {
    file: FileId,
    text: &'t str,
    raw: Vec<Lexeme>,
    diagnostics: Vec<Diagnostic>,
    /// Characters that the lexer rejected, up to here.
    rubbish: Option<Lexeme>,
    /// What lies before was dealt with.
    next: u32,
}

/// How many bytes of a line are searched for what belongs to a slip.
const WINDOW: usize = 4096;

/// Characters that stand for operators, and the operators.
const SIGNS: [(&str, &str, Token, &str); 14] = [
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
    ("&&", "and", Token::And, "conditions are joined with 'and'"),
    ("&", "and", Token::And, "conditions are joined with 'and'"),
    ("!", "not ", Token::Not, "a condition is negated with 'not'"),
];

impl<'t> Scan<'t> {
    fn span(&self, start: u32, end: u32) -> Span {
        spanned(self.file, start, end)
    }

    fn slice(&self, start: u32, end: u32) -> &'t str {
        self.text.get(start as usize..end as usize).unwrap_or("")
    }

    /// The rest of the line from there, as far as anything is looked for in it.
    fn line_from(&self, start: u32) -> &'t str {
        let rest = &self.text[start as usize..];
        rest[..rest.floor_char_boundary(WINDOW)].lines().next().unwrap_or("")
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Stands for something that was reported.
    fn push_error(&mut self, start: u32, end: u32) {
        self.raw.push(Lexeme { token: Token::Error, start, end });
        self.next = self.next.max(end);
    }

    /// What the lexer rejects: quotes and comments of other languages at once, other characters when their run ends.
    fn reject(&mut self, lexeme: Lexeme) {
        let rest = self.line_from(lexeme.start);
        match rest.chars().next() {
            Some('"') => self.unclosed_text(lexeme),
            Some('#') if self.rubbish.is_none_or(|r| r.end < lexeme.start) => {
                self.report_rubbish();
                let end = lexeme.start + rest.trim_end().len() as u32;
                let sign = self.span(lexeme.start, lexeme.start + 1);
                self.report(
                    Diagnostic::new(Code::UnknownCharacter, sign, "'#' means nothing here")
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
            _ => match &mut self.rubbish {
                Some(rubbish) if rubbish.end == lexeme.start => rubbish.end = lexeme.end,
                _ => {
                    self.report_rubbish();
                    self.rubbish = Some(lexeme);
                }
            },
        }
    }

    fn report_rubbish(&mut self) {
        let Some(Lexeme { start, end, .. }) = self.rubbish.take() else { return };
        let (span, text) = (self.span(start, end), self.slice(start, end));
        let after_value = self.raw.last().is_some_and(|l| l.end == start && ends_a_value(*l));
        let sign = SIGNS.iter().filter(|(sign, ..)| !(*sign == "!" && after_value)).find(|(sign, ..)| *sign == text);
        if let Some((_, ours, token, hint)) = sign {
            let spaced = ours.chars().all(char::is_alphabetic) && !self.text[end as usize..].starts_with(' ');
            let replacement = if spaced { format!("{ours} ") } else { (*ours).to_owned() };
            self.report(
                Diagnostic::new(Code::UnknownCharacter, span, format!("'{text}' means nothing here"))
                    .suggest(*hint, [Edit::replace(span, replacement)]),
            );
            self.raw.push(Lexeme { token: *token, start, end });
            return;
        }
        let shown: String = text.chars().take(8).flat_map(char::escape_debug).collect();
        let shown =
            if text.chars().all(|c| !c.is_control() && c != '\\') { text.chars().take(8).collect() } else { shown };
        let diagnostic = Diagnostic::new(Code::UnknownCharacter, span, format!("'{shown}' means nothing here"));
        let power = match text {
            "²" => Some("^ 2"),
            "³" => Some("^ 3"),
            _ => None,
        };
        let at_end = self.line_from(end).trim().is_empty();
        self.report(match (text.chars().next(), power) {
            (_, Some(power)) => diagnostic
                .suggest(format!("a power is written 'a {power}'"), [Edit::replace(span, format!(" {power}"))]),
            (Some('?'), _) => diagnostic.hint("a value is chosen with 'if c { a } else { b }'"),
            (Some('$'), _) if self.text[end as usize..].starts_with('f') => {
                diagnostic.hint("surfaces are exact; how finely they are drawn is an option: gmlc mesh --chord 0.1mm")
            }
            (Some('√'), _) => diagnostic.hint("a square root is written 'sqrt(x)'"),
            (Some('\\'), _) if at_end => {
                diagnostic.suggest("a line that ends with an operator goes on by itself", [Edit::remove(span)])
            }
            _ => diagnostic,
        });
        if !(text == "\\" && at_end) {
            self.push_error(start, end);
        }
    }

    /// A text without its end. Where its end lies some lines below, all up to there belongs to it.
    fn unclosed_text(&mut self, lexeme: Lexeme) {
        self.report_rubbish();
        let line = self.line_from(lexeme.start).trim_end();
        let end = lexeme.start + line.len() as u32;
        let span = self.span(lexeme.start, end);
        let below = self.text[end as usize..].lines().skip(1).take(5);
        let mut offset = self.text[end as usize..].find('\n').map_or(0, |n| n + 1);
        for line in below {
            if line.matches('"').count() % 2 == 1 {
                let last = end + (offset + line.find('"').unwrap_or(0)) as u32 + 1;
                let message = "a text must end on the line on which it begins";
                self.report(
                    Diagnostic::new(Code::UnclosedText, span, message).hint(r"write \n for a line end within it"),
                );
                return self.push_error(lexeme.start, last);
            }
            offset += line.len() + 1;
        }
        // Paths end with their ending; other texts most likely with the line.
        let length = line.find(".gml").map_or(line.len(), |at| at + 4) as u32;
        let place = self.span(lexeme.start, lexeme.start + length);
        let error = Diagnostic::new(Code::UnclosedText, span, "this text is not closed on its line");
        let number = self.raw.last().filter(|l| l.token == Token::Number && l.end == lexeme.start);
        self.report(match number {
            Some(_) => error
                .suggest("inches are written '3in'", [Edit::replace(self.span(lexeme.start, lexeme.start + 1), "in")]),
            None => error.suggest("end it with a double quote", [Edit::after(place, "\"")]),
        });
        self.push_error(lexeme.start, end);
    }

    /// A text in quotes of print.
    fn smart_quotes(&mut self, start: u32, quote: char) {
        self.report_rubbish();
        let line = self.line_from(start);
        let first = quote.len_utf8();
        let close = line[first..].find(['”', '“', '’', '»', '"']).map(|at| at + first);
        let length = close.map_or(first, |at| at + line[at..].chars().next().map_or(0, char::len_utf8));
        let end = start + length as u32;
        let span = self.span(start, end);
        let diagnostic = Diagnostic::new(Code::UnknownCharacter, span, "texts are written in straight double quotes");
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

    /// A token of the language; some sequences of them are operators elsewhere and mean nothing here.
    fn take(&mut self, mut lexeme: Lexeme) {
        use Token::{Bar, Caret, Colon, Dot, Equals, Number, Prime, PrimeName, Slash, Star};
        let rest = &self.text[lexeme.end as usize..];
        let last = self.raw.last().copied();
        let adjacent = last.filter(|l| l.end == lexeme.start);
        match lexeme.token {
            Prime | PrimeName if !adjacent.is_some_and(can_be_primed) => return self.stray_prime(lexeme),
            Slash if rest.starts_with('*') => return self.block_comment(lexeme.start),
            Star if rest.starts_with('*') => {
                lexeme.end += 1;
                self.operator(lexeme, "^", "a power is written 'a ^ b'");
                lexeme.token = Caret;
            }
            Bar if rest.starts_with('|') && last.is_some_and(ends_a_value) => {
                lexeme.end += 1;
                self.operator(lexeme, "or", "conditions are joined with 'or'");
                lexeme.token = Token::Or;
            }
            Colon if rest.starts_with('=') => {
                lexeme.end += 1;
                self.operator(lexeme, "=", "a value is named with '=' alone");
                lexeme.token = Equals;
            }
            Token::EqEq if rest.starts_with('=') => {
                lexeme.end += 1;
                self.operator(lexeme, "==", "two values are compared with '=='");
            }
            Token::Less if rest.starts_with('>') => {
                lexeme.end += 1;
                self.operator(lexeme, "!=", "'not equal' is written '!='");
                lexeme.token = Token::NotEq;
            }
            Dot if adjacent.is_some_and(|l| l.token == Token::DotDot) => {
                let span = self.span(lexeme.start, lexeme.end);
                let diagnostic = Diagnostic::new(Code::Syntax, span, "a range has two points");
                self.report(diagnostic.suggest("leave the third out", [Edit::remove(span)]));
                return;
            }
            Dot if rest.starts_with(|c: char| c.is_ascii_digit()) && !adjacent.is_some_and(ends_a_value) => {
                let span = self.span(lexeme.start, lexeme.end);
                let message = "a number begins with a digit";
                let diagnostic = Diagnostic::new(Code::BadNumber, span, message);
                self.report(diagnostic.suggest("put a 0 before the point", [Edit::before(span, "0")]));
                return;
            }
            Dot if adjacent.is_some_and(|l| l.token == Number)
                && !rest.trim_start().starts_with(|c: char| c.is_alphabetic() || c == '_') =>
            {
                let span = self.span(lexeme.start, lexeme.end);
                let diagnostic = Diagnostic::new(Code::BadNumber, span, "a number does not end with its point");
                self.report(diagnostic.suggest("leave the point out, or put a 0 after it", [Edit::after(span, "0")]));
                return;
            }
            Token::Plus | Token::Minus | Star | Slash if rest.starts_with('=') && !rest.starts_with("==") => {
                let (start, end) = (lexeme.start, lexeme.end + 1);
                let (span, sign) = (self.span(start, end), self.slice(start, end).to_owned());
                let message = format!("there is no '{sign}': nothing changes its value");
                let hint = "name the new value with 'let'; to add up, there are sum(xs) and fold(init, xs, f)";
                self.report(Diagnostic::new(Code::Syntax, span, message).hint(hint));
                return self.push_error(start, end);
            }
            _ => {}
        }
        self.next = self.next.max(lexeme.end);
        self.raw.push(lexeme);
    }

    /// An operator of other languages.
    fn operator(&mut self, lexeme: Lexeme, ours: &str, hint: &str) {
        let span = self.span(lexeme.start, lexeme.end);
        let message = format!("there is no operator '{}'", self.slice(lexeme.start, lexeme.end));
        self.report(Diagnostic::new(Code::Syntax, span, message).suggest(hint, [Edit::replace(span, ours)]));
    }

    fn stray_prime(&mut self, lexeme: Lexeme) {
        let line = self.line_from(lexeme.start);
        if let Some(close) = line[1..].find('\'').map(|at| at as u32 + 1) {
            let (start, end) = (lexeme.start, lexeme.start + close + 1);
            let quotes = [self.span(start, start + 1), self.span(end - 1, end)].map(|s| Edit::replace(s, "\""));
            let message = "texts are written in double quotes";
            let diagnostic = Diagnostic::new(Code::StrayPrime, self.span(start, end), message);
            self.report(diagnostic.suggest("use double quotes", quotes));
            return self.push_error(start, end);
        }
        let message = "a prime must directly follow what it differentiates, as in f' or s'u";
        let hint = "texts are written in double quotes";
        self.report(Diagnostic::new(Code::StrayPrime, self.span(lexeme.start, lexeme.end), message).hint(hint));
        self.push_error(lexeme.start, lexeme.end);
    }

    /// A comment as in C is left out.
    fn block_comment(&mut self, start: u32) {
        let rest = &self.text[start as usize..];
        let end = rest.find("*/").map_or(rest.len(), |at| at + 2);
        let span = self.span(start, start + rest.lines().next().unwrap_or("").len().min(end) as u32);
        let message = "there are no comments between '/*' and '*/'";
        self.report(
            Diagnostic::new(Code::Syntax, span, message).hint("a comment begins with '//' and ends with its line"),
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
