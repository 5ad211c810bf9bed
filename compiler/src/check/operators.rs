//! Operators: which operands they take, and the dimension of what they give.

use super::comparisons::comparison;
use super::constants::{exponent_of, int_binary};
use super::context::{Checker, boolean, error, int, known};
use super::convert::{exponent_error, is_bare_literal};
use super::solids::{Operation, holds_solids, is_solid};
use super::typed::{Binary, Expr, ExprKind, Type, Unary};
use super::types::Dimension;
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::Span;
use crate::syntax::ast::{self, BinaryOp};

impl<'a> Checker<'a> {
    pub(super) fn binary(&mut self, op: BinaryOp, a: &'a ast::Expr, b: &'a ast::Expr, span: Span) -> Expr {
        let first = self.expr(a);
        if matches!(op, BinaryOp::And | BinaryOp::Or) {
            return self.logic(op, first, b, span);
        }
        let second = self.expr(b);
        self.operate(op, first, second, span)
    }

    /// An operator on values.
    pub(super) fn operate(&mut self, op: BinaryOp, a: Expr, b: Expr, span: Span) -> Expr {
        if a.ty.is_error() || b.ty.is_error() || !self.use_fuel(1, span) {
            return error(span);
        }
        if let (Type::Int(x), Type::Int(y)) = (&a.ty, &b.ty) {
            return self.ints(op, (*x, *y), a, b, span);
        }
        if let Some(operation) = Operation::of(op)
            && (operation == Operation::Intersection
                || is_solid(&a.ty)
                || is_solid(&b.ty)
                || [&a, &b].iter().all(|e| matches!(e.ty, Type::Record(_)) && holds_solids(&e.ty)))
        {
            return self.combine(operation, a, b, span);
        }
        if let (BinaryOp::Add, Type::Text(first), Type::Text(second)) = (op, &a.ty, &b.ty) {
            return self.joined_texts(first.as_deref(), second.as_deref(), span);
        }
        match op {
            BinaryOp::Add | BinaryOp::Sub => self.sum(op, a, b, span),
            BinaryOp::Mul => self.product(a, b, span),
            BinaryOp::Div => self.quotient(a, b, span),
            BinaryOp::Rem => self.remainder(a, b, span),
            BinaryOp::Pow => self.power(a, b, span),
            BinaryOp::Compare(op) => self.compare(op, a, b, span),
            BinaryOp::And | BinaryOp::Or | BinaryOp::Common => error(span),
        }
    }

    /// Two texts, one after the other.
    fn joined_texts(&mut self, first: Option<&str>, second: Option<&str>, span: Span) -> Expr {
        let joined = first.zip(second).map(|(first, second)| format!("{first}{second}"));
        if !self.use_fuel(joined.as_ref().map_or(0, String::len), span) {
            return error(span);
        }
        let ty = Type::Text(joined.as_deref().map(Into::into));
        Expr { kind: ExprKind::Text(joined.unwrap_or_default()), ty, span }
    }

    pub(super) fn negate(&mut self, e: Expr, span: Span) -> Expr {
        match &e.ty {
            Type::Error => error(span),
            Type::Int(Some(k)) => match k.checked_neg() {
                Some(k) => int(k, span),
                None => self.overflow(span),
            },
            Type::Int(None) => unary(Unary::Neg, e, Type::INT, span),
            ty => match ty.all_real() {
                Some(real) if !matches!(ty, Type::Array(..) | Type::Record(_)) => {
                    let e = self.convert(e, &real);
                    unary(Unary::Neg, e, real, span)
                }
                _ => self.no_number(&e, "a minus sign"),
            },
        }
    }

    fn ints(&mut self, op: BinaryOp, values: (Option<i64>, Option<i64>), a: Expr, b: Expr, span: Span) -> Expr {
        if let (Some(x), Some(y)) = values {
            match int_binary(op, x, y) {
                Ok(Some(Type::Int(Some(k)))) => return int(k, span),
                Ok(Some(Type::Bool(Some(k)))) => return boolean(k, span),
                Ok(_) => {}
                Err(reason) => {
                    return self.fail(Diagnostic::new(Code::IntArithmetic, span, reason));
                }
            }
        }
        let op = match op {
            BinaryOp::Add => Binary::Add,
            BinaryOp::Sub => Binary::Sub,
            BinaryOp::Mul => Binary::Mul,
            BinaryOp::Rem => Binary::Rem,
            BinaryOp::Div => {
                let (a, b) = (self.convert(a, &Type::REAL), self.convert(b, &Type::REAL));
                return binary(Binary::Div, a, b, Type::REAL, span);
            }
            BinaryOp::Pow => return self.power(a, b, span),
            BinaryOp::Compare(op) => return comparison(op, a, b, span),
            BinaryOp::Common => return self.combine(Operation::Intersection, a, b, span),
            BinaryOp::And | BinaryOp::Or => return error(span),
        };
        binary(op, a, b, Type::INT, span)
    }

    pub(super) fn overflow(&mut self, span: Span) -> Expr {
        self.fail(Diagnostic::new(Code::IntArithmetic, span, "this whole number is too large"))
    }

    fn no_number(&mut self, e: &Expr, what: &str) -> Expr {
        let message = format!("{what} needs a number, but this is {}", self.describe(&e.ty));
        self.fail(Diagnostic::new(Code::TypeMismatch, e.span, message))
    }

    fn sum(&mut self, op: BinaryOp, a: Expr, b: Expr, span: Span) -> Expr {
        let kind = if op == BinaryOp::Add { Binary::Add } else { Binary::Sub };
        if is_number(&a.ty) && is_number(&b.ty) {
            let (Some((a, da)), Some((b, db))) = (self.real(a), self.real(b)) else { return error(span) };
            return match self.common_dimension(op, &a, da, &b, db, span) {
                Some(d) => binary(kind, a, b, Type::Real(d), span),
                None => error(span),
            };
        }
        match self.sum_type(&a.ty, &b.ty) {
            Some(ty) => {
                let (ra, rb) = (a.ty.all_real(), b.ty.all_real());
                let (Some(ra), Some(rb)) = (ra, rb) else { return error(span) };
                let (a, b) = (self.convert(a, &ra), self.convert(b, &rb));
                binary(kind, a, b, ty, span)
            }
            None => {
                let error = self.sum_error(op, &a, &b, span);
                self.fail(error)
            }
        }
    }

    /// The type of the sum of two numbers or, component by component, of two tuples.
    fn sum_type(&self, a: &Type, b: &Type) -> Option<Type> {
        let dimension = |ty: &Type| match ty {
            Type::Int(_) => Some(Dimension::NONE),
            Type::Real(d) => Some(*d),
            _ => None,
        };
        if let (Type::Tuple(x), Type::Tuple(y)) = (a, b) {
            if x.len() != y.len() {
                return None;
            }
            return Some(Type::tuple(x.iter().zip(&**y).map(|(x, y)| self.sum_type(x, y)).collect::<Option<_>>()?));
        }
        common(dimension(a)?, dimension(b)?).map(Type::Real)
    }

    /// The dimension of both operands of `+`, `-`, `%` and comparisons, or an error.
    pub(super) fn common_dimension(
        &mut self,
        op: BinaryOp,
        a: &Expr,
        da: Dimension,
        b: &Expr,
        db: Dimension,
        span: Span,
    ) -> Option<Dimension> {
        // 30 beside an angle is most likely meant as 30deg, and would be taken for radians.
        let ambiguous = da.angle != db.angle && (is_bare_literal(a) || is_bare_literal(b)) && !zero(a) && !zero(b);
        match common(da, db) {
            Some(d) if !ambiguous => Some(d),
            _ => {
                let error = self.sum_error(op, a, b, span);
                self.report(error);
                None
            }
        }
    }

    fn sum_error(&self, op: BinaryOp, a: &Expr, b: &Expr, span: Span) -> Diagnostic {
        let (first, second) = (self.describe(&a.ty), self.describe(&b.ty));
        let message = match op {
            BinaryOp::Add => format!("{second} cannot be added to {first}"),
            BinaryOp::Sub => format!("{second} cannot be subtracted from {first}"),
            BinaryOp::Rem => format!("the remainder of {first} by {second} is not defined"),
            _ => format!("{first} cannot be compared with {second}"),
        };
        let numbers = |ty: &Type| matches!(ty, Type::Int(_) | Type::Real(_) | Type::Tuple(_));
        let code = if numbers(&a.ty) && numbers(&b.ty) { Code::DimensionMismatch } else { Code::TypeMismatch };
        let diagnostic = Diagnostic::new(code, span, message)
            .related(a.span, format!("this is {first}"))
            .related(b.span, format!("this is {second}"));
        let bare = |e: &Expr| matches!(e.ty, Type::Int(_) | Type::Real(Dimension::NONE));
        let advice = match (&a.ty, &b.ty) {
            (Type::Real(d), _) if bare(b) => self.unit_advice(b, *d),
            (_, Type::Real(d)) if bare(a) => self.unit_advice(a, *d),
            (Type::Tuple(x), Type::Tuple(y)) if x.len() != y.len() => {
                return diagnostic.hint(format!("one has {} components, the other {}", x.len(), y.len()));
            }
            (Type::Array(..), Type::Tuple(_)) | (Type::Tuple(_), Type::Array(..)) => {
                return diagnostic.hint("a point or vector is written in parentheses: (x, y, z)");
            }
            (Type::Closure(f), Type::Closure(g)) => {
                return diagnostic.hint(if self.arity(*f) == 2 && self.arity(*g) == 2 {
                    "surfaces cannot be combined: make each a part of its own, or make solids of them: solid(faces, inside)"
                } else {
                    "add what they give: |t| a(t) + b(t)"
                });
            }
            (Type::Array(..), _) | (_, Type::Array(..)) => {
                return diagnostic.hint("for arrays, write a comprehension: for i in 0..len(a) { a[i] + b[i] }");
            }
            (Type::Tuple(x), Type::Tuple(y)) => {
                return match tuple_advice(x, y) {
                    Some(hint) => diagnostic.hint(hint),
                    None => diagnostic,
                };
            }
            _ => None,
        };
        diagnostic.suggestion(advice)
    }

    fn product(&mut self, a: Expr, b: Expr, span: Span) -> Expr {
        match (matches!(a.ty, Type::Tuple(_)), matches!(b.ty, Type::Tuple(_))) {
            (true, true) => {
                let message = format!("{} and {} cannot be multiplied", self.describe(&a.ty), self.describe(&b.ty));
                let error = Diagnostic::new(Code::TypeMismatch, span, message);
                self.fail(error.hint("for vectors there are dot(a, b) and cross(a, b)"))
            }
            (false, true) => self.scale(b, a, true, false, span),
            (true, false) => self.scale(a, b, false, false, span),
            (false, false) => {
                let (Some((a, da)), Some((b, db))) = (self.number(a, "a product"), self.number(b, "a product")) else {
                    return error(span);
                };
                match da.times(db) {
                    Some(d) => binary(Binary::Mul, a, b, Type::Real(d), span),
                    None => self.fail(exponent_error(span)),
                }
            }
        }
    }

    fn quotient(&mut self, a: Expr, b: Expr, span: Span) -> Expr {
        if matches!(b.ty, Type::Tuple(_)) {
            let message = format!("nothing can be divided by {}", self.describe(&b.ty));
            return self.fail(Diagnostic::new(Code::TypeMismatch, b.span, message));
        }
        if matches!(a.ty, Type::Tuple(_)) {
            return self.scale(a, b, false, true, span);
        }
        let (Some((a, da)), Some((b, db))) = (self.number(a, "a quotient"), self.number(b, "a quotient")) else {
            return error(span);
        };
        match da.over(db) {
            Some(d) => binary(Binary::Div, a, b, Type::Real(d), span),
            None => self.fail(exponent_error(span)),
        }
    }

    /// A tuple times or over a number.
    fn scale(&mut self, tuple: Expr, factor: Expr, factor_first: bool, divide: bool, span: Span) -> Expr {
        let Some((factor, dimension)) = self.number(factor, "a vector's factor") else { return error(span) };
        let Some(real) = tuple.ty.all_real() else { return self.no_number(&tuple, "a product") };
        let combine = |d: Dimension| if divide { d.over(dimension) } else { d.times(dimension) };
        let Some(ty) = real.map_dimensions(&combine) else { return self.fail(exponent_error(span)) };
        let tuple = self.convert(tuple, &real);
        match (divide, factor_first) {
            (true, _) => binary(Binary::Div, tuple, factor, ty, span),
            (false, true) => binary(Binary::Mul, factor, tuple, ty, span),
            (false, false) => binary(Binary::Mul, tuple, factor, ty, span),
        }
    }

    /// The value as a real, or an error.
    pub(super) fn number(&mut self, e: Expr, what: &str) -> Option<(Expr, Dimension)> {
        if e.ty.is_error() {
            return None;
        }
        if !is_number(&e.ty) {
            self.no_number(&e, what);
            return None;
        }
        self.real(e)
    }

    fn remainder(&mut self, a: Expr, b: Expr, span: Span) -> Expr {
        let (Some((a, da)), Some((b, db))) = (self.number(a, "a remainder"), self.number(b, "a remainder")) else {
            return error(span);
        };
        match self.common_dimension(BinaryOp::Rem, &a, da, &b, db, span) {
            Some(d) => binary(Binary::Rem, a, b, Type::Real(d), span),
            None => error(span),
        }
    }

    fn power(&mut self, a: Expr, b: Expr, span: Span) -> Expr {
        let Some((a, da)) = self.number(a, "a power") else { return error(span) };
        if let Type::Int(Some(k)) = b.ty
            && i32::try_from(k).is_ok()
        {
            return match super::types::Exponent::new(k, 1).and_then(|e| da.power(e)) {
                Some(d) => binary(Binary::Pow, a, b, Type::Real(d), span),
                None if da.is_none() || da.angle => binary(Binary::Pow, a, b, Type::REAL, span),
                None => self.fail(exponent_error(b.span)),
            };
        }
        // A whole exponent stays one: as a real, a large one would lose its last digit, and a power its sign.
        if matches!(b.ty, Type::Int(_)) && (da.is_none() || da.angle) {
            return binary(Binary::Pow, a, b, Type::REAL, span);
        }
        let constant = exponent_of(&b);
        let Some((b, db)) = self.number(b, "an exponent") else { return error(span) };
        if !db.is_none() && !db.angle {
            let message = format!("an exponent must be a bare number, but this is {db}");
            let diagnostic = Diagnostic::new(Code::DimensionMismatch, b.span, message);
            return self.fail(if db == Dimension::LENGTH {
                diagnostic.suggest(
                    "divide it by a length, such as 1mm",
                    vec![Edit::before(b.span, "("), Edit::after(b.span, " / 1mm)")],
                )
            } else {
                diagnostic
            });
        }
        let d = if da.is_none() || da.angle {
            Dimension::NONE
        } else {
            let Some(exponent) = constant else {
                let message = format!("the exponent of {da} must be a constant, or the dimension would not be known");
                let diagnostic =
                    Diagnostic::new(Code::VariableExponent, b.span, message).related(a.span, da.to_string());
                return self.fail(diagnostic.hint("divide the base by a length first, such as (r / 1mm) ^ n"));
            };
            match da.power(exponent) {
                Some(d) => d,
                None => return self.fail(exponent_error(b.span)),
            }
        };
        binary(Binary::Pow, a, b, Type::Real(d), span)
    }
}

/// The dimension that both have, an angle widening to a bare number.
pub(super) fn common(a: Dimension, b: Dimension) -> Option<Dimension> {
    if a == b {
        return Some(a);
    }
    ((a.angle && b.is_none()) || (a.is_none() && b.angle)).then_some(Dimension::NONE)
}

/// Whether it is a single number.
pub(super) fn is_number(ty: &Type) -> bool {
    matches!(ty, Type::Int(_) | Type::Real(_))
}

fn zero(e: &Expr) -> bool {
    match e.kind {
        ExprKind::Int(k) => k == 0,
        ExprKind::Real(x) => x == 0.0,
        _ => false,
    }
}

fn tuple_advice(a: &[Type], b: &[Type]) -> Option<String> {
    let has = |ts: &[Type], d| ts.iter().any(|t| matches!(t, Type::Real(x) if *x == d));
    let bare = |ts: &[Type]| ts.iter().any(|t| matches!(t, Type::Int(_) | Type::Real(Dimension::NONE)));
    let mixed = |x: &[Type]| has(x, Dimension::LENGTH) && bare(x);
    if mixed(a) || mixed(b) {
        return Some("every coordinate of a point is a length: write 0mm for 0".to_owned());
    }
    ((has(a, Dimension::LENGTH) && bare(b)) || (bare(a) && has(b, Dimension::LENGTH)))
        .then(|| "multiply the bare vector by a length, such as 1mm".to_owned())
}

pub(super) fn binary(op: Binary, a: Expr, b: Expr, ty: Type, span: Span) -> Expr {
    known(Expr { kind: ExprKind::Binary(op, Box::new(a), Box::new(b)), ty, span })
}

pub(super) fn unary(op: Unary, e: Expr, ty: Type, span: Span) -> Expr {
    known(Expr { kind: ExprKind::Unary(op, Box::new(e)), ty, span })
}
