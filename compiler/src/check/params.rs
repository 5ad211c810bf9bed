//! Parameters of models: free ones, and those that another model sets.

use super::annotations::Expected;
use super::comparisons::comparison;
use super::context::{Binding, Checker};
use super::model::Body;
use super::typed::{self, Compare, Expr, ExprKind, LocalId, Param, Statement, Type};
use super::types::Dimension;
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::parameters::{Parameter, Quantity};
use crate::source::Span;
use crate::syntax::ast::{self, Item, ParamDecl};

impl<'a> Checker<'a> {
    /// Declares a free parameter.
    pub(super) fn param(&mut self, decl: &'a ParamDecl, item: &'a Item, body: &mut Body<'a>) {
        let Some(quantity) = self.quantity_of_param(decl, item) else {
            let unknown = self.local(&decl.name.text, Type::Error, decl.name.span);
            return self.declare(decl, unknown, body);
        };
        let expected = Expected::Real(dimension(quantity));
        let bound = |checker: &mut Self, e: &'a ast::Expr, what: &str| {
            let e = checker.expr(e);
            Some(checker.coerce(e, &expected, what))
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
        let declared = Parameter {
            name: decl.name.text.clone(),
            doc: item.doc.clone(),
            quantity,
            default: 0.0,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            span: decl.name.span,
        };
        body.params.push(Param { declared, local, lower, upper });
        body.defaults.push((body.statements.len(), default));
    }

    /// Evaluates the defaults and bounds of the parameters, which may use earlier parameters and the `let`s between
    /// them. `defaults` also has the number of statements before each parameter.
    pub(super) fn evaluate_params(
        &mut self,
        params: &mut [Param],
        defaults: &[(usize, Option<Expr>)],
        statements: &[Statement],
    ) {
        let failed = self.has_errors();
        let mut lets = Vec::new();
        let mut bound = 0;
        let mut exprs = Vec::new();
        for (param, (before, default)) in params.iter().zip(defaults) {
            lets.extend(typed::lets(&statements[bound..*before]));
            bound = *before;
            lets.extend(default.iter().map(|e| (param.local, e)));
            exprs.push([
                ("the lower bound", &param.lower),
                ("the upper bound", &param.upper),
                ("the default", default),
            ]);
        }
        let without_default: Vec<&Param> =
            params.iter().zip(defaults).filter(|(_, (_, default))| default.is_none()).map(|(param, _)| param).collect();
        let known = |e: &&Expr| !e.ty.is_error();
        let all: Vec<&Expr> = exprs.iter().flatten().filter_map(|(_, e)| e.as_ref()).filter(known).collect();
        let mut values = self.evaluate(lets, &without_default, &all).into_iter();
        let mut of_params = Vec::new();
        for (param, exprs) in params.iter().zip(&exprs) {
            of_params.push(exprs.map(|(what, e)| {
                let e = e.as_ref().filter(known)?;
                let reason = match values.next()? {
                    Ok(value) => return Some(value),
                    Err(reason) => reason,
                };
                // In a model with errors the reason is one of these.
                if !failed {
                    let message = format!("{what} of '{}' has no value: {reason}", param.declared.name);
                    self.report(Diagnostic::new(Code::NotConstant, e.span, message));
                }
                None
            }));
        }
        for ((param, [lower, upper, default]), (_, e)) in params.iter_mut().zip(of_params).zip(defaults) {
            param.declared.lower = lower.unwrap_or(f64::NEG_INFINITY);
            param.declared.upper = upper.unwrap_or(f64::INFINITY);
            param.declared.default = default.unwrap_or(0.0);
            if let Some(error) = misplaced_bounds(param, default.and(e.as_ref())) {
                self.report(error);
            }
        }
    }

    /// The quantity of a parameter; `None` if its type is not a quantity that can vary, which is reported.
    fn quantity_of_param(&mut self, decl: &'a ParamDecl, item: &'a Item) -> Option<Quantity> {
        let expected = self.expected(&decl.ty);
        if let Some(quantity @ (Quantity::Real | Quantity::Length | Quantity::Angle)) = expected.quantity() {
            return Some(quantity);
        }
        let message = format!("a param must be real, length or angle, but this is {}", expected.describe());
        let error = Diagnostic::new(Code::InvalidType, decl.ty.span, message);
        let keyword = Span { end: item.span.start + "param".len() as u32, ..item.span };
        self.report(match expected {
            // Its type was reported.
            Expected::Any => return None,
            Expected::Int | Expected::Bool => {
                error.suggest("a value that is not fitted is an 'input'", [Edit::replace(keyword, "input")])
            }
            Expected::Tuple(_) | Expected::Point => {
                error.hint("declare its coordinates, and write (x, y, z) for the point")
            }
            _ => error,
        });
        None
    }

    /// Puts a parameter's name in scope.
    pub(super) fn declare(&mut self, decl: &'a ParamDecl, local: LocalId, body: &Body<'a>) {
        let params = body.params.iter().map(|p| (&p.declared.name, p.declared.span));
        let mut before = params.chain(body.inputs.iter().map(|i| (&i.name, i.span)));
        let before = before.find(|(name, _)| **name == decl.name.text).map(|(_, span)| span);
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
        let expected = self.expected(&decl.ty);
        let Some(ty) = given else {
            if let Some(default) = &decl.default {
                let value = self.expr(default);
                let value = self.coerce(value, &expected, "the default");
                self.bind_name(&decl.name, value, &mut body.statements);
            }
            return;
        };
        let local = self.local(&decl.name.text, ty, decl.name.span);
        locals.push(local);
        if let Some((lower, upper)) = &decl.bounds {
            for (bound, op) in [(lower, Compare::Ge), (upper, Compare::Le)] {
                let bound = self.expr(bound);
                let bound = self.coerce(bound, &expected, "the bound");
                let value = self.read(local, decl.name.span);
                // Truth values have no order.
                if bound.ty.is_error() || matches!(bound.ty, Type::Bool(_)) {
                    continue;
                }
                let message =
                    format!("the value given for the parameter '{}' is outside of its bounds", decl.name.text);
                let condition = comparison(op, value, bound, decl.name.span);
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

/// The error for bounds that leave no value, or a default outside of them.
fn misplaced_bounds(param: &Param, default: Option<&Expr>) -> Option<Diagnostic> {
    let Parameter { name, quantity, default: value, lower, upper, span, .. } = &param.declared;
    let shown = |x: &f64| quantity.shown(*x);
    let bounds = param.lower.as_ref().zip(param.upper.as_ref()).map(|(lower, upper)| lower.span.to(upper.span));
    if lower > upper {
        let message = format!("the bounds of '{name}' are the wrong way round: {} to {}", shown(lower), shown(upper));
        let error = Diagnostic::new(Code::OutOfBounds, bounds.unwrap_or(*span), message);
        let literal = |e: &Option<Expr>| matches!(e.as_ref().map(|e| &e.kind), Some(ExprKind::Real(_)));
        return Some(match bounds {
            Some(span) if literal(&param.lower) && literal(&param.upper) => {
                let swapped = format!("{}..{}", shown(upper), shown(lower));
                error.suggest(format!("write '{swapped}'"), [Edit::replace(span, swapped)])
            }
            _ => error,
        });
    }
    let default = default.filter(|_| value < lower || value > upper)?;
    let message = format!(
        "the default of '{name}', {}, lies outside of its bounds {} to {}",
        shown(value),
        shown(lower),
        shown(upper)
    );
    let error = Diagnostic::new(Code::OutOfBounds, default.span, message);
    Some(match bounds {
        Some(bounds) => error.related(bounds, "its bounds"),
        None => error,
    })
}
