//! Divides functions into what is computed once and what is computed at every point.

use super::scalar::Scalar;
use super::{Compare, Function, FunctionBuilder, FunctionId, Module, Op, Parameter, Type, Unary, Value};
use crate::ir::hash::HashMap;

/// Functions divided into one prelude and a body each.
#[derive(Clone, Debug)]
pub struct Split {
    /// `(uniform parameters..) -> captures..`, all captures Real.
    pub prelude: FunctionId,
    /// One for each function, in order.
    pub bodies: Vec<Body>,
}

/// A function to be divided: `(uniform parameters.., varying parameters..) -> results..`.
#[derive(Clone, Debug)]
pub struct Whole {
    /// The function.
    pub function: FunctionId,
    /// Which parameter of the prelude each of its uniform parameters is.
    pub uniform: Vec<u32>,
}

impl Whole {
    /// The arguments of `function` at the parameters x of the prelude.
    #[must_use]
    pub fn arguments<T: Copy>(&self, x: &[T], uv: [T; 2]) -> Vec<T> {
        self.uniform.iter().map(|i| x[*i as usize]).chain(uv).collect()
    }
}

/// What is left of a function.
#[derive(Clone, Debug)]
pub struct Body {
    /// `(its captures.., varying parameters..) -> results..`.
    pub function: FunctionId,
    /// Which of the prelude's results it takes, in the order of their first use: bodies that differ in what they capture
    /// only are equal.
    pub captures: Vec<u32>,
    /// How many of them, the last, are constants ([`merge_bodies`](super::merge::merge_bodies)).
    pub constants: usize,
}

/// Divides functions of some of the prelude's parameters: everything that does not depend on the varying ones goes
/// to the prelude, and its outermost values are captured by the bodies. Values that several bodies capture are
/// computed once. A truth value is captured as 0 or 1, an integer as a real (exact up to 2^53).
///
/// Inline and simplify the functions before: calls and branches go to the prelude only as a whole.
#[must_use]
pub fn split_all(module: &mut Module, params: Vec<Parameter>, functions: &[Whole]) -> Split {
    let mut prelude = Prelude {
        params: params.len(),
        builder: FunctionBuilder::new("prelude", params),
        captures: Vec::new(),
        indices: HashMap::default(),
    };
    let mut bodies = Vec::new();
    for whole in functions {
        let function = module.function(whole.function).clone();
        let (body, captures) = split_one(&mut prelude, &function, &whole.uniform);
        bodies.push(Body { function: module.add(body), captures, constants: 0 });
    }
    let Prelude { builder, captures, .. } = prelude;
    let prelude = module.add(builder.finish(captures.into_iter().map(|(p, v)| (p.name, v))));
    let mut all: Vec<FunctionId> = bodies.iter().map(|b| b.function).collect();
    all.push(prelude);
    super::simplify(module, &all);
    Split { prelude, bodies }
}

struct Prelude {
    params: usize,
    builder: FunctionBuilder,
    /// Captured values (all Real), and what a body calls them.
    captures: Vec<(Parameter, Value)>,
    indices: HashMap<Value, u32>,
}

impl Prelude {
    /// The index of the capture that is a value of the prelude.
    fn capture(&mut self, value: Value) -> u32 {
        let b = &mut self.builder;
        let real = match b.ty(value) {
            Type::Int => b.unary(Unary::ToReal, value),
            Type::Bool => {
                let (yes, no) = (b.real(1.0), b.real(0.0));
                b.select(value, yes, no)
            }
            Type::Real | Type::Multi => value,
        };
        if let Some(known) = self.indices.get(&real) {
            return *known;
        }
        let index = self.captures.len() as u32;
        let param = real.0 as usize;
        let name = if param < self.params { self.builder.param_name(param).to_owned() } else { format!("c{index}") };
        self.captures.push((Parameter::real(name), real));
        self.indices.insert(real, index);
        index
    }
}

/// The body of a function, and the captures that it takes.
fn split_one(prelude: &mut Prelude, function: &Function, uniform: &[u32]) -> (Function, Vec<u32>) {
    let outside = uniform_values(prelude, function, uniform);
    let (captured, captures) = captured_nodes(prelude, function, &outside);
    let mut params: Vec<Parameter> = captures.iter().map(|c| prelude.captures[*c as usize].0.clone()).collect();
    params.extend_from_slice(&function.params[uniform.len()..]);
    let mut b = FunctionBuilder::new(function.name.clone(), params);
    let mut values = vec![Value(u32::MAX); function.nodes.len()];
    for node in function.values() {
        let i = node.0 as usize;
        b.set_span(function.nodes[i].span);
        if let Some(position) = captured.get(&node) {
            let param = b.param(*position);
            values[i] = back_to(&mut b, param, function.nodes[i].ty);
        } else if let Some(constant) = outside[i].and_then(|v| prelude.builder.constant(v)) {
            values[i] = b.scalar(constant);
        } else if outside[i].is_none() {
            values[i] = match function.op(node) {
                Op::Param(p) => b.param(captures.len() + *p as usize - uniform.len()),
                op => b.emit(&op.map_operands(|v| values[v.0 as usize]), function.nodes[i].ty),
            };
        }
    }
    let results = function.results.iter().map(|r| values[r.0 as usize]);
    let named: Vec<(String, Value)> = function.result_names.iter().cloned().zip(results).collect();
    (b.finish(named), captures)
}

/// For every node that is uniform its value in the prelude.
fn uniform_values(prelude: &mut Prelude, function: &Function, uniform: &[u32]) -> Vec<Option<Value>> {
    let mut outside: Vec<Option<Value>> = Vec::with_capacity(function.nodes.len());
    for node in &function.nodes {
        let value = if let Op::Param(i) = node.op {
            uniform.get(i as usize).map(|p| prelude.builder.param(*p as usize))
        } else {
            let mut all = true;
            node.op.visit_operands(|v| all &= outside[v.0 as usize].is_some());
            all.then(|| {
                prelude.builder.set_span(node.span);
                let op = node.op.map_operands(|v| outside[v.0 as usize].unwrap_or(v));
                prelude.builder.emit(&op, node.ty)
            })
        };
        outside.push(value);
    }
    outside
}

/// The uniform nodes that are not constant and that a result is, or that something varying uses: the position of their
/// capture among those of the body; and these.
fn captured_nodes(
    prelude: &mut Prelude,
    function: &Function,
    outside: &[Option<Value>],
) -> (HashMap<Value, usize>, Vec<u32>) {
    let mut captured = HashMap::default();
    let (mut positions, mut captures) = (HashMap::default(), Vec::new());
    let mut capture = |node: Value| {
        if let Some(value) = outside[node.0 as usize]
            && prelude.builder.constant(value).is_none()
        {
            let position = *positions.entry(prelude.capture(value)).or_insert_with_key(|capture| {
                captures.push(*capture);
                captures.len() - 1
            });
            captured.insert(node, position);
        }
    };
    for (i, node) in function.nodes.iter().enumerate() {
        if outside[i].is_none() {
            node.op.visit_operands(&mut capture);
        }
    }
    function.results.iter().for_each(|r| capture(*r));
    (captured, captures)
}

/// A capture as a value of the type that it had.
fn back_to(b: &mut FunctionBuilder, capture: Value, ty: Type) -> Value {
    match ty {
        Type::Int => b.unary(Unary::ToInt, capture),
        Type::Bool => {
            let half = b.scalar(Scalar::Real(0.5));
            b.compare(Compare::Lt, half, capture)
        }
        Type::Real | Type::Multi => capture,
    }
}
