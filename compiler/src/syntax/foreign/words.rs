//! Unexpected words.

use super::super::recover::statement_around;
use super::super::token::Token;
use super::{Slip, alias};
use crate::diagnostic::{Diagnostic, Edit};
use crate::source::Span;
use crate::suggest::nearest;

impl Slip<'_, '_> {
    pub(super) fn name(&self) -> Option<Diagnostic> {
        let here = self.here();
        let (word, span) = (self.text(here), self.span(here));
        if here == self.start && self.expected.item() {
            return self.statement_word(word, span);
        }
        let known = self.operator_word(word, span).or_else(|| self.letter_before_text(word, span));
        if let Some(diagnostic) =
            known.or_else(|| self.second_shape(word, span)).or_else(|| self.after_number(word, span))
        {
            return Some(diagnostic);
        }
        let previous = self.back(1)?;
        let before = self.text(previous);
        match (before, word) {
            (_, "elif" | "elsif" | "elseif") => {
                let diagnostic = self.error(span, format!("there is no '{word}'"));
                Some(diagnostic.suggest("write 'else if'", [Edit::replace(span, "else if")]))
            }
            (_, "then") => Some(
                self.error(span, "there is no 'then': the branches of an 'if' must be in braces")
                    .hint("write 'if c { a } else { b }'"),
            ),
            ("mut" | "var" | "const", _) if self.before(2) == Some(Token::Let) => {
                let gap = Span { end: span.start, ..self.span(previous) };
                let message = format!("there is no '{before}': values cannot be changed");
                Some(self.error(self.span(previous), message).suggest("remove it", [Edit::remove(gap)]))
            }
            ("lambda", _) if self.token(here + 1) == Some(Token::Colon) => Some(self.lambda(previous, here + 1, word)),
            (_, "as") if self.token(self.start) == Some(Token::Use) => Some(
                self.error(span, "there is no 'as'")
                    .hint("'use \"sizes.gml\"' without names makes what the file defines known as 'sizes.NAME'"),
            ),
            _ if self.token(self.start) == Some(Token::Use) && self.expected.has("(") => {
                let end = statement_around(self.place.tokens, here).to - 1;
                let diagnostic = self.error(span, "the names after 'use' must be in parentheses");
                let edits = [Edit::before(span, "("), Edit::after(self.span(end), ")")];
                Some(diagnostic.suggest("put them in parentheses", edits))
            }
            _ if self.token(previous) == Some(Token::Name) && self.expected.has(":") && self.expected.has("=") => {
                let both = self.spans(previous, here);
                let diagnostic = self.error(both, "the type comes after the name and a colon");
                Some(
                    diagnostic.suggest(
                        format!("write '{word}: {before}'"),
                        [Edit::replace(both, format!("{word}: {before}"))],
                    ),
                )
            }
            _ => None,
        }
    }

    pub(super) fn no_while(&self, at: usize) -> Diagnostic {
        self.error(self.span(at), "there is no 'while': values cannot be changed")
            .hint("to repeat something, use 'for', fold(init, xs, f) or a function that calls itself")
    }

    /// `3 mm`, `2 x`.
    pub(super) fn after_number(&self, word: &str, span: Span) -> Option<Diagnostic> {
        let number = self.back(1).filter(|i| self.token(*i) == Some(Token::Number))?;
        let gap = Span { end: span.start, start: self.span(number).end, ..span };
        let digits = self.text(number);
        let bare = digits.ends_with(|c: char| c.is_ascii_digit());
        if bare && matches!(word, "mm" | "cm" | "m" | "deg" | "rad" | "turn") {
            let both = self.spans(number, self.here());
            let diagnostic = self.error(both, "a unit must directly follow its number");
            return Some(diagnostic.suggest(format!("write '{digits}{word}'"), [Edit::remove(gap)]));
        }
        if !self.expected.operator()
            || self.expected.has(",")
            || matches!(word, "then" | "elif" | "elsif" | "elseif")
            || self.expected.has("{")
        {
            return None;
        }
        let diagnostic = self.error(span, "a product needs '*'");
        Some(diagnostic.suggest(format!("write '{digits} * {word}'"), [Edit::replace(gap, " * ")]))
    }

    /// A word at the beginning of a statement that is not a keyword.
    pub(super) fn statement_word(&self, word: &str, span: Span) -> Option<Diagnostic> {
        let here = self.here();
        let next = self.token(here + 1);
        if word == "while" {
            return Some(self.no_while(here));
        }
        if word == "from" {
            return Some(self.import_of_another_language(span));
        }
        if let Some(diagnostic) = self.record_with_equals(here) {
            return Some(diagnostic);
        }
        if next == Some(Token::Equals) {
            let diagnostic = self.error(span, format!("'{word}' is not declared"));
            return Some(
                diagnostic.suggest(format!("write 'let {word} = ...' to define it"), [Edit::before(span, "let ")]),
            );
        }
        if let Some(diagnostic) = self.shape_of_another_language(word, span) {
            return Some(diagnostic);
        }
        let message = format!("'{word}' is not a keyword");
        if let Some(ours) = alias(word) {
            return Some(self.aliased(word, ours, self.error(span, message), span));
        }
        // The tokens after it tell which declarations are possible.
        let of_shape: &[&str] = match (next, self.token(here + 2)) {
            (Some(Token::Name), Some(Token::Colon)) => &["param", "input", "let"],
            (Some(Token::Name), Some(Token::Equals)) => &["let", "part", "measure"],
            (Some(Token::Name), Some(Token::ParenOpen)) => &["fn", "deriv", "use"],
            (Some(Token::Name), Some(Token::BraceOpen)) => &["model"],
            (Some(Token::Name | Token::Text), _) => &["use", "for", "require", "part", "measure", "let", "model"],
            _ => &[],
        };
        if let Some(ours) = nearest(word, of_shape.iter().copied()) {
            return Some(self.error(span, message).did_you_mean(span, ours));
        }
        Some(match next {
            Some(Token::ParenOpen | Token::Dot) => {
                self.error(span, "a shape needs a name").hint("write 'part NAME = ...'")
            }
            Some(Token::Separator | Token::BraceClose) if self.in_braces() => self
                .error(span, "a value alone is not a declaration")
                .hint(format!("write 'part NAME = {word}' to make a surface a part of the model")),
            _ => self.error(span, "expected a declaration: 'let', 'param', 'part', 'fn', ..."),
        })
    }

    pub(super) fn aliased(&self, word: &str, ours: &str, diagnostic: Diagnostic, span: Span) -> Diagnostic {
        let after_name = self.token(self.here() + 2);
        match ours {
            "model" if after_name == Some(Token::ParenOpen) => diagnostic
                .hint("write 'model NAME { ... }'; its parameters are declared inside, as 'param r: length = 3mm'"),
            "fn" if word == "def" => diagnostic.hint("write 'fn f(x) = ...', or the body in braces"),
            "use" if self.token(self.here() + 1) == Some(Token::Less) => {
                diagnostic.hint("write 'use \"file.gml\" (name)'")
            }
            _ => diagnostic.suggest(format!("did you mean '{ours}'?"), [Edit::replace(span, ours)]),
        }
    }

    /// `from std.curve import bezier`.
    pub(super) fn import_of_another_language(&self, span: Span) -> Diagnostic {
        let end = statement_around(self.place.tokens, self.here()).to;
        let import = (self.here()..end).find(|i| self.text(*i) == "import");
        let diagnostic = self.error(span, "'from' is not a keyword");
        match import.filter(|i| *i + 1 < end && self.token(*i + 1) == Some(Token::Name)) {
            Some(import) => {
                let gap = Span { end: self.span(import + 1).start, ..self.span(import) };
                let edits = [Edit::replace(span, "use"), Edit::replace(gap, "("), Edit::after(self.span(end - 1), ")")];
                diagnostic.suggest("write 'use std.module (name)'", edits)
            }
            None => diagnostic.hint("write 'use std.module (name)'; the library's names are known without it"),
        }
    }

    pub(super) fn comprehension_at_the_end(&self) -> Option<Diagnostic> {
        let inside = self.expected.has("]");
        inside.then(|| {
            self.error(self.span(self.here()), "'for' comes first, and its body after it")
                .hint("write 'for i in 0..n { ... }' without brackets: it makes an array")
        })
    }

    /// `return x`, `while c`: the grammar stops at what follows.
    pub(super) fn first_word(&self) -> Option<Diagnostic> {
        match self.text(self.start) {
            "while" if self.at_start(1) => return Some(self.no_while(self.start)),
            "return" if self.at_start(1) => {}
            _ => return None,
        }
        let span = self.span(self.start);
        let rest = Span { end: self.span(self.here()).start, ..span };
        let diagnostic = self.error(span, "there is no 'return': the last line of a block is its value");
        Some(diagnostic.suggest("remove it", [Edit::remove(rest)]))
    }

    pub(super) fn part_without_shape(&self) -> Option<Diagnostic> {
        let name = self.back(1)?;
        if !self.expected.has("=") || self.before(2) != Some(Token::Part) {
            return None;
        }
        let text = self.text(name);
        let message = format!("the part '{text}' has no shape");
        Some(self.error(self.span(name), message).hint(format!("write 'part {text} = sphere(3mm)', for example")))
    }

    /// Words between two values: operators of other languages, a unit beside a name, a tolerance in the wrong place.
    fn operator_word(&self, word: &str, span: Span) -> Option<Diagnostic> {
        let of_bounds = matches!(self.token(self.start), Some(Token::Param | Token::Input));
        if of_bounds && self.expected.has("in") && matches!(word, "min" | "max" | "from" | "between" | "range") {
            return Some(
                self.error(span, format!("there is no '{word}' here")).hint("write the bounds as 'in low..high'"),
            );
        }
        if !self.expected.operator() {
            return None;
        }
        let error = |message: &str| self.error(span, message);
        let gap = Span { start: self.span(self.back(1)?).end, ..span };
        let value = matches!(self.before(1), Some(Token::Name | Token::ParenClose | Token::BracketClose));
        let looped = (self.start..self.here()).any(|i| self.token(i) == Some(Token::For));
        Some(match word {
            "mod" => error("there is no 'mod'").suggest("a remainder is written 'a % b'", [Edit::replace(span, "%")]),
            "div" => error("there is no 'div'").hint("a whole quotient is written 'floor(a / b)'"),
            "is" => error("there is no 'is'").suggest("write '==' to compare two values", [Edit::replace(span, "==")]),
            "to" | "until" if of_bounds || looped => {
                let gap = Span { end: self.span(self.here() + 1).start, ..gap };
                error("a range is written with two dots").suggest("write 'a..b'", [Edit::replace(gap, "..")])
            }
            "mm" | "cm" | "m" | "deg" | "rad" | "turn" if value => error("a unit must directly follow a number")
                .suggest(
                    format!("multiply by '1{word}'"),
                    [Edit::replace(Span { end: span.end, ..gap }, format!(" * 1{word}"))],
                ),
            "tolerance" if self.token(self.start) == Some(Token::Part) => {
                error("the tolerance comes before the shape").hint("the order is 'part name tolerance 0.1mm = shape'")
            }
            "tolerance" if self.token(self.start) == Some(Token::Measure) => {
                error("the tolerance comes before the value")
                    .hint("the order is 'measure name tolerance +0.2/-0.1mm = value'")
            }
            _ => return None,
        })
    }

    /// `f"..."`.
    fn letter_before_text(&self, word: &str, span: Span) -> Option<Diagnostic> {
        let next = self.here() + 1;
        let letters = self.token(next) == Some(Token::Text) && self.glued(next) && word.len() <= 2;
        letters.then(|| {
            self.error(span, "values cannot be inserted into a text")
                .hint("the values of the parameters are shown with the message")
                .suggest("remove the letter", [Edit::remove(span)])
        })
    }

    /// `part "wall" = ...`.
    pub(super) fn quoted_name(&self) -> Option<Diagnostic> {
        let (here, span) = (self.here(), self.span(self.here()));
        let declared = matches!(
            self.before(1),
            Some(Token::Part | Token::Measure | Token::Param | Token::Input | Token::Let | Token::Model | Token::Fn)
        );
        let name = self.text(here).trim_matches('"');
        let usable = name.starts_with(char::is_alphabetic) && name.chars().all(|c| c.is_alphanumeric() || c == '_');
        let error = (declared && here > self.start).then(|| self.error(span, "a name is written without quotes"))?;
        Some(if usable {
            error.suggest(format!("write '{name}'"), [Edit::replace(span, name)])
        } else {
            error.hint("a name begins with a letter and consists of letters, digits and '_'")
        })
    }
}
