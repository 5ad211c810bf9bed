//! Which parameters a result depends on, as far as a derivative is concerned.

use crate::ir::graph::References;
use crate::ir::hash::HashMap;
use crate::ir::{ByHand, Function, FunctionId, Module, Op, Type, Unary, Value};
use std::rc::Rc;

/// A set of small numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Set(Vec<u64>);

impl Set {
    pub(super) fn insert(&mut self, i: usize) {
        if self.0.len() <= i / 64 {
            self.0.resize(i / 64 + 1, 0);
        }
        self.0[i / 64] |= 1 << (i % 64);
    }

    pub(super) fn contains(&self, i: usize) -> bool {
        self.0.get(i / 64).is_some_and(|word| word >> (i % 64) & 1 == 1)
    }

    pub(super) fn union(&mut self, other: &Set) {
        if self.0.len() < other.0.len() {
            self.0.resize(other.0.len(), 0);
        }
        for (a, b) in self.0.iter_mut().zip(&other.0) {
            *a |= b;
        }
    }

    pub(super) fn meets(&self, other: &Set) -> bool {
        self.0.iter().zip(&other.0).any(|(a, b)| a & b != 0)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = usize> {
        let words = self.0.iter().enumerate();
        words.flat_map(|(w, word)| (0..64).filter(move |i| word >> i & 1 == 1).map(move |i| w * 64 + i))
    }
}

/// For the functions asked after so far, the parameters that each result depends on.
#[derive(Debug, Default)]
pub(super) struct Dependence {
    results: HashMap<FunctionId, Rc<Vec<Set>>>,
}

impl Dependence {
    /// For each result of a function, the Real parameters that it depends on otherwise than in steps. A recursive
    /// function's are the least sets that agree with themselves.
    pub(super) fn of(&mut self, module: &Module, function: FunctionId) -> Rc<Vec<Set>> {
        if let Some(known) = self.results.get(&function) {
            return known.clone();
        }
        let references = References::new(module, &[function]);
        let new: Vec<FunctionId> = references.order.iter().copied().filter(|f| !self.results.contains_key(f)).collect();
        for f in &new {
            self.results.insert(*f, Rc::new(vec![Set::default(); module.function(*f).results.len()]));
        }
        let recursive = new.iter().any(|f| references.is_recursive(*f));
        loop {
            let mut changed = false;
            for f in &new {
                let sets = match module.by_hand.get(f) {
                    Some(by_hand) => self.by_hand(module.function(*f), by_hand),
                    None => self.of_results(module, module.function(*f)),
                };
                changed |= *self.results[f] != sets;
                self.results.insert(*f, Rc::new(sets));
            }
            if !changed || !recursive {
                break;
            }
        }
        self.results[&function].clone()
    }

    /// What the results of a function depend on by the derivative that was given.
    fn by_hand(&mut self, function: &Function, by_hand: &ByHand) -> Vec<Set> {
        let known = self.results.get(&by_hand.function).cloned().unwrap_or_default();
        let first = function.params.len();
        let own = |set: &Set| {
            let mut params = Set::default();
            let tangents = set.iter().filter_map(|p| by_hand.tangents.get(p.checked_sub(first)?).copied().flatten());
            tangents.for_each(|p| params.insert(p as usize));
            params
        };
        known.iter().map(own).collect()
    }

    fn of_results(&mut self, module: &Module, function: &Function) -> Vec<Set> {
        let sets = self.of_nodes(module, function);
        function.results.iter().map(|r| sets[r.0 as usize].clone()).collect()
    }

    /// The same for every node of a function (nothing for a structured one: its projections have it).
    pub(super) fn of_nodes(&mut self, module: &Module, function: &Function) -> Vec<Set> {
        let mut sets: Vec<Set> = Vec::with_capacity(function.nodes.len());
        let mut turns: HashMap<Value, Vec<Set>> = HashMap::default();
        for node in &function.nodes {
            let mut set = Set::default();
            let of = |v: &Value| &sets[v.0 as usize];
            match &node.op {
                _ if node.ty != Type::Real => {}
                Op::Param(i) => set.insert(*i as usize),
                Op::Unary(Unary::Sign | Unary::Floor | Unary::Ceil | Unary::Round | Unary::Stop | Unary::ToReal, _) => {
                }
                Op::Project(multi, k) => match function.op(*multi) {
                    Op::Loop { body, init, invariant, .. } => {
                        let all = turns.entry(*multi).or_insert_with(|| {
                            let body = self.of(module, *body);
                            let init: Vec<&Set> = init.iter().map(of).collect();
                            let invariant: Vec<&Set> = invariant.iter().map(of).collect();
                            carried_sets(&body, &init, &invariant)
                        });
                        set = all[*k as usize].clone();
                    }
                    op => {
                        let args: Vec<&Set> = args_of(op).iter().map(of).collect();
                        for callee in op.functions() {
                            for p in self.of(module, callee)[*k as usize].iter() {
                                set.union(args[p]);
                            }
                        }
                    }
                },
                op => op.visit_operands(|v| set.union(of(&v))),
            }
            sets.push(set);
        }
        sets
    }
}

/// The arguments of a call, branch or tangent.
fn args_of(op: &Op) -> &[Value] {
    match op {
        Op::If { args, .. } | Op::Call { args, .. } | Op::Tangent { args, .. } => args,
        _ => &[],
    }
}

/// What the carried values of a loop depend on in the end, given the sets of what goes in and the dependence of the
/// body's results on its parameters.
pub(super) fn carried_sets(body: &[Set], init: &[&Set], invariant: &[&Set]) -> Vec<Set> {
    let mut carried: Vec<Set> = init.iter().map(|s| (*s).clone()).collect();
    loop {
        let mut next = carried.clone();
        for (k, set) in next.iter_mut().enumerate() {
            for p in body[k].iter().filter(|p| *p > 0) {
                let from = if p <= init.len() { &carried[p - 1] } else { invariant[p - 1 - init.len()] };
                set.union(from);
            }
        }
        if next == carried {
            return carried;
        }
        carried = next;
    }
}
