//! Merging of equal functions, and of bodies that differ only in constants, which they capture then.
//!
//! The parts of a loop differ in what they capture and in constants that follow from the loop's variable. Merged, they
//! are differentiated and compiled once.

use super::call_graph::CallGraph;
use super::hash::{HashMap, HashSet};
use super::hoist::prelude::Split;
use super::{FailureId, Function, FunctionId, Module, Node, Op, Parameter, Type, Value};
use crate::source::Span;
use foldhash::fast::RandomState;
use std::hash::{BuildHasher, Hash, Hasher};

/// Lets operations name the same function where they name equal ones, in the roots and in all that these reach. Parts
/// of a body are lowered each for itself, and so are the loops of what they have in common.
pub(crate) fn merge_named(module: &mut Module, roots: &[FunctionId]) {
    merge_equal(module, roots);
    super::validate::after_pass(module, "merge");
}

/// For each root the function that stands for it: the first of those that are equal except for names. Places in the
/// source count, and the functions that they name are merged likewise.
fn merge_equal(module: &mut Module, roots: &[FunctionId]) -> Vec<FunctionId> {
    let failures = equal_failures(module);
    let graph = CallGraph::new(module, roots);
    let state = RandomState::default();
    let mut known: HashMap<u64, Vec<FunctionId>> = HashMap::default();
    let mut merged: HashMap<FunctionId, FunctionId> = HashMap::default();
    for id in &graph.order {
        for node in &mut module.functions[id.0 as usize].nodes {
            if let Op::Guard { failure, .. } = &mut node.op {
                *failure = failures[failure.0 as usize];
            } else {
                node.op.replace_functions(|f| merged.get(&f).copied().unwrap_or(f));
            }
        }
        // Functions may be equal although only one of them has a custom derivative.
        if module.custom_derivatives.contains_key(id) {
            continue;
        }
        let function = module.function(*id);
        let equal = known.entry(hash(&state, function, true)).or_default();
        match equal.iter().find(|other| is_equal(module.function(**other), function, true)) {
            Some(other) => _ = merged.insert(*id, *other),
            None => equal.push(*id),
        }
    }
    roots.iter().map(|id| merged.get(id).copied().unwrap_or(*id)).collect()
}

/// Merges the bodies of a split that are equal except for the values of real constants: constants that differ become
/// captures, after the others, and results of the prelude.
pub(crate) fn merge_bodies(module: &mut Module, split: &mut Split) {
    let roots: Vec<FunctionId> = split.bodies.iter().map(|b| b.function).collect();
    let merged = merge_equal(module, &roots);
    let state = RandomState::default();
    let mut known: HashMap<u64, Vec<Vec<FunctionId>>> = HashMap::default();
    let mut seen: HashSet<FunctionId> = HashSet::default();
    for id in merged.iter().filter(|id| seen.insert(**id)) {
        let function = module.function(*id);
        let groups = known.entry(hash(&state, function, false)).or_default();
        match groups.iter_mut().find(|group| is_equal(module.function(group[0]), function, false)) {
            Some(group) => group.push(*id),
            None => groups.push(vec![*id]),
        }
    }
    let mut groups: Vec<Vec<FunctionId>> = known.into_values().flatten().filter(|g| g.len() > 1).collect();
    groups.sort_unstable();
    let mut indices: HashMap<u64, u32> = HashMap::default();
    let mut replaced: HashMap<FunctionId, (FunctionId, Vec<u32>)> = HashMap::default();
    for group in groups {
        let differing = differing_constants(module, &group);
        let function = with_captures(module.function(group[0]), &differing);
        let function = module.add(function);
        for id in group {
            let bits: Vec<u64> = differing.iter().map(|v| real_bits(module.function(id), *v)).collect();
            let prelude = &mut module.functions[split.prelude.0 as usize];
            let captures =
                bits.into_iter().map(|bits| *indices.entry(bits).or_insert_with(|| add_constant(prelude, bits)));
            replaced.insert(id, (function, captures.collect()));
        }
    }
    for (body, function) in split.bodies.iter_mut().zip(merged) {
        body.function = function;
        if let Some((function, captures)) = replaced.get(&function) {
            body.function = *function;
            body.constants = captures.len();
            body.captures.extend(captures);
        }
    }
    super::validate::after_pass(module, "merge");
}

/// Adds a constant to the results of a prelude; returns its index.
fn add_constant(prelude: &mut Function, bits: u64) -> u32 {
    let index = prelude.results.len() as u32;
    prelude.results.push(Value(prelude.nodes.len() as u32));
    prelude.nodes.push(Node { op: Op::Real(bits), ty: Type::Real, span: Span::default() });
    prelude.result_names.push(format!("c{index}"));
    index
}

/// The constants in which functions differ that are equal otherwise.
fn differing_constants(module: &Module, group: &[FunctionId]) -> Vec<Value> {
    let first = module.function(group[0]);
    let differs = |v: &Value| {
        matches!(first.op(*v), Op::Real(_)) && group.iter().any(|id| module.function(*id).op(*v) != first.op(*v))
    };
    first.values().filter(differs).collect()
}

fn real_bits(function: &Function, v: Value) -> u64 {
    if let Op::Real(bits) = *function.op(v) { bits } else { 0 }
}

/// A body `(captures.., u, v)` with some of its constants as captures, after the others.
fn with_captures(body: &Function, constants: &[Value]) -> Function {
    let uv = body.params.len() - 2;
    let mut params = body.params[..uv].to_vec();
    params.extend((0..constants.len()).map(|k| Parameter::real(format!("k{k}"))));
    params.extend_from_slice(&body.params[uv..]);
    let added = uv..uv + constants.len();
    let args: Vec<Value> = (0..params.len()).filter(|i| !added.contains(i)).map(|i| Value(i as u32)).collect();
    body.with_params(params, &args, |_, v| constants.binary_search(&v).ok().map(|k| Value((uv + k) as u32)))
}

/// For each failure the first one with the same message and place.
fn equal_failures(module: &Module) -> Vec<FailureId> {
    let mut first: HashMap<(Span, &str), FailureId> = HashMap::default();
    let failures = (0..).map(FailureId).zip(&module.failures);
    failures.map(|(id, failure)| *first.entry((failure.span, &failure.message)).or_insert(id)).collect()
}

fn hash(state: &RandomState, function: &Function, constants: bool) -> u64 {
    let mut hasher = state.build_hasher();
    for node in &function.nodes {
        match node.op {
            Op::Real(_) if !constants => 0.hash(&mut hasher),
            _ => node.op.hash(&mut hasher),
        }
        (node.ty, node.span).hash(&mut hasher);
    }
    function.results.hash(&mut hasher);
    hasher.finish()
}

/// Whether functions are equal; with `constants` also in the values of real constants.
fn is_equal(a: &Function, b: &Function, constants: bool) -> bool {
    let alike = |(a, b): (&Node, &Node)| {
        let masked = !constants && matches!((&a.op, &b.op), (Op::Real(_), Op::Real(_)));
        (masked || a.op == b.op) && a.ty == b.ty && a.span == b.span
    };
    a.params.len() == b.params.len()
        && a.results == b.results
        && a.nodes.len() == b.nodes.len()
        && a.nodes.iter().zip(&b.nodes).all(alike)
}
