//! Replaces the derivatives that a script asks for by what computes them.

use super::forward::{Forward, Tangents};
use super::{DiffError, check_size};
use crate::ir::graph::References;
use crate::ir::inline::Limits;
use crate::ir::{self, Function, FunctionBuilder, FunctionId, Module, Op, Type, Value};

/// Replaces every [`Op::Tangent`] in the roots and the functions that they reach. Innermost first, so that
/// derivatives of derivatives work to any order. Functions whose derivative is taken are inlined.
///
/// # Errors
/// If a function needs its own derivative, or a derivative would be too large.
pub fn expand(module: &mut Module, roots: &[FunctionId]) -> Result<(), DiffError> {
    expand_within(module, roots, module.limits)
}

/// [`expand`] with limits of one's own; they hold for every function whose derivative is taken.
///
/// # Errors
/// As [`expand`].
pub fn expand_within(module: &mut Module, roots: &[FunctionId], limits: Limits) -> Result<(), DiffError> {
    let references = References::new(module, roots);
    for id in &references.order {
        let function = module.function(*id);
        let mut targets = Vec::new();
        for node in &function.nodes {
            let Op::Tangent { function: target, .. } = node.op else { continue };
            if references.in_one_cycle(*id, target) {
                return Err(DiffError::Recursive { function: function.name.clone(), span: node.span });
            }
            targets.push(target);
        }
        if targets.is_empty() {
            continue;
        }
        targets.sort_unstable();
        targets.dedup();
        ir::inline(module, &targets, limits)?;
        ir::simplify(module, &targets);
        let function = module.function(*id).clone();
        let expanded = expanded(module, &function, limits)?;
        module.define(*id, expanded);
    }
    ir::validate::after_pass(module, "expand");
    Ok(())
}

fn expanded(module: &mut Module, function: &Function, limits: Limits) -> Result<Function, DiffError> {
    let mut b = FunctionBuilder::new(function.name.clone(), function.params.clone());
    let mut forward = Forward::new(module, limits);
    let mut values: Vec<Expanded> = Vec::with_capacity(function.nodes.len());
    for node in &function.nodes {
        check_size(&b, &function.name, limits.nodes)?;
        b.set_span(node.span);
        let get = |v: &Value| values[v.0 as usize].one();
        let value = match &node.op {
            Op::Tangent { function: target, args, seeds } => {
                let args: Vec<Value> = args.iter().map(get).collect();
                let seeds: Vec<(u32, Value)> = seeds.iter().map(|(i, v)| (*i, get(v))).collect();
                Expanded::Many(tangents_of(&mut forward, &mut b, *target, &args, &seeds)?)
            }
            Op::Project(multi, k) => match &values[multi.0 as usize] {
                Expanded::Many(results) => Expanded::One(results[*k as usize]),
                Expanded::One(multi) => Expanded::One(b.project(*multi, *k, node.ty)),
            },
            op => Expanded::One(b.emit(&op.map_operands(|v| get(&v)), node.ty)),
        };
        values.push(value);
    }
    forward.finish()?;
    let results = function.results.iter().map(|r| values[r.0 as usize].one());
    Ok(b.finish(function.result_names.iter().cloned().zip(results)))
}

/// What a node has become.
enum Expanded {
    One(Value),
    /// The tangents of a function's results.
    Many(Vec<Value>),
}

impl Expanded {
    fn one(&self) -> Value {
        match self {
            Expanded::One(value) => *value,
            // Only projections use a structured node.
            Expanded::Many(_) => Value(u32::MAX),
        }
    }
}

fn tangents_of(
    forward: &mut Forward<'_>,
    b: &mut FunctionBuilder,
    id: FunctionId,
    args: &[Value],
    seeds: &[(u32, Value)],
) -> Result<Vec<Value>, DiffError> {
    let function = forward.function(id);
    let zero = b.real(0.0);
    let mut tangents = vec![Tangents::new(); args.len()];
    for (i, seed) in seeds {
        if function.params[*i as usize].ty == Type::Real && *seed != zero {
            tangents[*i as usize].insert(0, *seed);
        }
    }
    let (_, tangents) = forward.differentiated(b, id, args, &tangents)?;
    Ok(tangents.iter().map(|t| t.get(&0).copied().unwrap_or(zero)).collect())
}
