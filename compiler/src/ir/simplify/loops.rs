//! Loops: what stays the same goes before them, what is not needed goes away.

use super::super::scalar::Scalar;
use super::super::{Function, FunctionBuilder, FunctionId, Op, Parameter, Type, Value};
use super::{Constant, Fit, Simplifier};
use crate::ir::hash::HashMap;
use std::collections::BTreeSet;

impl Simplifier<'_> {
    pub(super) fn loop_(
        &mut self,
        builder: &mut FunctionBuilder,
        (count, body): (Value, FunctionId),
        init: &[Value],
        invariant: &[Value],
        used: &[(u32, Type)],
    ) -> HashMap<u32, Value> {
        match builder.constant(count) {
            Some(Scalar::Int(n)) if n <= 0 => return used.iter().map(|(k, _)| (*k, init[*k as usize])).collect(),
            Some(Scalar::Int(1)) => {
                let first = builder.int(0);
                let args = [&[first], init, invariant].concat();
                return self.inlined(builder, body, &args, used);
            }
            _ => {}
        }
        let outer = self.outer_values(builder, body, init, invariant);
        let kept = needed_carried(self.module.function(body), &outer, used);
        let constants: Vec<Option<Constant>> =
            outer.iter().map(|v| v.and_then(|v| self.constants(builder, &[v])[0])).collect();
        let fit = Fit { body, constants, results: kept.clone() };
        let turn = self.fit(&fit);
        let hoisted = hoist(builder, &turn, &outer);
        let (turn, invariant) = rebuild_turn(&turn, &kept, &outer, &hoisted);
        let body = self.module.add(turn);
        let carried = kept.iter().map(|k| init[*k as usize]).collect();
        let results = builder.loop_(count, body, carried, invariant);
        let mut values: HashMap<u32, Value> = kept.into_iter().zip(results).collect();
        for (k, _) in used {
            // What is carried unchanged is what it was.
            values.entry(*k).or_insert(init[*k as usize]);
        }
        values
    }

    /// For every parameter of the body the value outside that it has in every turn, if it is so: what is invariant,
    /// and what is carried but never changed.
    fn outer_values(
        &self,
        builder: &FunctionBuilder,
        body: FunctionId,
        init: &[Value],
        invariant: &[Value],
    ) -> Vec<Option<Value>> {
        let body = self.module.function(body);
        let mut outer = vec![None];
        for (k, first) in init.iter().enumerate() {
            let last = body.results[k];
            let unchanged = last == Value(k as u32 + 1)
                || matches!(body.op(last), op @ (Op::Real(_) | Op::Int(_) | Op::Bool(_)) if op == builder.op(*first));
            outer.push(unchanged.then_some(*first));
        }
        outer.extend(invariant.iter().map(|v| Some(*v)));
        outer
    }
}

/// The carried values that change and that the used results need, ascending.
fn needed_carried(body: &Function, outer: &[Option<Value>], used: &[(u32, Type)]) -> Vec<u32> {
    let changes = |k: u32| outer[k as usize + 1].is_none();
    let mut needed: BTreeSet<u32> = used.iter().map(|(k, _)| *k).filter(|k| changes(*k)).collect();
    loop {
        let mut reached = vec![false; body.nodes.len()];
        for k in &needed {
            reached[body.results[*k as usize].0 as usize] = true;
        }
        for i in (0..body.nodes.len()).rev() {
            if reached[i] {
                body.nodes[i].op.visit_operands(|v| reached[v.0 as usize] = true);
            }
        }
        let carried = (0..body.results.len() as u32).filter(|k| reached[*k as usize + 1] && changes(*k));
        let before = needed.len();
        needed.extend(carried.collect::<Vec<_>>());
        if needed.len() == before {
            return needed.into_iter().collect();
        }
    }
}

/// Computes before the loop what its turns would all compute alike: the nodes of the body that depend only on
/// parameters that have one value outside. Returns their values outside.
///
/// Guards stay, since a loop may turn not at all; so does what may take long, for the same reason.
fn hoist(builder: &mut FunctionBuilder, turn: &Function, outer: &[Option<Value>]) -> HashMap<Value, Value> {
    let mut hoisted: HashMap<Value, Value> = HashMap::default();
    for (i, node) in turn.nodes.iter().enumerate() {
        let outside = match &node.op {
            Op::Param(i) => outer[*i as usize],
            Op::Guard { .. }
            | Op::Project(..)
            | Op::If { .. }
            | Op::Loop { .. }
            | Op::Call { .. }
            | Op::Tangent { .. } => None,
            op => {
                let mut all = true;
                op.visit_operands(|v| all &= hoisted.contains_key(&v));
                all.then(|| {
                    builder.set_span(node.span);
                    builder.emit(&op.map_operands(|v| hoisted[&v]), node.ty)
                })
            }
        };
        if let Some(outside) = outside {
            hoisted.insert(Value(i as u32), outside);
        }
    }
    hoisted
}

/// The turn of the loop with the changing values `kept`, and the invariant values that it is handed.
fn rebuild_turn(
    turn: &Function,
    kept: &[u32],
    outer: &[Option<Value>],
    hoisted: &HashMap<Value, Value>,
) -> (Function, Vec<Value>) {
    // What is handed in: the outermost hoisted nodes that something in the loop uses, but for constants.
    let mut handed = BTreeSet::new();
    let constant = |v: Value| matches!(turn.op(v), Op::Real(_) | Op::Int(_) | Op::Bool(_));
    for (i, node) in turn.nodes.iter().enumerate() {
        if !hoisted.contains_key(&Value(i as u32)) {
            node.op.visit_operands(|v| handed.extend((hoisted.contains_key(&v) && !constant(v)).then_some(v)));
        }
    }
    handed.extend(turn.results.iter().filter(|r| hoisted.contains_key(r) && !constant(**r)));
    let mut params = vec![turn.params[0].clone()];
    params.extend(kept.iter().map(|k| turn.params[*k as usize + 1].clone()));
    params.extend(handed.iter().enumerate().map(|(i, v)| match turn.op(*v) {
        Op::Param(p) => turn.params[*p as usize].clone(),
        _ => Parameter::new(format!("fixed{i}"), turn.ty(*v)),
    }));
    let mut builder = FunctionBuilder::new(turn.name.clone(), params);
    let mut values = vec![Value(u32::MAX); turn.nodes.len()];
    values[0] = Value(0);
    for (position, k) in kept.iter().enumerate() {
        values[*k as usize + 1] = Value(position as u32 + 1);
    }
    for (position, v) in handed.iter().enumerate() {
        values[v.0 as usize] = Value((position + kept.len() + 1) as u32);
    }
    let used = turn.used_params();
    for (i, node) in turn.nodes.iter().enumerate() {
        let v = Value(i as u32);
        let param = matches!(node.op, Op::Param(_));
        debug_assert!(!param || !used[i] || values[i].0 != u32::MAX || outer[i].is_some());
        if param || handed.contains(&v) || (hoisted.contains_key(&v) && !constant(v)) {
            continue;
        }
        builder.set_span(node.span);
        values[i] = builder.emit(&node.op.map_operands(|v| values[v.0 as usize]), node.ty);
    }
    let results = turn.results.iter().map(|r| values[r.0 as usize]);
    let function = builder.finish(turn.result_names.iter().cloned().zip(results.collect::<Vec<_>>()));
    (function, handed.iter().map(|v| hoisted[v]).collect())
}
