//! The split of the parts' functions into one prelude, which is computed once for the parameters, and a body for each,
//! which is computed at every point.

use super::{hoist, visit_frontier};
use crate::ir::builder::{Image, Rebuild, Step};
use crate::ir::hash::HashMap;
use crate::ir::{Function, FunctionBuilder, FunctionId, Module, Parameter, ParameterFunction, Value, simplify};

/// Functions that were split into one prelude and a body each.
#[derive(Clone, Debug)]
pub(crate) struct Split {
    /// `(uniform parameters..) -> captures..`, all captures Real.
    pub prelude: FunctionId,
    /// One for each function, in order.
    pub bodies: Vec<Body>,
}

/// The body of a function that was split.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    /// `(its captures.., varying parameters..) -> results..`.
    pub function: FunctionId,
    /// The results of the prelude that it takes, in the order of their first use: bodies that differ only in what they
    /// capture are equal.
    pub captures: Vec<u32>,
    /// The number of captures, the last ones, that are constants
    /// ([`merge_bodies`](crate::ir::merge::merge_bodies)).
    pub constants: usize,
}

/// Splits functions of some of the prelude's parameters and of arguments that vary: everything that does not depend on
/// these goes to the prelude, and the bodies capture its outermost values. Values that several bodies capture are
/// computed once. Truth values and integers are captured as Reals.
///
/// Inline and simplify the functions before: calls and branches go to the prelude only as a whole.
#[must_use]
pub(crate) fn split_all(module: &mut Module, params: Vec<Parameter>, functions: &[ParameterFunction]) -> Split {
    let builder = FunctionBuilder::new("prelude", params.clone());
    let mut prelude = Prelude { params, builder, captures: Vec::new(), indices: HashMap::default() };
    let mut bodies = Vec::new();
    for whole in functions {
        let function = module.function(whole.function).clone();
        let (body, captures) = split(&mut prelude, &function, &whole.params);
        bodies.push(Body { function: module.add(body), captures, constants: 0 });
    }
    let Prelude { builder, captures, .. } = prelude;
    let prelude = module.add(builder.finish(captures.into_iter().map(|(p, v)| (p.name, v))));
    let mut all: Vec<FunctionId> = bodies.iter().map(|b| b.function).collect();
    all.push(prelude);
    simplify(module, &all);
    Split { prelude, bodies }
}

struct Prelude {
    params: Vec<Parameter>,
    builder: FunctionBuilder,
    /// Captured values (all Real), and the parameters of bodies that stand for them.
    captures: Vec<(Parameter, Value)>,
    indices: HashMap<Value, u32>,
}

impl Prelude {
    /// The indices of the captures for a value of the prelude.
    fn capture(&mut self, value: Value) -> Vec<u32> {
        self.builder.encoded(value).into_iter().map(|real| self.capture_real(real)).collect()
    }

    fn capture_real(&mut self, real: Value) -> u32 {
        if let Some(index) = self.indices.get(&real) {
            return *index;
        }
        let index = self.captures.len() as u32;
        let name = self.params.get(real.0 as usize).map_or_else(|| format!("c{index}"), |p| p.name.clone());
        self.captures.push((Parameter::real(name), real));
        self.indices.insert(real, index);
        index
    }
}

/// The body of a function, and the captures that it takes.
fn split(prelude: &mut Prelude, function: &Function, uniform: &[u32]) -> (Function, Vec<u32>) {
    let mut params: Vec<Option<Value>> = vec![None; function.params.len()];
    for (param, index) in params.iter_mut().zip(uniform) {
        *param = Some(prelude.builder.param(*index as usize));
    }
    let outer = hoist(&mut prelude.builder, function, &params, |_| true);
    // The positions of the captures of each captured node among those of the body.
    let mut captured: HashMap<Value, Vec<usize>> = HashMap::default();
    let (mut positions, mut captures) = (HashMap::default(), Vec::new());
    visit_frontier(
        function,
        |v| outer[v.0 as usize].is_some(),
        |v| {
            if let Some(value) = outer[v.0 as usize]
                && prelude.builder.constant(value).is_none()
            {
                let mut position = |capture: u32| {
                    *positions.entry(capture).or_insert_with(|| {
                        captures.push(capture);
                        captures.len() - 1
                    })
                };
                captured.insert(v, prelude.capture(value).into_iter().map(&mut position).collect());
            }
        },
    );
    let mut params: Vec<Parameter> = captures.iter().map(|c| prelude.captures[*c as usize].0.clone()).collect();
    params.extend_from_slice(&function.params[uniform.len()..]);
    let mut b = FunctionBuilder::new(function.name.clone(), params);
    let capture = |b: &mut FunctionBuilder, v: Value| {
        let reals: Vec<Value> = captured.get(&v)?.iter().map(|position| b.param(*position)).collect();
        Some(b.decoded(&reals, function.ty(v)))
    };
    let mut args: Vec<Value> =
        (0..uniform.len() as u32).map(|i| capture(&mut b, Value(i)).unwrap_or(Value::NONE)).collect();
    args.extend_from_slice(&b.params()[captures.len()..]);
    let mut rebuild = Rebuild::new(function, &args);
    while let Some(Step { index: v, node, op }) = rebuild.next(&mut b) {
        let outside = outer[v.0 as usize].map(|value| match prelude.builder.constant(value) {
            Some(constant) => b.scalar(constant),
            None => Value::NONE,
        });
        let value = capture(&mut b, v).or(outside).unwrap_or_else(|| b.emit(&op, node.ty));
        rebuild.push(Image::One(value));
    }
    let results = rebuild.results();
    (b.finish_like(function, results), captures)
}
