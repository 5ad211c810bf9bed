//! Inputs: values from outside that are fixed while compiling.

use super::InputValue;
use super::annotations::Expected;
use super::context::Checker;
use super::model::Body;
use super::params::dimension;
use super::typed::{Expr, ExprKind, Param, Statement, Type, lets};
use crate::diagnostic::{Code, Diagnostic};
use crate::number::plain;
use crate::parameters::{Input, Quantity};
use crate::suggest::nearest;
use crate::syntax::ast::{self, Item, ItemKind, ParamDecl};
use std::collections::BTreeMap;

/// Inputs are kept as reals, which hold the whole numbers below 2^53 exactly.
const LARGEST_INPUT: f64 = 9_007_199_254_740_992.0;

impl<'a> Checker<'a> {
    /// The quantity of an input; `None` after an error in its type, which was reported.
    fn quantity_of_input(&mut self, decl: &'a ParamDecl, expected: &Expected) -> Option<Quantity> {
        if expected.quantity().is_some() || *expected == Expected::Any {
            return expected.quantity();
        }
        let message = format!("an input must be int, bool, real, length or angle, but this is {}", expected.describe());
        self.report(Diagnostic::new(Code::InvalidType, decl.ty.span, message));
        Some(Quantity::Real)
    }

    /// Declares an input with the value that is given, or its default.
    pub(super) fn input(
        &mut self,
        decl: &'a ParamDecl,
        item: &'a Item,
        body: &mut Body<'a>,
        given: &BTreeMap<String, InputValue>,
    ) {
        let expected = self.expected(&decl.ty);
        let Some(quantity) = self.quantity_of_input(decl, &expected) else {
            let unknown = self.local(&decl.name.text, Type::Error, decl.name.span);
            return self.declare(decl, unknown, body);
        };
        let (statements, params) = (&body.statements, &body.params);
        let constant = |checker: &mut Self, e: &'a ast::Expr, what: &str| {
            let e = checker.expr(e);
            let e = checker.coerce(e, &expected, what);
            checker.constant_value(&e, statements, params)
        };
        let (lower, upper) = match &decl.bounds {
            Some((a, b)) => (constant(self, a, "the lower bound"), constant(self, b, "the upper bound")),
            None => (None, None),
        };
        let (lower, upper) = (lower.unwrap_or(f64::NEG_INFINITY), upper.unwrap_or(f64::INFINITY));
        let default = decl.default.as_ref().and_then(|e| constant(self, e, "the default"));
        let value = match given.get(&decl.name.text) {
            Some(value) => self.given_input(decl, quantity, *value),
            None if decl.default.is_none() => {
                let message = format!("the input '{}' has no default and is not given", decl.name.text);
                self.report(Diagnostic::new(Code::NoDefault, decl.name.span, message));
                None
            }
            None => default,
        };
        let ty = match (value, quantity) {
            (Some(x), Quantity::Int) => Type::Int(Some(x as i64)),
            (Some(x), Quantity::Bool) => Type::Bool(Some(x != 0.0)),
            (Some(_), _) => Type::Real(dimension(quantity)),
            (None, _) => Type::Error,
        };
        let local = self.local(&decl.name.text, ty.clone(), decl.name.span);
        let value = value.unwrap_or(0.0);
        if quantity == Quantity::Int && value.abs() >= LARGEST_INPUT {
            let message =
                format!("the input '{}' is too large: a whole number has at most 53 bits here", decl.name.text);
            self.report(Diagnostic::new(Code::OutOfBounds, decl.name.span, message));
        }
        if (value < lower || value > upper) && !ty.is_error() {
            let message =
                format!("the input '{}' is {value}, outside of its bounds {lower} to {upper}", decl.name.text);
            self.report(Diagnostic::new(Code::OutOfBounds, decl.name.span, message));
        }
        if matches!(ty, Type::Real(_)) {
            let constant = Expr { kind: ExprKind::Real(value), ty, span: decl.name.span };
            body.statements.push(Statement::Let(local, constant));
        }
        self.declare(decl, local, body);
        body.inputs.push(Input {
            name: decl.name.text.clone(),
            doc: item.doc.clone(),
            quantity,
            value,
            lower,
            upper,
            span: decl.name.span,
        });
    }

    /// The value of an expression that uses no parameter; the statements of the model's body are those before it.
    fn constant_value(&mut self, e: &Expr, body: &[Statement], params: &[Param]) -> Option<f64> {
        if e.ty.is_error() {
            return None;
        }
        let params: Vec<&Param> = params.iter().collect();
        match self.evaluate(lets(body).collect(), &params, &[e]).pop()? {
            Ok(value) => Some(value),
            Err(reason) => {
                let message = format!("this must be known before the model is evaluated: {reason}");
                self.report(Diagnostic::new(Code::NotConstant, e.span, message));
                None
            }
        }
    }

    fn given_input(&mut self, decl: &ParamDecl, quantity: Quantity, value: InputValue) -> Option<f64> {
        match (quantity, value) {
            (Quantity::Int | Quantity::Real, InputValue::Int(k)) => Some(k as f64),
            (Quantity::Bool, InputValue::Bool(b)) => Some(f64::from(b)),
            (Quantity::Real | Quantity::Length | Quantity::Angle, InputValue::Real(x)) if x.is_finite() => Some(x),
            _ => {
                let expected = match quantity {
                    Quantity::Int => "a whole number",
                    Quantity::Bool => "true or false",
                    Quantity::Length => "a length with its unit, such as 42mm",
                    Quantity::Angle => "an angle with its unit, such as 30deg",
                    Quantity::Real => "a finite number",
                };
                let given = match value {
                    InputValue::Bool(flag) => flag.to_string(),
                    InputValue::Int(whole) => whole.to_string(),
                    InputValue::Real(number) if quantity == Quantity::Int && number.fract() == 0.0 => {
                        "a value with a unit".to_owned()
                    }
                    InputValue::Real(number) => plain(number),
                };
                let message = format!("the input '{}' must be {expected}, not {given}", decl.name.text);
                self.report(Diagnostic::new(Code::TypeMismatch, decl.name.span, message));
                None
            }
        }
    }

    /// Says of values that are given which the model has no input for.
    pub(super) fn unknown_inputs(&mut self, decl: &'a ast::Model, given: &BTreeMap<String, InputValue>) {
        let names: Vec<(&str, bool)> = decl
            .items
            .iter()
            .filter_map(|item| match &item.kind {
                ItemKind::Input(d) => Some((d.name.text.as_str(), true)),
                ItemKind::Param(d) => Some((d.name.text.as_str(), false)),
                _ => None,
            })
            .collect();
        for name in given.keys() {
            if names.contains(&(name.as_str(), true)) {
                continue;
            }
            let message = format!("the model '{}' has no input '{name}'", decl.name.text);
            let diagnostic = Diagnostic::new(Code::UnknownInput, decl.name.span, message);
            self.report(if names.contains(&(name.as_str(), false)) {
                diagnostic.hint(format!("'{name}' is a param, not an input: `-p {name}=VALUE` sets it"))
            } else {
                match nearest(name, names.iter().filter(|(_, input)| *input).map(|(n, _)| *n)) {
                    Some(near) => diagnostic.hint(format!("did you mean '{near}'?")),
                    None => diagnostic,
                }
            });
        }
    }
}
