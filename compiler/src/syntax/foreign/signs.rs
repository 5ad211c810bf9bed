//! Unexpected operators and punctuation: those of other languages, and those of this one in a wrong place.

use super::super::token::Token;
use super::Slip;
use crate::diagnostic::{Diagnostic, Edit};
use crate::source::Span;

impl Slip<'_, '_> {
    /// `=`: for `==`, for `:`, in place of `>=`, and names that are not declared.
    pub(super) fn equals(&self) -> Option<Diagnostic> {
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
                    let colon = if self.glued(here + 1) { ": " } else { ":" };
                    let message = format!("the argument '{name}' is labelled with ':', not '='");
                    return Some(
                        self.error(span, message).suggest(format!("write '{name}: ...'"), [Edit::replace(gap, colon)]),
                    );
                }
                _ if self.at_start(1) => {
                    return self.record_with_equals(here - 1).or_else(|| Some(self.assignment(&name)));
                }
                _ => {}
            }
        }
        if let Some(diagnostic) = self.equals_of_declaration() {
            return Some(diagnostic);
        }
        if !self.expected.value() && (self.expected.has("{") || self.in_condition()) {
            let span = self.span(here);
            let diagnostic = self.error(span, "'=' gives a value a name; it does not compare");
            return Some(diagnostic.suggest("write '==' to compare two values", [Edit::replace(span, "==")]));
        }
        None
    }

    pub(super) fn assignment(&self, name: &str) -> Diagnostic {
        let span = self.span(self.here() - 1);
        let declared = (1..self.start).any(|i| {
            matches!(self.token(i - 1), Some(Token::Let | Token::Param | Token::Input)) && self.text(i) == name
        });
        let (message, question) = if declared {
            (
                format!("'{name}' already has a value, and values cannot be changed"),
                format!("write 'let {name} = ...' for a new value of that name"),
            )
        } else {
            (format!("'{name}' is not declared"), format!("write 'let {name} = ...' to define it"))
        };
        self.error(span, message).suggest(question, [Edit::before(span, "let ")])
    }

    pub(super) fn parameter_without_type(&self, name: &str) -> Diagnostic {
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

    pub(super) fn inclusive_range(&self) -> Option<Diagnostic> {
        let span = self.span(self.here());
        let diagnostic = self.error(span, "there is no '..=': a range ends before its upper bound");
        let last = self.here() + 1;
        Some(match self.text(last).parse::<i64>() {
            Ok(n) => diagnostic.suggest(
                format!("write '..{}' to include {n}", n + 1),
                [Edit::replace(self.spans(self.here(), last), (n + 1).to_string())],
            ),
            Err(_) => diagnostic.hint("add 1 to the upper bound: 'a..b + 1'"),
        })
    }

    pub(super) fn bounds_in_brackets(&self) -> Option<Diagnostic> {
        let close = self.here() - 1;
        let open = self.opening(close)?;
        let commas: Vec<usize> = (open..close).filter(|i| self.token(*i) == Some(Token::Comma)).collect();
        let diagnostic = self.error(self.spans(open, close), "bounds are written with two dots, without brackets");
        let [comma] = commas[..] else { return Some(diagnostic.hint("write 'in low..high'")) };
        let gap = Span { end: self.span(comma + 1).start, ..self.span(comma) };
        let edits = [Edit::remove(self.span(open)), Edit::replace(gap, ".."), Edit::remove(self.span(close))];
        Some(diagnostic.suggest("write 'in low..high'", edits))
    }

    /// `=>` where an expression goes on: a lambda, or a comparison with its signs swapped.
    pub(super) fn fat_arrow(&self) -> Option<Diagnostic> {
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

    pub(super) fn lambda(&self, from: usize, to: usize, parameters: &str) -> Diagnostic {
        let span = self.spans(from, to);
        self.error(span, "the parameters of an anonymous function stand between bars")
            .suggest(format!("write '|{parameters}| ...'"), [Edit::replace(span, format!("|{parameters}|"))])
    }

    /// `(x, y) -> ...`, the last token of the arrow being at `last`.
    pub(super) fn lambda_with_parentheses(&self, last: usize) -> Option<Diagnostic> {
        let close = self.here() - 1;
        let open = self.opening(close)?;
        let names: String = (open + 1..close).map(|i| if self.text(i) == "," { ", " } else { self.text(i) }).collect();
        Some(self.lambda(open, last, &names))
    }

    pub(super) fn arrow_of_lambda(&self) -> Option<Diagnostic> {
        if self.before(1) != Some(Token::ParenClose) {
            return None;
        }
        self.lambda_with_parentheses(self.here())
    }

    /// `fn f(x) => ...`: the grammar has taken the `=`.
    pub(super) fn fat_arrow_of_function(&self) -> Option<Diagnostic> {
        if self.before(1) != Some(Token::Equals) || !self.glued(self.here()) {
            return None;
        }
        let arrow = self.spans(self.here() - 1, self.here());
        let diagnostic = self.error(arrow, "a function's value follows '='");
        Some(diagnostic.suggest("write '= ...'", [Edit::replace(arrow, "=")]))
    }

    pub(super) fn double_equals(&self) -> Option<Diagnostic> {
        if !self.expected.has("=") || self.expected.operator() {
            return None;
        }
        let span = self.span(self.here());
        let diagnostic = self.error(span, "'==' compares; it does not give a value a name");
        Some(diagnostic.suggest("write '=' to give a value a name", [Edit::replace(span, "=")]))
    }

    pub(super) fn range_in_the_wrong_place(&self) -> Option<Diagnostic> {
        let here = self.here();
        let span = self.span(here);
        if self.before(2) == Some(Token::ParenOpen) && self.before(3) == Some(Token::For) {
            let open = here - 2;
            let close = (here..self.place.tokens.len())
                .find(|i| self.token(*i) == Some(Token::ParenClose) && self.opening(*i) == Some(open))?;
            let diagnostic = self.error(self.span(open), "a 'for' is written without parentheses");
            let edits = [Edit::remove(self.span(open)), Edit::remove(self.span(close))];
            return Some(diagnostic.suggest("write 'for i in 0..n { ... }'", edits));
        }
        if !matches!(self.token(self.start), Some(Token::Param | Token::Input)) {
            return self.expected.operator().then(|| {
                self.error(span, "'in' is for bounds and loops; it does not compare")
                    .hint("write 'low <= x and x <= high'")
            });
        }
        let order = "the order is 'param name: type in low..high = default'";
        Some(if self.back(2) == Some(self.start) {
            self.error(span, "the type comes before the bounds").hint(order)
        } else {
            self.error(span, "the bounds come before the default").hint(order)
        })
    }

    pub(super) fn colon(&self) -> Option<Diagnostic> {
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
        if let Some(diagnostic) = self.colon_of_range(span) {
            return Some(diagnostic);
        }
        let words = [Token::If, Token::Else, Token::For];
        let block = self.expected.has("{")
            && (self.start..self.here()).any(|i| self.token(i).is_some_and(|t| words.contains(&t)));
        block.then(|| {
            self.error(span, "a block is written in braces, not after a colon").hint("write 'if c { a } else { b }'")
        })
    }

    /// `,`: in a number, between bounds, declarations or names.
    pub(super) fn comma(&self) -> Option<Diagnostic> {
        self.decimal_comma()
            .or_else(|| self.comma_of_bounds())
            .or_else(|| self.list_of_declarations())
            .or_else(|| self.pattern_without_parentheses())
    }

    fn decimal_comma(&self) -> Option<Diagnostic> {
        let here = self.here();
        let number = |i: usize| self.token(i) == Some(Token::Number);
        let glued =
            self.before(1) == Some(Token::Number) && number(here + 1) && self.glued(here) && self.glued(here + 1);
        glued.then(|| {
            let span = self.span(here);
            let diagnostic = self.error(span, "a decimal number is written with a point, not a comma");
            diagnostic.suggest("write a point", [Edit::replace(span, ".")])
        })
    }

    pub(super) fn foreign_loop(&self) -> Diagnostic {
        self.error(self.span(self.here() - 2), "a 'for' loops over a range or an array, without parentheses")
            .hint("write 'for i in 0..n { ... }'")
    }

    /// `xs[1:2]`, `for i in 0:5`.
    fn colon_of_range(&self, span: Span) -> Option<Diagnostic> {
        let number = |i: usize| matches!(self.token(i), Some(Token::Number));
        if self.expected.has("]") && self.expected.operator() {
            let open = (self.start..self.here()).rev().find(|i| self.token(*i) == Some(Token::BracketOpen))?;
            let of_a_value =
                self.glued(open) && !matches!(self.token(open - 1), Some(Token::ParenOpen | Token::Equals));
            return Some(if of_a_value {
                self.error(span, "an index must be one number").hint("for a part of an array, use slice(xs, from, to)")
            } else {
                self.error(span, "a range is written with two dots and without brackets")
                    .hint("write 'a..b' for a up to, but not including, b")
            });
        }
        let range =
            self.before(2) == Some(Token::In) && self.before(1) == Some(Token::Number) && number(self.here() + 1);
        range.then(|| {
            self.error(span, "a range is written with two dots")
                .suggest("write 'a..b' for a up to, but not including, b", [Edit::replace(span, "..")])
        })
    }

    /// `in 1mm, 5mm`.
    pub(super) fn comma_of_bounds(&self) -> Option<Diagnostic> {
        let here = self.here();
        let bounds = matches!(self.token(self.start), Some(Token::Param | Token::Input))
            && self.expected.has("..")
            && !self.expected.has("separator")
            && !self.expected.has(")");
        bounds.then(|| {
            let span = self.span(here);
            let gap =
                if self.token(here + 1).is_some() { Span { end: self.span(here + 1).start, ..span } } else { span };
            self.error(span, "bounds are written with two dots")
                .suggest("write 'in low..high'", [Edit::replace(gap, "..")])
        })
    }

    /// `param a: length = 1mm, b: length = 2mm`.
    pub(super) fn list_of_declarations(&self) -> Option<Diagnostic> {
        let here = self.here();
        let word = match self.token(self.start)? {
            Token::Param | Token::Input | Token::Let | Token::Part => self.text(self.start),
            _ => return None,
        };
        let next = self.token(here + 1) == Some(Token::Name)
            && matches!(self.token(here + 2), Some(Token::Colon | Token::Equals));
        (self.expected.has("separator") && next).then(|| {
            let gap = Span { end: self.span(here + 1).start, ..self.span(here) };
            self.error(self.span(here), format!("each '{word}' declares one name"))
                .suggest(format!("write '{word}' before the next one"), [Edit::replace(gap, format!("; {word} "))])
        })
    }

    /// `a ++ b`.
    pub(super) fn two_pluses(&self) -> Option<Diagnostic> {
        let here = self.here();
        (self.before(1) == Some(Token::Plus) && self.glued(here)).then(|| {
            self.error(self.spans(here - 1, here), "there is no operator '++'")
                .hint("to join arrays, use concat(a, b); values cannot be changed, so there is no increment")
        })
    }
    /// `{radius = 2mm, height = 3mm}`, the first name at an index: the fields of a record. The grammar takes it for a
    /// block.
    pub(super) fn record_with_equals(&self, at: usize) -> Option<Diagnostic> {
        let before = |count: usize| self.token(at.checked_sub(count)?);
        let of_value = matches!(
            before(2),
            Some(Token::Equals | Token::ParenOpen | Token::BracketOpen | Token::Comma | Token::Colon | Token::Bar)
        );
        if before(1) != Some(Token::BraceOpen) || !of_value {
            return None;
        }
        let (mut depth, mut edits) = (0, Vec::new());
        for i in at..self.place.tokens.len() {
            let token = self.token(i)?;
            if token == Token::Separator && depth == 0 {
                return None;
            } else if token.closer().is_some() {
                depth += 1;
            } else if token.is_closer() {
                if depth == 0 {
                    break;
                }
                depth -= 1;
            }
            let field = i == at || self.token(i - 1) == Some(Token::Comma);
            if depth == 0 && field && token == Token::Name && self.token(i + 1) == Some(Token::Equals) {
                let gap = Span { start: self.span(i).end, ..self.span(i + 1) };
                edits.push(Edit::replace(gap, if self.glued(i + 2) { ": " } else { ":" }));
            }
        }
        let diagnostic = self.error(self.span(at), "the name of a field is followed by ':', not '='");
        (!edits.is_empty()).then(|| diagnostic.suggest("write '{name: value}'", edits))
    }

    /// `=` in a declaration that has none, or that lacks something before it.
    fn equals_of_declaration(&self) -> Option<Diagnostic> {
        let span = self.span(self.here());
        let gap = Span { start: self.span(self.back(1)?).end, ..span };
        match (self.before(2)?, self.before(1)?) {
            (Token::Model, Token::Name) => Some(
                self.error(span, "a model's name is followed by its body in braces")
                    .suggest("remove the '='", [Edit::remove(gap)]),
            ),
            (Token::Fn, Token::Name) => Some(
                self.error(span, "a function needs parentheses, even without parameters")
                    .suggest("write '()'", [Edit::after(self.span(self.here() - 1), "()")]),
            ),
            _ => None,
        }
    }

    /// `fn f(x) -> x + 1`: what was read as the type of the result is its value.
    pub(super) fn value_after_arrow(&self) -> Option<Diagnostic> {
        let arrow = self.back(2).filter(|i| self.token(*i) == Some(Token::Arrow))?;
        let of_function = self.token(self.start) == Some(Token::Fn) && self.expected.has("=") && self.expected.has("{");
        of_function.then(|| {
            let span = self.span(arrow);
            self.error(span, "'->' is followed by the type of the result")
                .suggest("a function's value follows '='", [Edit::replace(span, "=")])
        })
    }

    /// `deriv f(x, dx) = ...`.
    pub(super) fn tangents_without_semicolon(&self) -> Option<Diagnostic> {
        let lacking = self.token(self.start) == Some(Token::Deriv) && self.expected.has(";");
        lacking.then(|| {
            self.error(self.span(self.here()), "the names of the tangents are missing")
                .hint("write them after the arguments and a ';': 'deriv f(x; dx) = ...'")
        })
    }

    /// `model leg(r: length) { ... }`.
    pub(super) fn parameters_of_model(&self) -> Option<Diagnostic> {
        (self.before(2) == Some(Token::Model)).then(|| {
            self.error(self.span(self.here()), "a model's parameters are declared in its body")
                .hint("write 'model NAME { param r: length = 3mm; ... }'; a call sets them: 'NAME(r: 5mm)'")
        })
    }

    /// `for i, x in xs`, `let a, b = (1, 2)`.
    pub(super) fn pattern_without_parentheses(&self) -> Option<Diagnostic> {
        let here = self.here();
        let of_pattern = matches!(self.before(2), Some(Token::For | Token::Let))
            && self.before(1) == Some(Token::Name)
            && self.token(here + 1) == Some(Token::Name)
            && matches!(self.token(here + 2), Some(Token::In | Token::Equals));
        of_pattern.then(|| {
            let names = self.spans(here - 1, here + 1);
            self.error(names, "several names must be in parentheses")
                .suggest("put them in parentheses", [Edit::before(names, "("), Edit::after(names, ")")])
        })
    }

    /// `0..10..2`.
    pub(super) fn step_of_range(&self) -> Option<Diagnostic> {
        (self.expected.operator() || self.before(2) == Some(Token::DotDot)).then(|| {
            self.error(self.span(self.here()), "a range has no step")
                .hint("count the steps and multiply: 'for i in 0..5 { ... 2 * i ... }', or use steps(from, to, count)")
        })
    }

    /// `+3`.
    pub(super) fn leading_plus(&self) -> Option<Diagnostic> {
        let span = self.span(self.here());
        let begins =
            matches!(self.before(1), Some(Token::Equals | Token::ParenOpen | Token::Comma | Token::BracketOpen));
        (self.expected.value() && begins)
            .then(|| self.error(span, "a number is written without a '+'").suggest("remove it", [Edit::remove(span)]))
    }
}
