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
    let mut lowerer = Lowerer::new(model, limits)?;
    let bounds = lowerer.bounds()?;
    let requires = lowerer.requires()?;
    let parts = model.parts.iter().map(|part| lowerer.part(part)).collect::<Result<_, _>>()?;
    let measures = model.measures.iter().map(|measure| lowerer.measure(measure)).collect::<Result<_, _>>()?;
    Ok(LoweredModel { module: lowerer.module, parts, measures, bounds, requires })
}

/// Lowers single values that the model's body binds: a function of the parameters for each.
///
/// # Errors
/// If they would become too large.
pub(crate) fn lower_values(model: &typed::Model, values: &[LocalId]) -> Result<(Module, Vec<FunctionId>), SizeError> {
    let mut lowerer = Lowerer::new(model, SizeLimits::default())?;
    let function_of = |id: &LocalId| {
        let local = &model.locals[id.0 as usize];
        let value = Expr { kind: typed::ExprKind::Local(*id), ty: local.ty.clone(), span: local.span };
        lowerer.of_params(&local.name, &value)
    };
    let functions = values.iter().map(function_of).collect::<Result<_, _>>()?;
    Ok((lowerer.module, functions))
}

/// The functions made so far.
struct Lowerer<'m> {
    model: &'m typed::Model,
    module: Module,
    /// The function of each function instance.
    instances: HashMap<typed::FunctionId, FunctionId>,
    /// The number of nodes of the functions that are complete.
    nodes: usize,
}

/// A function under construction, and the scalars of the locals that are bound in it.
struct Frame<'l, 'm> {
    lowerer: &'l mut Lowerer<'m>,
    b: FunctionBuilder,
    locals: HashMap<LocalId, Vec<Value>>,
    /// The index of a loop, in the function of its body.
    index: Option<Value>,
}

impl<'m> Lowerer<'m> {
    /// Lowers the function instances.
    fn new(model: &'m typed::Model, limits: SizeLimits) -> Result<Lowerer<'m>, SizeError> {
        let mut module = Module { limits, ..Module::default() };
        let instances = model.functions.keys().map(|id| (*id, module.reserve())).collect();
        let mut lowerer = Lowerer { model, module, instances, nodes: 0 };
        for (id, function) in &model.functions {
            lowerer.function(*id, function)?;
        }
        lowerer.custom_derivatives();
        Ok(lowerer)
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
        let bound = locals.iter().zip(counts).map(|(local, n)| (*local, values.by_ref().take(n).collect()));
        let locals = bound.collect();
        Frame { lowerer: self, b, locals, index: None }
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

    fn function(&mut self, id: typed::FunctionId, function: &typed::Function) -> Result<(), SizeError> {
        let locals: Vec<LocalId> = function.captures.iter().chain(&function.params).copied().collect();
        let lowered = self.frame(&function.name, &locals, None).finish(&function.body)?;
        self.module.define(self.instances[&id], lowered);
        Ok(())
    }

    /// Finds the scalar to which each tangent of a custom derivative belongs.
    fn custom_derivatives(&mut self) {
        let model = self.model;
        for (id, function) in &model.functions {
            let Some(custom) = &function.custom_derivative else { continue };
            let types = |local: &LocalId| model.scalars(&model.locals[local.0 as usize].ty);
            let captures: usize = function.captures.iter().map(|l| types(l).len()).sum();
            let mut tangents = Vec::new();
            for param in &custom.params {
                let start = captures + function.params[..*param].iter().map(|l| types(l).len()).sum::<usize>();
                let scalars = types(&function.params[*param]).into_iter().zip(start as u32..);
                tangents.extend(scalars.map(|(ty, i)| (ty == super::Type::Real).then_some(i)));
            }
            let derivative = CustomDerivative { function: self.instances[&custom.function], tangents };
            self.module.custom_derivatives.insert(self.instances[id], derivative);
        }
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

    fn part(&mut self, part: &typed::Part) -> Result<LoweredPart, SizeError> {
        let (used, lets) = lets_for(self.model, [&part.shape]);
        let (params, mut locals) = self.used_params(&used);
        locals.extend([part.u, part.v]);
        let mut frame = self.frame(&part.name, &locals, None);
        frame.bind(&lets)?;
        let shape = frame.expr(&part.shape)?;
        frame.locals.insert(part.local, shape);
        let function = frame.add(&part.point)?;
        let tolerance = part.tolerance.as_ref().map(|t| self.of_params("tolerance", t)).transpose()?;
        Ok(LoweredPart { surface: ParameterFunction { function, params }, tolerance })
    }

    fn measure(&mut self, measure: &typed::Measure) -> Result<LoweredMeasure, SizeError> {
        let value = self.of_params(&measure.name, &measure.value)?;
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
        Ok(LoweredMeasure { value, limits })
    }

    /// A function of the parameters with the value of an expression of the model's body.
    fn of_params(&mut self, name: &str, expr: &Expr) -> Result<FunctionId, SizeError> {
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

impl Frame<'_, '_> {
    /// Binds the `let`s of the model's body that the expressions need.
    fn body_for<'e>(&mut self, exprs: impl IntoIterator<Item = &'e Expr>) -> Result<(), SizeError> {
        self.bind(&lets_for(self.lowerer.model, exprs).1)
    }

    fn bind(&mut self, lets: &[(LocalId, &Expr)]) -> Result<(), SizeError> {
        for (local, value) in lets {
            let values = self.expr(value)?;
            self.locals.insert(*local, values);
        }
        Ok(())
    }

    /// Completes a function of the value of an expression.
    fn finish(mut self, expr: &Expr) -> Result<super::Function, SizeError> {
        let results = self.expr(expr)?;
        self.lowerer.nodes += self.b.node_count();
        let mut names = Vec::new();
        self.lowerer.model.name_scalars("", &expr.ty, &mut |name, _| names.push(name));
        Ok(self.b.finish(names.into_iter().zip(results)))
    }

    /// Adds a function of the value of an expression to the module.
    fn add(self, expr: &Expr) -> Result<FunctionId, SizeError> {
        let Frame { lowerer, b, locals, index } = self;
        let function = Frame { lowerer: &mut *lowerer, b, locals, index }.finish(expr)?;
        Ok(lowerer.module.add(function))
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
