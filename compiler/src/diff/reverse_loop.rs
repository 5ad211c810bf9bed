//! Reverse mode of loops.

use super::DiffError;
use super::dependence::{Set, carried_sets};
use super::reverse::{Adjoint, Adjoints, Reverse, bar};
use crate::ir::scalar::Scalar;
use crate::ir::{Binary, Compare, Function, FunctionBuilder, FunctionId, Op, Parameter, Type, Value};

/// A loop of a known count is unrolled where its iterations have at most this many nodes in all.
const UNROLLED_NODES: i64 = 4096;

/// A loop that is differentiated, and the indices of its active values.
struct ActiveLoop {
    body: FunctionId,
    /// The number of values that it carries.
    width: usize,
    /// The carried values that are active and whose adjoints are not zero.
    carried: Vec<u32>,
    /// The invariant ones likewise.
    invariant: Vec<u32>,
    /// `(i, carried.., invariant.., adjoints of carried..) -> (adjoints of carried.., of invariant..)` of one
    /// iteration.
    pullback: FunctionId,
}

impl Reverse<'_> {
    pub(super) fn loop_(
        &mut self,
        b: &mut FunctionBuilder,
        op: &Op,
        values: &[Value],
        results: &[(u32, Adjoint)],
        sums: &mut Adjoints,
    ) -> Result<(), DiffError> {
        let Op::Loop { count, body, init, invariant } = op else { return Ok(()) };
        let active = self.active_loop(*body, init, invariant, results, sums);
        let zero = b.real(0.0);
        let seeds: Vec<Value> = (active.carried.iter())
            .map(|k| results.iter().find(|(r, _)| r == k).map_or(zero, |(_, a)| a.value))
            .collect();
        let value = |v: &Value| values[v.0 as usize];
        let first: Vec<Value> = init.iter().map(value).collect();
        let fixed: Vec<Value> = invariant.iter().map(value).collect();
        let size = self.module.function(*body).nodes.len() as i64;
        let made = match b.constant(value(count)) {
            Some(Scalar::Int(n)) if n.max(0).saturating_mul(size) <= UNROLLED_NODES => {
                self.unrolled(b, &active, n, first, &fixed, seeds)
            }
            _ => self.halved(b, &active, value(count), &first, &fixed, seeds),
        };
        let into = active.carried.iter().map(|k| init[*k as usize]);
        let into = into.chain(active.invariant.iter().map(|k| invariant[*k as usize]));
        for (operand, adjoint) in into.zip(made) {
            sums.add(b, operand, Adjoint { value: adjoint, masked: true });
        }
        Ok(())
    }

    fn active_loop(
        &mut self,
        body: FunctionId,
        init: &[Value],
        invariant: &[Value],
        results: &[(u32, Adjoint)],
        sums: &Adjoints,
    ) -> ActiveLoop {
        let sets = self.dependence.of(self.module, body);
        // The carried values that depend on an active operand.
        let flag = |v: &Value| sums.is_active(*v).then_some(0).into_iter().collect::<Set>();
        let depends =
            carried_sets(&sets, init.iter().map(flag).collect(), &invariant.iter().map(flag).collect::<Vec<_>>());
        // The values among them on which the results with adjoints depend.
        let mut matters = vec![false; init.len() + invariant.len()];
        let mut left: Vec<usize> = results.iter().map(|(k, _)| *k as usize).collect();
        while let Some(k) = left.pop() {
            if matters[k] || (k < init.len() && !depends[k].contains(0)) {
                continue;
            }
            matters[k] = true;
            if k < init.len() {
                left.extend(sets[k].iter().filter(|p| *p > 0).map(|p| p - 1));
            }
        }
        let carried: Vec<u32> = (0..init.len()).filter(|k| matters[*k]).map(|k| k as u32).collect();
        let is_active = |k: &usize| matters[init.len() + k] && sums.is_active(invariant[*k]);
        let invariant: Vec<u32> = (0..invariant.len()).filter(is_active).map(|k| k as u32).collect();
        let params = carried.iter().map(|k| k + 1).chain(invariant.iter().map(|k| k + 1 + init.len() as u32));
        let pullback = self.derived(body, params.collect(), carried.clone(), true);
        ActiveLoop { body, width: init.len(), carried, invariant, pullback }
    }

    /// Keeps the states of all iterations, and then goes through these backwards.
    fn unrolled(
        &mut self,
        b: &mut FunctionBuilder,
        active: &ActiveLoop,
        count: i64,
        first: Vec<Value>,
        fixed: &[Value],
        seeds: Vec<Value>,
    ) -> Vec<Value> {
        let types = self.module.function(active.body).result_types();
        let mut states = vec![first];
        for i in 0..count {
            let i = b.int(i);
            let state = &states[states.len() - 1];
            let args = [&[i], &state[..], fixed].concat();
            states.push(b.call(active.body, args, &types));
        }
        let zero = b.real(0.0);
        let (mut adjoints, mut fixed_adjoints) = (seeds, vec![zero; active.invariant.len()]);
        let types = vec![Type::Real; adjoints.len() + fixed_adjoints.len()];
        for i in (0..count).rev() {
            let index = b.int(i);
            let args = [&[index], &states[i as usize][..], fixed, &adjoints].concat();
            let made = b.call(active.pullback, args, &types);
            adjoints = made[..adjoints.len()].to_vec();
            for (sum, more) in fixed_adjoints.iter_mut().zip(&made[adjoints.len()..]) {
                *sum = b.add(*sum, *more);
            }
        }
        [adjoints, fixed_adjoints].concat()
    }

    /// Halves the loop recursively ([`super`]).
    fn halved(
        &mut self,
        b: &mut FunctionBuilder,
        active: &ActiveLoop,
        count: Value,
        first: &[Value],
        fixed: &[Value],
        seeds: Vec<Value>,
    ) -> Vec<Value> {
        let back = self.module.reserve();
        let shape = Shape::of(self.module.function(active.body), active);
        let none = self.module.add(shape.no_iteration());
        let single = self.module.add(shape.one_iteration(active));
        let shifted = self.module.add(shape.shifted(active.body));
        let halves = self.module.add(shape.halves(shifted, back));
        self.module.define(back, shape.back(single, halves));
        let zero = b.int(0);
        let some = b.compare(Compare::Lt, zero, count);
        let args = [&[zero, count], first, fixed, &seeds].concat();
        b.if_(some, back, none, args, &shape.results)
    }
}

/// The signature of the functions of a reversed loop: `(lo: Int, n: Int, carried.., invariant.., adjoints of
/// carried..)` with the state before iteration `lo` and the adjoints after iteration `lo + n - 1`. They return the
/// adjoints before iteration `lo`, and what the n iterations add to the adjoints of the invariant values.
struct Shape {
    params: Vec<Parameter>,
    carried: Vec<Type>,
    width: usize,
    fixed: usize,
    adjoints: usize,
    names: Vec<String>,
    results: Vec<Type>,
    name: String,
}

impl Shape {
    fn of(body: &Function, active: &ActiveLoop) -> Shape {
        let mut params = vec![Parameter::new("lo", Type::Int), Parameter::new("n", Type::Int)];
        params.extend(body.params[1..].iter().cloned());
        params.extend(active.carried.iter().map(|k| bar(&body.result_names[*k as usize])));
        let carried = active.carried.iter().map(|k| &body.params[*k as usize + 1]);
        let fixed = active.invariant.iter().map(|k| &body.params[*k as usize + 1 + active.width]);
        let names: Vec<String> = carried.chain(fixed).map(|p| bar(&p.name).name).collect();
        Shape {
            params,
            carried: body.result_types(),
            width: active.width,
            fixed: body.params.len() - 1 - active.width,
            adjoints: active.carried.len(),
            results: vec![Type::Real; names.len()],
            names,
            name: body.name.clone(),
        }
    }

    fn start(&self, prefix: &str) -> FunctionBuilder {
        FunctionBuilder::new(format!("{prefix}_{}", self.name), self.params.clone())
    }

    fn finish(&self, b: FunctionBuilder, results: Vec<Value>) -> Function {
        b.finish(self.names.iter().cloned().zip(results))
    }

    /// The parameters in their groups: carried, invariant, adjoints.
    fn groups(&self, b: &FunctionBuilder) -> [Vec<Value>; 3] {
        let all = b.params();
        let (carried, rest) = all[2..].split_at(self.width);
        let (fixed, adjoints) = rest.split_at(self.fixed);
        [carried.to_vec(), fixed.to_vec(), adjoints.to_vec()]
    }

    fn no_iteration(&self) -> Function {
        let mut b = self.start("no_iteration_of");
        let zero = b.real(0.0);
        let [_, _, mut results] = self.groups(&b);
        results.resize(self.names.len(), zero);
        self.finish(b, results)
    }

    fn one_iteration(&self, active: &ActiveLoop) -> Function {
        let mut b = self.start("iteration_back");
        let [carried, fixed, adjoints] = self.groups(&b);
        let args = [&[b.param(0)][..], &carried, &fixed, &adjoints].concat();
        let results = b.call(active.pullback, args, &self.results);
        self.finish(b, results)
    }

    /// `(i, carried.., lo, invariant..) -> carried..`: iteration lo + i.
    fn shifted(&self, body: FunctionId) -> Function {
        let mut params = vec![Parameter::new("i", Type::Int)];
        params.extend(self.params[2..2 + self.width].iter().cloned());
        params.push(self.params[0].clone());
        params.extend(self.params[2 + self.width..2 + self.width + self.fixed].iter().cloned());
        let mut b = FunctionBuilder::new(format!("shifted_{}", self.name), params);
        let all = b.params();
        let index = b.add(all[0], all[1 + self.width]);
        let args = [&[index], &all[1..=self.width], &all[2 + self.width..]].concat();
        let results = b.call(body, args, &self.carried);
        let names = self.params[2..].iter().map(|p| p.name.clone());
        b.finish(names.zip(results))
    }

    fn halves(&self, shifted: FunctionId, back: FunctionId) -> Function {
        let mut b = self.start("halves_of");
        let (lo, n) = (b.param(0), b.param(1));
        let [carried, fixed, adjoints] = self.groups(&b);
        let two = b.int(2);
        let half = b.binary(Binary::Div, n, two);
        let (rest, middle) = (b.sub(n, half), b.add(lo, half));
        let state = b.loop_(half, shifted, carried.clone(), [&[lo][..], &fixed].concat());
        let second = b.call(back, [&[middle, rest][..], &state, &fixed, &adjoints].concat(), &self.results);
        let adjoints = &second[..self.adjoints];
        let first = b.call(back, [&[lo, half][..], &carried, &fixed, adjoints].concat(), &self.results);
        let mut results = first[..self.adjoints].to_vec();
        for (x, y) in first[self.adjoints..].iter().zip(&second[self.adjoints..]) {
            results.push(b.add(*x, *y));
        }
        self.finish(b, results)
    }

    fn back(&self, single: FunctionId, halves: FunctionId) -> Function {
        let mut b = self.start("back_through");
        let one = b.int(1);
        let last = b.compare(Compare::Le, b.param(1), one);
        let args = b.params();
        let results = b.if_(last, single, halves, args, &self.results);
        self.finish(b, results)
    }
}
