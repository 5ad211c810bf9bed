//! Jacobians in seed directions: each direction moves some of a function's parameters at some rates.

use super::forward::{Tangents, forward};
use super::{DiffError, Entry, finish_jacobian};
use crate::ir::call_graph::CallGraph;
use crate::ir::{FunctionBuilder, FunctionId, Module, Parameter, Value};

/// Seed directions for the parameters p of a function, which follow from the parameters q of a function that is to be
/// made.
#[derive(Clone, Debug)]
pub(crate) struct Directions {
    /// The parameters q.
    pub params: Vec<Parameter>,
    /// For each p the index of the q that it is.
    pub args: Vec<u32>,
    /// The rates of each p by direction, ascending; none unless p is Real.
    pub rates: Vec<Vec<(u32, Rate)>>,
}

/// The rate at which a direction moves a parameter: an entry of the seed matrix.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Rate {
    /// A number.
    Constant(f64),
    /// The parameter q of that index.
    Param(u32),
}

impl Rate {
    fn value(self, builder: &mut FunctionBuilder) -> Value {
        match self {
            Rate::Constant(x) => builder.real(x),
            Rate::Param(i) => builder.param(i as usize),
        }
    }
}

/// The derivatives of a function's results in each direction: `(q..) -> entries..`, with the derivative that each entry
/// is, by result and then by direction (as `param`). Derivatives that are always zero are left out.
///
/// There are two ways: values carry their tangents in all directions, or they carry their tangents by every p, which
/// the seed matrix combines in the end. The one with fewer operations is taken. The other stays in the module:
/// functions that both reach may have been rewritten in terms of it.
///
/// # Errors
/// If the derivative would be too large.
pub(crate) fn directional(
    module: &mut Module,
    function: FunctionId,
    directions: &Directions,
) -> Result<(FunctionId, Vec<Entry>), DiffError> {
    let by_tangents = carried(module, function, directions)?;
    let by_params = combined(module, function, directions)?;
    if size(module, by_tangents.0) <= size(module, by_params.0) { Ok(by_tangents) } else { Ok(by_params) }
}

/// The number of operations of a function and of all that it names.
fn size(module: &Module, id: FunctionId) -> usize {
    CallGraph::new(module, &[id]).order.iter().map(|f| module.function(*f).nodes.len()).sum()
}

/// The derivatives by tangents in the directions.
fn carried(
    module: &mut Module,
    function: FunctionId,
    directions: &Directions,
) -> Result<(FunctionId, Vec<Entry>), DiffError> {
    let mut builder = FunctionBuilder::new("jacobian", directions.params.clone());
    let seeds = |rates: &Vec<(u32, Rate)>| rates.iter().map(|(d, rate)| (*d, rate.value(&mut builder))).collect();
    let tangents: Vec<Tangents> = directions.rates.iter().map(seeds).collect();
    let results = differentiate(module, &mut builder, function, directions, &tangents)?;
    finish(module, builder, &results)
}

/// The derivatives by tangents in the directions of every p.
fn combined(
    module: &mut Module,
    function: FunctionId,
    directions: &Directions,
) -> Result<(FunctionId, Vec<Entry>), DiffError> {
    let mut builder = FunctionBuilder::new("jacobian", directions.params.clone());
    let one = builder.real(1.0);
    let unit = |(p, rates): (u32, &Vec<_>)| if rates.is_empty() { Tangents::new() } else { [(p, one)].into() };
    let tangents: Vec<Tangents> = (0..).zip(&directions.rates).map(unit).collect();
    let mut results = Vec::new();
    for by_param in differentiate(module, &mut builder, function, directions, &tangents)? {
        let mut sums = Tangents::new();
        for (p, tangent) in by_param {
            for (direction, rate) in &directions.rates[p as usize] {
                let rate = rate.value(&mut builder);
                let product = builder.mul(rate, tangent);
                let sum = sums.get(direction).map_or(product, |sum| builder.add(*sum, product));
                sums.insert(*direction, sum);
            }
        }
        results.push(sums);
    }
    finish(module, builder, &results)
}

/// The tangents of a function's results.
fn differentiate(
    module: &mut Module,
    builder: &mut FunctionBuilder,
    function: FunctionId,
    directions: &Directions,
    tangents: &[Tangents],
) -> Result<Vec<Tangents>, DiffError> {
    let old = module.function(function).clone();
    let args: Vec<Value> = directions.args.iter().map(|i| builder.param(*i as usize)).collect();
    Ok(forward(module, builder, &old, &args, tangents)?.1)
}

fn finish(
    module: &mut Module,
    builder: FunctionBuilder,
    tangents: &[Tangents],
) -> Result<(FunctionId, Vec<Entry>), DiffError> {
    finish_jacobian(module, builder, Vec::new(), tangents, |e| format!("d{}_{}", e.result, e.param))
}
