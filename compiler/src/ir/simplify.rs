//! Cleans functions: rebuilds them through the builder, with their branches and loops fitted to where they are used.
//!
//! The body of a branch or loop is copied for its use, with the arguments that are constant there put in, and
//! without the parameters and results that are not used there. A branch whose condition is known is inlined, and
//! so are both sides of one that is cheap; a loop that turns once is inlined; what every turn of a loop would compute
//! alike is computed before it.

use super::graph::References;
use super::scalar::Scalar;
use super::{Binary, Function, FunctionBuilder, FunctionId, Module, Node, Op, Type, Unary, Value};
use crate::ir::hash::HashMap;
use std::collections::BTreeSet;
use std::rc::Rc;

mod loops;

/// Both sides of a branch are computed, and one selected, where they have at most so many operations, all cheap.
const CHEAP_BRANCH: usize = 12;

/// Bodies are copied and fitted to constant arguments until so many nodes were made; from then on each body is fitted
/// once. (Copies of copies could grow without bound.)
const MOST_FITTED_NODES: usize = 1_000_000;

/// Simplifies the roots, and all functions that they reach by calls, in place. Signatures stay as they are.
pub fn simplify(module: &mut Module, roots: &[FunctionId]) {
    let mut simplifier = Simplifier { module, fitted: HashMap::default(), added: HashMap::default(), made: 0 };
    let mut done = BTreeSet::new();
    let mut left = roots.to_vec();
    while let Some(id) = left.pop() {
        if !done.insert(id) {
            continue;
        }
        let old = simplifier.module.function(id).clone();
        let constants = vec![None; old.params.len()];
        let simple = simplifier.rebuild(old, &constants, None);
        simplifier.module.define(id, simple);
        left.extend(calls_reached(simplifier.module, id));
    }
    super::validate::after_pass(module, "simplify");
}

/// The functions that are called (or differentiated) from a function or from the bodies in it.
fn calls_reached(module: &Module, id: FunctionId) -> Vec<FunctionId> {
    let bodies = References::along(module, &[id], |op| matches!(op, Op::If { .. } | Op::Loop { .. }));
    let nodes = bodies.order.iter().flat_map(|f| &module.function(*f).nodes);
    let calls = nodes.filter(|n| matches!(n.op, Op::Call { .. } | Op::Tangent { .. }));
    calls.flat_map(|n| n.op.functions()).collect()
}

/// What a body is fitted to: constants for some parameters, and the results that are wanted.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Fit {
    body: FunctionId,
    constants: Vec<Option<Constant>>,
    results: Vec<u32>,
}

/// A constant that can be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Constant {
    Real(u64),
    Int(i64),
    Bool(bool),
}

impl Constant {
    fn of(x: Scalar) -> Constant {
        match x {
            Scalar::Real(x) => Constant::Real(x.to_bits()),
            Scalar::Int(i) => Constant::Int(i),
            Scalar::Bool(b) => Constant::Bool(b),
        }
    }

    fn scalar(self) -> Scalar {
        match self {
            Constant::Real(bits) => Scalar::Real(f64::from_bits(bits)),
            Constant::Int(i) => Scalar::Int(i),
            Constant::Bool(b) => Scalar::Bool(b),
        }
    }
}

struct Simplifier<'m> {
    module: &'m mut Module,
    /// Fitted bodies, with all of their parameters.
    fitted: HashMap<Fit, Rc<Function>>,
    /// Those of them that are functions of the module, by the parameters that they keep there.
    added: HashMap<(Fit, Vec<u32>), FunctionId>,
    made: usize,
}

/// What a node has become.
enum Simple {
    One(Value),
    /// The results of a structured operation that are used, by their index.
    Many(HashMap<u32, Value>),
}

impl Simple {
    fn one(&self) -> Value {
        match self {
            Simple::One(value) => *value,
            // Only projections use a structured node.
            Simple::Many(_) => Value(u32::MAX),
        }
    }
}

impl Simplifier<'_> {
    /// The function with constants in the place of some parameters (which stay in the signature), and only some of
    /// its results where `results` says so.
    fn rebuild(&mut self, mut old: Function, constants: &[Option<Constant>], results: Option<&[u32]>) -> Function {
        if let Some(results) = results {
            old.result_names = results.iter().map(|k| old.result_names[*k as usize].clone()).collect();
            old.results = results.iter().map(|k| old.results[*k as usize]).collect();
        }
        old.drop_unused();
        let mut builder = FunctionBuilder::new(old.name.clone(), old.params.clone());
        let args: Vec<Value> = (constants.iter().enumerate())
            .map(|(i, c)| c.map_or(Value(i as u32), |c| builder.scalar(c.scalar())))
            .collect();
        let results = self.splice(&mut builder, &old, &args);
        let new = builder.finish(old.result_names.into_iter().zip(results));
        self.made += new.nodes.len();
        new
    }

    fn splice(&mut self, builder: &mut FunctionBuilder, function: &Function, args: &[Value]) -> Vec<Value> {
        let used = used_results(function);
        let mut values: Vec<Simple> = Vec::with_capacity(function.nodes.len());
        for (i, node) in function.nodes.iter().enumerate() {
            builder.set_span(node.span);
            let simple = match &node.op {
                Op::Param(i) => Simple::One(args[*i as usize]),
                Op::Project(multi, k) => match &values[multi.0 as usize] {
                    Simple::Many(results) => Simple::One(results[k]),
                    Simple::One(multi) => Simple::One(builder.project(*multi, *k, node.ty)),
                },
                op => {
                    let op = op.map_operands(|v| values[v.0 as usize].one());
                    match used.get(&(i as u32)) {
                        Some(used) => Simple::Many(self.structured(builder, &op, used)),
                        None => Simple::One(builder.emit(&op, node.ty)),
                    }
                }
            };
            values.push(simple);
        }
        function.results.iter().map(|r| values[r.0 as usize].one()).collect()
    }

    /// A structured operation of which only some results are used.
    fn structured(&mut self, builder: &mut FunctionBuilder, op: &Op, used: &[(u32, Type)]) -> HashMap<u32, Value> {
        match op {
            Op::If { condition, then, otherwise, args } => match builder.constant(*condition) {
                Some(Scalar::Bool(c)) => self.inlined(builder, if c { *then } else { *otherwise }, args, used),
                _ => self.branch(builder, *condition, [*then, *otherwise], args, used),
            },
            Op::Loop { count, body, init, invariant } => self.loop_(builder, (*count, *body), init, invariant, used),
            op => {
                let multi = builder.emit(op, Type::Multi);
                used.iter().map(|(k, ty)| (*k, builder.project(multi, *k, *ty))).collect()
            }
        }
    }

    /// The nodes of a body in the place of the operation that runs it.
    fn inlined(
        &mut self,
        builder: &mut FunctionBuilder,
        body: FunctionId,
        args: &[Value],
        used: &[(u32, Type)],
    ) -> HashMap<u32, Value> {
        if self.made + builder.len() > MOST_FITTED_NODES {
            let types = self.module.function(body).result_types();
            let results = builder.call(body, args.to_vec(), &types);
            return used.iter().map(|(k, _)| (*k, results[*k as usize])).collect();
        }
        let mut function = self.module.function(body).clone();
        function.results = used.iter().map(|(k, _)| function.results[*k as usize]).collect();
        function.drop_unused();
        let results = self.splice(builder, &function, args);
        used.iter().map(|(k, _)| *k).zip(results).collect()
    }

    fn branch(
        &mut self,
        builder: &mut FunctionBuilder,
        condition: Value,
        bodies: [FunctionId; 2],
        args: &[Value],
        used: &[(u32, Type)],
    ) -> HashMap<u32, Value> {
        if bodies[0] == bodies[1] {
            return self.inlined(builder, bodies[0], args, used);
        }
        let constants = self.constants(builder, args);
        let fits = |sides: &mut Self, results: &[u32]| {
            bodies.map(|body| {
                let fit = Fit { body, constants: constants.clone(), results: results.to_vec() };
                (sides.fit(&fit), fit)
            })
        };
        let wanted: Vec<u32> = used.iter().map(|(k, _)| *k).collect();
        let [(then, _), (otherwise, _)] = fits(self, &wanted);
        if is_cheap(&then) && is_cheap(&otherwise) {
            let [a, b] = [then, otherwise].map(|side| builder.splice(&side, args));
            let selected = a.into_iter().zip(b).map(|(a, b)| builder.select(condition, a, b));
            return wanted.into_iter().zip(selected).collect();
        }
        // A result that both sides have in common is not the branch's.
        let mut values = HashMap::default();
        let mut differing = Vec::new();
        for (position, (k, ty)) in used.iter().enumerate() {
            match common(&then, &otherwise, position) {
                Some(Op::Param(i)) => drop(values.insert(*k, args[i as usize])),
                Some(constant) => drop(values.insert(*k, builder.emit(&constant, *ty))),
                None => differing.push(*k),
            }
        }
        if differing.is_empty() {
            return values;
        }
        let sides = fits(self, &differing);
        let [one, other] = [0, 1].map(|side| sides[side].0.used_params());
        let used = one.into_iter().zip(other).map(|(a, b)| a || b);
        let params: Vec<u32> = (0..).zip(used).filter(|(_, used)| *used).map(|(i, _)| i).collect();
        let types = sides[0].0.result_types();
        let [then, otherwise] = sides.map(|(body, fit)| self.add(&body, &fit, &params));
        let args = params.iter().map(|i| args[*i as usize]).collect();
        let results = builder.if_(condition, then, otherwise, args, &types);
        values.extend(differing.into_iter().zip(results));
        values
    }

    /// The arguments that are constant, as long as there is room for fitted copies.
    fn constants(&self, builder: &FunctionBuilder, args: &[Value]) -> Vec<Option<Constant>> {
        let room = self.made < MOST_FITTED_NODES;
        args.iter().map(|v| builder.constant(*v).filter(|_| room).map(Constant::of)).collect()
    }

    fn fit(&mut self, fit: &Fit) -> Rc<Function> {
        if let Some(known) = self.fitted.get(fit) {
            return known.clone();
        }
        let old = self.module.function(fit.body).clone();
        let function = Rc::new(self.rebuild(old, &fit.constants, Some(&fit.results)));
        self.fitted.insert(fit.clone(), function.clone());
        function
    }

    /// The function of the module that is a fitted body with only some of its parameters.
    fn add(&mut self, body: &Function, fit: &Fit, params: &[u32]) -> FunctionId {
        let key = (fit.clone(), params.to_vec());
        if let Some(known) = self.added.get(&key) {
            return *known;
        }
        let id = self.module.add(with_params(body, params));
        self.added.insert(key, id);
        id
    }
}

/// The results that are used of every structured operation, by its node.
fn used_results(function: &Function) -> HashMap<u32, Vec<(u32, Type)>> {
    let mut used: HashMap<u32, Vec<(u32, Type)>> = HashMap::default();
    for (i, node) in function.nodes.iter().enumerate() {
        match node.op {
            Op::Project(multi, k) => used.entry(multi.0).or_default().push((k, node.ty)),
            _ if node.ty == Type::Multi => drop(used.entry(i as u32).or_default()),
            _ => {}
        }
    }
    for results in used.values_mut() {
        results.sort_unstable_by_key(|(k, _)| *k);
        results.dedup();
    }
    used
}

/// A function with only some of its parameters, which are all that it uses.
fn with_params(function: &Function, params: &[u32]) -> Function {
    let kept: Vec<_> = params.iter().map(|i| function.params[*i as usize].clone()).collect();
    let mut builder = FunctionBuilder::new(function.name.clone(), kept);
    let mut args = vec![Value(u32::MAX); function.params.len()];
    for (new, old) in params.iter().enumerate() {
        args[*old as usize] = Value(new as u32);
    }
    let results = builder.splice(function, &args);
    builder.finish(function.result_names.iter().cloned().zip(results))
}

/// The parameter or constant that result k of both functions is.
fn common(a: &Function, b: &Function, k: usize) -> Option<Op> {
    let op = a.op(a.results[k]);
    let same = op == b.op(b.results[k]);
    (same && matches!(op, Op::Param(_) | Op::Real(_) | Op::Int(_) | Op::Bool(_))).then(|| op.clone())
}

/// Whether a function is so cheap that computing it needlessly costs less than a branch, and cannot fail.
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
