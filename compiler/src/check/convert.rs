//! Widening, and the type that two values have in common.

use super::annotations::Expected;
use super::context::Checker;
use super::typed::{Binary, Expr, ExprKind, Type, Unary};
use super::types::{Dimension, Exponent};
use crate::diagnostic::{Code, Diagnostic, Edit, Suggestion};
use crate::source::Span;

impl<'a> Checker<'a> {
    /// The value in another type of the same shape: ints become reals where `to` has a real. The caller makes sure that
    /// the dimensions allow it.
    pub(super) fn convert(&mut self, mut expr: Expr, to: &Type) -> Expr {
        if expr.ty == *to {
            return expr;
        }
        match (&mut expr.kind, to) {
            (ExprKind::Int(k), Type::Real(_)) => expr.kind = ExprKind::Real(*k as f64),
            (ExprKind::Aggregate(items), Type::Tuple(types)) if items.len() == types.len() => {
                let parts = std::mem::take(items).into_iter().zip(&**types).map(|(e, t)| self.convert(e, t));
                expr.kind = ExprKind::Aggregate(parts.collect());
            }
            (ExprKind::Aggregate(items), Type::Array(ty, _)) => {
                let parts = std::mem::take(items).into_iter().map(|e| self.convert(e, ty));
                expr.kind = ExprKind::Aggregate(parts.collect());
            }
            _ if self.same_representation(&expr.ty, to) => {}
            _ => {
                let span = expr.span;
                expr = Expr { kind: ExprKind::Convert(Box::new(expr)), ty: to.clone(), span };
            }
        }
        expr.ty = to.clone();
        expr
    }

    /// Whether two types of the same shape have ints at the same places.
    fn same_representation(&self, a: &Type, b: &Type) -> bool {
        match (a, b) {
            (Type::Int(_), Type::Real(_)) | (Type::Real(_), Type::Int(_)) => false,
            (Type::Tuple(a), Type::Tuple(b)) => a.iter().zip(&**b).all(|(a, b)| self.same_representation(a, b)),
            (Type::Array(a, n), Type::Array(b, _)) => *n == 0 || self.same_representation(a, b),
            (Type::Record(a), Type::Record(b)) => {
                a.iter().zip(&**b).all(|((_, a), (_, b))| self.same_representation(a, b))
            }
            (Type::Closure(a), Type::Closure(b)) => {
                let (a, b) = (&self.closure(*a).captures, &self.closure(*b).captures);
                a.iter().zip(b).all(|((_, a), (_, b))| self.same_representation(a, b))
            }
            _ => true,
        }
    }

    /// The type that both can be converted to: the value of either side of an `if`, of any element of an array.
    pub(super) fn join(&mut self, a: &Type, b: &Type) -> Option<Type> {
        Some(match (a, b) {
            _ if a == b => a.clone(),
            (Type::Error, other) | (other, Type::Error) => other.clone(),
            (Type::Int(_), Type::Int(_)) => Type::INT,
            (Type::Bool(_), Type::Bool(_)) => Type::BOOL,
            (Type::Range(..), Type::Range(..)) => Type::Range(None, None),
            (Type::Text(_), Type::Text(_)) => Type::Text(None),
            (Type::Int(_), Type::Real(d)) | (Type::Real(d), Type::Int(_)) => {
                (d.is_none() || d.angle).then_some(Type::REAL)?
            }
            (Type::Real(a), Type::Real(b)) => {
                ((a.is_none() && b.angle) || (a.angle && b.is_none())).then_some(Type::REAL)?
            }
            (Type::Tuple(a), Type::Tuple(b)) if a.len() == b.len() => {
                Type::tuple(a.iter().zip(&**b).map(|(a, b)| self.join(a, b)).collect::<Option<_>>()?)
            }
            (Type::Array(a, n), Type::Array(b, m)) if n == m => Type::Array(self.join(a, b)?.into(), *n),
            (Type::Record(a), Type::Record(b)) if a.len() == b.len() => {
                let fields: Option<Vec<_>> = a
                    .iter()
                    .zip(&**b)
                    .map(|((name, a), (other, b))| {
                        (name == other).then(|| Some((name.clone(), self.join(a, b)?))).flatten()
                    })
                    .collect();
                Type::Record(fields?.into())
            }
            (Type::Closure(a), Type::Closure(b)) => {
                // The same callee with captures that differ in what is known of them.
                let (first, second) = (self.closure(*a), self.closure(*b));
                let (name, callee) = (first.name.clone(), first.callee);
                if callee.origin() != second.callee.origin() || first.captures.len() != second.captures.len() {
                    return None;
                }
                let pairs: Vec<(&'a str, Type, Type)> = first
                    .captures
                    .iter()
                    .zip(&second.captures)
                    .map(|((n, a), (_, b))| (*n, a.clone(), b.clone()))
                    .collect();
                let captures: Option<Vec<(&'a str, Type)>> =
                    pairs.iter().map(|(n, a, b)| Some((*n, self.join(a, b)?))).collect();
                Type::Closure(self.intern(&name, callee, captures?))
            }
            _ => return None,
        })
    }

    /// The value as a bare or dimensioned real where it is a number; its dimension.
    pub(super) fn real(&mut self, expr: Expr) -> Option<(Expr, Dimension)> {
        match expr.ty {
            Type::Int(_) => Some((self.convert(expr, &Type::REAL), Dimension::NONE)),
            Type::Real(d) => Some((expr, d)),
            _ => None,
        }
    }

    /// The suggestion for a bare number in the place of a length or angle: the number with a unit.
    pub(super) fn unit_hint(&self, expr: &Expr, expected: &Expected) -> Option<Suggestion> {
        let Expected::Real(want) = expected else { return None };
        match expr.ty {
            Type::Int(_) | Type::Real(Dimension::NONE) => self.unit_advice(expr, *want),
            Type::Real(have) if want.is_none() && have == Dimension::LENGTH => Some(Suggestion {
                message: "divide it by a length, such as 1mm, to get a bare number".to_owned(),
                edits: followed_by(expr, " / 1mm"),
            }),
            _ => None,
        }
    }

    /// `did you mean 3mm?`, or how to give a number the dimension.
    pub(super) fn unit_advice(&self, expr: &Expr, want: Dimension) -> Option<Suggestion> {
        if matches!(expr.ty, Type::Bool(_)) {
            return None;
        }
        let (unit, one, factor) = match want {
            Dimension::LENGTH => ("mm", "by 1mm to give it a unit", " * 1mm"),
            Dimension::ANGLE => ("deg", "by 1deg or 1rad to give it a unit", " * 1deg"),
            _ => return None,
        };
        let digits = inner_span(expr);
        Some(match literal(expr).filter(|_| self.bare_literals.contains(&digits)) {
            Some(number) => {
                Suggestion { message: format!("did you mean {number}{unit}?"), edits: vec![Edit::after(digits, unit)] }
            }
            None => Suggestion { message: format!("multiply {one}"), edits: followed_by(expr, factor) },
        })
    }
}

/// Edits that put a factor or divisor after an expression, in parentheses where it may hold a looser operator.
pub(super) fn followed_by(expr: &Expr, text: &str) -> Vec<Edit> {
    fn is_tight(expr: &Expr) -> bool {
        match &expr.kind {
            ExprKind::Local(_) | ExprKind::Call(_) | ExprKind::Int(_) | ExprKind::Real(_) => true,
            ExprKind::Element(..) | ExprKind::Index(..) => true,
            ExprKind::Binary(Binary::Mul | Binary::Div, ..) => true,
            ExprKind::Convert(e) => is_tight(e),
            _ => false,
        }
    }
    if is_tight(expr) {
        return vec![Edit::after(expr.span, text)];
    }
    vec![Edit::before(expr.span, "("), Edit::after(expr.span, format!("){text}"))]
}

/// The number of a literal.
fn literal(expr: &Expr) -> Option<f64> {
    match &expr.kind {
        ExprKind::Int(k) => Some(*k as f64),
        ExprKind::Real(x) => Some(*x),
        ExprKind::Unary(Unary::Neg, e) | ExprKind::Convert(e) => {
            let sign = if matches!(expr.kind, ExprKind::Convert(_)) { 1.0 } else { -1.0 };
            literal(e).map(|x| sign * x)
        }
        _ => None,
    }
}

/// The place of a literal's digits.
fn inner_span(expr: &Expr) -> Span {
    match &expr.kind {
        ExprKind::Unary(Unary::Neg, e) | ExprKind::Convert(e) => inner_span(e),
        _ => expr.span,
    }
}

/// Whether it is a number written out, without a unit.
pub(super) fn is_bare_literal(expr: &Expr) -> bool {
    matches!(expr.ty, Type::Int(_) | Type::Real(Dimension::NONE)) && literal(expr).is_some()
}

/// The dimension of sqrt.
pub(super) fn square_root(d: Dimension) -> Option<Dimension> {
    d.power(Exponent::new(1, 2)?)
}

/// An error for an exponent of length that gets out of hand.
pub(super) fn exponent_error(span: Span) -> Diagnostic {
    Diagnostic::new(Code::ExponentRange, span, "the exponent of length is too large here")
}
