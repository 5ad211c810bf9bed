//! Tolerances of measures: limits with signs, of which the grammar reads most as sums and quotients.

use super::ast::{BinaryOp, Expr, ExprKind, UnaryOp, Unit};
use super::builder::Builder;
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::Span;

/// The tolerance of a measure, about its nominal value.
#[derive(Clone, Debug, PartialEq)]
pub enum Tolerance {
    /// `0.2mm`: as much below as above.
    Symmetric(Expr),
    /// `+0.2/-0.1mm`, as they are written.
    Limits([Limit; 2]),
    /// Could not be parsed; a diagnostic says why.
    Error,
}

impl Tolerance {
    /// Its values.
    pub(crate) fn values(&self) -> impl Iterator<Item = &Expr> {
        let (one, two) = match self {
            Tolerance::Symmetric(value) => (Some(value), None),
            Tolerance::Limits(limits) => (None, Some(limits)),
            Tolerance::Error => (None, None),
        };
        one.into_iter().chain(two.into_iter().flatten().map(|limit| &limit.value))
    }
}

/// A limit of a tolerance.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// Its sign; none of a zero.
    pub sign: Option<Sign>,
    /// What follows the sign.
    pub value: Expr,
}

/// The sign of a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// `+`
    Plus,
    /// `-`
    Minus,
}

impl Builder<'_> {
    /// What reads as a sum: `0.2mm`, or the limits `-0.1/0mm`, `0/-0.1mm`, `-0.1/-0.2mm`.
    pub(in crate::syntax) fn tolerance(&mut self, sum: Expr) -> Tolerance {
        let limits = |second: &Expr| self.has_minus(second) || is_zero(second);
        match quotient(sum, &limits) {
            Ok([first, second]) => {
                let (first, second) = (self.limit(first), self.limit(second));
                self.limits(first, second)
            }
            Err(sum) => Tolerance::Symmetric(sum),
        }
    }

    /// `a/+b`.
    pub(in crate::syntax) fn limits_to(&mut self, first: Expr, second: Expr) -> Tolerance {
        let first = self.limit(first);
        self.limits(first, Limit { sign: Some(Sign::Plus), value: second })
    }

    /// `+a/-b`, where the plus stands at `l`, and what follows it reads as a quotient.
    pub(in crate::syntax) fn limits_from(&mut self, l: u32, product: Expr) -> Tolerance {
        match quotient(product, &|_| true) {
            Ok([first, second]) => {
                let second = self.limit(second);
                self.limits(Limit { sign: Some(Sign::Plus), value: first }, second)
            }
            Err(product) => {
                let plus = Span { start: l, end: l + 1, ..product.span };
                let error =
                    Diagnostic::new(Code::Tolerance, plus.to(product.span), "a limit with a sign needs another");
                let hint = "write both, as in '+0.2/-0.1mm', or one without a sign for as much below as above";
                self.diagnostics.push(error.suggest(hint, [Edit::remove(plus)]));
                Tolerance::Error
            }
        }
    }

    /// `+a/+b`.
    pub(in crate::syntax) fn limits_up(&mut self, first: Expr, second: Expr) -> Tolerance {
        let plus = |value| Limit { sign: Some(Sign::Plus), value };
        self.limits(plus(first), plus(second))
    }

    /// A limit that reads as an expression: with a minus, or without a sign.
    fn limit(&self, expr: Expr) -> Limit {
        if !self.has_minus(&expr) {
            return Limit { sign: None, value: expr };
        }
        match expr.kind {
            ExprKind::Unary(UnaryOp::Neg, value) => Limit { sign: Some(Sign::Minus), value: *value },
            kind => Limit { sign: None, value: Expr { kind, ..expr } },
        }
    }

    /// Both limits: a number without a unit has that of the other one, and only a zero has no sign.
    fn limits(&mut self, mut first: Limit, mut second: Limit) -> Tolerance {
        take_unit(&mut first.value, &second.value);
        take_unit(&mut second.value, &first.value);
        for limit in [&first, &second] {
            if limit.sign.is_none() && !is_zero(&limit.value) && !matches!(limit.value.kind, ExprKind::Error) {
                let error = Diagnostic::new(Code::Tolerance, limit.value.span, "the sign of this limit is missing");
                let hint = "write '+' or '-' before each limit, as in '+0.2/-0.1mm'";
                self.diagnostics.push(error.suggest(hint, [Edit::before(limit.value.span, "+")]));
                return Tolerance::Error;
            }
        }
        Tolerance::Limits([first, second])
    }

    fn has_minus(&self, expr: &Expr) -> bool {
        matches!(expr.kind, ExprKind::Unary(UnaryOp::Neg, _))
            && self.slice(expr.span.start, expr.span.end).starts_with('-')
    }
}

/// The sides of a quotient that is not in parentheses, and whose divisor is as it should be; else the expression.
fn quotient(expr: Expr, divisor: &dyn Fn(&Expr) -> bool) -> Result<[Expr; 2], Expr> {
    match expr.kind {
        ExprKind::Binary(BinaryOp::Div, first, second) if first.span.start == expr.span.start && divisor(&second) => {
            Ok([*first, *second])
        }
        kind => Err(Expr { kind, ..expr }),
    }
}

fn is_zero(expr: &Expr) -> bool {
    matches!(expr.kind, ExprKind::Int(0)) || matches!(expr.kind, ExprKind::Real(0.0, _))
}

/// Gives a number without a unit that of another number.
fn take_unit(value: &mut Expr, other: &Expr) {
    let Some(unit) = unit(other) else { return };
    match value.kind {
        ExprKind::Int(number) => value.kind = ExprKind::Real(number as f64, Some(unit)),
        ExprKind::Real(number, None) => value.kind = ExprKind::Real(number, Some(unit)),
        _ => {}
    }
}

fn unit(expr: &Expr) -> Option<Unit> {
    match &expr.kind {
        ExprKind::Real(_, unit) => *unit,
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use crate::diagnostic::Code;
    use crate::source::FileId;
    use crate::syntax::{parse, print};

    /// The tree of a measure as one line.
    fn tree(text: &str) -> String {
        let (file, diagnostics) = parse(FileId(0), &format!("model m {{\n  measure d {text}\n}}"));
        assert_eq!(diagnostics, [], "in {text}");
        let tree = print(&file);
        tree.lines().skip(2).map(str::trim).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn limits_are_told_from_quotients() {
        for (text, expected) in [
            ("= 2", "2"),
            ("tolerance 0.2mm = 2", "tolerance 0.2mm 2"),
            ("tolerance 0.2mm / 2 = 2", "tolerance / 0.2mm 2 2"),
            ("tolerance fine + 0.1mm = 2", "tolerance + fine 0.1mm 2"),
            ("tolerance (1mm / -2) = 2", "tolerance / 1.0mm negative 2 2"),
            ("tolerance +0.2/-0.1mm = 2", "tolerance + 0.2mm - 0.1mm 2"),
            ("tolerance -0.1/+0.2mm = 2", "tolerance - 0.1mm + 0.2mm 2"),
            ("tolerance + 0.2mm / - 0.1mm = 2", "tolerance + 0.2mm - 0.1mm 2"),
            ("tolerance +2/+1deg = 2", "tolerance + 2.0deg + 1.0deg 2"),
            ("tolerance -1/-2 = 2", "tolerance - 1 - 2 2"),
            ("tolerance 0/-0.1mm = 2", "tolerance zero 0.0mm - 0.1mm 2"),
            ("tolerance +0.1mm/0 = 2", "tolerance + 0.1mm zero 0.0mm 2"),
            ("tolerance -0.1mm/0 = 2", "tolerance - 0.1mm zero 0.0mm 2"),
            ("tolerance 0/+fine = 2", "tolerance zero 0 + fine 2"),
            ("tolerance +fine/-(2 * fine) = 2", "tolerance + fine - * 2 fine 2"),
            ("of bore tolerance 1mm = 2", "of bore tolerance 1.0mm 2"),
            ("of a . b, c[ 2 ].d tolerance +1/-2 = 2", "of a.b of c[2].d tolerance + 1 - 2 2"),
            ("of of, tolerance tolerance 1 = of", "of of of tolerance tolerance 1 of"),
        ] {
            assert_eq!(tree(text), expected, "{text}");
        }
    }

    #[test]
    fn limits_need_their_signs() {
        for text in ["+0.2mm", "0.2/-0.1mm", "+0.2/0.1mm", "0.2/+0.1mm"] {
            let (_, found) = parse(FileId(0), &format!("model m {{\n  measure d tolerance {text} = 2\n}}"));
            assert_eq!(found.iter().map(|d| d.code).collect::<Vec<_>>(), [Code::Tolerance], "{text}");
        }
    }

    #[test]
    fn measure_is_a_name_elsewhere() {
        let text = "use std.measure\nlet measure = 3\nfn f(c) = measure.arc_length(c)\nfn g() = {\n  let a = 1\n  measure\n}\n";
        assert_eq!(parse(FileId(0), text).1, []);
        let (file, found) = parse(FileId(0), "model m {\n  /// Doc.\n  measure measure = 1; measure tolerance = 2\n}");
        assert_eq!((found, print(&file).lines().count()), (Vec::new(), 6));
    }
}
