//! Reassociation of products and sums by the coordinates on which their operands depend.
//!
//! A value of the parameters alone is computed once for each x, a value of u or of v alone once a column or a row of a
//! grid. `a * (p * c)`, with a uniform, p of v and c of u, becomes `(a * p) * c`: the outer product, which is computed
//! at every point, is one operation as before, and the inner one has left the points. The same holds of sums. This is
//! how a surface of revolution in any pose becomes `A cos(u) + B sin(u) + C` at every point, with A, B and C computed
//! once a row. Reassociation changes the rounding, as the rules of [`builder`](super::builder) do.

use super::builder::{Image, Rebuild, Step};
use super::hoist::axes::{Axes, UV, axes_of};
use super::{Binary, FunctionBuilder, FunctionId, Module, Op, Type, Value};

/// Reassociates a function of some captures, u and v.
pub(crate) fn reassociate(module: &mut Module, function: FunctionId, captures: usize) {
    let old = module.function(function);
    let mut pass = Reassociation { builder: FunctionBuilder::like(old), axes: Vec::new(), captures, depth: 0 };
    let params = pass.builder.params();
    let mut rebuild = Rebuild::new(old, &params);
    while let Some(Step { node, op, .. }) = rebuild.next(&mut pass.builder) {
        rebuild.push(Image::One(match op {
            Op::Binary(Binary::Mul, a, b) if node.ty == Type::Real => pass.product(a, b),
            Op::Binary(Binary::Add, a, b) if node.ty == Type::Real => pass.sum((false, a), (false, b)),
            Op::Binary(Binary::Sub, a, b) if node.ty == Type::Real => pass.sum((false, a), (true, b)),
            op => pass.builder.emit(&op, node.ty),
        }));
    }
    let new = pass.builder.finish_like(old, rebuild.results());
    module.define(function, new);
}

struct Reassociation {
    builder: FunctionBuilder,
    /// The axes of the builder's values, as far as they were asked for.
    axes: Vec<Axes>,
    captures: usize,
    /// The depth of the recursion.
    depth: usize,
}

/// Most steps into a product or sum: a script decides how long they are, and each step recurses.
const DEPTH: usize = 64;

/// A term of a sum; true where it is subtracted.
type Term = (bool, Value);

impl Reassociation {
    fn axes(&mut self, value: Value) -> Axes {
        for i in self.axes.len()..=value.0 as usize {
            let op = self.builder.op(Value(i as u32));
            self.axes.push(axes_of(op, self.captures, |v| self.axes[v.0 as usize]) & UV);
        }
        self.axes[value.0 as usize]
    }

    fn product(&mut self, a: Value, b: Value) -> Value {
        let (a_axes, b_axes) = (self.axes(a), self.axes(b));
        for (low, low_axes, high, high_axes) in [(a, a_axes, b, b_axes), (b, b_axes, a, a_axes)] {
            let Op::Binary(Binary::Mul, p, q) = *self.builder.op(high) else { continue };
            for (p, q) in [(p, q), (q, p)] {
                if self.depth < DEPTH && is_better(low_axes, self.axes(p), high_axes) {
                    self.depth += 1;
                    let first = self.product(low, p);
                    let product = self.product(first, q);
                    self.depth -= 1;
                    return product;
                }
            }
        }
        self.builder.mul(a, b)
    }

    fn sum(&mut self, a: Term, b: Term) -> Value {
        let (a_axes, b_axes) = (self.axes(a.1), self.axes(b.1));
        for (low, low_axes, high, high_axes) in [(a, a_axes, b, b_axes), (b, b_axes, a, a_axes)] {
            let (p, q) = match *self.builder.op(high.1) {
                Op::Binary(Binary::Add, p, q) => ((high.0, p), (high.0, q)),
                Op::Binary(Binary::Sub, p, q) => ((high.0, p), (!high.0, q)),
                _ => continue,
            };
            for (p, q) in [(p, q), (q, p)] {
                if self.depth < DEPTH && is_better(low_axes, self.axes(p.1), high_axes) {
                    self.depth += 1;
                    // At most one of the two is subtracted; if both are, their sum is.
                    let negative = low.0 && p.0;
                    let first = self.sum((low.0 && !negative, low.1), (p.0 && !negative, p.1));
                    let sum = self.sum((negative, first), q);
                    self.depth -= 1;
                    return sum;
                }
            }
        }
        match (a, b) {
            ((false, a), (false, b)) => self.builder.add(a, b),
            ((false, a), (true, b)) | ((true, b), (false, a)) => self.builder.sub(a, b),
            ((true, a), (true, b)) => {
                let sum = self.builder.add(a, b);
                self.builder.neg(sum)
            }
        }
    }
}

/// Whether an operand on the axes `low` is better combined first with an operand on `p` of the other side, which is on
/// `high`: whether the two together depend on less than the whole.
fn is_better(low: Axes, p: Axes, high: Axes) -> bool {
    let (inner, whole) = (low | p, low | high);
    high == whole && inner != whole
}
