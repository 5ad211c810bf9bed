//! Derivatives in several directions at once, each of which moves some of a function's parameters at some rates.

use super::forward::{Forward, Tangents};
use super::{DiffError, Entry, clean, drop_zeros};
use crate::ir::graph::References;
use crate::ir::{FunctionBuilder, FunctionId, Module, Parameter, Value};
use std::collections::BTreeMap;

/// How the parameters p of a function follow from those of a function that is to be made, q, and how they move.
#[derive(Clone, Debug)]
pub struct Directions {
    /// The parameters q.
    pub params: Vec<Parameter>,
    /// Which q each p is.
    pub args: Vec<u32>,
    /// The rates of each p (none but where it is Real), by direction, ascending.
    pub rates: Vec<Vec<(u32, Rate)>>,
}

/// How fast a parameter moves.
#[derive(Clone, Copy, Debug)]
pub enum Rate {
    /// At any q.
    Constant(f64),
    /// As the parameter q of that index says.
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

/// The derivatives of a function's results in each direction: `(q..) -> entries..`; the second result says what each
/// entry is, by result and then by direction (as `param`). What is always zero is left out.
///
/// Two ways lead there: values carry their tangents in all directions; or in the direction of every p, and these are
/// combined in the end. The one with fewer operations is taken. The other stays in the module: functions that both
/// reach may have been rewritten in terms of it.
///
/// # Errors
/// If the derivative would be too large.
pub fn directional(
    module: &mut Module,
    function: FunctionId,
    directions: &Directions,
) -> Result<(FunctionId, Vec<Entry>), DiffError> {
    let by_tangents = carried(module, function, directions)?;
    let by_params = combined(module, function, directions)?;
    if size(module, by_tangents.0) <= size(module, by_params.0) { Ok(by_tangents) } else { Ok(by_params) }
}

/// Operations of a function and of all that it names.
fn size(module: &Module, id: FunctionId) -> usize {
    References::new(module, &[id]).order.iter().map(|f| module.function(*f).nodes.len()).sum()
}

/// By tangents in the directions.
fn carried(
    module: &mut Module,
    function: FunctionId,
    directions: &Directions,
) -> Result<(FunctionId, Vec<Entry>), DiffError> {
    let mut builder = FunctionBuilder::new("jacobian", directions.params.clone());
    let of = |rates: &Vec<(u32, Rate)>| rates.iter().map(|(d, rate)| (*d, rate.value(&mut builder))).collect();
    let tangents: Vec<Tangents> = directions.rates.iter().map(of).collect();
    let results = differentiate(module, &mut builder, function, directions, &tangents)?;
    finish(module, builder, results)
}

/// By tangents in the directions of p.
fn combined(
    module: &mut Module,
    function: FunctionId,
    directions: &Directions,
) -> Result<(FunctionId, Vec<Entry>), DiffError> {
    let mut builder = FunctionBuilder::new("jacobian", directions.params.clone());
    let one = builder.real(1.0);
    let unit = |(p, rates): (u32, &Vec<_>)| if rates.is_empty() { Tangents::new() } else { [(p, one)].into() };
    let tangents: Vec<Tangents> = (0..).zip(&directions.rates).map(unit).collect();
    let by_params = differentiate(module, &mut builder, function, directions, &tangents)?;
    let mut results = Vec::new();
    for by_param in by_params {
        let mut sums: BTreeMap<u32, Value> = BTreeMap::new();
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
    finish(module, builder, results)
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
    let mut forward = Forward::new(module, module.limits);
    let (_, tangents) = forward.splice(builder, &old, &args, tangents)?;
    forward.finish()?;
    Ok(tangents)
}

fn finish(
    module: &mut Module,
    builder: FunctionBuilder,
    results: Vec<BTreeMap<u32, Value>>,
) -> Result<(FunctionId, Vec<Entry>), DiffError> {
    let mut pattern = Vec::new();
    let mut named = Vec::new();
    for (result, tangents) in (0..).zip(results) {
        for (param, tangent) in tangents {
            pattern.push(Entry { result, param });
            named.push((format!("d{result}_{param}"), tangent));
        }
    }
    let id = module.add(builder.finish(named));
    clean(module, id)?;
    drop_zeros(module, id, &mut pattern);
    Ok((id, pattern))
}
