//! Inlining.

use super::builder::{Image, Rebuild, Step};
use super::call_graph::CallGraph;
use super::hash::HashMap;
use super::scalar::Scalar;
use super::size::SizeError;
use super::{Function, FunctionBuilder, FunctionId, Module, Op, Value};
use crate::source::Span;

/// Inlines the calls in the roots and in everything that they reach, within the module's limits; calls of recursive
/// functions and of functions with custom derivatives stay. A branch whose condition is thereby known is replaced by
/// the side that is taken.
///
/// # Errors
/// If the program would exceed a limit; the module is then partly inlined, and still valid.
pub(crate) fn inline(module: &mut Module, roots: &[FunctionId]) -> Result<(), SizeError> {
    let limits = module.limits;
    let graph = CallGraph::new(module, roots);
    let mut nesting: HashMap<FunctionId, usize> = HashMap::default();
    let mut nodes = 0;
    for id in &graph.order {
        let old = module.function(*id);
        let name = old.name.clone();
        let mut inlined = None;
        if has_calls_to_inline(old, &graph) {
            let inliner = Inliner { module, graph: &graph, room: limits.nodes.saturating_sub(nodes) };
            let mut builder = FunctionBuilder::like(old);
            let params = builder.params();
            match inliner.splice(&mut builder, old, &params) {
                Ok(results) => inlined = Some(builder.finish_like(old, results)),
                Err(span) => return Err(SizeError::too_large(name, span, limits.nodes)),
            }
        }
        let function = inlined.as_ref().unwrap_or(old);
        nodes += function.nodes.len();
        let depth = nesting_of(function, &nesting);
        nesting.insert(*id, depth);
        let Some(inlined) = inlined else {
            if nodes > limits.nodes {
                let span = old.nodes.last().map_or(Span::default(), |n| n.span);
                return Err(SizeError::too_large(name, span, limits.nodes));
            }
            continue;
        };
        if depth > limits.nesting {
            let deep = inlined.nodes.iter().find(|n| n.op.is_structured());
            let span = deep.map_or(Span::default(), |n| n.span);
            return Err(SizeError::TooDeep { function: name, span, limit: limits.nesting });
        }
        module.define(*id, inlined);
    }
    super::validate::after_pass(module, "inline");
    Ok(())
}

/// Whether a function has a call or a branch that can be inlined.
fn has_calls_to_inline(function: &Function, graph: &CallGraph) -> bool {
    function.nodes.iter().any(|node| match &node.op {
        Op::Call { function, .. } => !graph.is_recursive(*function),
        Op::If { condition, .. } => matches!(function.op(*condition), Op::Bool(_)),
        _ => false,
    })
}

/// The depth to which the branches and loops of a function are nested, given that of the functions that it names. The
/// calls that are left are not counted: they are recursive.
fn nesting_of(function: &Function, nesting: &HashMap<FunctionId, usize>) -> usize {
    let bodies = function.nodes.iter().filter(|n| matches!(n.op, Op::If { .. } | Op::Loop { .. }));
    bodies.flat_map(|n| n.op.functions()).map(|f| nesting.get(&f).copied().unwrap_or(0) + 1).max().unwrap_or(0)
}

struct Inliner<'m> {
    module: &'m Module,
    graph: &'m CallGraph,
    /// Most nodes that the function may have.
    room: usize,
}

impl Inliner<'_> {
    /// Puts a function's nodes into a builder; returns its results.
    ///
    /// # Errors
    /// If there is no more room: the span of the node that does not fit.
    fn splice(&self, builder: &mut FunctionBuilder, function: &Function, args: &[Value]) -> Result<Vec<Value>, Span> {
        let mut rebuild = Rebuild::new(function, args);
        while let Some(Step { node, op, .. }) = rebuild.next(builder) {
            if builder.node_count() > self.room {
                return Err(node.span);
            }
            rebuild.push(match self.callee(builder, &op) {
                Some((callee, args)) => Image::Many(self.splice(builder, self.module.function(callee), args)?),
                None => Image::One(builder.emit(&op, node.ty)),
            });
        }
        Ok(rebuild.results())
    }

    /// The function to inline and its arguments, if the operation is a call or a branch whose condition is known.
    fn callee<'o>(&self, builder: &FunctionBuilder, op: &'o Op) -> Option<(FunctionId, &'o [Value])> {
        let (function, args) = match op {
            Op::Call { function, args } => (*function, args),
            Op::If { condition, then, otherwise, args } => match builder.constant(*condition)? {
                Scalar::Bool(c) => (if c { *then } else { *otherwise }, args),
                _ => return None,
            },
            _ => return None,
        };
        let stays = self.graph.is_recursive(function) || self.module.custom_derivatives.contains_key(&function);
        (!stays).then_some((function, args))
    }
}
