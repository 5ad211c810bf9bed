//! Derivatives of expressions with respect to the current model's parameters.

use super::display::{inner_unit, number};
use super::evaluate::{self, Lowered};
use super::{Session, Value};
use crate::check::typed::{Dimension, Type};
use crate::diagnostic::{Code, Diagnostic};
use crate::diff;
use crate::ir;
use crate::program::Failed;
use crate::source::Loader;
use serde::Serialize;

/// An expression's value and its derivatives.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Gradient {
    /// The value. Its span says nothing.
    pub value: Value,
    /// Names of its numbers: empty for the one of a plain number; `x`, `[2]`, `p.x` for those of a tuple, array or
    /// record.
    pub components: Vec<String>,
    /// With respect to every parameter, in the model's order.
    pub slopes: Vec<Slope>,
}

/// The derivatives of an expression's numbers by one parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slope {
    /// The parameter.
    pub parameter: String,
    /// One derivative for each number, in millimetres and radians.
    pub values: Vec<f64>,
    /// The unit of each: `mm/rad`, `mm`, `1/mm`, or empty.
    pub units: Vec<String>,
}

impl Session {
    /// The derivatives of an expression with respect to every parameter of the current model, at its values.
    ///
    /// # Errors
    /// The errors of the expression; if there is no model, if something else than numbers depends on the
    /// parameters, or if a derivative is not finite.
    pub fn gradient(&mut self, text: &str, loader: &dyn Loader) -> Result<Gradient, Failed> {
        self.with_expression(text, loader, |s, checked, asked| {
            let span = asked.span;
            let Some(model) = &s.model else {
                let message = "there is no model with parameters to differentiate by";
                return Err(vec![Diagnostic::new(Code::NoModel, span, message)]);
            };
            let numbers = numbers_of(&asked.ty).ok_or_else(|| {
                let message = format!("only numbers have derivatives, but this is {}", asked.words);
                vec![Diagnostic::new(Code::NoDerivative, span, message).hint("call the function, or take a component")]
            })?;
            let losses = s.scope.request(&s.options).lost_derivatives(checked);
            if !losses.is_empty() {
                return Err(losses);
            }
            let Lowered { mut module, functions } = evaluate::lower_asked(checked)?;
            let value = evaluate::values(s, checked)?.pop().ok_or_else(Vec::new)?;
            let function = functions[functions.len() - 1];
            let wrt: Vec<u32> = (0..model.parameters().len() as u32).collect();
            ir::inline(&mut module, &[function]).map_err(|e| vec![e.diagnostic()])?;
            ir::simplify(&mut module, &[function]);
            let jacobian = diff::jacobian(&mut module, function, &wrt);
            let (jacobian, entries) = jacobian.map_err(|e| vec![e.diagnostic()])?;
            let results = evaluate::run(s, &module, jacobian).map_err(|e| vec![of_derivative(e)])?;
            let mut slopes: Vec<Slope> = model
                .parameters()
                .iter()
                .map(|p| Slope {
                    parameter: p.name.clone(),
                    values: vec![0.0; numbers.len()],
                    units: numbers.iter().map(|d| slope_unit(*d, crate::check::dimension(p.quantity))).collect(),
                })
                .collect();
            let first = results.len() - entries.len();
            for (entry, result) in entries.iter().zip(&results[first..]) {
                slopes[entry.param as usize].values[entry.result as usize] = result.real().unwrap_or(0.0);
            }
            let names = &module.function(function).result_names;
            Ok(Gradient { value, components: names.iter().map(|n| n.trim_matches('.').to_owned()).collect(), slopes })
        })
    }
}

impl Slope {
    /// The derivatives with their units: `2`, `-31.4159 mm/rad`.
    #[must_use]
    pub fn shown(&self) -> Vec<String> {
        let each = self.values.iter().zip(&self.units);
        each.map(|(x, unit)| if unit.is_empty() { number(*x) } else { format!("{} {unit}", number(*x)) }).collect()
    }
}

fn of_derivative(e: Diagnostic) -> Diagnostic {
    if e.code != Code::NotFinite {
        return e;
    }
    Diagnostic { message: format!("the derivative is not finite: {}", e.message), ..e }
}

/// The dimensions of a value's numbers; nothing where it has a function in it.
fn numbers_of(ty: &Type) -> Option<Vec<Dimension>> {
    Some(match ty {
        Type::Real(d) => vec![*d],
        Type::Int(_) | Type::Bool(_) => vec![Dimension::NONE],
        Type::Range(..) => vec![Dimension::NONE; 2],
        Type::Text(_) | Type::Error => Vec::new(),
        Type::Tuple(types) => flatten(types.iter().map(numbers_of))?,
        Type::Array(t, n) => flatten((0..*n).map(|_| numbers_of(t)))?,
        Type::Record(fields) => flatten(fields.iter().map(|(_, t)| numbers_of(t)))?,
        Type::Closure(_) => return None,
    })
}

fn flatten(parts: impl Iterator<Item = Option<Vec<Dimension>>>) -> Option<Vec<Dimension>> {
    Some(parts.collect::<Option<Vec<_>>>()?.into_iter().flatten().collect())
}

/// The unit of a derivative, in millimetres and radians.
fn slope_unit(of: Dimension, by: Dimension) -> String {
    if of.angle && by.angle {
        return String::new();
    }
    if of.angle || by.angle {
        let top = Some(inner_unit(of)).filter(|u| !u.is_empty()).unwrap_or_else(|| "1".to_owned());
        let below = inner_unit(by);
        return if below.is_empty() { top } else { format!("{top}/{below}") };
    }
    of.over(by).map(inner_unit).unwrap_or_default()
}
