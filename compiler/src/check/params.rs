//! Parameters of models: free ones, and those that another model sets.

use super::annotations::Wanted;
use super::context::{Binding, Checker};
use super::model::Body;
use super::typed::{Binary, LocalId, Param, Statement, Type};
use super::types::Dimension;
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::parameters::Quantity;
use crate::source::Span;
use crate::syntax::ast::{self, Item, ParamDecl};

impl<'a> Checker<'a> {
    /// Declares a free parameter.
    pub(super) fn param(&mut self, decl: &'a ParamDecl, item: &'a Item, body: &mut Body<'a>) {
        let Some(quantity) = self.quantity_of_param(decl, item) else {
            let unknown = self.local(&decl.name.text, Type::Error, decl.name.span);
            return self.declare(decl, unknown, body);
        };
        let wanted = Wanted::Real(dimension(quantity));
        let bound = |checker: &mut Self, e: &'a ast::Expr, what: &str| {
            let e = checker.expr(e);
            Some(checker.fit(e, &wanted, what))
        };
        let (lower, upper) = match &decl.bounds {
            Some((a, b)) => (bound(self, a, "the lower bound"), bound(self, b, "the upper bound")),
            None => (None, None),
        };
        let default = match &decl.default {
            Some(e) => bound(self, e, "the default"),
            None => {
                let message = format!("the parameter '{}' has no default", decl.name.text);
                let hint = format!("add one, such as '= {}'", example(quantity));
                let error = Diagnostic::new(Code::NoDefault, decl.name.span, message);
                self.report(if decl.bounds.is_none() {
                    error.suggest(hint, [Edit::after(item.span, format!(" = {}", example(quantity)))])
                } else {
                    error.hint(hint)
                });
                None
            }
        };
        let local = self.local(&decl.name.text, Type::Real(dimension(quantity)), decl.name.span);
        self.declare(decl, local, body);
        body.params.push(Param {
            name: decl.name.text.clone(),
            doc: item.doc.clone(),
            quantity,
            local,
            lower,
            upper,
            default: 0.0,
            bounds: (f64::NEG_INFINITY, f64::INFINITY),
            span: decl.name.span,
        });
        body.defaults.push(default);
    }

    /// What a parameter measures; `None` where that is no quantity, which is reported.
    fn quantity_of_param(&mut self, decl: &'a ParamDecl, item: &'a Item) -> Option<Quantity> {
        let wanted = self.wanted(&decl.ty);
        Some(match wanted {
            Wanted::Real(Dimension::NONE) => Quantity::Real,
            Wanted::Real(Dimension::LENGTH) => Quantity::Length,
            Wanted::Real(Dimension::ANGLE) => Quantity::Angle,
            // Its type was reported.
            Wanted::Any => return None,
            _ => {
                let message = format!("a param must be real, length or angle, but this is {}", wanted.describe());
                let diagnostic = Diagnostic::new(Code::InvalidType, decl.ty.span, message);
                let keyword = Span { end: item.span.start + "param".len() as u32, ..item.span };
                self.report(match wanted {
                    Wanted::Int | Wanted::Bool => diagnostic
                        .suggest("a value that is not fitted is an 'input'", [Edit::replace(keyword, "input")]),
                    Wanted::Tuple(_) | Wanted::Point => {
                        diagnostic.hint("declare its coordinates, and write (x, y, z) for the point")
                    }
                    _ => diagnostic,
                });
                return None;
            }
        })
    }

    /// Puts a parameter's name in scope.
    pub(super) fn declare(&mut self, decl: &'a ParamDecl, local: LocalId, body: &Body<'a>) {
        let before = body.params.iter().map(|p| (&p.name, p.span)).chain(body.inputs.iter().map(|i| (&i.name, i.span)));
        let before = before.into_iter().find(|(name, _)| **name == decl.name.text).map(|(_, span)| span);
        if let Some(before) = before {
            let message = format!("'{}' is declared twice", decl.name.text);
            self.report(
                Diagnostic::new(Code::DuplicateName, decl.name.span, message).related(before, "first declared here"),
            );
        }
        self.env.names.push((&decl.name.text, Binding::Local(local)));
    }

    /// A parameter of a model within another: an argument of the call, or its default.
    pub(super) fn argument_param(
        &mut self,
        decl: &'a ParamDecl,
        given: Option<Type>,
        body: &mut Body<'a>,
        locals: &mut Vec<LocalId>,
    ) {
        let wanted = self.wanted(&decl.ty);
        let Some(ty) = given else {
            if let Some(default) = &decl.default {
                let value = self.expr(default);
                let value = self.fit(value, &wanted, "the default");
                self.bind_name(&decl.name, value, &mut body.statements);
            }
            return;
        };
        let local = self.local(&decl.name.text, ty, decl.name.span);
        locals.push(local);
        if let Some((lower, upper)) = &decl.bounds {
            for (bound, op) in [(lower, Binary::Ge), (upper, Binary::Le)] {
                let bound = self.expr(bound);
                let bound = self.fit(bound, &wanted, "the bound");
                let value = self.read(local, decl.name.span);
                if bound.ty.is_error() {
                    continue;
                }
                let message =
                    format!("the value given for the parameter '{}' is outside of its bounds", decl.name.text);
                let condition = super::operators::binary(op, value, bound, Type::BOOL, decl.name.span);
                body.statements.push(Statement::Require { condition, message, span: decl.name.span });
            }
        }
        self.env.names.push((&decl.name.text, Binding::Local(local)));
    }
}

/// The dimension of a parameter.
pub(crate) fn dimension(quantity: Quantity) -> Dimension {
    match quantity {
        Quantity::Length => Dimension::LENGTH,
        Quantity::Angle => Dimension::ANGLE,
        Quantity::Real | Quantity::Int | Quantity::Bool => Dimension::NONE,
    }
}

fn example(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Length => "10mm",
        Quantity::Angle => "0deg",
        _ => "1",
    }
}
