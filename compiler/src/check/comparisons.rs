//! Truth values: `and`, `or`, `not` and comparisons.

use super::context::{Checker, boolean, error};
use super::operators::{is_number, unary};
use super::typed::{Compare, Expr, ExprKind, Type, Unary};
use crate::diagnostic::{Code, Diagnostic};
use crate::source::Span;
use crate::syntax::ast::{self, BinaryOp};

impl<'a> Checker<'a> {
    /// `and`, `or`: the second side is not looked at where the first, known now, decides.
    pub(super) fn logic(&mut self, op: BinaryOp, a: Expr, b: &'a ast::Expr, span: Span) -> Expr {
        let decides = op == BinaryOp::Or;
        match a.ty {
            Type::Bool(Some(x)) if x == decides => return boolean(decides, span),
            Type::Bool(_) => {}
            _ => self.condition_error(&a),
        }
        let b = self.expr(b);
        match (&a.ty, &b.ty) {
            (Type::Bool(Some(_)), Type::Bool(_)) => b,
            (Type::Bool(None), Type::Bool(y)) => {
                if *y == Some(decides) {
                    return boolean(decides, span);
                }
                let constant = Expr { kind: ExprKind::Bool(decides), ty: Type::BOOL, span };
                let (then, otherwise) = if decides { (constant, b) } else { (b, constant) };
                let kind = ExprKind::If(Box::new(a), Box::new(then), Box::new(otherwise));
                Expr { kind, ty: Type::BOOL, span }
            }
            (Type::Bool(_), _) => {
                self.condition_error(&b);
                error(span)
            }
            _ => error(span),
        }
    }

    pub(super) fn not(&mut self, e: Expr, span: Span) -> Expr {
        match e.ty {
            Type::Bool(Some(b)) => boolean(!b, span),
            Type::Bool(None) => unary(Unary::Not, e, Type::BOOL, span),
            _ => {
                self.condition_error(&e);
                error(span)
            }
        }
    }

    /// A comparison of two numbers, or of two truth values for equality.
    pub(super) fn compare(&mut self, op: Compare, a: Expr, b: Expr, span: Span) -> Expr {
        if let (Type::Bool(x), Type::Bool(y)) = (&a.ty, &b.ty)
            && matches!(op, Compare::Eq | Compare::Ne)
        {
            let equal = op == Compare::Eq;
            return match (*x, *y) {
                (Some(x), Some(y)) => boolean((x == y) == equal, span),
                (Some(x), None) => {
                    if x == equal {
                        b
                    } else {
                        self.not(b, span)
                    }
                }
                (None, Some(y)) => {
                    if y == equal {
                        a
                    } else {
                        self.not(a, span)
                    }
                }
                (None, None) => {
                    let opposite = unary(Unary::Not, b.clone(), Type::BOOL, span);
                    let (then, otherwise) = if equal { (b, opposite) } else { (opposite, b) };
                    let kind = ExprKind::If(Box::new(a), Box::new(then), Box::new(otherwise));
                    Expr { kind, ty: Type::BOOL, span }
                }
            };
        }
        if is_number(&a.ty) && is_number(&b.ty) {
            let (Some((a, da)), Some((b, db))) = (self.real(a), self.real(b)) else { return error(span) };
            return match self.common_dimension(BinaryOp::Compare(op), &a, da, &b, db, span) {
                Some(_) => comparison(op, a, b, span),
                None => error(span),
            };
        }
        let message = format!("{} cannot be compared with {}", self.describe(&a.ty), self.describe(&b.ty));
        let diagnostic = Diagnostic::new(Code::TypeMismatch, span, message);
        self.fail(diagnostic.hint("compare numbers; for vectors, their lengths norm(v) or their components v.x"))
    }
}

/// `a op b`, which is known only at run time, of two reals or two ints.
pub(super) fn comparison(op: Compare, a: Expr, b: Expr, span: Span) -> Expr {
    Expr { kind: ExprKind::Compare(op, Box::new(a), Box::new(b)), ty: Type::BOOL, span }
}
