//! Reverse mode: adjoints are summed from the results back to the parameters.

use super::dependence::{Dependence, Set};
use super::rules::{self, Rule};
use super::{DiffError, check_size};
use crate::ir::hash::HashMap;
use crate::ir::worklist::Worklist;
use crate::ir::{CustomDerivative, Function, FunctionBuilder, FunctionId, Module, Op, Parameter, Type, Value};

/// The derivative of the differentiated function by a value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Adjoint {
    pub(super) value: Value,
    /// Whether it may be zero because a branch was not taken, behind which values need not be finite.
    pub(super) masked: bool,
}

/// A pullback to be made as a function: `(p.., adjoint of each of results..) -> (adjoint of each of params..)`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Derived {
    pub(super) function: FunctionId,
    pub(super) params: Vec<u32>,
    pub(super) results: Vec<u32>,
    masked: bool,
}

/// Reverse differentiation in a module.
pub(super) struct Reverse<'m> {
    pub(super) module: &'m mut Module,
    pub(super) dependence: Dependence,
    derived: Worklist<Derived>,
}

/// The adjoints of the nodes of a function, as far as the sweep has summed them.
pub(super) struct Adjoints {
    sums: Vec<Option<Adjoint>>,
    /// For each node, whether it depends on a parameter by which the derivative is taken; others need no adjoint.
    active: Vec<bool>,
}

impl Adjoints {
    pub(super) fn add(&mut self, b: &mut FunctionBuilder, node: Value, more: Adjoint) {
        if !self.is_active(node) {
            return;
        }
        let slot = &mut self.sums[node.0 as usize];
        *slot = Some(match *slot {
            None => more,
            Some(sum) => Adjoint { value: b.add(sum.value, more.value), masked: sum.masked && more.masked },
        });
    }

    pub(super) fn is_active(&self, node: Value) -> bool {
        self.active[node.0 as usize]
    }
}

impl<'m> Reverse<'m> {
    pub(super) fn new(module: &'m mut Module) -> Reverse<'m> {
        Reverse { module, dependence: Dependence::default(), derived: Worklist::default() }
    }

    /// Makes the pullbacks of the functions that the spliced ones call.
    pub(super) fn finish(mut self) -> Result<(), DiffError> {
        while let Some((derived, id)) = self.derived.next() {
            let function = self.derive(&derived)?;
            self.module.define(id, function);
        }
        Ok(())
    }

    /// Puts a function's nodes and then its reverse sweep into a builder; returns its results, and the adjoints of
    /// the parameters `wrt` for the given adjoints of its results. `None` stands for zero.
    pub(super) fn splice(
        &mut self,
        b: &mut FunctionBuilder,
        function: &Function,
        args: &[Value],
        adjoints: &[Option<Adjoint>],
        wrt: &[u32],
    ) -> Result<(Vec<Value>, Vec<Option<Value>>), DiffError> {
        let primal = b.splice_nodes(function, args);
        let values: Vec<Value> = function.values().map(|v| primal.value(v)).collect();
        let wrt_set: Set = wrt.iter().map(|i| *i as usize).collect();
        let sets = self.dependence.of_nodes(self.module, function);
        let active = sets.iter().map(|set| set.meets(&wrt_set)).collect();
        let mut sums = Adjoints { sums: vec![None; function.nodes.len()], active };
        for (result, adjoint) in function.results.iter().zip(adjoints) {
            if let Some(adjoint) = adjoint {
                sums.add(b, *result, *adjoint);
            }
        }
        // The adjoints of a structured node's results, until the sweep comes to it.
        let mut several: HashMap<Value, Vec<(u32, Adjoint)>> = HashMap::default();
        for node in function.values().rev() {
            check_size(b, &function.name, self.module.limits.nodes)?;
            b.set_span(function.nodes[node.0 as usize].span);
            let op = function.op(node);
            if let Some(mut results) = several.remove(&node) {
                results.sort_by_key(|(k, _)| *k);
                self.structured(b, function, op, &values, &results, &mut sums)?;
                continue;
            }
            let Some(adjoint) = sums.sums[node.0 as usize] else { continue };
            if let Op::Project(multi, k) = op {
                several.entry(*multi).or_default().push((*k, adjoint));
            } else {
                simple(b, op, &values, node, adjoint, &mut sums);
            }
        }
        let adjoint = |i: &u32| sums.sums[*i as usize].map(|a| a.value);
        Ok((primal.results(), wrt.iter().map(adjoint).collect()))
    }

    fn structured(
        &mut self,
        b: &mut FunctionBuilder,
        function: &Function,
        op: &Op,
        values: &[Value],
        results: &[(u32, Adjoint)],
        sums: &mut Adjoints,
    ) -> Result<(), DiffError> {
        let value = |v: &Value| values[v.0 as usize];
        let masked = results.iter().any(|(_, a)| a.masked);
        let varied: Vec<u32> = results.iter().map(|(k, _)| *k).collect();
        let (args, made) = match op {
            Op::Call { function: callee, args } => {
                let params = self.reached(&[*callee], &varied, args, sums);
                let pullback = self.derived(*callee, params.clone(), varied, masked);
                let types = vec![Type::Real; params.len()];
                let made = b.call(pullback, with_adjoints(args.iter().map(value), results), &types);
                (args, params.into_iter().zip(made).collect::<Vec<_>>())
            }
            Op::If { condition, then, otherwise, args } => {
                let params = self.reached(&[*then, *otherwise], &varied, args, sums);
                let sides = [*then, *otherwise].map(|side| self.derived(side, params.clone(), varied.clone(), masked));
                let types = vec![Type::Real; params.len()];
                let all = with_adjoints(args.iter().map(value), results);
                let made = b.if_(value(condition), sides[0], sides[1], all, &types);
                (args, params.into_iter().zip(made).collect())
            }
            Op::Loop { .. } => return self.loop_(b, op, values, results, sums),
            _ => {
                debug_assert!(false, "a tangent in '{}' was not expanded", function.name);
                return Ok(());
            }
        };
        for (param, adjoint) in made {
            sums.add(b, args[param as usize], Adjoint { value: adjoint, masked: true });
        }
        Ok(())
    }

    /// The active parameters on which the given results of any of some functions depend.
    fn reached(&mut self, functions: &[FunctionId], results: &[u32], args: &[Value], sums: &Adjoints) -> Vec<u32> {
        let mut reached = Set::default();
        for function in functions {
            let sets = self.dependence.of(self.module, *function);
            results.iter().for_each(|k| reached.union(&sets[*k as usize]));
        }
        reached.iter().filter(|p| sums.is_active(args[*p])).map(|p| p as u32).collect()
    }

    /// The id of a pullback, which [`Reverse::finish`] will make if it is new.
    pub(super) fn derived(
        &mut self,
        function: FunctionId,
        params: Vec<u32>,
        results: Vec<u32>,
        masked: bool,
    ) -> FunctionId {
        self.derived.id(self.module, Derived { function, params, results, masked })
    }

    /// The adjoints of a function with a custom derivative. This is linear in the tangents: its pullback by them, which
    /// does not depend on their values, is its transpose.
    fn transposed(
        &mut self,
        b: &mut FunctionBuilder,
        derived: &Derived,
        custom: &CustomDerivative,
        args: &[Value],
    ) -> Vec<Option<Value>> {
        let active = |t: &usize| custom.tangents[*t].is_some_and(|p| derived.params.contains(&p));
        let tangents: Vec<usize> = (0..custom.tangents.len()).filter(active).collect();
        let params = tangents.iter().map(|t| (args.len() + t) as u32).collect();
        let pullback = self.derived(custom.function, params, derived.results.clone(), derived.masked);
        let mut all = args.to_vec();
        all.extend(custom.tangents.iter().map(|_| b.real(0.0)));
        all.extend((0..derived.results.len()).map(|k| b.param(args.len() + k)));
        let made = b.call(pullback, all, &vec![Type::Real; tangents.len()]);
        let adjoint = |p: &u32| tangents.iter().position(|t| custom.tangents[*t] == Some(*p)).map(|k| made[k]);
        derived.params.iter().map(adjoint).collect()
    }

    fn derive(&mut self, derived: &Derived) -> Result<Function, DiffError> {
        let old = self.module.function(derived.function).clone();
        let mut params = old.params.clone();
        params.extend(derived.results.iter().map(|k| bar(&old.result_names[*k as usize])));
        let mut b = FunctionBuilder::new(format!("pullback_{}", old.name), params);
        let args = b.params()[..old.params.len()].to_vec();
        let mut adjoints = vec![None; old.results.len()];
        for (position, k) in derived.results.iter().enumerate() {
            let value = b.param(args.len() + position);
            adjoints[*k as usize] = Some(Adjoint { value, masked: derived.masked });
        }
        let adjoints = match self.module.custom_derivatives.get(&derived.function).cloned() {
            Some(custom) => self.transposed(&mut b, derived, &custom, &args),
            None => self.splice(&mut b, &old, &args, &adjoints, &derived.params)?.1,
        };
        let zero = b.real(0.0);
        let named = derived.params.iter().zip(adjoints);
        Ok(b.finish(named.map(|(i, a)| (bar(&old.params[*i as usize].name).name, a.unwrap_or(zero)))))
    }
}

/// The parameter that hands in the adjoint of a result.
pub(super) fn bar(name: &str) -> Parameter {
    Parameter::real(format!("{name}_bar"))
}

fn with_adjoints(args: impl Iterator<Item = Value>, results: &[(u32, Adjoint)]) -> Vec<Value> {
    args.chain(results.iter().map(|(_, a)| a.value)).collect()
}

/// Hands the adjoint of an operation that runs no function to its operands.
fn simple(b: &mut FunctionBuilder, op: &Op, values: &[Value], node: Value, adjoint: Adjoint, sums: &mut Adjoints) {
    let operands = op.operands();
    let needed: Vec<bool> = operands.iter().map(|v| sums.is_active(*v)).collect();
    if !needed.contains(&true) {
        return;
    }
    let mapped = op.map_operands(|v| values[v.0 as usize]);
    let Adjoint { value: t, masked } = adjoint;
    match rules::rule(b, &mapped, values[node.0 as usize], &needed) {
        Rule::Linear(factors) => {
            for (operand, factor) in factors {
                if needed[operand] {
                    let value = factor.apply(b, t, masked);
                    sums.add(b, operands[operand], Adjoint { value, masked });
                }
            }
        }
        Rule::Select(condition) => {
            let zero = b.real(0.0);
            for (operand, value) in [(1, b.select(condition, t, zero)), (2, b.select(condition, zero, t))] {
                sums.add(b, operands[operand], Adjoint { value, masked: true });
            }
        }
        Rule::Extreme(first, second) => {
            let (zero, half) = (b.real(0.0), b.real(0.5));
            let tie = b.mul(half, t);
            for (operand, mine, other) in [(0, first, second), (1, second, first)] {
                let rest = b.select(other, zero, tie);
                let value = b.select(mine, t, rest);
                sums.add(b, operands[operand], Adjoint { value, masked: true });
            }
        }
    }
}
