//! What other languages write otherwise, and common slips: recognised where the grammar stops, and answered with what to
//! write instead.

use super::layout::Lexeme;
use super::messages::{Expected, Place};
use super::recover::statement_around;
use super::token::Token;
use crate::diagnostic::{Diagnostic, Edit};
use crate::source::Span;
use crate::suggest::nearest;

/// What to say instead of what was expected and found; nothing where it is no known slip.
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
        Some(Token::Comma) => slip.decimal_comma(),
        Some(Token::Name) => slip.name(),
        Some(Token::Separator | Token::BraceClose) | None => slip.part_without_shape(),
        _ => None,
    };
    by_token.or_else(|| slip.first_word()).or_else(|| slip.no_braces()).or_else(|| slip.comma_forgotten())
}

struct Slip<'p, 'e> {
    place: &'p Place<'p>,
    expected: &'p Expected<'e>,
    /// The first token of the statement.
    start: usize,
}

/// Words of other languages for ours, where the rest is alike.
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

/// The word of the language for one of another.
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

    /// The index of the token so many places before the one that was found.
    fn back(&self, count: usize) -> Option<usize> {
        self.place.index.checked_sub(count)
    }

    fn before(&self, count: usize) -> Option<Token> {
        self.token(self.back(count)?)
    }

    fn here(&self) -> usize {
        self.place.index
    }

    /// Whether the token directly follows the one before.
    fn glued(&self, index: usize) -> bool {
        match (index.checked_sub(1).and_then(|i| self.lexeme(i)), self.lexeme(index)) {
            (Some(a), Some(b)) => a.end == b.start,
            _ => false,
        }
    }

    fn error(&self, span: Span, message: impl Into<String>) -> Diagnostic {
        Diagnostic::error("syntax", span, message)
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

    /// `=`: for `==`, for `:`, in place of `>=`, and names that are not declared.
    fn equals(&self) -> Option<Diagnostic> {
        let here = self.here();
        if self.token(here + 1) == Some(Token::Greater) && self.glued(here + 1) {
            return self.fat_arrow();
        }
        if self.before(1) == Some(Token::DotDot) && self.glued(here) {
            return self.inclusive_range();
        }
        if self.before(1) == Some(Token::BracketClose) && self.expected.has("..") && !self.expected.value() {
            return self.bounds_in_brackets();
        }
        if self.before(1) == Some(Token::Name) {
            let name = self.text(here - 1).to_owned();
            match self.before(2) {
                Some(Token::Param | Token::Input) => return Some(self.parameter_without_type(&name)),
                Some(Token::ParenOpen) if self.before(3) == Some(Token::For) => return Some(self.foreign_loop()),
                Some(Token::ParenOpen | Token::Comma) if self.expected.has(":") => {
                    let span = self.span(here);
                    let gap = Span { start: self.span(here - 1).end, ..span };
                    let message = format!("the argument '{name}' is labelled with ':', not '='");
                    return Some(
                        self.error(span, message).suggest(format!("write '{name}: ...'"), [Edit::replace(gap, ":")]),
                    );
                }
                _ if self.at_start(1) => return Some(self.assignment(&name)),
                _ => {}
            }
        }
        if !self.expected.value() && (self.expected.has("{") || self.in_condition()) {
            let span = self.span(here);
            let diagnostic = self.error(span, "'=' names a value; it does not compare");
            return Some(diagnostic.suggest("two values are compared with '=='", [Edit::replace(span, "==")]));
        }
        None
    }

    fn in_condition(&self) -> bool {
        let require = self.token(self.start) == Some(Token::Require);
        require
            || (self.start..self.here())
                .any(|i| matches!(self.token(i), Some(Token::If | Token::And | Token::Or | Token::Not)))
    }

    fn assignment(&self, name: &str) -> Diagnostic {
        let span = self.span(self.here() - 1);
        let declared = (1..self.start).any(|i| {
            matches!(self.token(i - 1), Some(Token::Let | Token::Param | Token::Input)) && self.text(i) == name
        });
        let (message, question) = if declared {
            (
                format!("nothing changes its value, and '{name}' has one"),
                format!("'let {name} = ...' makes a new value of that name"),
            )
        } else {
            (format!("'{name}' is not declared"), format!("'let {name} = ...' names a value"))
        };
        self.error(span, message).suggest(question, [Edit::before(span, "let ")])
    }

    fn parameter_without_type(&self, name: &str) -> Diagnostic {
        let span = self.span(self.here() - 1);
        let value = self.text(self.here() + 1).trim_start_matches(|c: char| c.is_ascii_digit() || "._".contains(c));
        let ty = match value {
            "mm" | "cm" | "m" | "in" => "length",
            "deg" | "rad" | "turn" => "angle",
            _ => "real",
        };
        let message = format!("'{name}' needs a type: real, length or angle");
        self.error(span, message).suggest(format!("write '{name}: {ty}'"), [Edit::after(span, format!(": {ty}"))])
    }

    fn inclusive_range(&self) -> Option<Diagnostic> {
        let span = self.span(self.here());
        let diagnostic = self.error(span, "there is no '..=': a range ends before its upper bound");
        let last = self.here() + 1;
        Some(match self.text(last).parse::<i64>() {
            Ok(n) => diagnostic.suggest(
                format!("up to {n} and with it is '..{}'", n + 1),
                [Edit::replace(self.spans(self.here(), last), (n + 1).to_string())],
            ),
            Err(_) => diagnostic.hint("add 1 to the upper bound: 'a..b + 1'"),
        })
    }

    fn bounds_in_brackets(&self) -> Option<Diagnostic> {
        let close = self.here() - 1;
        let open = self.opening(close)?;
        let commas: Vec<usize> = (open..close).filter(|i| self.token(*i) == Some(Token::Comma)).collect();
        let diagnostic = self.error(self.spans(open, close), "bounds are written with two points, without brackets");
        let [comma] = commas[..] else { return Some(diagnostic.hint("write 'in low..high'")) };
        let gap = Span { end: self.span(comma + 1).start, ..self.span(comma) };
        let edits = [Edit::remove(self.span(open)), Edit::replace(gap, ".."), Edit::remove(self.span(close))];
        Some(diagnostic.suggest("write 'in low..high'", edits))
    }

    /// `=>` where an expression goes on: a lambda, or a comparison with its signs swapped.
    fn fat_arrow(&self) -> Option<Diagnostic> {
        let here = self.here();
        let arrow = self.spans(here, here + 1);
        if self.before(1) == Some(Token::Name) && matches!(self.before(2), Some(Token::ParenOpen | Token::Comma)) {
            let name = self.text(here - 1).to_owned();
            return Some(self.lambda(here - 1, here + 1, &name));
        }
        if self.before(1) == Some(Token::ParenClose) && !self.in_condition() {
            return self.lambda_with_parentheses(here + 1);
        }
        let diagnostic = self.error(arrow, "there is no operator '=>'");
        Some(diagnostic.suggest("did you mean '>='?", [Edit::replace(arrow, ">=")]))
    }

    fn lambda(&self, from: usize, to: usize, parameters: &str) -> Diagnostic {
        let span = self.spans(from, to);
        self.error(span, "a function without a name is written with bars")
            .suggest(format!("write '|{parameters}| ...'"), [Edit::replace(span, format!("|{parameters}|"))])
    }

    /// `(x, y) -> ...`, the last token of the arrow being at `last`.
    fn lambda_with_parentheses(&self, last: usize) -> Option<Diagnostic> {
        let close = self.here() - 1;
        let open = self.opening(close)?;
        let names: String = (open + 1..close).map(|i| if self.text(i) == "," { ", " } else { self.text(i) }).collect();
        Some(self.lambda(open, last, &names))
    }

    fn arrow_of_lambda(&self) -> Option<Diagnostic> {
        if self.before(1) != Some(Token::ParenClose) {
            return None;
        }
        self.lambda_with_parentheses(self.here())
    }

    /// `fn f(x) => ...`: the grammar has taken the `=`.
    fn fat_arrow_of_function(&self) -> Option<Diagnostic> {
        if self.before(1) != Some(Token::Equals) || !self.glued(self.here()) {
            return None;
        }
        let arrow = self.spans(self.here() - 1, self.here());
        let diagnostic = self.error(arrow, "a function's value is given with '='");
        Some(diagnostic.suggest("write '= ...'", [Edit::replace(arrow, "=")]))
    }

    fn double_equals(&self) -> Option<Diagnostic> {
        if !self.expected.has("=") || self.expected.operator() {
            return None;
        }
        let span = self.span(self.here());
        let diagnostic = self.error(span, "'==' compares; it does not name a value");
        Some(diagnostic.suggest("a value is named with '='", [Edit::replace(span, "=")]))
    }

    fn range_in_the_wrong_place(&self) -> Option<Diagnostic> {
        let here = self.here();
        let span = self.span(here);
        if self.before(2) == Some(Token::ParenOpen) && self.before(3) == Some(Token::For) {
            let open = here - 2;
            let close = (here..self.place.tokens.len())
                .find(|i| self.token(*i) == Some(Token::ParenClose) && self.opening(*i) == Some(open))?;
            let diagnostic = self.error(self.span(open), "a 'for' has no parentheses");
            let edits = [Edit::remove(self.span(open)), Edit::remove(self.span(close))];
            return Some(diagnostic.suggest("write 'for i in 0..n { ... }'", edits));
        }
        if !matches!(self.token(self.start), Some(Token::Param | Token::Input)) {
            return None;
        }
        let order = "the order is 'param name: type in low..high = default'";
        Some(if self.back(2) == Some(self.start) {
            self.error(span, "the type comes before the bounds").hint(order)
        } else {
            self.error(span, "the bounds come before the default").hint(order)
        })
    }

    fn comprehension_at_the_end(&self) -> Option<Diagnostic> {
        let inside = self.expected.has("]");
        inside.then(|| {
            self.error(self.span(self.here()), "a 'for' comes before what it makes")
                .hint("an array is made with 'for i in 0..n { ... }', without brackets")
        })
    }

    fn colon(&self) -> Option<Diagnostic> {
        let span = self.span(self.here());
        if self.token(self.start) == Some(Token::Fn) && self.expected.has("->") {
            let typed = self.token(self.here() + 1) == Some(Token::Name);
            let diagnostic = self.error(span, "the type of the result comes after '->'");
            return Some(if typed {
                diagnostic.suggest("write '-> type'", [Edit::replace(span, " ->")])
            } else {
                self.error(span, "a function's body follows '=', or stands in braces").hint("write 'fn f(x) = ...'")
            });
        }
        let words = [Token::If, Token::Else, Token::For];
        let block = self.expected.has("{")
            && (self.start..self.here()).any(|i| self.token(i).is_some_and(|t| words.contains(&t)));
        block.then(|| {
            self.error(span, "a block stands in braces, not after a colon").hint("write 'if c { a } else { b }'")
        })
    }

    fn decimal_comma(&self) -> Option<Diagnostic> {
        let here = self.here();
        let number = |i: usize| self.token(i) == Some(Token::Number);
        let glued =
            self.before(1) == Some(Token::Number) && number(here + 1) && self.glued(here) && self.glued(here + 1);
        glued.then(|| {
            let span = self.span(here);
            let diagnostic = self.error(span, "the decimal sign of a number is a point");
            diagnostic.suggest("write a point", [Edit::replace(span, ".")])
        })
    }

    fn part_without_shape(&self) -> Option<Diagnostic> {
        let name = self.back(1)?;
        if !self.expected.has("=") || self.before(2) != Some(Token::Part) {
            return None;
        }
        let text = self.text(name);
        let message = format!("the part '{text}' has no shape");
        Some(self.error(self.span(name), message).hint(format!("write 'part {text} = sphere(3mm)', for example")))
    }

    /// `return x`, `while c`: the grammar stops at what follows.
    fn first_word(&self) -> Option<Diagnostic> {
        match self.text(self.start) {
            "while" if self.at_start(1) => return Some(self.no_while(self.start)),
            "return" if self.at_start(1) => {}
            _ => return None,
        }
        let span = self.span(self.start);
        let rest = Span { end: self.span(self.here()).start, ..span };
        let diagnostic = self.error(span, "there is no 'return': the last line of a block is its value");
        Some(diagnostic.suggest("leave it out", [Edit::remove(rest)]))
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
            self.error(self.span(self.here()), "what an 'if' chooses from stands in braces")
                .hint("write 'if c { a } else { b }'")
        } else {
            self.error(self.span(self.here()), "what a 'for' makes stands in braces")
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
        Some(diagnostic.suggest("put a comma between the two", [Edit::after(span, ",")]))
    }
}

// Names where there should be none.
impl Slip<'_, '_> {
    fn name(&self) -> Option<Diagnostic> {
        let here = self.here();
        let (word, span) = (self.text(here), self.span(here));
        if here == self.start && self.expected.item() {
            return self.statement_word(word, span);
        }
        if let Some(diagnostic) = self.after_number(word, span) {
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
                self.error(span, "there is no 'then': what an 'if' chooses from stands in braces")
                    .hint("write 'if c { a } else { b }'"),
            ),
            ("mut" | "var" | "const", _) if self.before(2) == Some(Token::Let) => {
                let gap = Span { end: span.start, ..self.span(previous) };
                let message = format!("there is no '{before}': nothing changes its value");
                Some(self.error(self.span(previous), message).suggest("leave it out", [Edit::remove(gap)]))
            }
            ("lambda", _) if self.token(here + 1) == Some(Token::Colon) => Some(self.lambda(previous, here + 1, word)),
            _ if self.token(self.start) == Some(Token::Use) && self.expected.has("(") => {
                let end = statement_around(self.place.tokens, here).to - 1;
                let diagnostic = self.error(span, "the names that 'use' brings stand in parentheses");
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

    fn no_while(&self, at: usize) -> Diagnostic {
        self.error(self.span(at), "there is no 'while': nothing changes its value")
            .hint("to repeat, there are 'for', fold(init, xs, f), and functions that call themselves")
    }

    /// `3 mm`, `2 x`.
    fn after_number(&self, word: &str, span: Span) -> Option<Diagnostic> {
        let number = self.back(1).filter(|i| self.token(*i) == Some(Token::Number))?;
        let gap = Span { end: span.start, start: self.span(number).end, ..span };
        let digits = self.text(number);
        let bare = digits.ends_with(|c: char| c.is_ascii_digit());
        if bare && matches!(word, "mm" | "cm" | "m" | "deg" | "rad" | "turn") {
            let both = self.spans(number, self.here());
            let diagnostic = self.error(both, "a unit is glued to its number");
            return Some(diagnostic.suggest(format!("write '{digits}{word}'"), [Edit::remove(gap)]));
        }
        if !self.expected.operator()
            || self.expected.has(",")
            || matches!(word, "then" | "elif" | "elsif" | "elseif")
            || self.expected.has("{")
        {
            return None;
        }
        let diagnostic = self.error(span, "a product needs its sign");
        Some(diagnostic.suggest(format!("write '{digits} * {word}'"), [Edit::replace(gap, " * ")]))
    }

    /// A word that begins a statement and is none of the language's.
    fn statement_word(&self, word: &str, span: Span) -> Option<Diagnostic> {
        let here = self.here();
        let next = self.token(here + 1);
        if word == "while" {
            return Some(self.no_while(here));
        }
        if word == "from" {
            return Some(self.import_of_another_language(span));
        }
        if next == Some(Token::Equals) {
            let diagnostic = self.error(span, format!("'{word}' is not declared"));
            return Some(diagnostic.suggest(format!("'let {word} = ...' names a value"), [Edit::before(span, "let ")]));
        }
        let message = format!("'{word}' is no word of the language");
        if let Some(ours) = alias(word) {
            return Some(self.aliased(word, ours, self.error(span, message), span));
        }
        // What follows tells which declarations it may be.
        let of_shape: &[&str] = match (next, self.token(here + 2)) {
            (Some(Token::Name), Some(Token::Colon)) => &["param", "input", "let"],
            (Some(Token::Name), Some(Token::Equals)) => &["let", "part"],
            (Some(Token::Name), Some(Token::ParenOpen)) => &["fn", "deriv", "use"],
            (Some(Token::Name), Some(Token::BraceOpen)) => &["model"],
            (Some(Token::Name | Token::Text), _) => &["use", "for", "require", "part", "let", "model"],
            _ => &[],
        };
        if let Some(ours) = nearest(word, of_shape.iter().copied()) {
            return Some(self.error(span, message).did_you_mean(span, ours));
        }
        let diagnostic = self.error(span, "a declaration must stand here: 'let', 'param', 'part', 'fn', ...");
        Some(if next == Some(Token::ParenOpen) || next == Some(Token::Dot) {
            self.error(span, "a shape must be given a name").hint("write 'part NAME = ...'")
        } else {
            diagnostic
        })
    }

    fn aliased(&self, word: &str, ours: &str, diagnostic: Diagnostic, span: Span) -> Diagnostic {
        let after_name = self.token(self.here() + 2);
        match ours {
            "model" if after_name == Some(Token::ParenOpen) => {
                diagnostic.hint("write 'model NAME { ... }'; its parameters stand within, as 'param r: length = 3mm'")
            }
            "fn" if word == "def" => diagnostic.hint("write 'fn f(x) = ...', or the body in braces"),
            "use" if self.token(self.here() + 1) == Some(Token::Less) => {
                diagnostic.hint("write 'use \"file.gml\" (name)'")
            }
            _ => diagnostic.suggest(format!("did you mean '{ours}'?"), [Edit::replace(span, ours)]),
        }
    }

    /// `from std.curve import bezier`.
    fn import_of_another_language(&self, span: Span) -> Diagnostic {
        let end = statement_around(self.place.tokens, self.here()).to;
        let import = (self.here()..end).find(|i| self.text(*i) == "import");
        let diagnostic = self.error(span, "'from' is no word of the language");
        match import.filter(|i| *i + 1 < end) {
            Some(import) => {
                let gap = Span { end: self.span(import + 1).start, ..self.span(import) };
                let edits = [Edit::replace(span, "use"), Edit::replace(gap, "("), Edit::after(self.span(end - 1), ")")];
                diagnostic.suggest("write 'use std.module (name)'", edits)
            }
            None => diagnostic.hint("write 'use std.module (name)'"),
        }
    }

    fn foreign_loop(&self) -> Diagnostic {
        self.error(self.span(self.here() - 2), "a 'for' runs over a range or an array, without parentheses")
            .hint("write 'for i in 0..n { ... }'")
    }
}
