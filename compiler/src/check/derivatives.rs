//! `c'` and `s'u`: functions that are derivatives of functions.

use super::context::{Callee, Checker, error};
use super::typed::{Call, Expr, ExprKind, LocalId, Type};
use super::types::ClosureId;
use crate::diagnostic::{Code, Diagnostic, Edit, Suggestion};
use crate::source::Span;
use crate::syntax::ast::{self, Ident};

impl<'a> Checker<'a> {
    pub(super) fn prime(&mut self, f: &'a ast::Expr, argument: Option<&'a Ident>, span: Span) -> Expr {
        let f = self.expr(f);
        let id = match f.ty {
            Type::Closure(id) => id,
            Type::Error => return error(span),
            _ => {
                let message = format!("only functions have derivatives, but this is {}", self.describe(&f.ty));
                let diagnostic = Diagnostic::new(Code::NoDerivative, f.span, message);
                return self
                    .fail(diagnostic.hint("make it a function of the variable to differentiate by: (|t| ...)'"));
            }
        };
        match self.argument_index(id, argument, span) {
            Some(wrt) => {
                let mark = argument.map_or_else(|| "'".to_owned(), |a| format!("'{}", a.text));
                let name = format!("{}{mark}", self.closure(id).name);
                let derivative = self.intern(&name, Callee::Derivative(id, wrt), vec![("f", Type::Closure(id))]);
                Expr { kind: ExprKind::Aggregate(vec![f]), ty: Type::Closure(derivative), span }
            }
            None => error(span),
        }
    }

    /// The argument that a derivative is taken by. `u` and `v` also name the first and second argument of any function
    /// of two.
    fn argument_index(&mut self, id: ClosureId, argument: Option<&Ident>, span: Span) -> Option<usize> {
        let params = self.parameters(id);
        let name = self.called(id);
        let Some(argument) = argument else {
            if self.arity(id) == 1 || params.len() == 1 {
                return Some(0);
            }
            let message = format!("{name} has {} arguments: name the one to differentiate by", params.len());
            let diagnostic = Diagnostic::new(Code::NoDerivative, span, message);
            let first = params.first().map(|p| Suggestion {
                message: format!("name it after the prime, as in f'{}", p.name),
                edits: vec![Edit::after(span, p.name)],
            });
            self.report(diagnostic.suggestion(first));
            return None;
        };
        let position =
            params.iter().position(|p| p.name == argument.text).or(match (argument.text.as_str(), params.len()) {
                ("u", 2) => Some(0),
                ("v", 2) => Some(1),
                _ => None,
            });
        if position.is_none() {
            let names: Vec<&str> = params.iter().map(|p| p.name).collect();
            let message = format!("{name} has no argument '{}' to differentiate by", argument.text);
            let diagnostic = Diagnostic::new(Code::UnknownLabel, argument.span, message);
            self.report(diagnostic.hint(format!("its arguments are {}", names.join(", "))));
        }
        position
    }

    /// Parameters and body of a derivative's instance: the derivative of a call with the same arguments.
    pub(super) fn derivative_body(
        &mut self,
        of: ClosureId,
        wrt: usize,
        f: LocalId,
        args: &[Option<Type>],
        span: Span,
    ) -> Option<(Vec<LocalId>, Expr)> {
        let Some(Some(Type::Real(by))) = args.get(wrt) else {
            let kind = match args.get(wrt) {
                Some(Some(ty)) => self.describe(ty),
                _ => "left to its default".to_owned(),
            };
            let message = format!("a function is differentiated by a number, but this argument is {kind}");
            self.report(Diagnostic::new(Code::NoDerivative, span, message));
            return None;
        };
        let by = *by;
        let (function, ty) = self.instantiate_real(of, args, span)?;
        let Some(ty) = ty.map_dimensions(&|d| d.over(by)) else {
            self.report(super::convert::exponent_error(span));
            return None;
        };
        let params: Vec<LocalId> = args.iter().flatten().map(|t| self.local("", t.clone(), span)).collect();
        let values: Vec<Expr> = params.iter().map(|l| self.read(*l, span)).collect();
        let closure = (!self.closure(of).captures.is_empty()).then(|| Box::new(self.read(f, span)));
        let before = args[..wrt].iter().flatten().count();
        let call = Call { function, closure, args: values };
        Some((params, Expr { kind: ExprKind::Derivative { call, wrt: before }, ty, span }))
    }
}
