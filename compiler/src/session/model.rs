//! The current model of a session: its parameters and their values.

use super::evaluate;
use super::{Data, Options, Session};
use crate::check::{InputValue, typed};
use crate::diagnostic::{Code, Diagnostic};
use crate::diff;
use crate::ir::interpret::{self, Limits};
use crate::ir::scalar::Scalar;
use crate::ir::{LoweredModel, lower};
use crate::parameters::bounds_of;
use crate::program::{self, Compilation, Failed, Input, Parameter, Quantity};
use crate::source::{Loader, Span};
use crate::suggest::nearest_of;
use std::sync::Arc;

/// The current model of a session, with values of its parameters.
#[derive(Clone)]
pub struct CurrentModel {
    typed: Arc<typed::Model>,
    parameters: Arc<[Parameter]>,
    /// Without the parts: surfaces are compiled when they are asked for.
    lowered: Arc<LoweredModel>,
    values: Vec<f64>,
}

impl CurrentModel {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.typed.name
    }

    /// Its free parameters, in order.
    #[must_use]
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Their values, in millimetres and radians.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Their bounds at these values; infinite where there is none, or it cannot be computed.
    #[must_use]
    pub fn bounds(&self) -> Vec<(f64, f64)> {
        self.bounds_at(&self.values)
    }

    /// Its inputs, with their values.
    #[must_use]
    pub fn inputs(&self) -> &[Input] {
        &self.typed.inputs
    }

    /// The names of its surfaces.
    pub fn parts(&self) -> impl Iterator<Item = &str> {
        self.typed.parts.iter().map(|p| p.name.as_str())
    }

    /// The names of its measures.
    pub fn measures(&self) -> impl Iterator<Item = &str> {
        self.typed.measures.iter().map(|m| m.name.as_str())
    }

    pub(super) fn new(model: typed::Model) -> Result<Self, Vec<Diagnostic>> {
        let mut lowered = lower::lower(&model).map_err(|e| vec![e.diagnostic()])?;
        let mut roots = vec![lowered.bounds];
        roots.extend(lowered.requires.iter().map(|r| r.condition.function));
        diff::expand(&mut lowered.module, &roots).map_err(|e| vec![e.diagnostic()])?;
        lowered.parts.clear();
        lowered.measures.clear();
        lowered.module.drop_unreached(&mut roots);
        lowered.bounds = roots[0];
        lowered.requires.iter_mut().zip(&roots[1..]).for_each(|(r, id)| r.condition.function = *id);
        let parameters: Arc<[Parameter]> = model.params.iter().map(|p| p.declared.clone()).collect();
        let values = parameters.iter().map(|p| p.default).collect();
        Ok(Self { typed: Arc::new(model), parameters, lowered: Arc::new(lowered), values })
    }

    fn bounds_at(&self, x: &[f64]) -> Vec<(f64, f64)> {
        let results = interpret::run_real(&self.lowered.module, self.lowered.bounds, x, Limits::default());
        bounds_of(results.ok(), x.len())
    }

    /// The first bound or requirement that refuses these values.
    fn refuses(&self, x: &[f64], limits: Limits) -> Option<Diagnostic> {
        for (parameter, (value, bounds)) in self.parameters().iter().zip(x.iter().zip(self.bounds_at(x))) {
            if let Err(message) = parameter.within(*value, bounds) {
                return Some(Diagnostic::new(Code::OutOfBounds, parameter.span, message));
            }
        }
        let args: Vec<Scalar> = x.iter().map(|x| Scalar::Real(*x)).collect();
        self.lowered.requires.iter().find_map(|require| {
            let condition = &require.condition;
            match interpret::run(&self.lowered.module, condition.function, &condition.arguments(&args, &[]), limits) {
                Ok(holds) if holds == [Scalar::Bool(true)] => None,
                Ok(_) => Some(Diagnostic::new(Code::Require, require.span, require.message.clone())),
                Err(e) => Some(Diagnostic::new(Code::Require, require.span, e.to_string())),
            }
        })
    }

    /// Takes the values of another model for parameters of the same names, where all of them together are allowed.
    pub(super) fn keep_values(&mut self, old: &Self, options: &Options) {
        let mut values = self.values.clone();
        for (parameter, value) in self.parameters.iter().zip(&mut values) {
            let same = |p: &Parameter| p.name == parameter.name && p.quantity == parameter.quantity;
            if let Some(i) = old.parameters().iter().position(same) {
                // A parameter at its default follows the default.
                if old.values[i] != old.parameters()[i].default {
                    *value = old.values[i];
                }
            }
        }
        if self.refuses(&values, options.limits).is_none() {
            self.values = values;
        }
    }
}

impl Session {
    /// The current model, where there is one.
    #[must_use]
    pub fn model(&self) -> Option<&CurrentModel> {
        self.model.as_ref()
    }

    /// The script that the current model comes from; nothing where it was entered.
    #[must_use]
    pub fn model_file(&self) -> Option<String> {
        let current = self.scope.names.current.as_ref()?;
        let name = &self.scope.files.loaded.get(current.file)?.name;
        (!name.starts_with("input ")).then(|| name.clone())
    }

    /// Gives a parameter or an input of the current model the value of an expression: `42mm`, `h / 2`.
    ///
    /// # Errors
    /// If there is no such name, the value does not fit it, or the model does not allow it; the session is then as
    /// before.
    pub fn set(&mut self, name: &str, text: &str, loader: &dyn Loader) -> Result<(), Failed> {
        let value =
            self.with_expression(text, loader, |s, checked, _| Ok(evaluate::values(s, checked)?.into_iter().next()))?;
        self.attempt(|s| {
            let file = s.add_text(text);
            let whole = Span { file, start: 0, end: text.len() as u32 };
            let Some(model) = &s.model else {
                return Err(vec![Diagnostic::new(Code::NoModel, whole, "there is no model with parameters to set")]);
            };
            let data = value.as_ref().map(|v| &v.data);
            let wrong = |quantity| {
                let have = value.as_ref().map_or("nothing", |v| v.ty.as_str());
                let message = format!("'{name}' is {}, but this is {have}", noun(quantity));
                vec![Diagnostic::new(Code::DimensionMismatch, whole, message)]
            };
            if let Some(i) = model.parameters().iter().position(|p| p.name == name) {
                let quantity = model.parameters()[i].quantity;
                let mut x = model.values.clone();
                x[i] = data.and_then(|d| number(d, quantity)).ok_or_else(|| wrong(quantity))?;
                return s.set_values(x);
            }
            if let Some(input) = model.inputs().iter().find(|i| i.name == name) {
                let quantity = input.quantity;
                let value = data.and_then(|d| input_value(d, quantity)).ok_or_else(|| wrong(quantity))?;
                return s.set_input(name, value);
            }
            let known = model.parameters().iter().map(|p| &p.name).chain(model.inputs().iter().map(|i| &i.name));
            let known: Vec<&str> = known.map(String::as_str).collect();
            let message = format!("the model '{}' has no parameter or input '{name}'", model.name());
            let error = Diagnostic::new(Code::UnknownName, whole, message);
            Err(vec![match nearest_of(name, &[&known]) {
                Some(near) => error.hint(format!("did you mean '{near}'?")),
                None if known.is_empty() => error,
                None => error.hint(format!("it has {}", known.join(", "))),
            }])
        })
    }

    /// Gives all parameters values, in millimetres and radians.
    ///
    /// # Errors
    /// If there is no model, the number of values is not that of its parameters, or the model does not allow them.
    pub fn set_all(&mut self, values: &[f64]) -> Result<(), Failed> {
        self.attempt(|s| s.set_values(values.to_vec()))
    }

    fn set_values(&mut self, x: Vec<f64>) -> Result<(), Vec<Diagnostic>> {
        let limits = self.options.limits;
        let Some(model) = self.model.as_mut().filter(|m| m.values.len() == x.len()) else {
            return Err(vec![Diagnostic::new(
                Code::NoModel,
                Span::default(),
                "there is no model with these parameters",
            )]);
        };
        if let Some(refused) = model.refuses(&x, limits) {
            return Err(vec![refused]);
        }
        model.values = x;
        Ok(())
    }

    fn set_input(&mut self, name: &str, value: InputValue) -> Result<(), Vec<Diagnostic>> {
        let before = self.options.inputs.insert(name.to_owned(), value);
        let result = self.scope.request(&self.options).model();
        match result.and_then(|current| current.map(|(model, _)| CurrentModel::new(model)).transpose()) {
            Ok(Some(mut made)) => {
                if let Some(old) = &self.model {
                    made.keep_values(old, &self.options);
                }
                self.model = Some(made);
                Ok(())
            }
            Ok(None) => Ok(()),
            Err(diagnostics) => {
                match before {
                    Some(before) => _ = self.options.inputs.insert(name.to_owned(), before),
                    None => _ = self.options.inputs.remove(name),
                }
                Err(diagnostics)
            }
        }
    }

    /// The current model as a program.
    ///
    /// # Errors
    /// If there is no model, or it cannot be compiled.
    pub fn compile(&self, options: &program::Options) -> Result<Compilation, Failed> {
        let failed = |diagnostics| Failed { diagnostics, sources: self.sources.clone() };
        let Some((model, warnings)) = self.scope.request(&self.options).model().map_err(failed)? else {
            return Err(failed(vec![Diagnostic::new(Code::NoModel, Span::default(), "there is no model")]));
        };
        let program = program::build_model(model, &self.sources, options).map_err(|e| failed(vec![e]))?;
        Ok(Compilation { program, warnings, sources: self.sources.clone() })
    }
}

fn number(data: &Data, quantity: Quantity) -> Option<f64> {
    let expected = crate::check::dimension(quantity);
    match data {
        Data::Int(k) if expected.is_none() => Some(*k as f64),
        // Zero is zero in any unit.
        Data::Int(0) => Some(0.0),
        Data::Number { value, unit } if *unit == expected || (expected.is_none() && unit.angle) => Some(*value),
        _ => None,
    }
}

fn input_value(data: &Data, quantity: Quantity) -> Option<InputValue> {
    match (quantity, data) {
        (Quantity::Int, Data::Int(k)) => Some(InputValue::Int(*k)),
        (Quantity::Bool, Data::Bool(b)) => Some(InputValue::Bool(*b)),
        (Quantity::Int | Quantity::Bool, _) => None,
        _ => number(data, quantity).map(InputValue::Real),
    }
}

fn noun(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Real => "a bare number",
        Quantity::Length => "a length",
        Quantity::Angle => "an angle",
        Quantity::Int => "a whole number",
        Quantity::Bool => "a truth value",
    }
}
