//! Data flow: the coordinates on which values depend, through branches, loops and calls, and the decisions of nodes.

use crate::ir::hash::{HashMap, HashSet};
use crate::ir::hoist::axes::{Axes, UV};
use crate::ir::{Binary, Function, FunctionId, Module, Op, Type, Unary, Value};
use std::collections::BTreeMap;
use std::ops::BitOr;
use std::rc::Rc;

/// Most factors of a product whose signs are told apart.
const MOST_FACTORS: usize = 8;

/// A decision that depends on u or v. Integers take none: they come from rounding, conditions and counts of loops,
/// which come from integers and conditions, and all of these are decisions already.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Decision {
    /// Whether a condition holds.
    Truth(Value),
    /// Whether the first number is the smaller one.
    Less(Value, Value),
    /// Whether a number is below 0.
    Negative(Value),
    /// Whether a number is above 0.
    Positive(Value),
    /// The branch cut of atan2(y, x).
    BehindCut(Value, Value),
    /// A whole number, Real.
    Whole(Value),
    /// An integer.
    Integer(Value),
    /// How many times x has the divisor, given the remainder: `Quotient(x, divisor, remainder)`.
    Quotient(Value, Value, Value),
}

impl Decision {
    pub(super) fn map(self, map: impl Fn(Value) -> Value) -> Decision {
        match self {
            Decision::Truth(c) => Decision::Truth(map(c)),
            Decision::Less(x, y) => Decision::Less(map(x), map(y)),
            Decision::Negative(x) => Decision::Negative(map(x)),
            Decision::Positive(x) => Decision::Positive(map(x)),
            Decision::BehindCut(y, x) => Decision::BehindCut(map(y), map(x)),
            Decision::Whole(x) => Decision::Whole(map(x)),
            Decision::Integer(i) => Decision::Integer(map(i)),
            Decision::Quotient(x, divisor, r) => Decision::Quotient(map(x), map(divisor), map(r)),
        }
    }
}

/// A set of the three signatures: of u alone, of v alone, of both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Slots(u8);

impl Slots {
    pub(super) const ALL: Slots = Slots(7);

    fn of(axes: Axes) -> Slots {
        Slots(1 << (axes - 1))
    }

    pub(super) fn iter(self) -> impl Iterator<Item = usize> {
        (0..3).filter(move |slot| self.0 >> slot & 1 == 1)
    }

    pub(super) fn count(self) -> usize {
        self.iter().count()
    }
}

impl BitOr for Slots {
    type Output = Slots;

    fn bitor(self, other: Slots) -> Slots {
        Slots(self.0 | other.0)
    }
}

/// The values that a function's results depend on, and the decisions that it and its callees take.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Summary {
    pub(super) results: Vec<Axes>,
    pub(super) slots: Slots,
}

/// The coordinates of a function's values, and its own decisions.
pub(super) struct Nodes {
    pub(super) axes: Vec<Axes>,
    decisions: BTreeMap<Value, Vec<(Axes, Decision)>>,
    slots: Slots,
}

impl Nodes {
    /// The decisions of a node that no earlier node takes, with the coordinates on which they depend.
    pub(super) fn decisions(&self, node: Value) -> impl Iterator<Item = (Axes, Decision)> {
        self.decisions.get(&node).into_iter().flatten().copied()
    }
}

/// Functions by the coordinates of their parameters.
type Key = (FunctionId, Vec<Axes>);

/// The summaries of functions: the least fixed point.
#[derive(Default)]
pub(super) struct Flow {
    known: HashMap<Key, Rc<Summary>>,
    /// Functions that were looked at since the last change; they are not looked at again.
    visited: HashSet<Key>,
    changed: bool,
}

impl Flow {
    /// The summaries of a function and all that it reaches.
    pub(super) fn solved(module: &Module, function: FunctionId, params: &[Axes]) -> Flow {
        let mut flow = Flow::default();
        loop {
            flow.changed = false;
            flow.visited.clear();
            flow.of(module, function, params);
            if !flow.changed {
                return flow;
            }
        }
    }

    /// The summary of a function, as far as it is known.
    pub(super) fn of(&mut self, module: &Module, id: FunctionId, params: &[Axes]) -> Rc<Summary> {
        let key = (id, params.to_vec());
        let function = module.function(id);
        if !self.visited.insert(key.clone()) {
            let nothing = || Rc::new(Summary { results: vec![0; function.results.len()], slots: Slots::default() });
            return self.known.get(&key).cloned().unwrap_or_else(nothing);
        }
        let nodes = self.nodes(module, function, params);
        let results = function.results.iter().map(|r| nodes.axes[r.0 as usize]).collect();
        let summary = Rc::new(Summary { results, slots: nodes.slots });
        self.changed |= self.known.get(&key) != Some(&summary);
        self.known.insert(key, summary.clone());
        summary
    }

    /// The coordinates of all values of a function whose parameters depend on the given ones.
    pub(super) fn nodes(&mut self, module: &Module, function: &Function, params: &[Axes]) -> Nodes {
        let mut axes: Vec<Axes> = Vec::with_capacity(function.nodes.len());
        let mut results: HashMap<Value, Vec<Axes>> = HashMap::default();
        let mut nodes = Nodes { axes: Vec::new(), decisions: BTreeMap::new(), slots: Slots::default() };
        let mut taken = HashSet::default();
        for (index, node) in function.values().zip(&function.nodes) {
            let mut union = 0;
            node.op.visit_operands(|v| union |= axes[v.0 as usize]);
            axes.push(match &node.op {
                Op::Param(i) => params[*i as usize],
                Op::Project(multi, k) => results[multi][*k as usize],
                op if op.is_structured() => {
                    let (of_results, slots) = self.structured(module, op, &axes);
                    results.insert(index, of_results);
                    nodes.slots = nodes.slots | slots;
                    union
                }
                _ => union,
            });
            for decision in decisions(function, index, &axes) {
                let of = coordinates(decision, &axes);
                if of != 0 && taken.insert(decision) {
                    nodes.slots = nodes.slots | Slots::of(of);
                    nodes.decisions.entry(index).or_default().push((of, decision));
                }
            }
        }
        nodes.axes = axes;
        nodes
    }

    /// The coordinates of the results of an operation that runs functions, and the decisions that these take.
    fn structured(&mut self, module: &Module, op: &Op, axes: &[Axes]) -> (Vec<Axes>, Slots) {
        let of = |values: &[Value]| -> Vec<Axes> { values.iter().map(|v| axes[v.0 as usize]).collect() };
        match op {
            Op::If { condition, then, otherwise, args } => {
                let (args, condition) = (of(args), axes[condition.0 as usize]);
                let [a, b] = [*then, *otherwise].map(|side| self.of(module, side, &args));
                (a.results.iter().zip(&b.results).map(|(a, b)| a | b | condition).collect(), a.slots | b.slots)
            }
            Op::Loop { count, body, init, invariant } => {
                let params = self.loop_params(module, *body, &of(init), &of(invariant));
                let count = axes[count.0 as usize];
                let carried = params[1..=init.len()].iter().map(|axes| axes | count).collect();
                (carried, self.of(module, *body, &params).slots)
            }
            Op::Call { function, args } => {
                let summary = self.of(module, *function, &of(args));
                (summary.results.clone(), summary.slots)
            }
            op => {
                let union = of(&op.operands()).iter().fold(0, |all, axes| all | axes);
                let results = op.functions().first().map_or(0, |f| module.function(*f).results.len());
                (vec![union; results], Slots::default())
            }
        }
    }

    /// The coordinates of the parameters of a loop's body, in all iterations.
    pub(super) fn loop_params(
        &mut self,
        module: &Module,
        body: FunctionId,
        init: &[Axes],
        invariant: &[Axes],
    ) -> Vec<Axes> {
        let mut params = [&[0], init, invariant].concat();
        loop {
            let summary = self.of(module, body, &params);
            let before = params.clone();
            params[1..].iter_mut().zip(&summary.results).for_each(|(param, result)| *param |= result);
            if params == before {
                return params;
            }
        }
    }
}

/// The coordinates on which a decision depends.
fn coordinates(decision: Decision, axes: &[Axes]) -> Axes {
    let of = |v: Value| axes[v.0 as usize];
    match decision {
        Decision::Truth(x) | Decision::Negative(x) | Decision::Positive(x) => of(x),
        Decision::Whole(x) | Decision::Integer(x) => of(x),
        Decision::Less(x, y) | Decision::BehindCut(y, x) | Decision::Quotient(x, y, _) => of(x) | of(y),
    }
}

/// The decisions that a node takes.
fn decisions(function: &Function, index: Value, axes: &[Axes]) -> Vec<Decision> {
    let node = &function.nodes[index.0 as usize];
    match node.op {
        Op::Unary(Unary::Abs | Unary::Sign, x) => signs(factors(function, x, axes)),
        Op::Unary(Unary::Floor | Unary::Ceil | Unary::Round, _) => vec![Decision::Whole(index)],
        Op::Unary(Unary::ToInt, x) => truncated(function, index, x),
        Op::Binary(Binary::Rem, x, divisor) if node.ty == Type::Real => vec![Decision::Quotient(x, divisor, index)],
        Op::Binary(Binary::Min | Binary::Max, x, y) if node.ty == Type::Real => order(function, x, y, axes),
        Op::Binary(Binary::Atan2, y, x) => vec![Decision::BehindCut(y, x)],
        Op::Select(condition, ..) | Op::If { condition, .. } => conditions(function, condition, axes),
        _ => Vec::new(),
    }
}

/// The decision of a conversion to an integer, unless the number is whole anyway.
fn truncated(function: &Function, index: Value, x: Value) -> Vec<Decision> {
    let whole = matches!(function.op(x), Op::Unary(Unary::Floor | Unary::Ceil | Unary::Round | Unary::ToReal, _));
    if whole { Vec::new() } else { vec![Decision::Integer(index)] }
}

/// The decisions of a condition: those of the comparisons of Reals that it combines.
fn conditions(function: &Function, condition: Value, axes: &[Axes]) -> Vec<Decision> {
    let (mut decisions, mut open, mut seen) = (Vec::new(), vec![condition], HashSet::default());
    while let Some(c) = open.pop() {
        if !seen.insert(c) {
            continue;
        }
        match *function.op(c) {
            Op::Unary(Unary::Not, x) | Op::Guard { value: x, .. } => open.push(x),
            Op::Binary(_, x, y) | Op::Select(_, x, y) => open.extend([x, y]),
            Op::Compare(_, x, _) if function.ty(x) == Type::Int => {}
            Op::Compare(_, x, y) => match product(function, x, y, axes) {
                Some(factors) => decisions.extend(signs(factors)),
                None => decisions.push(Decision::Truth(c)),
            },
            _ => decisions.push(Decision::Truth(c)),
        }
    }
    decisions
}

/// The decisions of an extreme: also whether both are equal, as its derivative then is that of neither.
fn order(function: &Function, x: Value, y: Value, axes: &[Axes]) -> Vec<Decision> {
    match product(function, x, y, axes) {
        Some(factors) => signs(factors),
        None => vec![Decision::Less(x, y), Decision::Less(y, x)],
    }
}

/// The signs of some numbers; 0 has its own, as the derivative of the absolute value there is that of neither side.
fn signs(numbers: Vec<Value>) -> Vec<Decision> {
    numbers.into_iter().flat_map(|x| [Decision::Negative(x), Decision::Positive(x)]).collect()
}

/// The factors of the one of two numbers, where the other is 0 and the factors depend on fewer coordinates.
fn product(function: &Function, x: Value, y: Value, axes: &[Axes]) -> Option<Vec<Value>> {
    let zero = |v: Value| matches!(function.op(v), Op::Real(bits) if f64::from_bits(*bits) == 0.0);
    let other = if zero(y) { x } else { zero(x).then_some(y)? };
    let factors = factors(function, other, axes);
    (factors.len() > 1).then_some(factors)
}

/// The numbers whose signs decide that of a number of both coordinates: the factors of a product, so that zeros along
/// lines of constant u or v are known as such.
fn factors(function: &Function, x: Value, axes: &[Axes]) -> Vec<Value> {
    let (mut factors, mut open) = (Vec::new(), vec![x]);
    while let Some(v) = open.pop() {
        match *function.op(v) {
            Op::Unary(Unary::Neg, a) if axes[v.0 as usize] == UV => open.push(a),
            Op::Binary(Binary::Mul | Binary::Div | Binary::MulOrZero | Binary::DivOrZero, a, b)
                if axes[v.0 as usize] == UV && factors.len() + open.len() + 2 <= MOST_FACTORS =>
            {
                open.extend([b, a]);
            }
            _ => factors.push(v),
        }
    }
    factors
}
