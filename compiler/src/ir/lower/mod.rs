//! Lowering: the typed tree becomes scalar functions.
//!
//! Tuples, arrays, records and closures become their scalars, in order. Every function instance becomes one function
//! of its flattened captures and arguments; a call is [`Op::Call`](super::Op::Call) (inlining is a pass of its own),
//! a derivative is [`Op::Tangent`](super::Op::Tangent) of the function called. The sides of an `if` that may fail or
//! cost much, and the bodies of folds, become functions of the locals that they use from outside (lambda lifting).
//!
//! Each of the model's functions ([`LoweredModel`]) computes from the parameters the part of the model's body that it
//! needs.

mod control;
mod expr;
mod free;
pub(crate) mod model;
mod need;
mod operators;
mod shape;

#[cfg(test)]
mod tests;

use super::{
    CustomDerivative, FunctionBuilder, FunctionId, LoweredMeasure, LoweredModel, LoweredPart, Module, Parameter,
    ParameterFunction, Requirement, SizeError, SizeLimits, Value,
};
use crate::check::typed::{self, Expr, LocalId, Statement};
use crate::ir::hash::{HashMap, HashSet};
use crate::source::Span;
use need::Needs;

/// Lowers a model.
///
/// # Errors
/// If the model would become too large.
pub fn lower(model: &typed::Model) -> Result<LoweredModel, SizeError> {
    lower_within(model, SizeLimits::default())
}

/// [`lower`] with limits of one's own, which the module keeps.
///
/// # Errors
/// If the model would become too large.
pub(crate) fn lower_within(model: &typed::Model, limits: SizeLimits) -> Result<LoweredModel, SizeError> {
    let mut lowerer = Lowerer::new(model, limits);
    let bounds = lowerer.bounds()?;
    let requires = lowerer.requires()?;
    let parts = model.parts.iter().map(|part| lowerer.part(part)).collect::<Result<_, _>>()?;
    let measures = model.measures.iter().map(|measure| lowerer.measure(measure)).collect::<Result<_, _>>()?;
    lowerer.called_functions()?;
    Ok(LoweredModel { module: lowerer.module, parts, measures, bounds, requires })
}

/// Lowers single values that the model's body binds: a function of the parameters for each.
///
/// # Errors
/// If they would become too large.
pub(crate) fn lower_values(model: &typed::Model, values: &[LocalId]) -> Result<(Module, Vec<FunctionId>), SizeError> {
    let read = |id: &LocalId| {
        let local = &model.locals[id.0 as usize];
        Expr { kind: typed::ExprKind::Local(*id), ty: local.ty.clone(), span: local.span }
    };
    let exprs: Vec<Expr> = values.iter().map(read).collect();
    let mut lowerer = Lowerer::new(model, SizeLimits::default());
    let name = |id: &LocalId| &model.locals[id.0 as usize].name;
    let functions =
        values.iter().zip(&exprs).map(|(id, value)| lowerer.of_params(name(id), value)).collect::<Result<_, _>>()?;
    lowerer.called_functions()?;
    Ok((lowerer.module, functions))
}

/// The functions made so far.
struct Lowerer<'m> {
    model: &'m typed::Model,
    module: Module,
    /// The function of each function instance that is called.
    instances: HashMap<typed::FunctionId, FunctionId>,
    /// Those of them that are not lowered yet.
    open: Vec<typed::FunctionId>,
    /// The number of nodes of the functions that are complete.
    nodes: usize,
}

/// A function under construction, and the values of the locals that are bound in it.
struct Frame<'l, 'm> {
    lowerer: &'l mut Lowerer<'m>,
    b: FunctionBuilder,
    needs: Needs<'m>,
    /// The index of a loop, in the function of its body.
    index: Option<Value>,
}

impl<'m> Lowerer<'m> {
    fn new(model: &'m typed::Model, limits: SizeLimits) -> Lowerer<'m> {
        let module = Module { limits, ..Module::default() };
        Lowerer { model, module, instances: HashMap::default(), open: Vec::new(), nodes: 0 }
    }

    /// The function of a function instance, which [`Lowerer::called_functions`] lowers.
    fn instance(&mut self, id: typed::FunctionId) -> FunctionId {
        *self.instances.entry(id).or_insert_with(|| {
            self.open.push(id);
            self.module.reserve()
        })
    }

    /// Lowers the functions that are called, and those that they call.
    fn called_functions(&mut self) -> Result<(), SizeError> {
        while let Some(id) = self.open.pop() {
            let function = &self.model.functions[&id];
            let locals: Vec<LocalId> = function.captures.iter().chain(&function.params).copied().collect();
            let lowered = self.frame(&function.name, &locals, None).finish(&function.body)?;
            let own = self.instance(id);
            self.module.define(own, lowered);
            if let Some(custom) = &function.custom_derivative {
                let derivative = self.custom_derivative(function, custom);
                self.module.custom_derivatives.insert(own, derivative);
            }
        }
        Ok(())
    }

    /// Starts a function of the scalars of some locals, followed by an int of that name, if there is one.
    fn frame(&mut self, name: &str, locals: &[LocalId], int: Option<&str>) -> Frame<'_, 'm> {
        let mut params = Vec::new();
        let mut counts = Vec::new();
        for &local in locals {
            let local = &self.model.locals[local.0 as usize];
            let before = params.len();
            self.model.name_scalars(&local.name, &local.ty, &mut |name, ty| params.push(Parameter { name, ty }));
            counts.push(params.len() - before);
        }
        params.extend(int.map(|name| Parameter::new(name, super::Type::Int)));
        let b = FunctionBuilder::new(name, params);
        let mut values = b.params().into_iter();
        let mut needs = Needs::new();
        for (local, n) in locals.iter().zip(counts) {
            needs.bind(*local, values.by_ref().take(n).collect());
        }
        Frame { lowerer: self, b, needs, index: None }
    }

    /// The model's parameters among some locals.
    fn used_params(&self, used: &HashSet<LocalId>) -> (Vec<u32>, Vec<LocalId>) {
        let params = (0..).zip(&self.model.params);
        params.filter(|(_, p)| used.contains(&p.local)).map(|(i, p)| (i, p.local)).unzip()
    }

    /// Starts a function of the model's parameters.
    fn model_frame(&mut self, name: &str) -> Frame<'_, 'm> {
        let params: Vec<LocalId> = self.model.params.iter().map(|p| p.local).collect();
        self.frame(name, &params, None)
    }

    /// Finds the scalar to which each tangent of a custom derivative belongs.
    fn custom_derivative(&mut self, function: &typed::Function, custom: &typed::CustomDerivative) -> CustomDerivative {
        let model = self.model;
        let types = |local: &LocalId| model.scalars(&model.locals[local.0 as usize].ty);
        let captures: usize = function.captures.iter().map(|l| types(l).len()).sum();
        let mut tangents = Vec::new();
        for param in &custom.params {
            let start = captures + function.params[..*param].iter().map(|l| types(l).len()).sum::<usize>();
            let scalars = types(&function.params[*param]).into_iter().zip(start as u32..);
            tangents.extend(scalars.map(|(ty, i)| (ty == super::Type::Real).then_some(i)));
        }
        CustomDerivative { function: self.instance(custom.function), tangents }
    }

    fn bounds(&mut self) -> Result<FunctionId, SizeError> {
        let model = self.model;
        let mut frame = self.model_frame("bounds");
        frame.body_for(model.params.iter().flat_map(|p| p.lower.iter().chain(&p.upper)))?;
        let mut results = Vec::new();
        for param in &model.params {
            for (name, bound, none) in
                [("lower", &param.lower, f64::NEG_INFINITY), ("upper", &param.upper, f64::INFINITY)]
            {
                let value = match bound {
                    Some(bound) => frame.scalar(bound)?,
                    None => frame.b.real(none),
                };
                results.push((format!("{name}.{}", param.declared.name), value));
            }
        }
        let function = frame.b.finish(results);
        Ok(self.module.add(function))
    }

    fn requires(&mut self) -> Result<Vec<Requirement>, SizeError> {
        let mut requires = Vec::new();
        for statement in &self.model.body {
            if let Statement::Require { condition, message, span } = statement {
                let (used, lets) = lets_for(self.model, [condition]);
                let (params, locals) = self.used_params(&used);
                let mut frame = self.frame("require", &locals, None);
                frame.bind(&lets)?;
                let function = frame.add(condition)?;
                let condition = ParameterFunction { function, params };
                requires.push(Requirement { condition, message: message.clone(), span: *span });
            }
        }
        Ok(requires)
    }

    fn part(&mut self, part: &'m typed::Part) -> Result<LoweredPart, SizeError> {
        let (used, lets) = lets_for(self.model, [&part.shape]);
        let (params, mut locals) = self.used_params(&used);
        locals.extend([part.u, part.v]);
        let mut frame = self.frame(&part.name, &locals, None);
        frame.bind(&lets)?;
        frame.bind_let(part.local, &part.shape)?;
        let point = frame.point(&part.point)?;
        let function = frame.add_scalars(&point, &part.point.ty);
        let tolerance = part.tolerance.as_ref().map(|t| self.of_params("tolerance", t)).transpose()?;
        Ok(LoweredPart { surface: ParameterFunction { function, params }, tolerance })
    }

    fn measure(&mut self, measure: &'m typed::Measure) -> Result<LoweredMeasure, SizeError> {
        let (used, lets) = lets_for(self.model, [&measure.value]);
        let figures = (0..).zip(&self.model.figures).filter(|(_, figure)| used.contains(&figure.local));
        let (figures, taken): (Vec<u32>, Vec<LocalId>) = figures.map(|(i, taken)| (i, taken.local)).unzip();
        let locals: Vec<LocalId> = self.model.params.iter().map(|p| p.local).chain(taken).collect();
        let mut frame = self.frame(&measure.name, &locals, None);
        frame.bind(&lets)?;
        let value = frame.add(&measure.value)?;
        let limits = match &measure.limits {
            Some(limits) => {
                let mut frame = self.model_frame("limits");
                frame.body_for(limits)?;
                let [lower, upper] = [frame.scalar(&limits[0])?, frame.scalar(&limits[1])?];
                let function = frame.b.finish([("lower".to_owned(), lower), ("upper".to_owned(), upper)]);
                Some(self.module.add(function))
            }
            None => None,
        };
        Ok(LoweredMeasure { value, figures, limits })
    }

    /// A function of the parameters with the value of an expression of the model's body.
    fn of_params(&mut self, name: &str, expr: &'m Expr) -> Result<FunctionId, SizeError> {
        let mut frame = self.model_frame(name);
        frame.body_for([expr])?;
        frame.add(expr)
    }
}

/// The `let`s of the model's body that some expressions need, in their order; and all locals that these and the
/// expressions use.
fn lets_for<'m, 'e>(
    model: &'m typed::Model,
    exprs: impl IntoIterator<Item = &'e Expr>,
) -> (HashSet<LocalId>, Vec<(LocalId, &'m Expr)>) {
    let mut needed = HashSet::default();
    exprs.into_iter().for_each(|e| typed::locals_in(e, &mut needed));
    let lets = typed::needed_lets(typed::lets(&model.body), &mut needed);
    (needed, lets)
}

impl<'m> Frame<'_, 'm> {
    /// Binds the `let`s of the model's body that the expressions need.
    fn body_for(&mut self, exprs: impl IntoIterator<Item = &'m Expr>) -> Result<(), SizeError> {
        self.bind(&lets_for(self.lowerer.model, exprs).1)
    }

    fn bind(&mut self, lets: &[(LocalId, &'m Expr)]) -> Result<(), SizeError> {
        lets.iter().try_for_each(|(local, value)| self.bind_let(*local, value))
    }

    /// Completes a function of the value of an expression.
    fn finish(mut self, expr: &'m Expr) -> Result<super::Function, SizeError> {
        let results = self.expr(expr)?;
        Ok(self.finish_scalars(&results, &expr.ty))
    }

    /// Completes a function of the scalars of a value.
    fn finish_scalars(self, results: &[Value], ty: &typed::Type) -> super::Function {
        self.lowerer.nodes += self.b.node_count();
        let mut names = Vec::new();
        self.lowerer.model.name_scalars("", ty, &mut |name, _| names.push(name));
        self.b.finish(names.into_iter().zip(results.iter().copied()))
    }

    /// Adds a function of the value of an expression to the module.
    fn add(mut self, expr: &'m Expr) -> Result<FunctionId, SizeError> {
        let results = self.expr(expr)?;
        Ok(self.add_scalars(&results, &expr.ty))
    }

    /// Adds a function of the scalars of a value to the module.
    fn add_scalars(self, results: &[Value], ty: &typed::Type) -> FunctionId {
        let Frame { lowerer, b, needs, index } = self;
        let function = Frame { lowerer: &mut *lowerer, b, needs, index }.finish_scalars(results, ty);
        lowerer.module.add(function)
    }

    /// An error if the functions have outgrown the limit.
    fn check_size(&self, span: Span) -> Result<(), SizeError> {
        let limits = self.lowerer.module.limits;
        let most = limits.lowered_nodes();
        if self.lowerer.nodes + self.b.node_count() <= most {
            return Ok(());
        }
        Err(SizeError::TooLarge { function: self.b.name().to_owned(), span, most, limit: limits.nodes })
    }
}
