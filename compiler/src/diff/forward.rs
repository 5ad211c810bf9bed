//! Forward mode: every value carries its tangents.

use super::dependence::{Dependence, Set, carried_sets};
use super::rules::{self, Factor, Rule};
use super::{DiffError, check_size};
use crate::ir::builder::{Image, Rebuild, Step};
use crate::ir::scalar::Scalar;
use crate::ir::worklist::Worklist;
use crate::ir::{Binary, Function, FunctionBuilder, FunctionId, Module, Op, Parameter, Type, Value};
use std::collections::BTreeMap;

/// The tangents of a value by direction; the value does not change in a direction that is missing.
pub(super) type Tangents = BTreeMap<u32, Value>;

/// The directions in which each of some values has a tangent, ascending.
type Pattern = Vec<Vec<u32>>;

/// A callee to be differentiated: `(p.., dp.., q.., dq..) -> (r.., dr..)`, where p are its parameters before `split`
/// and q the others.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Derived {
    function: FunctionId,
    split: usize,
    params: Pattern,
    results: Pattern,
}

/// Puts a function's nodes and their tangents into a builder; returns its results and their tangents.
///
/// # Errors
/// If the derivative would be too large.
pub(super) fn forward(
    module: &mut Module,
    b: &mut FunctionBuilder,
    function: &Function,
    args: &[Value],
    tangents: &[Tangents],
) -> Result<(Vec<Value>, Vec<Tangents>), DiffError> {
    let mut forward = Forward::new(module);
    let made = forward.splice(b, function, args, tangents)?;
    forward.finish()?;
    Ok(made)
}

/// Forward differentiation in a module.
pub(super) struct Forward<'m> {
    module: &'m mut Module,
    dependence: Dependence,
    derived: Worklist<Derived>,
}

impl<'m> Forward<'m> {
    pub(super) fn new(module: &'m mut Module) -> Forward<'m> {
        Forward { module, dependence: Dependence::default(), derived: Worklist::default() }
    }

    pub(super) fn function(&self, id: FunctionId) -> Function {
        self.module.function(id).clone()
    }

    /// A function's results and their tangents: by its operations, or by its custom derivative.
    pub(super) fn differentiated(
        &mut self,
        b: &mut FunctionBuilder,
        id: FunctionId,
        args: &[Value],
        tangents: &[Tangents],
    ) -> Result<(Vec<Value>, Vec<Tangents>), DiffError> {
        let function = self.function(id);
        let Some(custom) = self.module.custom_derivatives.get(&id).cloned() else {
            return self.splice(b, &function, args, tangents);
        };
        let results = b.call(id, args.to_vec(), &function.result_types());
        let zero = b.real(0.0);
        let mut derivatives = vec![Tangents::new(); results.len()];
        let varied = custom.tangents.iter().flatten().map(|p| &tangents[*p as usize]);
        for d in varied.fold(Vec::new(), |all, t| union(&all, &t.keys().copied().collect::<Vec<_>>())) {
            let seed = |p: u32| tangents[p as usize].get(&d).copied();
            let mut all = args.to_vec();
            all.extend(custom.tangents.iter().map(|p| p.and_then(seed).unwrap_or(zero)));
            let made = b.call(custom.function, all, &vec![Type::Real; results.len()]);
            for (tangents, made) in derivatives.iter_mut().zip(made) {
                tangents.insert(d, made);
            }
        }
        Ok((results, derivatives))
    }

    /// Makes the derivatives of the functions that the spliced ones call.
    pub(super) fn finish(mut self) -> Result<(), DiffError> {
        while let Some((derived, id)) = self.derived.next() {
            let function = self.derive(&derived)?;
            self.module.define(id, function);
        }
        Ok(())
    }

    /// Puts a function's nodes and their tangents into a builder; returns its results and theirs.
    pub(super) fn splice(
        &mut self,
        b: &mut FunctionBuilder,
        function: &Function,
        args: &[Value],
        tangents: &[Tangents],
    ) -> Result<(Vec<Value>, Vec<Tangents>), DiffError> {
        let mut rebuild = Rebuild::new(function, args);
        let mut made = MadeTangents { function, params: tangents, nodes: Vec::with_capacity(function.nodes.len()) };
        while let Some(Step { index, node, op }) = rebuild.next(b) {
            check_size(b, &function.name, self.module.limits.nodes)?;
            let operands: Vec<&Tangents> = node.op.operands().into_iter().map(|v| made.of(v)).collect();
            let (image, tangents) = match &op {
                Op::If { .. } | Op::Loop { .. } | Op::Call { .. } => {
                    let (results, tangents) = self.structured(b, &op, &operands);
                    (Image::Many(results), tangents)
                }
                // The derivative of a surface is not trimmed.
                Op::Binary(Binary::Keep, a, _) => (Image::One(*a), vec![operands[0].clone()]),
                op => {
                    let value = b.emit(op, node.ty);
                    let real = node.ty == Type::Real;
                    (Image::One(value), if real { vec![simple(b, op, value, &operands)] } else { Vec::new() })
                }
            };
            rebuild.push(image);
            made.nodes.resize(index.0 as usize, Vec::new());
            made.nodes.push(tangents);
        }
        Ok((rebuild.results(), function.results.iter().map(|r| made.of(*r).clone()).collect()))
    }

    fn structured(&mut self, b: &mut FunctionBuilder, op: &Op, tangents: &[&Tangents]) -> (Vec<Value>, Vec<Tangents>) {
        match op {
            Op::Call { function, args } => {
                let (pattern, labels) = pattern_of(tangents);
                let results = self.reached(*function, &pattern);
                let derived = self.derived(*function, args.len(), &pattern, &results);
                let types = self.result_types(*function, &results);
                let made = b.call(derived, with_tangents(args, tangents), &types);
                split_results(b, made, &results, &labels)
            }
            Op::If { condition, then, otherwise, args } => {
                let tangents = &tangents[1..];
                let (pattern, labels) = pattern_of(tangents);
                let mut results = self.reached(*then, &pattern);
                for (directions, more) in results.iter_mut().zip(self.reached(*otherwise, &pattern)) {
                    *directions = union(directions, &more);
                }
                let sides = [*then, *otherwise].map(|side| self.derived(side, args.len(), &pattern, &results));
                let types = self.result_types(*then, &results);
                let made = b.if_(*condition, sides[0], sides[1], with_tangents(args, tangents), &types);
                split_results(b, made, &results, &labels)
            }
            Op::Loop { count, body, init, invariant } => {
                let tangents = &tangents[1..];
                let (pattern, labels) = pattern_of(tangents);
                let (first, fixed) = pattern.split_at(init.len());
                let carried = self.carried(*body, first, fixed);
                let params: Pattern = [vec![vec![]], carried.clone(), fixed.to_vec()].concat();
                let derived = self.derived(*body, 1 + init.len(), &params, &carried);
                let zero = b.real(0.0);
                let mut start = init.clone();
                for (directions, tangents) in carried.iter().zip(tangents) {
                    let get = |d: &u32| tangents.get(&labels[*d as usize]).copied().unwrap_or(zero);
                    start.extend(directions.iter().map(get));
                }
                let fixed = with_tangents(invariant, &tangents[init.len()..]);
                let made = b.loop_(*count, derived, start, fixed);
                split_results(b, made, &carried, &labels)
            }
            _ => (Vec::new(), Vec::new()),
        }
    }

    /// The directions in which the results have tangents, given those of the parameters.
    fn reached(&mut self, function: FunctionId, params: &Pattern) -> Pattern {
        let sets = self.dependence.of(self.module, function);
        sets.iter().map(|set| set.iter().fold(Vec::new(), |all, p| union(&all, &params[p]))).collect()
    }

    /// The directions of the carried values of a loop, in every iteration.
    fn carried(&mut self, body: FunctionId, init: &[Vec<u32>], invariant: &[Vec<u32>]) -> Pattern {
        let sets = self.dependence.of(self.module, body);
        let as_sets = |pattern: &[Vec<u32>]| -> Vec<Set> {
            pattern.iter().map(|directions| directions.iter().map(|d| *d as usize).collect()).collect()
        };
        let carried = carried_sets(&sets, as_sets(init), &as_sets(invariant));
        carried.iter().map(|set| set.iter().map(|d| d as u32).collect()).collect()
    }

    fn result_types(&self, function: FunctionId, results: &Pattern) -> Vec<Type> {
        let mut types = self.module.function(function).result_types();
        types.extend(results.iter().flatten().map(|_| Type::Real));
        types
    }

    /// The id of a derivative, which [`Forward::finish`] will make if it is new.
    fn derived(&mut self, function: FunctionId, split: usize, params: &Pattern, results: &Pattern) -> FunctionId {
        if params.iter().all(Vec::is_empty) {
            return function;
        }
        let derived = Derived { function, split, params: params.clone(), results: results.clone() };
        self.derived.id(self.module, derived)
    }

    fn derive(&mut self, derived: &Derived) -> Result<Function, DiffError> {
        let old = self.module.function(derived.function).clone();
        let (mut params, mut args, mut tangents) = (Vec::new(), Vec::new(), Vec::new());
        for range in [0..derived.split, derived.split..old.params.len()] {
            for i in range.clone() {
                args.push(Value(params.len() as u32));
                params.push(old.params[i].clone());
            }
            for i in range {
                let mut of_param = Tangents::new();
                for d in &derived.params[i] {
                    of_param.insert(*d, Value(params.len() as u32));
                    params.push(Parameter::real(tangent_name(&old.params[i].name, *d)));
                }
                tangents.push(of_param);
            }
        }
        let mut b = FunctionBuilder::new(format!("d{}", old.name), params);
        let (results, tangents) = self.differentiated(&mut b, derived.function, &args, &tangents)?;
        let mut named: Vec<(String, Value)> = old.result_names.iter().cloned().zip(results).collect();
        let zero = b.real(0.0);
        for (k, directions) in derived.results.iter().enumerate() {
            for d in directions {
                let tangent = tangents[k].get(d).copied().unwrap_or(zero);
                named.push((tangent_name(&old.result_names[k], *d), tangent));
            }
        }
        Ok(b.finish(named))
    }
}

fn tangent_name(name: &str, direction: u32) -> String {
    if direction == 0 { format!("d{name}") } else { format!("d{name}_{direction}") }
}

/// The tangents of the nodes of a function, as far as they are made.
struct MadeTangents<'f> {
    function: &'f Function,
    params: &'f [Tangents],
    /// The tangents of each node's value or results; those of parameters and projections are elsewhere.
    nodes: Vec<Vec<Tangents>>,
}

impl MadeTangents<'_> {
    fn of(&self, v: Value) -> &Tangents {
        static NONE: Tangents = Tangents::new();
        let (node, k) = match *self.function.op(v) {
            Op::Param(i) => return &self.params[i as usize],
            Op::Project(multi, k) => (multi, k),
            _ => (v, 0),
        };
        // An `Op::Tangent` that is still to be expanded has none.
        self.nodes[node.0 as usize].get(k as usize).unwrap_or(&NONE)
    }
}

/// The tangents of an operation that runs no function.
fn simple(b: &mut FunctionBuilder, op: &Op, value: Value, tangents: &[&Tangents]) -> Tangents {
    let mut sum = Tangents::new();
    let directions = tangents.iter().fold(Vec::new(), |all, t| union(&all, &t.keys().copied().collect::<Vec<_>>()));
    if directions.is_empty() || b.constant(value).is_some() {
        return sum;
    }
    let needed: Vec<bool> = tangents.iter().map(|t| !t.is_empty()).collect();
    let rule = rules::rule(b, op, value, &needed);
    let zero = b.real(0.0);
    for d in directions {
        let tangent_of = |operand: usize| tangents[operand].get(&d).copied();
        let tangent = match &rule {
            Rule::Linear(factors) => {
                let mut total = zero;
                for (operand, factor) in factors {
                    total = match (tangent_of(*operand), factor) {
                        (None, _) => total,
                        // A difference, not a negation, which would hide that t exists already.
                        (Some(t), Factor::Minus) => b.sub(total, t),
                        (Some(t), factor) => {
                            let term = factor.apply(b, t, false);
                            b.add(total, term)
                        }
                    };
                }
                total
            }
            Rule::Select(condition) => {
                b.select(*condition, tangent_of(1).unwrap_or(zero), tangent_of(2).unwrap_or(zero))
            }
            Rule::Extreme(first, second) => {
                let (x, y) = (tangent_of(0).unwrap_or(zero), tangent_of(1).unwrap_or(zero));
                let (half, both) = (b.real(0.5), b.add(x, y));
                let tie = b.mul(half, both);
                let rest = b.select(*second, y, tie);
                b.select(*first, x, rest)
            }
        };
        if tangent != zero {
            sum.insert(d, tangent);
        }
    }
    sum
}

/// The directions of some tangents, numbered in ascending order so that functions differentiated in other directions
/// of the same pattern are the same; and the direction of each number.
fn pattern_of(tangents: &[&Tangents]) -> (Pattern, Vec<u32>) {
    let labels = tangents.iter().fold(Vec::new(), |all, t| union(&all, &t.keys().copied().collect::<Vec<_>>()));
    let number = |d: &u32| labels.binary_search(d).unwrap_or(0) as u32;
    (tangents.iter().map(|t| t.keys().map(number).collect()).collect(), labels)
}

fn with_tangents(args: &[Value], tangents: &[&Tangents]) -> Vec<Value> {
    args.iter().copied().chain(tangents.iter().flat_map(|t| t.values().copied())).collect()
}

/// The results of a derivative: those of the function, and their tangents by the labels of the directions.
fn split_results(
    b: &FunctionBuilder,
    made: Vec<Value>,
    pattern: &Pattern,
    labels: &[u32],
) -> (Vec<Value>, Vec<Tangents>) {
    let mut rest = made[pattern.len()..].iter();
    let mut next = |directions: &Vec<u32>| -> Tangents {
        let labelled = directions.iter().map(|d| labels[*d as usize]).zip(rest.by_ref().copied());
        labelled.filter(|(_, t)| b.constant(*t) != Some(Scalar::Real(0.0))).collect()
    };
    let tangents = pattern.iter().map(&mut next).collect();
    (made[..pattern.len()].to_vec(), tangents)
}

/// The union of two ascending lists.
fn union(a: &[u32], b: &[u32]) -> Vec<u32> {
    let mut all = [a, b].concat();
    all.sort_unstable();
    all.dedup();
    all
}
