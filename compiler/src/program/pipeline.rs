//! All stages after the check, in their order: those that every script passes through, and those that run when their
//! results are first asked for.

use super::bounds::BoundsJacobian;
use super::compile::{Options, Stage};
use super::evaluators::{Evaluator, Evaluators, OPTIONS};
use super::functions::{self, BodyFunction, ModelFunctions, PartFunctions, pick, positions};
use super::measures::MeasureFunctions;
use super::{Measure, Order, Part, Program, jacobians};
use crate::check::typed;
use crate::diagnostic::{self, Diagnostic};
use crate::diff::{self, DiffError};
use crate::ir::decisions::decisions;
use crate::ir::hash::HashMap;
use crate::ir::hoist::grid::{GridSplit, split_grid};
use crate::ir::hoist::prelude::split_all;
use crate::ir::keep::{erase, keep_of};
use crate::ir::merge::{merge_bodies, merge_named};
use crate::ir::reassociate::reassociate;
use crate::ir::separable::decompose;
use crate::ir::{self, FunctionId, LoweredModel, Module, Parameter, ParameterFunction, SizeError, SizeLimits, lower};
use crate::jit::{Code, JitError, KernelShape, Output};
use crate::source::{Sources, Span};
use crate::workers::Workers;
use std::sync::Arc;
use thiserror::Error;

/// Why a checked model cannot be compiled.
#[derive(Clone, Debug, Error)]
pub(super) enum BuildError {
    #[error(transparent)]
    Size(#[from] SizeError),
    #[error(transparent)]
    Diff(#[from] DiffError),
    #[error(transparent)]
    Jit(#[from] JitError),
    #[error("a surface cannot be trimmed in a function that calls itself at run time")]
    RecursiveKeep(Span),
}

impl BuildError {
    /// For the user; `model` is the place where no other is known.
    pub(super) fn diagnostic(&self, model: Span) -> Diagnostic {
        match self {
            BuildError::Size(e) => e.diagnostic(),
            BuildError::Diff(e) => e.diagnostic(),
            BuildError::RecursiveKeep(span) => Diagnostic::new(diagnostic::Code::Recursion, *span, self.to_string()),
            BuildError::Jit(e) => Diagnostic::new(diagnostic::Code::MachineCode, model, e.to_string()),
        }
    }
}

/// The stages after the check, with machine code for points and Jacobians.
pub(super) fn build(
    typed: typed::Model,
    sources: &Sources,
    options: &Options,
    done: &mut dyn FnMut(Stage),
) -> Result<Program, BuildError> {
    let limits = SizeLimits { nodes: options.operations, ..SizeLimits::default() };
    let lowered = lower::lower_within(&typed, limits)?;
    done(Stage::Lower);
    let parameters: Vec<_> = typed.params.iter().map(|p| p.declared.clone()).collect();
    let names = parameters.iter().map(|p| Parameter::real(p.name.clone())).collect();
    let functions = model_functions(names, lowered, options)?;
    done(Stage::Differentiate);
    // At once: functions that both orders call are compiled once, and the memory of code is had once.
    let (points, jacobians) = (points(&functions), jacobians(&functions));
    let shapes = [&points.shapes[..], &jacobians.shapes].concat();
    let routines = functions.routines();
    let (code, _) = Code::compile(&functions.module, &shapes, &routines, OPTIONS, options.workers)?;
    let (code, first) = (Arc::new(code), points.shapes.len());
    let made = [(Order::Points, points.with(code.clone(), 0)), (Order::Jacobian, jacobians.with(code.clone(), first))];
    let evaluators = Evaluators::new(options.workers, made);
    done(Stage::MachineCode);
    let active = |patch: usize| functions.parts[patch].jacobian.active.clone();
    let parts = typed.parts.iter().enumerate().map(|(i, part)| Part {
        name: part.name.clone(),
        group: part.group.clone(),
        active: active(i),
    });
    let mut patches: Vec<Part> = parts.collect();
    for (i, part) in functions.trimmed.iter().enumerate() {
        let Part { name, group, .. } = &patches[*part];
        let (name, group) = (format!("{name}.keep"), group.clone());
        patches.push(Part { name, group, active: active(typed.parts.len() + i) });
    }
    let measures = typed.measures.iter().map(|m| Measure {
        name: m.name.clone(),
        doc: m.doc.clone(),
        parts: m.parts.clone(),
        unit: m.dimension.unit(),
        span: m.span,
    });
    Ok(Program {
        patches,
        measures: measures.collect(),
        figures: typed.figures.iter().map(|taken| taken.declared.clone()).collect(),
        parameters,
        sources: sources.clone(),
        typed,
        functions,
        routines: code,
        evaluators,
        limits: options.limits,
    })
}

/// From the functions that the lowering wrote to prelude and bodies, with their derivatives by the parameters.
fn model_functions(
    params: Vec<Parameter>,
    LoweredModel { mut module, parts, measures, bounds, requires }: LoweredModel,
    options: &Options,
) -> Result<ModelFunctions, BuildError> {
    let (mut surfaces, tolerances): (Vec<ParameterFunction>, Vec<Option<FunctionId>>) =
        parts.into_iter().map(|p| (p.surface, p.tolerance)).unzip();
    let mut roots: Vec<FunctionId> = surfaces.iter().map(|s| s.function).collect();
    roots.push(bounds);
    roots.extend(requires.iter().map(|r| r.condition.function));
    roots.extend(tolerances.iter().flatten());
    roots.extend(measures.iter().flat_map(|m| [Some(m.value), m.limits]).flatten());

    merge_named(&mut module, &roots);
    // Derivatives that the script takes become functions; calls what they call.
    diff::expand(&mut module, &roots)?;
    ir::inline(&mut module, &roots)?;
    ir::simplify(&mut module, &roots);
    let trimmed = keep_functions(&mut module, &mut surfaces)?;
    erase(&mut module, &roots);
    // Values of the parameters, of u and of v apart. Texts show surfaces as they are before they are decomposed.
    for surface in &surfaces {
        reassociate(&mut module, surface.function, surface.params.len());
    }
    let decomposed: Vec<ParameterFunction> = surfaces
        .iter()
        .map(|s| ParameterFunction { function: decompose(&mut module, s.function, s.params.len()), ..s.clone() })
        .collect();
    merge_named(&mut module, &decomposed.iter().map(|s| s.function).collect::<Vec<_>>());
    // The prelude has all that depends on the parameters alone; bodies the rest, one for parts that are alike.
    let count = params.len();
    let mut split = split_all(&mut module, params, &decomposed);
    merge_bodies(&mut module, &mut split);
    // Again, as constants were not captured and came back to the points.
    let mut known: HashMap<FunctionId, FunctionId> = HashMap::default();
    for body in &mut split.bodies {
        let (function, captures) = (body.function, body.captures.len());
        body.function = *known.entry(function).or_insert_with(|| decompose(&mut module, function, captures));
    }
    // Derivatives by the parameters: of bounds, of measures, of the prelude, and of the bodies in its directions.
    let bounds_jacobian = BoundsJacobian::new(&mut module, bounds, count)?;
    let of_measure = |measure| MeasureFunctions::new(&mut module, measure, count);
    let measures = measures.into_iter().map(of_measure).collect::<Result<_, _>>()?;
    let (prelude_jacobian, entries) = functions::prelude_jacobian(&mut module, split.prelude)?;
    let (bodies, of_part) = functions::bodies(&split.bodies);
    let of_parts = split.bodies.iter().map(|part| functions::entries_of_part(&part.captures, &entries));
    let of_parts: Vec<_> = of_part.into_iter().zip(of_parts).collect();
    let jacobians = jacobians::of_parts(&mut module, &bodies, &of_parts, options.workers)?;
    let parts = surfaces.into_iter().zip(split.bodies).zip(of_parts).zip(jacobians);
    let parts = parts.map(|(((surface, part), (body, entries)), jacobian)| PartFunctions {
        surface,
        body,
        captures: part.captures,
        jacobian,
        entries,
    });
    let functions = ModelFunctions {
        module: Arc::default(),
        bounds,
        bounds_jacobian,
        requires,
        prelude: split.prelude,
        prelude_jacobian,
        bodies,
        parts: parts.collect(),
        trimmed,
        tolerances,
        measures,
    };
    Ok(functions.drop_unreached(module))
}

/// Adds to some surfaces the functions of where the trimmed ones are there, and returns which those are.
fn keep_functions(module: &mut Module, surfaces: &mut Vec<ParameterFunction>) -> Result<Vec<usize>, BuildError> {
    let functions: Vec<FunctionId> = surfaces.iter().map(|s| s.function).collect();
    let keeps = keep_of(module, &functions).map_err(BuildError::RecursiveKeep)?;
    let trimmed: Vec<usize> = (0..keeps.len()).filter(|i| keeps[*i].is_some()).collect();
    for (i, function) in keeps.iter().enumerate().filter_map(|(i, keep)| Some((i, (*keep)?))) {
        surfaces.push(ParameterFunction { function, ..surfaces[i].clone() });
    }
    Ok(trimmed)
}

/// An evaluator before its code.
struct Uncompiled {
    module: Arc<Module>,
    functions: Vec<FunctionId>,
    of_part: Vec<usize>,
    splits: Vec<GridSplit>,
    shapes: Vec<KernelShape>,
}

impl Uncompiled {
    /// Functions `(captures.., values..) -> results..` at scattered sites.
    fn new(
        module: Arc<Module>,
        functions: Vec<FunctionId>,
        of_part: Vec<usize>,
        values: usize,
        output: Output,
    ) -> Uncompiled {
        let captures = |f: &FunctionId| module.function(*f).params.len() - values;
        let shapes = functions.iter().map(|f| KernelShape { function: *f, captures: captures(f), output }).collect();
        Uncompiled { module, functions, of_part, splits: Vec::new(), shapes }
    }

    fn with(self, code: Arc<Code>, first: usize) -> Evaluator {
        let Uncompiled { module, functions, of_part, splits, shapes } = self;
        Evaluator { module, functions, of_part, splits, shapes, code, first }
    }

    fn compiled(self, workers: Workers) -> Result<Evaluator, BuildError> {
        let (code, _) = Code::compile(&self.module, &self.shapes, &[], OPTIONS, workers)?;
        Ok(self.with(Arc::new(code), 0))
    }
}

/// The functions of the points of all parts.
fn points(model: &ModelFunctions) -> Uncompiled {
    let functions = model.bodies.iter().map(|b| b.points).collect();
    let of_part = model.parts.iter().map(|p| p.body).collect();
    Uncompiled::new(model.module.clone(), functions, of_part, 2, Output::Store)
}

/// The functions of the Jacobians of all parts.
fn jacobians(model: &ModelFunctions) -> Uncompiled {
    let functions: Vec<FunctionId> = model.parts.iter().map(|p| p.jacobian.function).collect();
    let (different, of_part) = different(&functions);
    Uncompiled::new(model.module.clone(), different, of_part, 2, Output::Store)
}

/// The functions of an order at the points of all parts, compiled.
pub(super) fn differentiated(
    evaluators: &Evaluators,
    model: &ModelFunctions,
    order: Order<'_>,
) -> Result<Evaluator, BuildError> {
    let of_bodies = |module, functions, values, output| -> Result<Uncompiled, BuildError> {
        let (module, functions) = of_bodies(module, functions, model, order)?;
        let of_part = model.parts.iter().map(|p| p.body).collect();
        Ok(Uncompiled::new(module, functions, of_part, values, output))
    };
    let uncompiled = match order {
        Order::Points => points(model),
        Order::Jacobian => jacobians(model),
        Order::Partials | Order::Decisions => of_bodies(&model.module, points(model).functions, 2, Output::Store)?,
        Order::Pullback(_) => of_bodies(&model.module, points(model).functions, 5, Output::Accumulate)?,
        Order::SecondPartials => {
            let partials = evaluators.get(model, false, Order::Partials).map_err(Clone::clone)?;
            of_bodies(&partials.module, partials.functions.clone(), 2, Output::Store)?
        }
    };
    uncompiled.compiled(evaluators.workers)
}

/// The same functions for grids: values of columns, values of rows, and what is left at every point.
pub(super) fn split_for_grids(
    evaluators: &Evaluators,
    model: &ModelFunctions,
    order: Order<'_>,
) -> Result<Evaluator, BuildError> {
    let scattered = evaluators.get(model, false, order).map_err(Clone::clone)?;
    let (mut module, mut functions) = (Module::clone(&scattered.module), scattered.functions.clone());
    module.drop_unreached(&mut functions);
    let (mut splits, mut shapes) = (Vec::new(), Vec::new());
    for (function, KernelShape { captures, output, .. }) in functions.iter().zip(&scattered.shapes) {
        let split = split_grid(&mut module, *function, *captures);
        let with_row = captures + split.row_values;
        for (function, captures) in [(split.columns, *captures), (split.rows, *captures), (split.inner, with_row)] {
            shapes.push(KernelShape { function, captures, output: *output });
        }
        splits.push(split);
    }
    let of_part = scattered.of_part.clone();
    Uncompiled { module: Arc::new(module), functions, of_part, splits, shapes }.compiled(evaluators.workers)
}

/// The different ones of some functions, and which of them each is.
fn different(functions: &[FunctionId]) -> (Vec<FunctionId>, Vec<usize>) {
    let mut different = functions.to_vec();
    different.sort_unstable();
    different.dedup();
    let place = |f: &FunctionId| different.binary_search(f).unwrap_or(0);
    let of_part = functions.iter().map(place).collect();
    (different, of_part)
}

/// A derivative of functions of all bodies, or their decisions, in a module of its own.
fn of_bodies(
    module: &Module,
    mut functions: Vec<FunctionId>,
    model: &ModelFunctions,
    order: Order<'_>,
) -> Result<(Arc<Module>, Vec<FunctionId>), BuildError> {
    let mut module = module.clone();
    module.drop_unreached(&mut functions);
    for (function, BodyFunction { captures, varied, .. }) in functions.iter_mut().zip(&model.bodies) {
        *function = match order {
            Order::Pullback(_) => {
                let wrt: Vec<u32> = (0..*varied as u32).collect();
                diff::pullback(&mut module, *function, &wrt, false)?
            }
            Order::SecondPartials => second_partials(&mut module, *function, *captures as u32)?,
            Order::Decisions => decisions(&mut module, *function, *captures)?,
            Order::Points | Order::Partials | Order::Jacobian => partials(&mut module, *function, *captures as u32)?,
        };
    }
    module.drop_unreached(&mut functions);
    Ok((Arc::new(module), functions))
}

/// `(C.., u, v) -> (point, du, dv)`.
fn partials(module: &mut Module, points: FunctionId, captures: u32) -> Result<FunctionId, BuildError> {
    let uv = [captures, captures + 1];
    let (first, pattern) = diff::jacobian(module, points, &uv)?;
    let entries = positions(&pattern, 3);
    let mut picks: Vec<Option<usize>> = (0..3).map(Some).collect();
    picks.extend(uv.iter().flat_map(|p| [0, 1, 2].map(|r| entries.get(&(r, *p)).copied())));
    let partials = pick(module.function(first), "partials", &picks);
    Ok(module.add(partials))
}

/// `(C.., u, v) -> (point, du, dv, duu, duv, dvv)` from the partials.
fn second_partials(module: &mut Module, partials: FunctionId, captures: u32) -> Result<FunctionId, BuildError> {
    let [u, v] = [captures, captures + 1];
    let (second, pattern) = diff::jacobian(module, partials, &[u, v])?;
    let entries = positions(&pattern, 9);
    let mut picks: Vec<Option<usize>> = (0..9).map(Some).collect();
    // The partials of du are duu and duv; of those of dv, dvv is new.
    for (results, param) in [(3..6, u), (3..6, v), (6..9, v)] {
        picks.extend(results.map(|r| entries.get(&(r, param)).copied()));
    }
    let second = pick(module.function(second), "second_partials", &picks);
    Ok(module.add(second))
}
