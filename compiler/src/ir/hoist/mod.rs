//! Invariant hoisting: what is the same wherever a function is run is computed before and handed in.
//!
//! Loops of functions use it (loop-invariant code motion, in [`simplify`](super::simplify())), the loop over the points
//! of all parts ([`prelude`]), and the loops over the rows and columns of a grid ([`grid`]).

use super::{Function, FunctionBuilder, Op, Value};

pub(super) mod axes;
pub(crate) mod grid;
pub(crate) mod prelude;

/// Computes in the builder the nodes of a function whose operands have outer values, starting from those of its
/// parameters (`None` for a parameter that varies). Returns the outer value of every node that has one.
pub(super) fn hoist(
    builder: &mut FunctionBuilder,
    function: &Function,
    params: &[Option<Value>],
    is_movable: impl Fn(&Op) -> bool,
) -> Vec<Option<Value>> {
    let mut outer: Vec<Option<Value>> = Vec::with_capacity(function.nodes.len());
    for node in &function.nodes {
        let value = match node.op {
            Op::Param(i) => params[i as usize],
            ref op if is_movable(op) && op.all_operands(|v| outer[v.0 as usize].is_some()) => {
                builder.set_span(node.span);
                let op = op.map_operands(|v| outer[v.0 as usize].unwrap_or(v));
                Some(builder.emit(&op, node.ty))
            }
            _ => None,
        };
        outer.push(value);
    }
    outer
}

/// Visits the values that the rest of a function takes from those that are hoisted, in the order of their use: operands
/// of nodes that stay, and results. A value that is used twice comes twice.
pub(super) fn visit_frontier(function: &Function, is_hoisted: impl Fn(Value) -> bool, mut visit: impl FnMut(Value)) {
    let mut visit_hoisted = |v: Value| {
        if is_hoisted(v) {
            visit(v);
        }
    };
    for (node, v) in function.nodes.iter().zip(function.values()) {
        if !is_hoisted(v) {
            node.op.visit_operands(&mut visit_hoisted);
        }
    }
    function.results.iter().copied().for_each(&mut visit_hoisted);
}
