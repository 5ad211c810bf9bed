//! Simplification of whole functions: they are rebuilt through the builder, with the bodies of their branches and loops
//! specialised to their use.
//!
//! The body of a branch or loop is copied for its use, with the arguments that are constant there put in, and without
//! the parameters and results that are not used there. A branch whose condition is known is inlined, and so are both
//! sides of a cheap one (if-conversion); a loop with one iteration is inlined; loop-invariant values are computed
//! before the loop.

use super::builder::{Image, Rebuild, Step};
use super::call_graph::CallGraph;
use super::scalar::Scalar;
use super::{Binary, Function, FunctionBuilder, FunctionId, Module, Node, Op, Unary, Value};
use crate::ir::hash::HashMap;
use std::collections::BTreeSet;
use std::rc::Rc;

mod loops;

/// Most operations of each side of a branch that is replaced by both sides and a selection; they must all be cheap.
const CHEAP_BRANCH: usize = 12;

/// Bodies are specialised to constant arguments until this many nodes were made; from then on each body is specialised
/// only once. (Copies of copies could grow without bound.)
const MOST_SPECIALIZED_NODES: usize = 1_000_000;

/// Simplifies the roots, and all functions that they reach by calls, in place. Signatures stay as they are.
pub(crate) fn simplify(module: &mut Module, roots: &[FunctionId]) {
    let mut simplifier = Simplifier { module, specialized: HashMap::default(), added: HashMap::default(), made: 0 };
    let mut done = BTreeSet::new();
    let mut left = roots.to_vec();
    while let Some(id) = left.pop() {
        if !done.insert(id) {
            continue;
        }
        let old = simplifier.module.function(id).clone();
        let constants = vec![None; old.params.len()];
        let simple = simplifier.rebuild(old, &constants);
        simplifier.module.define(id, simple);
        left.extend(calls_reached(simplifier.module, id));
    }
    super::validate::after_pass(module, "simplify");
}

/// The functions that are called (or differentiated) in a function or in the bodies within it.
fn calls_reached(module: &Module, id: FunctionId) -> Vec<FunctionId> {
    let bodies = CallGraph::along(module, &[id], |op| matches!(op, Op::If { .. } | Op::Loop { .. }));
    let nodes = bodies.order.iter().flat_map(|f| &module.function(*f).nodes);
    let calls = nodes.filter(|n| matches!(n.op, Op::Call { .. } | Op::Tangent { .. }));
    calls.flat_map(|n| n.op.functions()).collect()
}

/// A body, the constants for some of its parameters, and the results that are needed.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Specialization {
    body: FunctionId,
    /// Constant operations.
    constants: Vec<Option<Op>>,
    results: Vec<u32>,
}

struct Simplifier<'m> {
    module: &'m mut Module,
    /// Specialised bodies, with all of their parameters.
    specialized: HashMap<Specialization, Rc<Function>>,
    /// Specialised bodies that are functions of the module, by the parameters that they keep there.
    added: HashMap<(Specialization, Vec<u32>), FunctionId>,
    /// The number of nodes that were made.
    made: usize,
}

impl Simplifier<'_> {
    /// The function with constants in the place of some parameters, which stay in the signature.
    fn rebuild(&mut self, mut old: Function, constants: &[Option<Op>]) -> Function {
        old.drop_unused();
        let mut builder = FunctionBuilder::like(&old);
        let args: Vec<Value> = (constants.iter().zip(builder.params()))
            .map(|(constant, param)| constant.as_ref().map_or(param, |c| builder.emit(c, old.ty(param))))
            .collect();
        let results = self.splice(&mut builder, &old, &args);
        let new = builder.finish_like(&old, results);
        self.made += new.nodes.len();
        new
    }

    fn splice(&mut self, builder: &mut FunctionBuilder, function: &Function, args: &[Value]) -> Vec<Value> {
        let used = used_results(function);
        let mut rebuild = Rebuild::new(function, args);
        while let Some(Step { index, node, op }) = rebuild.next(builder) {
            let used = used.get(&index).map_or(&[][..], Vec::as_slice);
            rebuild.push(match &op {
                Op::If { condition, then, otherwise, args } => Image::Many(match builder.constant(*condition) {
                    Some(Scalar::Bool(c)) => self.inlined(builder, if c { *then } else { *otherwise }, args, used),
                    _ => self.branch(builder, *condition, [*then, *otherwise], args, used),
                }),
                Op::Loop { count, body, init, invariant } => {
                    Image::Many(self.loop_(builder, (*count, *body), init, invariant, used))
                }
                op => Image::One(builder.emit(op, node.ty)),
            });
        }
        rebuild.results()
    }

    /// Puts the nodes of a body in the place of the operation that runs it; returns its results, those that are used.
    fn inlined(&mut self, builder: &mut FunctionBuilder, body: FunctionId, args: &[Value], used: &[u32]) -> Vec<Value> {
        if self.made + builder.node_count() > MOST_SPECIALIZED_NODES {
            let types = self.module.function(body).result_types();
            return builder.call(body, args.to_vec(), &types);
        }
        let mut function = self.module.function(body).clone();
        let mut results = vec![Value::NONE; function.results.len()];
        function.results = used.iter().map(|k| function.results[*k as usize]).collect();
        function.drop_unused();
        for (k, value) in used.iter().zip(self.splice(builder, &function, args)) {
            results[*k as usize] = value;
        }
        results
    }

    /// A branch of which some results are used.
    fn branch(
        &mut self,
        builder: &mut FunctionBuilder,
        condition: Value,
        bodies: [FunctionId; 2],
        args: &[Value],
        used: &[u32],
    ) -> Vec<Value> {
        if bodies[0] == bodies[1] {
            return self.inlined(builder, bodies[0], args, used);
        }
        let constants: Vec<Option<Op>> = args.iter().map(|v| self.constant(builder, *v)).collect();
        let specialize = |simplifier: &mut Self, results: &[u32]| {
            bodies.map(|body| {
                let key = Specialization { body, constants: constants.clone(), results: results.to_vec() };
                (simplifier.specialize(&key), key)
            })
        };
        let mut values = vec![Value::NONE; self.module.function(bodies[0]).results.len()];
        let [(then, _), (otherwise, _)] = specialize(self, used);
        if is_cheap(&then) && is_cheap(&otherwise) {
            let [a, b] = [then, otherwise].map(|side| builder.splice(&side, args));
            for ((k, a), b) in used.iter().zip(a).zip(b) {
                values[*k as usize] = builder.select(condition, a, b);
            }
            return values;
        }
        // A result that is the same on both sides does not depend on the branch.
        let mut differing = Vec::new();
        for (position, k) in used.iter().enumerate() {
            match common(&then, &otherwise, position) {
                Some(Op::Param(i)) => values[*k as usize] = args[*i as usize],
                Some(constant) => values[*k as usize] = builder.emit(constant, then.ty(then.results[position])),
                None => differing.push(*k),
            }
        }
        if differing.is_empty() {
            return values;
        }
        let sides = specialize(self, &differing);
        let [one, other] = [0, 1].map(|side| sides[side].0.used_params());
        let used = one.into_iter().zip(other).map(|(a, b)| a || b);
        let params: Vec<u32> = (0..).zip(used).filter(|(_, used)| *used).map(|(i, _)| i).collect();
        let types = sides[0].0.result_types();
        let [then, otherwise] = sides.map(|(body, key)| self.add(&body, &key, &params));
        let args = params.iter().map(|i| args[*i as usize]).collect();
        let results = builder.if_(condition, then, otherwise, args, &types);
        differing.into_iter().zip(results).for_each(|(k, value)| values[k as usize] = value);
        values
    }

    /// The constant that an argument is, as long as there is room for specialised copies.
    fn constant(&self, builder: &FunctionBuilder, arg: Value) -> Option<Op> {
        let room = self.made < MOST_SPECIALIZED_NODES;
        Some(builder.op(arg)).filter(|op| room && op.is_constant()).cloned()
    }

    fn specialize(&mut self, key: &Specialization) -> Rc<Function> {
        if let Some(function) = self.specialized.get(key) {
            return function.clone();
        }
        let mut old = self.module.function(key.body).clone();
        old.result_names = key.results.iter().map(|k| old.result_names[*k as usize].clone()).collect();
        old.results = key.results.iter().map(|k| old.results[*k as usize]).collect();
        let function = Rc::new(self.rebuild(old, &key.constants));
        self.specialized.insert(key.clone(), function.clone());
        function
    }

    /// The function of the module that is a specialised body with only some of its parameters.
    fn add(&mut self, body: &Function, key: &Specialization, params: &[u32]) -> FunctionId {
        let key = (key.clone(), params.to_vec());
        if let Some(id) = self.added.get(&key) {
            return *id;
        }
        let id = self.module.add(with_params(body, params));
        self.added.insert(key, id);
        id
    }
}

/// For every structured operation the results that are used, ascending.
fn used_results(function: &Function) -> HashMap<Value, Vec<u32>> {
    let mut used: HashMap<Value, Vec<u32>> = HashMap::default();
    for node in &function.nodes {
        if let Op::Project(multi, k) = node.op {
            used.entry(multi).or_default().push(k);
        }
    }
    for results in used.values_mut() {
        results.sort_unstable();
        results.dedup();
    }
    used
}

/// A function with only some of its parameters, which must be all that it uses.
fn with_params(function: &Function, params: &[u32]) -> Function {
    let mut args = vec![Value::NONE; function.params.len()];
    for (new, old) in (0..).zip(params) {
        args[*old as usize] = Value(new);
    }
    let remaining = params.iter().map(|i| function.params[*i as usize].clone()).collect();
    function.with_params(remaining, &args, |_, _| None)
}

/// Result k, if it is the same parameter or constant in both functions.
fn common<'f>(a: &'f Function, b: &Function, k: usize) -> Option<&'f Op> {
    let op = a.op(a.results[k]);
    (op == b.op(b.results[k]) && (op.is_constant() || matches!(op, Op::Param(_)))).then_some(op)
}

/// Whether a function cannot fail and is so cheap that computing it needlessly costs less than a branch.
fn is_cheap(function: &Function) -> bool {
    let operations = &function.nodes[function.params.len()..];
    operations.len() <= CHEAP_BRANCH && operations.iter().all(is_cheap_node)
}

fn is_cheap_node(node: &Node) -> bool {
    match node.op {
        Op::Unary(op, _) => {
            use Unary::{Abs, Neg, Not, Sign, Stop, ToReal};
            matches!(op, Neg | Abs | Sign | Stop | Not | ToReal)
        }
        Op::Binary(op, ..) => !matches!(op, Binary::Pow | Binary::Atan2 | Binary::Rem),
        Op::PowInt(_, n) => n.unsigned_abs() <= 4,
        Op::Real(_) | Op::Int(_) | Op::Bool(_) | Op::Compare(..) | Op::Select(..) => true,
        _ => false,
    }
}
