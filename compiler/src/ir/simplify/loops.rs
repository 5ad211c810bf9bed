//! Loops: invariant values are computed before them (loop-invariant code motion), carried values that nothing needs are
//! dropped.

use super::{Simplifier, Specialization};
use crate::ir::hoist::{hoist, visit_frontier};
use crate::ir::scalar::Scalar;
use crate::ir::{Function, FunctionBuilder, FunctionId, Op, Parameter, Value};
use std::collections::BTreeSet;

impl Simplifier<'_> {
    /// A loop of which some results are used.
    pub(super) fn loop_(
        &mut self,
        builder: &mut FunctionBuilder,
        (count, body): (Value, FunctionId),
        init: &[Value],
        invariant: &[Value],
        used: &[u32],
    ) -> Vec<Value> {
        match builder.constant(count) {
            Some(Scalar::Int(n)) if n <= 0 => return init.to_vec(),
            Some(Scalar::Int(1)) => {
                let first = builder.int(0);
                let args = [&[first], init, invariant].concat();
                return self.inlined(builder, body, &args, used);
            }
            _ => {}
        }
        let outer = outer_values(builder, self.module.function(body), init, invariant);
        let carried = needed_carried(self.module.function(body), &outer, used);
        let constants = outer.iter().map(|v| v.and_then(|v| self.constant(builder, v))).collect();
        let body = self.specialize(&Specialization { body, constants, results: carried.clone() });
        let (body, invariant) = without_invariants(builder, &body, &carried, &outer);
        let body = self.module.add(body);
        let changing = carried.iter().map(|k| init[*k as usize]).collect();
        let results = builder.loop_(count, body, changing, invariant);
        // The values that are carried unchanged keep their first values.
        let mut values = init.to_vec();
        carried.into_iter().zip(results).for_each(|(k, value)| values[k as usize] = value);
        values
    }
}

/// For every parameter of a loop's body the outer value that it has in every iteration, if there is one: for the
/// invariant ones, and for those that are carried but never changed.
fn outer_values(builder: &FunctionBuilder, body: &Function, init: &[Value], invariant: &[Value]) -> Vec<Option<Value>> {
    let mut outer = vec![None];
    for (k, first) in init.iter().enumerate() {
        let last = body.results[k];
        let op = body.op(last);
        let unchanged = last == Value(k as u32 + 1) || (op.is_constant() && op == builder.op(*first));
        outer.push(unchanged.then_some(*first));
    }
    outer.extend(invariant.iter().copied().map(Some));
    outer
}

/// The carried values that change and that the used results need, ascending.
fn needed_carried(body: &Function, outer: &[Option<Value>], used: &[u32]) -> Vec<u32> {
    let changes = |k: &u32| outer[*k as usize + 1].is_none();
    let mut needed: BTreeSet<u32> = used.iter().copied().filter(changes).collect();
    loop {
        let nodes = body.needed_by(needed.iter().map(|k| body.results[*k as usize]));
        let before = needed.len();
        needed.extend((0..body.results.len() as u32).filter(|k| nodes[*k as usize + 1]).filter(changes));
        if needed.len() == before {
            return needed.into_iter().collect();
        }
    }
}

/// The body of a loop that carries the values `carried`, without what every iteration would compute alike, which is
/// computed in the builder; and the invariant values that the body takes now.
///
/// Guards stay in the body, since the loop may have no iteration; so does what may take long, for the same reason.
fn without_invariants(
    builder: &mut FunctionBuilder,
    body: &Function,
    carried: &[u32],
    outer: &[Option<Value>],
) -> (Function, Vec<Value>) {
    let is_movable = |op: &Op| !op.is_structured() && !matches!(op, Op::Guard { .. } | Op::Project(..));
    let hoisted = hoist(builder, body, outer, is_movable);
    // The body has its own constants.
    let is_invariant = |v: Value| hoisted[v.0 as usize].is_some() && !body.op(v).is_constant();
    let mut taken = BTreeSet::new();
    visit_frontier(body, |v| hoisted[v.0 as usize].is_some(), |v| taken.extend(is_invariant(v).then_some(v)));
    let mut params = vec![body.params[0].clone()];
    params.extend(carried.iter().map(|k| body.params[*k as usize + 1].clone()));
    params.extend(taken.iter().enumerate().map(|(i, v)| match body.op(*v) {
        Op::Param(p) => body.params[*p as usize].clone(),
        _ => Parameter::new(format!("fixed{i}"), body.ty(*v)),
    }));
    let mut images = vec![Value::NONE; body.nodes.len()];
    let old = [0].into_iter().chain(carried.iter().map(|k| *k as usize + 1)).chain(taken.iter().map(|v| v.0 as usize));
    old.zip(0..).for_each(|(old, param)| images[old] = Value(param));
    let inner =
        body.with_params(params, &images[..body.params.len()], |_, v| is_invariant(v).then_some(images[v.0 as usize]));
    (inner, taken.iter().filter_map(|v| hoisted[v.0 as usize]).collect())
}
