//! Expansion of the derivatives that a script asks for.

use super::forward::{Forward, Tangents};
use super::{DiffError, check_size};
use crate::ir::builder::{Image, Rebuild, Step};
use crate::ir::call_graph::CallGraph;
use crate::ir::{self, Function, FunctionBuilder, FunctionId, Module, Op, Type, Value};

/// Replaces every [`Op::Tangent`] in the roots and the functions that they reach, innermost first, so that derivatives
/// of derivatives work to any order. Functions whose derivative is taken are inlined.
///
/// # Errors
/// If a function needs its own derivative, or a derivative would be too large.
pub fn expand(module: &mut Module, roots: &[FunctionId]) -> Result<(), DiffError> {
    let graph = CallGraph::new(module, roots);
    for id in &graph.order {
        let function = module.function(*id);
        let mut targets = Vec::new();
        for node in &function.nodes {
            let Op::Tangent { function: target, .. } = node.op else { continue };
            if graph.in_one_cycle(*id, target) {
                return Err(DiffError::Recursive { function: function.name.clone(), span: node.span });
            }
            targets.push(target);
        }
        if targets.is_empty() {
            continue;
        }
        targets.sort_unstable();
        targets.dedup();
        ir::inline(module, &targets)?;
        ir::simplify(module, &targets);
        let function = module.function(*id).clone();
        let expanded = expanded(module, &function)?;
        module.define(*id, expanded);
    }
    ir::validate::after_pass(module, "expand");
    Ok(())
}

fn expanded(module: &mut Module, function: &Function) -> Result<Function, DiffError> {
    let limit = module.limits.nodes;
    let mut b = FunctionBuilder::like(function);
    let mut forward = Forward::new(module);
    let params = b.params();
    let mut rebuild = Rebuild::new(function, &params);
    while let Some(Step { node, op, .. }) = rebuild.next(&mut b) {
        check_size(&b, &function.name, limit)?;
        rebuild.push(match &op {
            Op::Tangent { function: target, args, seeds } => {
                Image::Many(tangents_of(&mut forward, &mut b, *target, args, seeds)?)
            }
            op => Image::One(b.emit(op, node.ty)),
        });
    }
    forward.finish()?;
    Ok(b.finish_like(function, rebuild.results()))
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
