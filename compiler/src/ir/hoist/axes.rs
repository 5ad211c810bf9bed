//! The coordinates on which values of a function `(captures.., u, v) -> ..` depend.

use crate::ir::{Binary, Function, Op, Value};

/// A set of [`U`], [`V`] and [`CAPTURES`].
pub(crate) type Axes = u8;
/// Depends on u.
pub(crate) const U: Axes = 1;
/// Depends on v.
pub(crate) const V: Axes = 2;
/// Depends on u and on v.
pub(crate) const UV: Axes = U | V;
/// Depends on a capture.
pub(crate) const CAPTURES: Axes = 4;

/// The axes of an operation's value, from those of its operands.
pub(crate) fn axes_of(op: &Op, captures: usize, operand: impl Fn(Value) -> Axes) -> Axes {
    let mut axes = match *op {
        Op::Param(i) if (i as usize) < captures => CAPTURES,
        Op::Param(i) if i as usize == captures => U,
        Op::Param(_) => V,
        _ => 0,
    };
    op.visit_operands(|v| axes |= operand(v));
    axes
}

/// For each value of a function the coordinates on which it depends: [`U`], [`V`], [`UV`] or none. The product of a
/// value of the captures and a value of u alone counts as one of both where no value of u alone needs it: the values of
/// columns then stay while parameters change.
pub(crate) fn axes(function: &Function, captures: usize) -> Vec<Axes> {
    let mut axes: Vec<Axes> = Vec::with_capacity(function.nodes.len());
    for node in &function.nodes {
        axes.push(axes_of(&node.op, captures, |v| axes[v.0 as usize]));
    }
    let mut used_by_columns = vec![false; axes.len()];
    for (node, _) in function.nodes.iter().zip(&axes).filter(|(_, axes)| **axes & UV == U) {
        node.op.visit_operands(|v| used_by_columns[v.0 as usize] = true);
    }
    for (i, node) in function.nodes.iter().enumerate() {
        if let Op::Binary(Binary::Mul, a, b) = node.op
            && axes[i] & UV == U
            && !used_by_columns[i]
            && [(a, b), (b, a)].iter().any(|(a, b)| axes[a.0 as usize] == CAPTURES && axes[b.0 as usize] == U)
        {
            axes[i] = UV;
        }
    }
    axes.into_iter().map(|axes| axes & UV).collect()
}
