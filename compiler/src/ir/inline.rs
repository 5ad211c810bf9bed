//! Replaces calls by what they call.

use super::graph::References;
use super::hash::HashMap;
use super::scalar::Scalar;
use super::{Function, FunctionBuilder, FunctionId, Module, Op, Value};
use crate::source::Span;

/// How large a program may grow.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Nodes of all functions together.
    pub nodes: usize,
    /// How deep branches and loops may be nested.
    pub nesting: usize,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits { nodes: 400_000, nesting: 100 }
    }
}

/// Why a program cannot be inlined.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InlineError {
    /// It would have more nodes than the limit.
    #[error("the program is too large: '{function}' calls for more than {limit} operations in all")]
    TooLarge {
        /// Where the limit was met.
        function: String,
        /// The call there.
        span: Span,
        /// The limit.
        limit: usize,
    },
    /// Its branches and loops would be nested deeper than the limit.
    #[error("the program is too deep: '{function}' nests more than {limit} branches and loops")]
    TooDeep {
        /// Where the limit was met.
        function: String,
        /// The branch or loop there.
        span: Span,
        /// The limit.
        limit: usize,
    },
}

impl InlineError {
    /// Where in the source.
    #[must_use]
    pub fn span(&self) -> Span {
        match self {
            InlineError::TooLarge { span, .. } | InlineError::TooDeep { span, .. } => *span,
        }
    }
}

/// Inlines all calls of functions that are not recursive and have no derivative by hand, in the roots and everything that they reach. Branches
/// whose condition is thereby known are inlined as well.
///
/// # Errors
/// If the program would exceed a limit; the module is then partly inlined, and still valid.
pub fn inline(module: &mut Module, roots: &[FunctionId], limits: Limits) -> Result<(), InlineError> {
    let references = References::new(module, roots);
    let mut nesting: HashMap<FunctionId, usize> = HashMap::default();
    let mut nodes = 0;
    for id in references.order.clone() {
        let old = module.function(id);
        if !calls_any(old, &references) {
            nodes += old.nodes.len();
            if nodes > limits.nodes {
                let span = old.nodes.last().map_or(Span::default(), |n| n.span);
                return Err(InlineError::TooLarge { function: old.name.clone(), span, limit: limits.nodes });
            }
            let depth = nesting_of(old, &nesting);
            nesting.insert(id, depth);
            continue;
        }
        let mut builder = FunctionBuilder::new(old.name.clone(), old.params.clone());
        let params = builder.params();
        let inliner = Inliner { module, references: &references, room: limits.nodes.saturating_sub(nodes) };
        let results = inliner.splice(&mut builder, old, &params).map_err(|span| InlineError::TooLarge {
            function: old.name.clone(),
            span,
            limit: limits.nodes,
        })?;
        let new = builder.finish(old.result_names.iter().cloned().zip(results));
        nodes += new.nodes.len();
        let depth = nesting_of(&new, &nesting);
        nesting.insert(id, depth);
        if depth > limits.nesting {
            let deep = new.nodes.iter().find(|n| !n.op.functions().is_empty());
            let span = deep.map_or(Span::default(), |n| n.span);
            return Err(InlineError::TooDeep { function: new.name, span, limit: limits.nesting });
        }
        module.define(id, new);
    }
    super::validate::after_pass(module, "inline");
    Ok(())
}

/// Whether there is something in a function to be inlined.
fn calls_any(function: &Function, references: &References) -> bool {
    function.nodes.iter().any(|node| match &node.op {
        Op::Call { function, .. } => !references.is_recursive(*function),
        Op::If { condition, .. } => matches!(function.op(*condition), Op::Bool(_)),
        _ => false,
    })
}

/// How deep the branches and loops of a function are nested, given that of those that it names. Calls that are
/// left are recursive, and not counted.
fn nesting_of(function: &Function, nesting: &HashMap<FunctionId, usize>) -> usize {
    let bodies = function.nodes.iter().filter(|n| matches!(n.op, Op::If { .. } | Op::Loop { .. }));
    bodies.flat_map(|n| n.op.functions()).map(|f| nesting.get(&f).copied().unwrap_or(0) + 1).max().unwrap_or(0)
}

struct Inliner<'m> {
    module: &'m Module,
    references: &'m References,
    room: usize,
}

impl Inliner<'_> {
    /// Puts a function's nodes into a builder; the span of the node at which there is no more room as an error.
    fn splice(&self, builder: &mut FunctionBuilder, function: &Function, args: &[Value]) -> Result<Vec<Value>, Span> {
        let mut values: Vec<Spliced> = Vec::with_capacity(function.nodes.len());
        for node in &function.nodes {
            if builder.len() > self.room {
                return Err(node.span);
            }
            builder.set_span(node.span);
            let spliced = match &node.op {
                Op::Param(i) => Spliced::One(args[*i as usize]),
                Op::Project(multi, k) => match &values[multi.0 as usize] {
                    Spliced::Many(results) => Spliced::One(results[*k as usize]),
                    Spliced::One(multi) => Spliced::One(builder.project(*multi, *k, node.ty)),
                },
                op => {
                    let op = op.map_operands(|v| values[v.0 as usize].one());
                    match self.called(builder, &op) {
                        Some((callee, args)) => {
                            Spliced::Many(self.splice(builder, self.module.function(callee), &args)?)
                        }
                        None => Spliced::One(builder.emit(&op, node.ty)),
                    }
                }
            };
            values.push(spliced);
        }
        Ok(function.results.iter().map(|r| values[r.0 as usize].one()).collect())
    }

    /// The function to inline, if the operation is a call of one, or a branch that is known to be taken.
    fn called(&self, builder: &FunctionBuilder, op: &Op) -> Option<(FunctionId, Vec<Value>)> {
        let (function, args) = match op {
            Op::Call { function, args } => (*function, args),
            Op::If { condition, then, otherwise, args } => match builder.constant(*condition)? {
                Scalar::Bool(c) => (if c { *then } else { *otherwise }, args),
                _ => return None,
            },
            _ => return None,
        };
        let stays = self.references.is_recursive(function) || self.module.by_hand.contains_key(&function);
        (!stays).then(|| (function, args.clone()))
    }
}

/// What a node has become.
enum Spliced {
    One(Value),
    /// The results of an inlined call.
    Many(Vec<Value>),
}

impl Spliced {
    fn one(&self) -> Value {
        match self {
            Spliced::One(value) => *value,
            // Only projections use a call's node.
            Spliced::Many(_) => Value(u32::MAX),
        }
    }
}
