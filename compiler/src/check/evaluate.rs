//! Values of typed expressions, for what must be known while compiling: defaults and bounds.

use super::context::Checker;
use super::typed::{Call, Expr, ExprKind, Function, FunctionId, LocalId, Model, Param, Statement, Type};
use super::types::ClosureId;
use super::values::{self, Value, component, number};
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::parameters::Quantity;
use crate::source::Span;
use std::collections::HashMap;

/// How many nodes one evaluation may visit.
const STEP_LIMIT: usize = 2_000_000;
/// How deep its calls may nest.
const DEPTH_LIMIT: usize = 500;

/// Where functions and closure layouts are found.
pub(super) trait Tree {
    fn function(&self, id: FunctionId) -> Option<&Function>;
    fn captures(&self, id: ClosureId) -> Vec<Type>;
}

impl Tree for Checker<'_> {
    fn function(&self, id: FunctionId) -> Option<&Function> {
        Checker::function(self, id)
    }

    fn captures(&self, id: ClosureId) -> Vec<Type> {
        self.closure(id).captures.iter().map(|(_, ty)| ty.clone()).collect()
    }
}

impl Tree for Model {
    fn function(&self, id: FunctionId) -> Option<&Function> {
        self.functions.get(id.0 as usize)
    }

    fn captures(&self, id: ClosureId) -> Vec<Type> {
        self.closures[id.0 as usize].captures.iter().map(|(_, ty)| ty.clone()).collect()
    }
}

/// The value of an expression without free locals, as a number.
pub(super) fn constant(tree: &dyn Tree, e: &Expr) -> Result<f64, String> {
    let mut evaluation = Evaluation::new(tree);
    number(&evaluation.expr(e)?)
}

/// Puts the values of the parameters' defaults and bounds into the model; what is wrong with them.
pub(super) fn defaults(model: &mut Model, defaults: &[Option<Expr>], checker: &Checker<'_>) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut found: Vec<(f64, f64, f64)> = Vec::new();
    {
        // Expressions of defaults are not part of the finished model: their functions are the checker's.
        let mut own = Evaluation::new(checker);
        let mut of_model = Evaluation::new(&*model);
        for (param, default) in model.params.iter().zip(defaults) {
            for evaluation in [&mut own, &mut of_model] {
                evaluation.lets = lets(&model.body);
            }
            let mut value = |evaluation: &mut Evaluation<'_>, e: &Option<Expr>, missing: f64, what: &str| {
                let Some(e) = e.as_ref().filter(|e| !e.ty.is_error()) else { return missing };
                evaluation.steps = 0;
                match evaluation.expr(e).and_then(|v| number(&v)) {
                    Ok(x) => x,
                    Err(reason) => {
                        let message = format!("{what} of '{}' has no value: {reason}", param.name);
                        diagnostics.push(Diagnostic::new(Code::NotConstant, e.span, message));
                        missing
                    }
                }
            };
            let lower = value(&mut of_model, &param.lower, f64::NEG_INFINITY, "the lower bound");
            let upper = value(&mut of_model, &param.upper, f64::INFINITY, "the upper bound");
            let middle = if lower.is_finite() { lower } else { 0.0 };
            let x = value(&mut own, default, middle, "the default");
            for evaluation in [&mut own, &mut of_model] {
                evaluation.values.insert(param.local, Value::Real(x));
            }
            found.push((lower, upper, x));
        }
    }
    for ((param, (lower, upper, default)), e) in model.params.iter_mut().zip(found).zip(defaults) {
        param.bounds = (lower, upper);
        param.default = default;
        let shown = |x: f64| in_units(x, param.quantity);
        if lower > upper {
            let message =
                format!("the bounds of '{}' are the wrong way round: {} to {}", param.name, shown(lower), shown(upper));
            let error = Diagnostic::new(Code::OutOfBounds, bounds_span(param).unwrap_or(param.span), message);
            let literal = |e: &Option<Expr>| matches!(e.as_ref().map(|e| &e.kind), Some(ExprKind::Real(_)));
            diagnostics.push(match bounds_span(param) {
                Some(span) if literal(&param.lower) && literal(&param.upper) => {
                    let swapped = format!("{}..{}", shown(upper), shown(lower));
                    error.suggest(format!("write '{swapped}'"), [Edit::replace(span, swapped)])
                }
                _ => error,
            });
        } else if (default < lower || default > upper) && e.as_ref().is_some_and(|e| !e.ty.is_error()) {
            let message = format!(
                "the default of '{}', {}, lies outside of its bounds {} to {}",
                param.name,
                shown(default),
                shown(lower),
                shown(upper)
            );
            let span = e.as_ref().map_or(param.span, |e| e.span);
            let error = Diagnostic::new(Code::OutOfBounds, span, message);
            diagnostics.push(match bounds_span(param) {
                Some(bounds) => error.related(bounds, "its bounds"),
                None => error,
            });
        }
    }
    diagnostics
}

/// Where both bounds are written.
fn bounds_span(param: &Param) -> Option<Span> {
    Some(param.lower.as_ref()?.span.to(param.upper.as_ref()?.span))
}

fn in_units(x: f64, quantity: Quantity) -> String {
    match quantity {
        Quantity::Length => format!("{x}mm"),
        Quantity::Angle => format!("{}deg", (x.to_degrees() * 1e9).round() / 1e9),
        _ => format!("{x}"),
    }
}

fn lets(body: &[Statement]) -> HashMap<LocalId, &Expr> {
    body.iter()
        .filter_map(|s| match s {
            Statement::Let(local, e) => Some((*local, e)),
            Statement::Require { .. } => None,
        })
        .collect()
}

/// An evaluation: values of locals, and `let`s that are evaluated when they are needed.
pub(super) struct Evaluation<'t> {
    tree: &'t dyn Tree,
    pub(super) values: HashMap<LocalId, Value>,
    pub(super) lets: HashMap<LocalId, &'t Expr>,
    steps: usize,
    depth: usize,
    /// How a derivative is to be had; there is none while compiling.
    #[cfg(test)]
    pub(super) derivative_step: Option<f64>,
}

type Result1 = Result<Value, String>;

impl<'t> Evaluation<'t> {
    pub(super) fn new(tree: &'t dyn Tree) -> Evaluation<'t> {
        Evaluation {
            tree,
            values: HashMap::new(),
            lets: HashMap::new(),
            steps: 0,
            depth: 0,
            #[cfg(test)]
            derivative_step: None,
        }
    }

    pub(super) fn expr(&mut self, e: &Expr) -> Result1 {
        self.steps += 1;
        if self.steps > STEP_LIMIT {
            return Err("it takes too many steps".to_owned());
        }
        stacker::maybe_grow(64 << 10, 1 << 20, || self.dispatch(e))
    }

    fn dispatch(&mut self, e: &Expr) -> Result1 {
        Ok(match &e.kind {
            ExprKind::Real(x) => Value::Real(*x),
            ExprKind::Int(k) => Value::Int(*k),
            ExprKind::Bool(b) => Value::Bool(*b),
            ExprKind::Text(_) => Value::Many([].into()),
            ExprKind::Local(id) => return self.local(*id),
            ExprKind::Convert(inner) => {
                let value = self.expr(inner)?;
                self.convert(value, &e.ty)
            }
            ExprKind::Unary(op, a) => {
                let a = self.expr(a)?;
                values::unary(*op, &a)?
            }
            ExprKind::Binary(op, a, b) => {
                let (a, b) = (self.expr(a)?, self.expr(b)?);
                values::binary(*op, &a, &b)?
            }
            ExprKind::If(c, a, b) => match self.expr(c)? {
                Value::Bool(true) => self.expr(a)?,
                _ => self.expr(b)?,
            },
            ExprKind::Aggregate(items) => {
                Value::Many(items.iter().map(|e| self.expr(e)).collect::<Result<Vec<_>, _>>()?.into())
            }
            ExprKind::Element(a, k) => component(&self.expr(a)?, *k)?,
            ExprKind::Index(a, i) => {
                let (a, i) = (self.expr(a)?, self.expr(i)?);
                let Value::Int(i) = i else { return Err("its index is not a whole number".to_owned()) };
                component(&a, usize::try_from(i).unwrap_or(usize::MAX))?
            }
            ExprKind::Block(statements, value) => {
                for statement in statements {
                    self.statement(statement)?;
                }
                self.expr(value)?
            }
            ExprKind::Call(call) => self.call(call)?,
            ExprKind::Derivative { call, wrt } => self.derivative(call, *wrt)?,
            ExprKind::Fold { from, to, init, index, accumulator, body } => {
                let (Value::Int(from), Value::Int(to)) = (self.expr(from)?, self.expr(to)?) else {
                    return Err("its range is not of whole numbers".to_owned());
                };
                let mut value = self.expr(init)?;
                for i in from..to {
                    self.values.insert(*index, Value::Int(i));
                    self.values.insert(*accumulator, value);
                    value = self.expr(body)?;
                }
                value
            }
        })
    }

    fn statement(&mut self, statement: &Statement) -> Result<(), String> {
        match statement {
            Statement::Let(id, e) => {
                let value = self.expr(e)?;
                self.values.insert(*id, value);
            }
            Statement::Require { condition, message, .. } => {
                if self.expr(condition)? != Value::Bool(true) {
                    return Err(message.clone());
                }
            }
        }
        Ok(())
    }

    fn local(&mut self, id: LocalId) -> Result1 {
        if let Some(value) = self.values.get(&id) {
            return Ok(value.clone());
        }
        let Some(e) = self.lets.get(&id).copied() else {
            return Err("it depends on a parameter that is declared later".to_owned());
        };
        let value = self.expr(e)?;
        self.values.insert(id, value.clone());
        Ok(value)
    }

    fn call(&mut self, call: &Call) -> Result1 {
        let args = call.args.iter().map(|e| self.expr(e)).collect::<Result<Vec<_>, _>>()?;
        let closure = match &call.closure {
            Some(e) => Some(self.expr(e)?),
            None => None,
        };
        self.enter(call.function, closure.as_ref(), args)
    }

    fn enter(&mut self, id: FunctionId, closure: Option<&Value>, args: Vec<Value>) -> Result1 {
        let tree = self.tree;
        let Some(function) = tree.function(id) else { return Err("it calls a function with errors".to_owned()) };
        self.depth += 1;
        if self.depth > DEPTH_LIMIT {
            return Err("its calls are nested too deeply".to_owned());
        }
        // Recursion binds the same locals again: the caller's values come back afterwards.
        let saved = function.recursive.then(|| self.values.clone());
        for (i, local) in function.captures.iter().enumerate() {
            let value = component(closure.unwrap_or(&Value::Many([].into())), i)?;
            self.values.insert(*local, value);
        }
        for (local, value) in function.params.iter().zip(args) {
            self.values.insert(*local, value);
        }
        let value = self.expr(&function.body);
        if let Some(saved) = saved {
            self.values = saved;
        }
        self.depth -= 1;
        value
    }

    #[cfg(not(test))]
    fn derivative(&mut self, _: &Call, _: usize) -> Result1 {
        Err("it needs a derivative, which is not had while compiling".to_owned())
    }

    /// Central differences: tests use this evaluator as their oracle.
    #[cfg(test)]
    fn derivative(&mut self, call: &Call, wrt: usize) -> Result1 {
        let Some(step) = self.derivative_step else {
            return Err("it needs a derivative, which is not had while compiling".to_owned());
        };
        let args = call.args.iter().map(|e| self.expr(e)).collect::<Result<Vec<_>, _>>()?;
        let closure = match &call.closure {
            Some(e) => Some(self.expr(e)?),
            None => None,
        };
        let mut at = |x: f64| {
            let mut args = args.clone();
            args[wrt] = Value::Real(number(&args[wrt])? + x);
            self.enter(call.function, closure.as_ref(), args)
        };
        let (a, b) = (at(step)?, at(-step)?);
        use super::typed::Binary::{Div, Sub};
        values::binary(Div, &values::binary(Sub, &a, &b)?, &Value::Real(2.0 * step))
    }

    fn convert(&self, value: Value, ty: &Type) -> Value {
        match (value, ty) {
            (Value::Int(k), Type::Real(_)) => Value::Real(k as f64),
            (Value::Many(values), Type::Tuple(types)) => {
                Value::Many(values.iter().zip(&**types).map(|(v, t)| self.convert(v.clone(), t)).collect())
            }
            (Value::Many(values), Type::Array(ty, _)) => {
                Value::Many(values.iter().map(|v| self.convert(v.clone(), ty)).collect())
            }
            (Value::Many(values), Type::Record(fields)) => {
                Value::Many(values.iter().zip(&**fields).map(|(v, (_, t))| self.convert(v.clone(), t)).collect())
            }
            (Value::Many(values), Type::Closure(id)) => {
                let types = self.tree.captures(*id);
                Value::Many(values.iter().zip(&types).map(|(v, t)| self.convert(v.clone(), t)).collect())
            }
            (value, _) => value,
        }
    }
}
