//! Signatures of the decisions that a function of captures, u and v takes: which branches it runs, which of two values
//! is the smaller one, how a number is rounded. A surface can only have a corner or a jump where one of them changes.
//!
//! Decisions are told apart by the coordinates on which they depend ([`flow`]): those of u alone change along lines of
//! constant u, those of v alone along lines of constant v, those of both anywhere; those of captures alone nowhere.
//! Each of the three has a signature: the sum of a weight for every decision, without its whole part. A body's sums
//! become results of it, and a loop carries them. Operations that only points need are dropped.

use super::builder::{Image, Rebuild, Step};
use super::hoist::axes::{Axes, U, V};
use super::worklist::Worklist;
use super::{
    Binary, Compare, Function, FunctionBuilder, FunctionId, Module, Op, Parameter, SizeError, Type, Unary, Value,
};
use crate::ir;
use flow::{Decision, Flow, Slots};

mod flow;
#[cfg(test)]
mod tests;

/// Factor of the signatures of a loop's earlier iterations. It is greater than 1, so that a difference does not fade,
/// and not a power of 2, by which bits would be shifted out.
const ITERATION: f64 = 3.732_050_807_568_877;

/// Whole numbers below this have signatures of their own. (Above, the fraction of a product has too few bits.)
const MOST_WHOLE: f64 = 1e9;

/// `(C.., u, v) -> signatures of the decisions of u alone, of v alone, of both`, from `(C.., u, v) -> ..` with the
/// given number of C.
///
/// # Errors
/// If the program would exceed a limit.
pub(crate) fn decisions(module: &mut Module, points: FunctionId, captures: usize) -> Result<FunctionId, SizeError> {
    let params = module.function(points).params.len();
    let axes: Vec<Axes> = (0..params).map(|i| [0, U, V][(i + 1).saturating_sub(captures)]).collect();
    decisions_of(module, points, &axes)
}

/// The same for a function whose parameters depend on the given coordinates.
fn decisions_of(module: &mut Module, function: FunctionId, params: &[Axes]) -> Result<FunctionId, SizeError> {
    let mut signing = Signing { flow: Flow::solved(module, function, params), signed: Worklist::default(), sites: 0 };
    let signed = signing.id(module, function, params, Slots::ALL);
    while let Some((key, id)) = signing.signed.next() {
        let function = signing.sign(module, &key);
        module.define(id, function);
    }
    let mut function = module.function(signed).clone();
    let first = function.results.len() - Slots::ALL.count();
    function.name = "decisions".to_owned();
    function.results.drain(..first);
    function.result_names.drain(..first);
    function.drop_unused();
    let id = module.add(function);
    ir::inline(module, &[id])?;
    ir::simplify(module, &[id]);
    Ok(id)
}

/// A function to which the signatures `slots` are added: `(p..) -> (r.., signatures..)`, for parameters that depend on
/// the given coordinates.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Signed {
    function: FunctionId,
    params: Vec<Axes>,
    slots: Slots,
}

struct Signing {
    flow: Flow,
    signed: Worklist<Signed>,
    /// The number of decisions so far: each has a weight of its own.
    sites: u64,
}

/// Signatures under construction.
type Sums = [Option<Value>; 3];

impl Signing {
    fn id(&mut self, module: &mut Module, function: FunctionId, params: &[Axes], slots: Slots) -> FunctionId {
        self.signed.id(module, Signed { function, params: params.to_vec(), slots })
    }

    fn sign(&mut self, module: &mut Module, key: &Signed) -> Function {
        let old = module.function(key.function).clone();
        let nodes = self.flow.nodes(module, &old, &key.params);
        let mut b = FunctionBuilder::like(&old);
        let args = b.params();
        let mut rebuild = Rebuild::new(&old, &args);
        let mut sums = Sums::default();
        while let Some(Step { index, node, op }) = rebuild.next(&mut b) {
            let image = match op.is_structured() {
                true => self.structured(module, &mut b, (&node.op, &op), &nodes.axes, &mut sums),
                false => Image::One(b.emit(&op, node.ty)),
            };
            rebuild.push(image);
            for (axes, decision) in nodes.decisions(index) {
                let term = self.term(&mut b, decision.map(|v| rebuild.value(v)));
                add(&mut b, &mut sums, axes as usize - 1, term);
            }
        }
        let mut named: Vec<(String, Value)> = old.result_names.iter().cloned().zip(rebuild.results()).collect();
        for slot in key.slots.iter() {
            let sum = match sums[slot] {
                Some(sum) => fraction(&mut b, sum),
                None => b.real(0.0),
            };
            named.push((["of_u", "of_v", "of_both"][slot].to_owned(), sum));
        }
        b.finish(named)
    }

    /// A branch, loop or call whose bodies have signatures, which it adds to the sums. `old` has the operands in the
    /// function whose coordinates are given, `new` in the builder.
    fn structured(
        &mut self,
        module: &mut Module,
        b: &mut FunctionBuilder,
        (old, new): (&Op, &Op),
        axes: &[Axes],
        sums: &mut Sums,
    ) -> Image {
        let of = |values: &[Value]| -> Vec<Axes> { values.iter().map(|v| axes[v.0 as usize]).collect() };
        let (params, callees) = match old {
            Op::If { then, otherwise, args, .. } => (of(args), vec![*then, *otherwise]),
            Op::Call { function, args } => (of(args), vec![*function]),
            Op::Loop { body, init, invariant, .. } => {
                (self.flow.loop_params(module, *body, &of(init), &of(invariant)), vec![*body])
            }
            _ => return Image::One(b.emit(new, Type::Multi)),
        };
        let slots = callees.iter().fold(Slots::default(), |all, f| all | self.flow.of(module, *f, &params).slots);
        if slots == Slots::default() {
            return Image::One(b.emit(new, Type::Multi));
        }
        let mut types = module.function(callees[0]).result_types();
        let results = types.len();
        types.extend(slots.iter().map(|_| Type::Real));
        let signed: Vec<FunctionId> = callees.iter().map(|f| self.id(module, *f, &params, slots)).collect();
        let mut values = match new {
            Op::If { condition, args, .. } => b.if_(*condition, signed[0], signed[1], args.clone(), &types),
            Op::Loop { count, init, invariant, .. } => {
                let body = iteration(module, callees[0], signed[0], init.len(), &types);
                let mut init = init.clone();
                init.extend(slots.iter().map(|_| b.real(0.0)));
                b.loop_(*count, body, init, invariant.clone())
            }
            _ => b.call(signed[0], new.operands(), &types),
        };
        for (slot, signature) in slots.iter().zip(values.split_off(results)) {
            let weight = self.weight(b);
            let term = b.mul(weight, signature);
            add(b, sums, slot, term);
        }
        Image::Many(values)
    }

    /// The contribution of a decision to a signature.
    fn term(&mut self, b: &mut FunctionBuilder, decision: Decision) -> Value {
        let (weight, zero) = (self.weight(b), b.real(0.0));
        let truth = match decision {
            Decision::Truth(condition) => condition,
            Decision::Less(x, y) => b.compare(Compare::Lt, x, y),
            Decision::Negative(x) => b.compare(Compare::Lt, x, zero),
            Decision::Positive(x) => b.compare(Compare::Lt, zero, x),
            Decision::BehindCut(y, x) => {
                let (behind, below) = (b.compare(Compare::Lt, x, zero), b.compare(Compare::Lt, y, zero));
                b.binary(Binary::And, behind, below)
            }
            Decision::Whole(whole) => return weighted_whole(b, weight, whole),
            Decision::Integer(integer) => {
                let whole = b.unary(Unary::ToReal, integer);
                return weighted_whole(b, weight, whole);
            }
            Decision::Quotient(x, divisor, remainder) => {
                let multiple = b.sub(x, remainder);
                let quotient = b.div(multiple, divisor);
                // Whole but for rounding.
                let quotient = b.unary(Unary::Round, quotient);
                return weighted_whole(b, weight, quotient);
            }
        };
        b.select(truth, weight, zero)
    }

    /// The weight of the next decision, a number in 0..1. (They are scattered, so that no two sets of decisions have
    /// the same sum: splitmix64, Steele, Lea and Flood 2014.)
    fn weight(&mut self, b: &mut FunctionBuilder) -> Value {
        self.sites += 1;
        let mut z = self.sites.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        b.real(((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64)
    }
}

/// A loop's body with signatures: `(i, carried.., signatures.., invariant..) -> (carried.., signatures..)`.
fn iteration(
    module: &mut Module,
    body: FunctionId,
    signed: FunctionId,
    carried: usize,
    results: &[Type],
) -> FunctionId {
    let (old, signatures) = (module.function(body), results.len() - carried);
    let mut params = old.params.clone();
    params.splice(1 + carried..1 + carried, (0..signatures).map(|k| Parameter::real(format!("signature{k}"))));
    let names: Vec<String> = params[1..=results.len()].iter().map(|p| p.name.clone()).collect();
    let mut b = FunctionBuilder::new(old.name.clone(), params);
    let mut args = b.params();
    let before: Vec<Value> = args.drain(1 + carried..=results.len()).collect();
    let mut values = b.call(signed, args, results);
    let factor = b.real(ITERATION);
    for (value, before) in values[carried..].iter_mut().zip(before) {
        let earlier = b.mul(factor, before);
        let sum = b.add(earlier, *value);
        *value = fraction(&mut b, sum);
    }
    module.add(b.finish(names.into_iter().zip(values)))
}

fn add(b: &mut FunctionBuilder, sums: &mut Sums, slot: usize, term: Value) {
    sums[slot] = Some(match sums[slot] {
        Some(sum) => b.add(sum, term),
        None => term,
    });
}

/// A number without its whole part.
fn fraction(b: &mut FunctionBuilder, x: Value) -> Value {
    let whole = b.unary(Unary::Floor, x);
    b.sub(x, whole)
}

/// A weight for every whole number; 0 for one that is too large, infinite or NaN.
fn weighted_whole(b: &mut FunctionBuilder, weight: Value, whole: Value) -> Value {
    let (most, zero) = (b.real(MOST_WHOLE), b.real(0.0));
    let size = b.unary(Unary::Abs, whole);
    let small = b.compare(Compare::Lt, size, most);
    let whole = b.select(small, whole, zero);
    let product = b.mul(weight, whole);
    fraction(b, product)
}
