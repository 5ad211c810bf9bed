//! Activity analysis: the parameters on which a result depends, as far as derivatives are concerned.

use crate::ir::call_graph::CallGraph;
use crate::ir::hash::HashMap;
use crate::ir::{CustomDerivative, Function, FunctionId, Module, Op, Type, Unary, Value};
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

impl FromIterator<usize> for Set {
    fn from_iter<I: IntoIterator<Item = usize>>(numbers: I) -> Set {
        let mut set = Set::default();
        numbers.into_iter().for_each(|i| set.insert(i));
        set
    }
}

/// For the functions asked after so far, the parameters that each result depends on.
#[derive(Debug, Default)]
pub(super) struct Dependence {
    results: HashMap<FunctionId, Rc<Vec<Set>>>,
}

impl Dependence {
    /// For each result of a function, the Real parameters on which it depends otherwise than in steps. The sets of a
    /// recursive function are the least fixed point.
    pub(super) fn of(&mut self, module: &Module, function: FunctionId) -> Rc<Vec<Set>> {
        if let Some(known) = self.results.get(&function) {
            return known.clone();
        }
        let graph = CallGraph::new(module, &[function]);
        let new: Vec<FunctionId> = graph.order.iter().copied().filter(|f| !self.results.contains_key(f)).collect();
        for f in &new {
            self.results.insert(*f, Rc::new(vec![Set::default(); module.function(*f).results.len()]));
        }
        let recursive = new.iter().any(|f| graph.is_recursive(*f));
        loop {
            let mut changed = false;
            for f in &new {
                let sets = match module.custom_derivatives.get(f) {
                    Some(custom) => self.of_custom(module.function(*f), custom),
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

    /// The dependence of a function's results according to its custom derivative.
    fn of_custom(&self, function: &Function, custom: &CustomDerivative) -> Vec<Set> {
        let sets = self.results.get(&custom.function).cloned().unwrap_or_default();
        let first = function.params.len();
        let param = |p: usize| custom.tangents.get(p.checked_sub(first)?).copied().flatten().map(|p| p as usize);
        sets.iter().map(|set| set.iter().filter_map(param).collect()).collect()
    }

    fn of_results(&mut self, module: &Module, function: &Function) -> Vec<Set> {
        let sets = self.of_nodes(module, function);
        function.results.iter().map(|r| sets[r.0 as usize].clone()).collect()
    }

    /// The same for every node of a function; the sets of a structured node are those of its projections.
    pub(super) fn of_nodes(&mut self, module: &Module, function: &Function) -> Vec<Set> {
        let mut sets: Vec<Set> = Vec::with_capacity(function.nodes.len());
        let mut loops: HashMap<Value, Vec<Set>> = HashMap::default();
        for node in &function.nodes {
            let mut set = Set::default();
            let set_of = |v: &Value| &sets[v.0 as usize];
            match &node.op {
                _ if node.ty != Type::Real => {}
                Op::Param(i) => set.insert(*i as usize),
                Op::Unary(Unary::Sign | Unary::Floor | Unary::Ceil | Unary::Round | Unary::Stop | Unary::ToReal, _) => {
                }
                Op::Project(multi, k) => match function.op(*multi) {
                    Op::Loop { body, init, invariant, .. } => {
                        let all = loops.entry(*multi).or_insert_with(|| {
                            let body = self.of(module, *body);
                            let sets_of = |values: &[Value]| values.iter().map(set_of).cloned().collect::<Vec<_>>();
                            carried_sets(&body, sets_of(init), &sets_of(invariant))
                        });
                        set = all[*k as usize].clone();
                    }
                    op => {
                        // The condition of a branch comes before its arguments; the seeds of a tangent after them.
                        let operands = op.operands();
                        let args = &operands[usize::from(matches!(op, Op::If { .. }))..];
                        for callee in op.functions() {
                            for p in self.of(module, callee)[*k as usize].iter() {
                                set.union(set_of(&args[p]));
                            }
                        }
                    }
                },
                op => op.visit_operands(|v| set.union(set_of(&v))),
            }
            sets.push(set);
        }
        sets
    }
}

/// The dependence of the carried values of a loop after its last iteration, given the sets of its operands and the
/// dependence of the body's results on its parameters.
pub(super) fn carried_sets(body: &[Set], mut carried: Vec<Set>, invariant: &[Set]) -> Vec<Set> {
    loop {
        let mut next = carried.clone();
        for (k, set) in next.iter_mut().enumerate() {
            for p in body[k].iter().filter(|p| *p > 0) {
                set.union(carried.get(p - 1).unwrap_or_else(|| &invariant[p - 1 - carried.len()]));
            }
        }
        if next == carried {
            return carried;
        }
        carried = next;
    }
}
