//! The origin of a non-finite result.

use super::{Computed, Interpreter, RunError, STACK_LEFT, STACK_MORE, one};
use crate::ir::scalar::Scalar;
use crate::ir::{FunctionId, Op, Value};
use crate::source::Span;

/// The origin of a non-finite result.
pub(super) enum Origin {
    /// An operation whose operands were finite.
    Node(Span),
    /// A parameter, with the place of its first use.
    Param(usize, Span),
}

/// The next step of the search.
enum Next {
    /// The node itself is the origin.
    Node,
    Operand(Value),
    /// The origin lies in a function that the node runs.
    Inner(Span),
}

impl Interpreter<'_> {
    /// Follows result `k` of a function, which is not finite for these arguments.
    pub(super) fn origin(
        &mut self,
        function: FunctionId,
        args: &[Scalar],
        k: usize,
        span: Span,
    ) -> Result<Origin, RunError> {
        let function = self.module.function(function);
        let values = self.evaluate(function, args, span)?;
        self.depth = self.depth.checked_sub(1).ok_or(RunError::Depth(span))?;
        let mut at = function.results[k];
        let mut used = span;
        let origin = loop {
            let node = &function.nodes[at.0 as usize];
            let next = match &node.op {
                Op::Param(i) => break Origin::Param(*i as usize, used),
                Op::Project(multi, k) => self.origin_inside(&values, function.op(*multi), *k as usize, node.span)?,
                Op::Select(c, a, b) => {
                    Next::Operand(if one(&values, *c) == Some(Scalar::Bool(true)) { *a } else { *b })
                }
                op => {
                    let bad = |v: &Value| one(&values, *v).is_some_and(|x| !x.is_finite());
                    op.operands().into_iter().find(bad).map_or(Next::Node, Next::Operand)
                }
            };
            match next {
                Next::Operand(operand) => {
                    used = node.span;
                    at = operand;
                }
                Next::Node => break Origin::Node(node.span),
                Next::Inner(span) => break Origin::Node(span),
            }
        };
        self.depth += 1;
        self.memory += function.nodes.len();
        Ok(origin)
    }

    /// Follows result `k` of a branch, a loop or a call into the functions that it runs.
    fn origin_inside(&mut self, values: &[Computed], op: &Op, k: usize, span: Span) -> Result<Next, RunError> {
        let get = |v: &Value| one(values, *v).ok_or(RunError::Malformed(span));
        let all = |vs: &[Value]| vs.iter().map(get).collect::<Result<Vec<_>, _>>();
        let (function, operands) = match op {
            Op::If { condition, then, otherwise, args } => {
                (if get(condition)? == Scalar::Bool(true) { *then } else { *otherwise }, args)
            }
            Op::Call { function, args } => (*function, args),
            Op::Loop { count, body, init, invariant } => {
                let Scalar::Int(count) = get(count)? else { return Err(RunError::Malformed(span)) };
                self.require_steps(*body, count, span)?;
                let iterations = Iterations { body: *body, init: all(init)?, invariant: all(invariant)?, span };
                return Ok(match self.origin_in_loop(&iterations, count, k)? {
                    Origin::Node(span) => Next::Inner(span),
                    Origin::Param(i, _) => {
                        Next::Operand(if i < init.len() { init[i] } else { invariant[i - init.len()] })
                    }
                });
            }
            _ => return Err(RunError::Malformed(span)),
        };
        let args = all(operands)?;
        let origin = stacker::maybe_grow(STACK_LEFT, STACK_MORE, || self.origin(function, &args, k, span))?;
        Ok(match origin {
            Origin::Node(span) => Next::Inner(span),
            Origin::Param(i, _) => Next::Operand(operands[i]),
        })
    }

    /// Follows carried value `k` backwards through the iterations of a loop. The index of a parameter counts the
    /// carried values, then the invariant ones.
    fn origin_in_loop(&mut self, iterations: &Iterations, count: i64, mut k: usize) -> Result<Origin, RunError> {
        let Iterations { body, init, invariant, span } = iterations;
        let mut states = vec![init.clone()];
        for i in 0..count {
            self.memory = self.memory.checked_sub(init.len()).ok_or(RunError::Memory(*span))?;
            let next = self.iteration(*body, i, &states[i as usize], invariant, *span)?;
            states.push(next);
        }
        let mut origin = Origin::Param(k, *span);
        for i in (0..count).rev() {
            let args = [&[Scalar::Int(i)], &states[i as usize][..], invariant].concat();
            origin = match self.origin(*body, &args, k, *span)? {
                Origin::Param(p, span) if p > 0 => Origin::Param(p - 1, span),
                origin => origin,
            };
            match origin {
                Origin::Param(carried, _) if carried < init.len() => k = carried,
                _ => break,
            }
        }
        self.memory += init.len() * (states.len() - 1);
        Ok(origin)
    }
}

struct Iterations {
    body: FunctionId,
    init: Vec<Scalar>,
    invariant: Vec<Scalar>,
    span: Span,
}
