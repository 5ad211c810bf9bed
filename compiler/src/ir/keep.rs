//! Trimmed surfaces: [`Binary::Keep`] marks the points of a surface that are there where a value is positive.
//! [`keep_of`] makes a function of that value, [`erase`] takes the marks out of the surface.
//!
//! Whatever a script does with the points of a trimmed surface, the result is trimmed in the same places: all marks
//! that a function's results depend on count, also those in functions that it calls, in the side of a branch that is
//! taken, and in every iteration of a loop.

use super::builder::{Image, Rebuild, Step};
use super::call_graph::CallGraph;
use super::hash::HashMap;
use super::{Binary, Function, FunctionBuilder, FunctionId, Module, Op, Parameter, Type, Value};
use crate::source::Span;

/// The value of what is not trimmed, as in one side of a branch, in millimetres: it is finite, as results must be, and
/// larger than any model (10 m).
const EVERYWHERE: f64 = 1e6;

/// For functions `(args..) -> (x, y, z)` a function `(args..) -> (keep, 0, 0)` of the least of the values where points
/// are kept; `None` for those in which nothing is trimmed.
///
/// # Errors
/// The place of a mark in a function that runs itself: how many marks count there is not known.
pub(crate) fn keep_of(module: &mut Module, functions: &[FunctionId]) -> Result<Vec<Option<FunctionId>>, Span> {
    let graph = CallGraph::new(module, functions);
    let mut extended: HashMap<FunctionId, FunctionId> = HashMap::default();
    for id in &graph.order {
        let trims = |op: &Op| {
            matches!(op, Op::Binary(Binary::Keep, ..)) || op.functions().iter().any(|f| extended.contains_key(f))
        };
        let Some(mark) = module.function(*id).nodes.iter().find(|node| trims(&node.op)) else { continue };
        if graph.is_recursive(*id) {
            return Err(mark.span);
        }
        let function = Marks { module, extended: &extended }.collected(*id);
        extended.insert(*id, module.add(function));
    }
    Ok(functions.iter().map(|id| extended.get(id).map(|f| alone(module, *f))).collect())
}

/// Takes the marks out of some functions, and of all that they run.
pub(crate) fn erase(module: &mut Module, functions: &[FunctionId]) {
    for id in CallGraph::new(module, functions).order {
        let function = module.function(id);
        let is_mark = |op: &Op| matches!(op, Op::Binary(Binary::Keep, ..));
        if !function.nodes.iter().any(|node| is_mark(&node.op)) {
            continue;
        }
        let mut builder = FunctionBuilder::like(function);
        let params = builder.params();
        let mut rebuild = Rebuild::new(function, &params);
        while let Some(Step { node, op, .. }) = rebuild.next(&mut builder) {
            rebuild.push(Image::One(match op {
                Op::Binary(Binary::Keep, a, _) => a,
                op => builder.emit(&op, node.ty),
            }));
        }
        let results = rebuild.results();
        let erased = builder.finish_like(function, results);
        module.define(id, erased);
    }
    super::validate::after_pass(module, "erase");
}

/// The last result of a function with two zeros.
fn alone(module: &mut Module, id: FunctionId) -> FunctionId {
    let function = module.function(id);
    let mut builder = FunctionBuilder::new("keep", function.params.clone());
    let args = builder.params();
    let keep = builder.splice(function, &args).pop().unwrap_or(Value::NONE);
    let zero = builder.real(0.0);
    let results = [("keep", keep), ("none", zero), ("none", zero)];
    module.add(builder.finish(results.map(|(name, value)| (name.to_owned(), value))))
}

struct Marks<'m> {
    module: &'m mut Module,
    /// The functions with marks that are done: those with one more result.
    extended: &'m HashMap<FunctionId, FunctionId>,
}

impl Marks<'_> {
    /// The function with one more result: the least value of its marks.
    fn collected(&mut self, id: FunctionId) -> Function {
        let function = self.module.function(id).clone();
        let mut builder = FunctionBuilder::like(&function);
        let params = builder.params();
        let mut rebuild = Rebuild::new(&function, &params);
        let mut least = builder.real(EVERYWHERE);
        while let Some(Step { node, op, .. }) = rebuild.next(&mut builder) {
            let (image, mark) = match op {
                Op::Binary(Binary::Keep, a, mark) => (Image::One(a), Some(mark)),
                op => match self.structured(&mut builder, &op) {
                    Some(mut results) => {
                        let mark = results.pop();
                        (Image::Many(results), mark)
                    }
                    None => (Image::One(builder.emit(&op, node.ty)), None),
                },
            };
            if let Some(mark) = mark {
                least = builder.binary(Binary::Min, least, mark);
            }
            rebuild.push(image);
        }
        let names = function.result_names.iter().cloned().chain(["keep".to_owned()]);
        let results = rebuild.results().into_iter().chain([least]);
        builder.finish(names.zip(results))
    }

    /// The results of an operation that runs functions with marks, and their least value.
    fn structured(&mut self, builder: &mut FunctionBuilder, op: &Op) -> Option<Vec<Value>> {
        if !op.functions().iter().any(|f| self.extended.contains_key(f)) {
            return None;
        }
        let types = |module: &Module, f: FunctionId| {
            module.function(f).result_types().into_iter().chain([Type::Real]).collect::<Vec<_>>()
        };
        match op {
            Op::Call { function, args } => {
                let types = types(self.module, *function);
                Some(builder.call(self.extended[function], args.clone(), &types))
            }
            Op::If { condition, then, otherwise, args } => {
                let types = types(self.module, *then);
                let [then, otherwise] = [*then, *otherwise].map(|side| match self.extended.get(&side) {
                    Some(extended) => *extended,
                    None => {
                        let function = self.collected(side);
                        self.module.add(function)
                    }
                });
                Some(builder.if_(*condition, then, otherwise, args.clone(), &types))
            }
            Op::Loop { count, body, init, invariant } => {
                let body = self.carried(*body, init.len());
                let everywhere = builder.real(EVERYWHERE);
                let init = init.iter().copied().chain([everywhere]).collect();
                Some(builder.loop_(*count, body, init, invariant.clone()))
            }
            _ => None,
        }
    }

    /// The body of a loop with `carried` values, which carries the least value of its marks as one more.
    fn carried(&mut self, body: FunctionId, carried: usize) -> FunctionId {
        let function = self.module.function(self.extended[&body]);
        let mut params = function.params.clone();
        params.insert(1 + carried, Parameter::real("keep"));
        let mut builder = FunctionBuilder::new(function.name.clone(), params);
        let mut args = builder.params();
        let before = args.remove(1 + carried);
        let mut results = builder.splice(function, &args);
        if let Some(last) = results.last_mut() {
            *last = builder.binary(Binary::Min, before, *last);
        }
        let function = builder.finish_like(function, results);
        self.module.add(function)
    }
}
