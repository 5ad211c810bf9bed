//! Builds functions and simplifies them on the way.
//!
//! Equal operations become one node (global value numbering by hash-consing, since nodes have no side effects).
//! Constants are folded (but never into an infinity or NaN: such an operation stays, so that it can be reported where
//! it happens), and the algebraic rules of `algebra`, `powers` and `logic` are applied. **The rules assume that values
//! are finite, and ignore the sign of zero**: `x - x` and `0 * x` are 0, `sqrt(x)^2` is x, `(x + 1) + 2` is `x + 3`
//! with another rounding. A rule must never turn a finite value into one that is not finite. Comparisons are not
//! simplified in this way, since scripts ask by them what is a number. docs/language.md tells users all of this.

use super::scalar::{self, Scalar};
use super::{Binary, Compare, FailureId, Function, FunctionId, Node, Op, Parameter, Type, Unary, Value, arithmetic};
use crate::ir::hash::HashMap;
use crate::source::Span;
use std::collections::hash_map::Entry;
use value_analysis::Properties;

mod algebra;
mod encoding;
mod logic;
mod powers;
mod rebuild;
mod value_analysis;

pub(crate) use encoding::encoded_width;
pub(crate) use rebuild::{Image, Rebuild, Step};

/// A function under construction.
#[derive(Debug)]
pub struct FunctionBuilder {
    function: Function,
    properties: Vec<Properties>,
    interned: HashMap<Op, Value>,
    span: Span,
}

impl FunctionBuilder {
    /// Starts a function with the given parameters.
    #[must_use]
    pub fn new(name: impl Into<String>, params: Vec<Parameter>) -> FunctionBuilder {
        let types: Vec<Type> = params.iter().map(|p| p.ty).collect();
        let function = Function { name: name.into(), params, ..Function::default() };
        let mut builder =
            FunctionBuilder { function, properties: Vec::new(), interned: HashMap::default(), span: Span::default() };
        for (i, ty) in types.into_iter().enumerate() {
            builder.node(Op::Param(i as u32), ty);
        }
        builder
    }

    /// Starts a function with the name and the parameters of another.
    #[must_use]
    pub(crate) fn like(function: &Function) -> FunctionBuilder {
        FunctionBuilder::new(function.name.clone(), function.params.clone())
    }

    /// Completes the function; nodes that no result needs are dropped.
    #[must_use]
    pub fn finish(self, results: impl IntoIterator<Item = (String, Value)>) -> Function {
        let mut function = self.finish_unsimplified(results);
        function.reverse_negated_differences();
        function
    }

    /// Completes the function without a change to the operations that remain.
    pub(super) fn finish_unsimplified(mut self, results: impl IntoIterator<Item = (String, Value)>) -> Function {
        (self.function.result_names, self.function.results) = results.into_iter().unzip();
        self.function.drop_unused();
        self.function
    }

    /// Completes the function with results that have the names of another function's results.
    #[must_use]
    pub(crate) fn finish_like(self, function: &Function, results: Vec<Value>) -> Function {
        self.finish(function.result_names.iter().cloned().zip(results))
    }

    /// The function's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.function.name
    }

    /// Parameter i.
    ///
    /// # Panics
    /// If the function has no such parameter.
    #[must_use]
    pub fn param(&self, i: usize) -> Value {
        assert!(i < self.function.params.len(), "a parameter of the function");
        Value(i as u32)
    }

    /// All parameters in order.
    #[must_use]
    pub fn params(&self) -> Vec<Value> {
        (0..self.function.params.len() as u32).map(Value).collect()
    }

    /// Sets the span of the nodes that are made from here on.
    pub fn set_span(&mut self, span: Span) {
        self.span = span;
    }

    /// The span of a node.
    pub(super) fn span_of(&self, v: Value) -> Span {
        self.function.nodes[v.0 as usize].span
    }

    /// The span of the nodes that are made at present.
    #[must_use]
    pub fn span(&self) -> Span {
        self.span
    }

    /// The number of nodes so far, for limits on size.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.function.nodes.len()
    }

    /// The operation that makes a value.
    #[must_use]
    pub fn op(&self, value: Value) -> &Op {
        self.function.op(value)
    }

    /// The type of a value.
    #[must_use]
    pub fn ty(&self, value: Value) -> Type {
        self.function.ty(value)
    }

    /// The value, where it is a constant.
    #[must_use]
    pub fn constant(&self, value: Value) -> Option<Scalar> {
        match *self.op(value) {
            Op::Real(bits) => Some(Scalar::Real(f64::from_bits(bits))),
            Op::Int(i) => Some(Scalar::Int(i)),
            Op::Bool(b) => Some(Scalar::Bool(b)),
            _ => None,
        }
    }

    /// A constant.
    pub fn scalar(&mut self, x: Scalar) -> Value {
        match x {
            Scalar::Real(x) => self.real(x),
            Scalar::Int(i) => self.int(i),
            Scalar::Bool(b) => self.bool(b),
        }
    }

    /// A constant.
    pub fn real(&mut self, x: f64) -> Value {
        // One zero: the sign of zero is not kept, and -0 would hide equal constants.
        self.node(Op::Real(if x == 0.0 { 0 } else { x.to_bits() }), Type::Real)
    }

    /// A constant.
    pub fn int(&mut self, i: i64) -> Value {
        self.node(Op::Int(i), Type::Int)
    }

    /// A constant.
    pub fn bool(&mut self, b: bool) -> Value {
        self.node(Op::Bool(b), Type::Bool)
    }

    /// An operation with one operand. On an Int it is expressed by operations with two operands, so that later stages
    /// need not know it.
    pub fn unary(&mut self, op: Unary, a: Value) -> Value {
        if let Some(x) = self.constant(a)
            && let Some(y) = scalar::unary(op, x)
            && y.is_finite()
        {
            return self.scalar(y);
        }
        if let Some(simpler) = self.simpler_unary(op, a) {
            return simpler;
        }
        if self.ty(a) == Type::Int && op != Unary::ToReal {
            return self.int_unary(op, a);
        }
        let ty = match op {
            Unary::ToReal => Type::Real,
            Unary::ToInt => Type::Int,
            _ => self.ty(a),
        };
        self.node(Op::Unary(op, a), ty)
    }

    /// An operation with two operands.
    pub fn binary(&mut self, op: Binary, a: Value, b: Value) -> Value {
        if let (Some(x), Some(y)) = (self.constant(a), self.constant(b))
            && op != Binary::Keep
            && let Some(z) = scalar::binary(op, x, y)
            && z.is_finite()
        {
            return self.scalar(z);
        }
        if let Some(simpler) = self.simpler_binary(op, a, b) {
            return simpler;
        }
        let (a, b) = self.ordered(op, a, b);
        self.node(Op::Binary(op, a, b), self.ty(a))
    }

    /// a + b.
    pub fn add(&mut self, a: Value, b: Value) -> Value {
        self.binary(Binary::Add, a, b)
    }

    /// a - b.
    pub fn sub(&mut self, a: Value, b: Value) -> Value {
        self.binary(Binary::Sub, a, b)
    }

    /// a * b.
    pub fn mul(&mut self, a: Value, b: Value) -> Value {
        self.binary(Binary::Mul, a, b)
    }

    /// a / b.
    pub fn div(&mut self, a: Value, b: Value) -> Value {
        self.binary(Binary::Div, a, b)
    }

    /// -a.
    pub fn neg(&mut self, a: Value) -> Value {
        self.unary(Unary::Neg, a)
    }

    /// x to a real power; a constant whole exponent makes it [`Op::PowInt`].
    pub fn pow(&mut self, x: Value, y: Value) -> Value {
        self.binary(Binary::Pow, x, y)
    }

    /// x to a whole power.
    pub fn pow_int(&mut self, x: Value, n: i32) -> Value {
        if let Some(Scalar::Real(c)) = self.constant(x) {
            let power = arithmetic::pow_int(c, n);
            if power.is_finite() {
                return self.real(power);
            }
        }
        match self.simpler_pow_int(x, n) {
            Some(simpler) => simpler,
            None => self.node(Op::PowInt(x, n), Type::Real),
        }
    }

    /// A comparison of two Reals or two Ints.
    pub fn compare(&mut self, op: Compare, a: Value, b: Value) -> Value {
        if let (Some(x), Some(y)) = (self.constant(a), self.constant(b))
            && let Some(holds) = scalar::compare(op, x, y)
        {
            return self.bool(holds);
        }
        self.simple_compare(op, a, b)
    }

    /// `if condition { a } else { b }`, both computed.
    pub fn select(&mut self, condition: Value, a: Value, b: Value) -> Value {
        match self.simpler_select(condition, a, b) {
            Some(simpler) => simpler,
            None => self.node(Op::Select(condition, a, b), self.ty(a)),
        }
    }

    /// Runs one of two functions; `results` are the types of the results of either.
    pub fn if_(
        &mut self,
        condition: Value,
        then: FunctionId,
        otherwise: FunctionId,
        args: Vec<Value>,
        results: &[Type],
    ) -> Vec<Value> {
        let op = match self.constant(condition) {
            Some(Scalar::Bool(c)) => Op::Call { function: if c { then } else { otherwise }, args },
            _ if then == otherwise => Op::Call { function: then, args },
            _ => Op::If { condition, then, otherwise, args },
        };
        self.multi(op, results)
    }

    /// Runs a loop; returns the carried values after the last iteration.
    pub fn loop_(&mut self, count: Value, body: FunctionId, init: Vec<Value>, invariant: Vec<Value>) -> Vec<Value> {
        if let Some(Scalar::Int(n)) = self.constant(count)
            && n <= 0
        {
            return init;
        }
        let types: Vec<Type> = init.iter().map(|v| self.ty(*v)).collect();
        self.multi(Op::Loop { count, body, init, invariant }, &types)
    }

    /// Runs a function; `results` are the types of its results.
    pub fn call(&mut self, function: FunctionId, args: Vec<Value>, results: &[Type]) -> Vec<Value> {
        self.multi(Op::Call { function, args }, results)
    }

    /// The tangents (all Real) of the `results` results of a function, for the tangents of some of its parameters.
    pub fn tangent(
        &mut self,
        function: FunctionId,
        args: Vec<Value>,
        mut seeds: Vec<(u32, Value)>,
        results: usize,
    ) -> Vec<Value> {
        seeds.sort_by_key(|(i, _)| *i);
        self.multi(Op::Tangent { function, args, seeds }, &vec![Type::Real; results])
    }

    /// An `If`, `Loop`, `Call` or `Tangent` and its projections.
    fn multi(&mut self, op: Op, results: &[Type]) -> Vec<Value> {
        let node = self.node(op, Type::Multi);
        (0..).zip(results).map(|(k, ty)| self.project(node, k, *ty)).collect()
    }

    /// Result k of an `If`, `Loop`, `Call` or `Tangent` node. (The methods that make such nodes return their
    /// projections; only passes that go node by node need this.)
    pub fn project(&mut self, multi: Value, k: u32, ty: Type) -> Value {
        self.node(Op::Project(multi, k), ty)
    }

    /// The value where the condition holds; otherwise the evaluation ends with the failure.
    pub fn guard(&mut self, value: Value, condition: Value, failure: FailureId) -> Value {
        if self.constant(condition) == Some(Scalar::Bool(true)) {
            return value;
        }
        let guard = Op::Guard { value, condition, failure };
        if matches!(self.op(value), Op::Guard { condition: c, failure: f, .. } if *c == condition && *f == failure) {
            return value;
        }
        self.node(guard, self.ty(value))
    }

    /// Makes an operation whose operands are values of this function, by the simplifying method for it. `Param(i)` is
    /// parameter i of this function. Structured operations stay as they are.
    pub fn emit(&mut self, op: &Op, ty: Type) -> Value {
        match *op {
            Op::Param(i) => Value(i),
            Op::Real(bits) => self.real(f64::from_bits(bits)),
            Op::Int(i) => self.int(i),
            Op::Bool(b) => self.bool(b),
            Op::Unary(op, a) => self.unary(op, a),
            Op::Binary(op, a, b) => self.binary(op, a, b),
            Op::PowInt(a, n) => self.pow_int(a, n),
            Op::Compare(op, a, b) => self.compare(op, a, b),
            Op::Select(c, a, b) => self.select(c, a, b),
            Op::Guard { value, condition, failure } => self.guard(value, condition, failure),
            Op::Project(multi, k) => self.project(multi, k, ty),
            Op::If { .. } | Op::Loop { .. } | Op::Call { .. } | Op::Tangent { .. } => self.node(op.clone(), ty),
        }
    }

    fn int_unary(&mut self, op: Unary, a: Value) -> Value {
        let (zero, one) = (self.int(0), self.int(1));
        match op {
            Unary::Neg => self.sub(zero, a),
            Unary::Abs => {
                let negative = self.sub(zero, a);
                self.binary(Binary::Max, a, negative)
            }
            Unary::Sign => {
                let minus_one = self.int(-1);
                let below_one = self.binary(Binary::Min, a, one);
                self.binary(Binary::Max, below_one, minus_one)
            }
            // Rounding an integer changes nothing; `validate` rejects the other operations on one.
            _ => a,
        }
    }

    /// The node that already computes an operation.
    fn existing(&self, op: &Op) -> Option<Value> {
        self.interned.get(op).copied()
    }

    /// An operation with two Real operands without the rules, which would bring constants out of sums and products.
    pub(super) fn unsimplified_binary(&mut self, op: Binary, a: Value, b: Value) -> Value {
        let (a, b) = self.ordered(op, a, b);
        self.node(Op::Binary(op, a, b), Type::Real)
    }

    /// The properties of a value that are proved.
    fn properties(&self, value: Value) -> Properties {
        self.properties[value.0 as usize]
    }

    /// The value as a constant Real.
    pub(super) fn real_constant(&self, value: Value) -> Option<f64> {
        self.constant(value).and_then(Scalar::real)
    }

    /// The operand of a negation.
    fn negated(&self, value: Value) -> Option<Value> {
        if let Op::Unary(Unary::Neg, a) = *self.op(value) { Some(a) } else { None }
    }

    /// The equal node that already exists, or a new one; without the rules.
    pub(super) fn node(&mut self, op: Op, ty: Type) -> Value {
        let vacant = match self.interned.entry(op) {
            Entry::Occupied(equal) => return *equal.get(),
            Entry::Vacant(vacant) => vacant,
        };
        let op = vacant.key().clone();
        let operand = |v: Value| self.properties[v.0 as usize];
        let properties = if ty == Type::Real { Properties::of(&op, operand) } else { Properties::default() };
        let value = Value(u32::try_from(self.function.nodes.len()).expect("fewer than 2^32 nodes"));
        self.function.nodes.push(Node { op, ty, span: self.span });
        self.properties.push(properties);
        *vacant.insert(value)
    }

    /// Commutative operands in canonical order: constants last (first in a product), then by their index.
    fn ordered(&self, op: Binary, a: Value, b: Value) -> (Value, Value) {
        let swap = match op {
            Binary::Mul => self.constant(b).is_some() || (self.constant(a).is_none() && b < a),
            Binary::Add | Binary::Min | Binary::Max | Binary::And | Binary::Or => {
                self.constant(a).is_some() || (self.constant(b).is_none() && b < a)
            }
            _ => false,
        };
        if swap { (b, a) } else { (a, b) }
    }
}
