//! Regroups products and sums by what their operands depend on.
//!
//! What depends on the parameters only is computed once for each x, what depends on one of u and v once a row or once a
//! column of a grid. `a * (p * c)`, with a uniform, p of v and c of u, becomes `(a * p) * c`: the outer product, which is
//! computed at every point, has one operation as before, and the inner one is gone from there. Likewise sums. That a
//! surface of revolution in any pose is `A cos(u) + B sin(u) + C` at every point, with A, B and C once a row, comes from this.
//! It changes the rounding, as the rules of [`builder`](super::builder) do.

use super::{Binary, FunctionBuilder, FunctionId, Module, Op, Type, Value};

/// Regroups a function of these uniforms, u and v.
pub fn regroup(module: &mut Module, function: FunctionId, uniforms: usize) {
    let old = module.function(function);
    let builder = FunctionBuilder::new(old.name.clone(), old.params.clone());
    let mut regroup = Regroup { builder, classes: Vec::new(), uniforms, depth: 0 };
    let mut values: Vec<Value> = Vec::with_capacity(old.nodes.len());
    for node in &old.nodes {
        regroup.builder.set_span(node.span);
        let value = match node.op.map_operands(|v| values[v.0 as usize]) {
            Op::Binary(Binary::Mul, a, b) if node.ty == Type::Real => regroup.product(a, b),
            Op::Binary(Binary::Add, a, b) if node.ty == Type::Real => regroup.sum((false, a), (false, b)),
            Op::Binary(Binary::Sub, a, b) if node.ty == Type::Real => regroup.sum((false, a), (true, b)),
            op => regroup.builder.emit(&op, node.ty),
        };
        values.push(value);
    }
    let results = old.results.iter().map(|r| values[r.0 as usize]);
    let named: Vec<(String, Value)> = old.result_names.iter().cloned().zip(results).collect();
    let new = regroup.builder.finish(named);
    module.define(function, new);
}

struct Regroup {
    builder: FunctionBuilder,
    /// What the values made so far depend on: 1 is u, 2 is v.
    classes: Vec<u8>,
    uniforms: usize,
    /// Of the recursion.
    depth: usize,
}

/// Products and sums are regrouped this deep: a script decides how long they are, and each step recurses.
const DEPTH: usize = 64;

/// A term of a sum; true where it is subtracted.
type Term = (bool, Value);

impl Regroup {
    fn class(&mut self, value: Value) -> u8 {
        for i in self.classes.len()..=value.0 as usize {
            let op = self.builder.op(Value(i as u32));
            let mut class = match op {
                Op::Param(p) if *p as usize == self.uniforms => 1,
                Op::Param(p) if *p as usize > self.uniforms => 2,
                _ => 0,
            };
            op.visit_operands(|v| class |= self.classes[v.0 as usize]);
            self.classes.push(class);
        }
        self.classes[value.0 as usize]
    }

    fn product(&mut self, a: Value, b: Value) -> Value {
        let (of_a, of_b) = (self.class(a), self.class(b));
        for (low, of_low, high, of_high) in [(a, of_a, b, of_b), (b, of_b, a, of_a)] {
            let Op::Binary(Binary::Mul, p, q) = *self.builder.op(high) else { continue };
            for (p, q) in [(p, q), (q, p)] {
                if self.depth < DEPTH && regroups(of_low, self.class(p), of_high) {
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
        let (of_a, of_b) = (self.class(a.1), self.class(b.1));
        for (low, of_low, high, of_high) in [(a, of_a, b, of_b), (b, of_b, a, of_a)] {
            let (p, q) = match *self.builder.op(high.1) {
                Op::Binary(Binary::Add, p, q) => ((high.0, p), (high.0, q)),
                Op::Binary(Binary::Sub, p, q) => ((high.0, p), (!high.0, q)),
                _ => continue,
            };
            for (p, q) in [(p, q), (q, p)] {
                if self.depth < DEPTH && regroups(of_low, self.class(p.1), of_high) {
                    self.depth += 1;
                    // One of the two is not subtracted, or the sum of both is.
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

/// Whether an operand is better taken together with an operand p of the other one, which is of class `high`: what they
/// make together depends on less than the whole.
fn regroups(low: u8, p: u8, high: u8) -> bool {
    let (inner, whole) = (low | p, low | high);
    high == whole && inner != whole
}
