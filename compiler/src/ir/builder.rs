//! Makes functions, simplifying as it goes.
//!
//! Equal operations become one node. Constants are folded (but never into an infinity or NaN: such an operation
//! stays, so that it can be reported where it happens), and the algebraic rules of `algebra`, `powers` and `logic`
//! are applied. **They assume that values are finite and take no care of the sign of zero**: `x - x` and `0 * x` are 0,
//! `sqrt(x)^2` is x, `(x + 1) + 2` is `x + 3` with another rounding. What a rule may not do is make a value that was
//! finite into one that is not.

use super::facts::Facts;
use super::scalar::{self, Scalar};
use super::{Binary, Compare, FailureId, Function, FunctionId, Node, Op, Parameter, Type, Unary, Value, arithmetic};
use crate::ir::hash::HashMap;
use crate::source::Span;
use std::collections::hash_map::Entry;

/// A function in the making.
#[derive(Debug)]
pub struct FunctionBuilder {
    function: Function,
    facts: Vec<Facts>,
    interned: HashMap<Op, Value>,
    span: Span,
}

impl FunctionBuilder {
    /// Starts a function of these parameters.
    #[must_use]
    pub fn new(name: impl Into<String>, params: Vec<Parameter>) -> FunctionBuilder {
        let types: Vec<Type> = params.iter().map(|p| p.ty).collect();
        let function = Function { name: name.into(), params, ..Function::default() };
        let mut builder =
            FunctionBuilder { function, facts: Vec::new(), interned: HashMap::default(), span: Span::default() };
        for (i, ty) in types.into_iter().enumerate() {
            builder.node(Op::Param(i as u32), ty);
        }
        builder
    }

    /// Ends the function; nodes that no result needs are dropped.
    #[must_use]
    pub fn finish(mut self, results: impl IntoIterator<Item = (String, Value)>) -> Function {
        (self.function.result_names, self.function.results) = results.into_iter().unzip();
        self.function.drop_unused();
        self.function.turn_differences();
        self.function
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

    /// The name of parameter i.
    ///
    /// # Panics
    /// If the function has no such parameter.
    #[must_use]
    pub fn param_name(&self, i: usize) -> &str {
        &self.function.params[i].name
    }

    /// The span of the nodes made from here on.
    pub fn set_span(&mut self, span: Span) {
        self.span = span;
    }

    /// The span of the nodes made at present.
    #[must_use]
    pub fn span(&self) -> Span {
        self.span
    }

    /// How many nodes there are, for limits on size.
    #[must_use]
    pub fn len(&self) -> usize {
        self.function.nodes.len()
    }

    /// True before the first node.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.function.nodes.is_empty()
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

    /// An operation of one operand. Those of an Int are made of the operations of two, so that nobody else
    /// need know them.
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

    /// An operation of two operands.
    pub fn binary(&mut self, op: Binary, a: Value, b: Value) -> Value {
        if let (Some(x), Some(y)) = (self.constant(a), self.constant(b))
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

    /// Runs one of two functions; `results` are the types of what either returns.
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

    /// Runs a loop; returns what was carried out of it.
    pub fn loop_(&mut self, count: Value, body: FunctionId, init: Vec<Value>, invariant: Vec<Value>) -> Vec<Value> {
        if let Some(Scalar::Int(n)) = self.constant(count)
            && n <= 0
        {
            return init;
        }
        let types: Vec<Type> = init.iter().map(|v| self.ty(*v)).collect();
        self.multi(Op::Loop { count, body, init, invariant }, &types)
    }

    /// Runs a function; `results` are the types of what it returns.
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

    /// Result k of an `If`, `Loop`, `Call` or `Tangent` node. The methods that make those give their results
    /// already; passes that go node by node need this.
    pub fn project(&mut self, multi: Value, k: u32, ty: Type) -> Value {
        self.node(Op::Project(multi, k), ty)
    }

    /// The value, where the condition holds; else the failure.
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

    /// Makes an operation whose operands are values of this function, through the simplifying methods above.
    /// A parameter is the parameter of that index of this function. `Multi` operations stay as they are.
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
            // Whole already (what else there is takes no Int, which `validate` says).
            _ => a,
        }
    }

    /// The node of an operation, if there is one.
    pub(super) fn known(&self, op: &Op) -> Option<Value> {
        self.interned.get(op).copied()
    }

    /// The operation of two reals as it is: the rules would bring constants out of sums and products.
    pub(super) fn raw_binary(&mut self, op: Binary, a: Value, b: Value) -> Value {
        let (a, b) = self.ordered(op, a, b);
        self.node(Op::Binary(op, a, b), Type::Real)
    }

    /// The comparison as it is.
    pub(super) fn raw_compare(&mut self, op: Compare, a: Value, b: Value) -> Value {
        self.node(Op::Compare(op, a, b), Type::Bool)
    }

    /// Puts the nodes of a function here, in the place of a call of it; returns its results.
    pub fn splice(&mut self, function: &Function, args: &[Value]) -> Vec<Value> {
        let mut values: Vec<Value> = Vec::with_capacity(function.nodes.len());
        for node in &function.nodes {
            let value = if let Op::Param(i) = node.op {
                args[i as usize]
            } else {
                self.span = node.span;
                self.emit(&node.op.map_operands(|v| values[v.0 as usize]), node.ty)
            };
            values.push(value);
        }
        function.results.iter().map(|r| values[r.0 as usize]).collect()
    }

    /// What is known of a value.
    pub(super) fn facts(&self, value: Value) -> Facts {
        self.facts[value.0 as usize]
    }

    /// The constant, where it is a real one.
    pub(super) fn real_constant(&self, value: Value) -> Option<f64> {
        self.constant(value).and_then(Scalar::real)
    }

    /// The operand of a negation.
    pub(super) fn negated(&self, value: Value) -> Option<Value> {
        if let Op::Unary(Unary::Neg, a) = *self.op(value) { Some(a) } else { None }
    }

    /// The node as it is, or the equal one that there already was.
    fn node(&mut self, op: Op, ty: Type) -> Value {
        let vacant = match self.interned.entry(op) {
            Entry::Occupied(known) => return *known.get(),
            Entry::Vacant(vacant) => vacant,
        };
        let op = vacant.key().clone();
        let of = |v: Value| self.facts[v.0 as usize];
        let facts = if ty == Type::Real { Facts::of(&op, of) } else { Facts::default() };
        let value = Value(u32::try_from(self.function.nodes.len()).expect("fewer than 2^32 nodes"));
        self.function.nodes.push(Node { op, ty, span: self.span });
        self.facts.push(facts);
        *vacant.insert(value)
    }

    /// Commutative operands in one order: constants last (first in a product), then as they were made.
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
