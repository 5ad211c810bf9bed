//! Two points at once and one after the other give the same bits, and those of single calls.

use super::*;
use crate::diff;
use crate::ir::{Binary, Compare, Failure, Unary, arithmetic, interpret};

/// (a, b, u, v) -> results with everything that there are instructions for.
fn plain() -> (Module, FunctionId) {
    let mut module = Module::default();
    let failure = module.fail(Failure { span: Span::default(), message: "u is too large".to_owned() });
    let mut raw = Raw::new(&[Type::Real; 4]);
    let [a, b, u, v] = [0, 1, 2, 3].map(Value);
    let sin = raw.real(Op::Unary(Unary::Sin, u));
    let exp = raw.real(Op::Unary(Unary::Exp, v));
    let product = raw.real(Op::Binary(Binary::Mul, sin, exp));
    let quotient = raw.real(Op::Binary(Binary::Div, product, a));
    let sum = raw.real(Op::Binary(Binary::Add, quotient, b));
    let difference = raw.real(Op::Binary(Binary::Sub, u, v));
    let sign = raw.real(Op::Unary(Unary::Sign, difference));
    let abs = raw.real(Op::Unary(Unary::Abs, difference));
    let root = raw.real(Op::Unary(Unary::Sqrt, abs));
    let cube = raw.real(Op::PowInt(sum, -3));
    let less = raw.node(Op::Compare(Compare::Lt, u, v), Type::Bool);
    let not = raw.node(Op::Unary(Unary::Not, less), Type::Bool);
    let of_row = raw.node(Op::Compare(Compare::Gt, v, a), Type::Bool);
    let either = raw.node(Op::Binary(Binary::Or, not, of_row), Type::Bool);
    let selected = raw.real(Op::Select(either, root, cube));
    let least = raw.real(Op::Binary(Binary::Min, selected, sum));
    let zero = raw.real(Op::Unary(Unary::Floor, sign));
    let masked = raw.real(Op::Binary(Binary::MulOrZero, zero, cube));
    let divided = raw.real(Op::Binary(Binary::DivOrZero, sign, root));
    let limit = raw.constant(1e6);
    let holds = raw.node(Op::Compare(Compare::Lt, abs, limit), Type::Bool);
    let guarded = raw.real(Op::Guard { value: least, condition: holds, failure });
    let negative = raw.real(Op::Unary(Unary::Neg, guarded));
    let id = module.add(raw.returns(&[negative, masked, divided]));
    (module, id)
}

const U: [f64; 6] = [0.1, 0.5, 0.5, 0.9, 1.3, -2.0];
const V: [f64; 3] = [0.5, 1.1, -0.4];
const CAPTURES: [f64; 2] = [0.7, 0.3];

/// u and v of every point of a grid, but for the last: an odd number of points.
fn sites() -> (Vec<f64>, Vec<f64>) {
    V.iter().flat_map(|v| U.map(|u| (u, *v))).take(17).unzip()
}

/// The results of a function at all of them, and its two-lane code has been compiled.
fn run(module: &Module, function: FunctionId, values: &[f64], output: Output, one_lane: bool) -> (bool, Vec<f64>) {
    let shape = KernelShape { function, captures: 2, output };
    let options = Options { listings: true, one_lane, ..OPTIONS };
    let (code, listings) = Code::compile(module, &[shape], &[], options, Workers::ONE).unwrap();
    let results = module.function(function).results.len();
    let mut out = vec![0.0; if output == Output::Store { 17 * results } else { results }];
    code.run(0, &CAPTURES, Points { count: 17, values }, &mut out, Limits::default()).unwrap();
    (listings[0].clif.contains("f64x2"), out)
}

#[test]
fn two_at_once_are_the_same_as_one() {
    let (module, id) = plain();
    let (u, v) = sites();
    let values = [&u[..], &v].concat();
    let (paired, pairs) = run(&module, id, &values, Output::Store, false);
    let (also_paired, single) = run(&module, id, &values, Output::Store, true);
    assert!(paired && !also_paired);
    let native = Native::new(&module, id);
    for (i, point) in pairs.chunks_exact(3).enumerate() {
        let arguments = [CAPTURES[0], CAPTURES[1], u[i], v[i]];
        let expected = native.code.call_reals(0, &arguments, Limits::default()).unwrap();
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(point), bits(&expected), "at {arguments:?}");
        assert_eq!(bits(&single[3 * i..3 * i + 3]), bits(&expected), "at {arguments:?}");
    }
}

#[test]
fn sums_do_not_depend_on_the_lanes() {
    let (mut module, id) = plain();
    let pullback = diff::pullback(&mut module, id, &[0, 1], false).unwrap();
    let (u, v) = sites();
    let w = (0..51).map(|i| (0.9 * f64::from(i)).sin());
    let values: Vec<f64> = [u, v].concat().into_iter().chain(w).collect();
    let (paired, pairs) = run(&module, pullback, &values, Output::Accumulate, false);
    let (also_paired, single) = run(&module, pullback, &values, Output::Accumulate, true);
    assert!(paired && !also_paired);
    assert!(pairs.iter().any(|x| *x != 0.0));
    let text = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>();
    assert_eq!(text(&pairs), text(&single));
}

/// Where one of two points fails, it is named, whichever it is.
#[test]
fn the_lane_that_fails_is_found() {
    let (module, id) = plain();
    let code =
        compiled(&module, &[KernelShape { function: id, captures: 2, output: Output::Store }], &[], OPTIONS).unwrap();
    for bad in 0..7 {
        let mut values = [0.5; 14];
        values[bad] = 1e7;
        let mut out = [0.0; 21];
        let stopped = code.run(0, &CAPTURES, Points { count: 7, values: &values }, &mut out, Limits::default());
        assert_eq!(stopped.map_err(|s| (s.point, s.trap)), Err((bad, Trap::Failure(crate::ir::FailureId(0)))));
    }
}

/// Integers have no instructions for pairs: one point after the other.
#[test]
fn integers_take_one_lane() {
    let mut module = Module::default();
    let mut raw = Raw::new(&[Type::Real; 4]);
    let product = raw.real(Op::Binary(Binary::Mul, Value(2), Value(3)));
    let whole = raw.node(Op::Unary(Unary::ToInt, product), Type::Int);
    let back = raw.real(Op::Unary(Unary::ToReal, whole));
    let sin = raw.real(Op::Unary(Unary::Sin, product));
    let sum = raw.real(Op::Binary(Binary::Add, back, sin));
    let id = module.add(raw.returns(&[sum]));
    let (u, v) = sites();
    let (paired, out) = run(&module, id, &[&u[..], &v].concat(), Output::Store, false);
    assert!(!paired);
    let value = |x: f64| x.trunc() + arithmetic::unary(Unary::Sin, x).unwrap();
    assert_eq!(out, u.iter().zip(&v).map(|(u, v)| value(u * v)).collect::<Vec<f64>>());
}

/// Elementary functions of both u and v, with arguments that are in their range in one lane alone, or in none.
#[test]
fn elementary_functions_of_pairs() {
    use Binary::{Atan2, Mul, Pow, Rem};
    use Unary::{Acos, Asin, Atan, Cos, Cosh, Exp, Ln, Round, Sin, Sinh, Tan, Tanh};
    for scale in [1.0, 3.7, -900.0, 1e4, 1e300] {
        let mut module = Module::default();
        let mut raw = Raw::new(&[Type::Real; 4]);
        let [a, u, v] = [0, 2, 3].map(Value);
        let product = raw.real(Op::Binary(Mul, u, v));
        let scale = raw.constant(scale);
        let x = raw.real(Op::Binary(Mul, product, scale));
        let unary = [Sin, Cos, Exp, Ln, Tan, Asin, Acos, Atan, Sinh, Cosh, Tanh, Round];
        let mut results: Vec<Value> = unary.iter().map(|op| raw.real(Op::Unary(*op, x))).collect();
        // A sine and a cosine that are alone, and powers of everything.
        results.push(raw.real(Op::Unary(Sin, product)));
        let sum = raw.real(Op::Binary(Binary::Add, x, a));
        results.push(raw.real(Op::Unary(Cos, sum)));
        results.extend([Atan2, Pow, Rem].map(|op| raw.real(Op::Binary(op, x, u))));
        results.push(raw.real(Op::Binary(Pow, u, x)));
        // Powers of one number: two, three, and one more, and a logarithm.
        let base = raw.real(Op::Binary(Mul, v, v));
        for k in 0..6 {
            let of = if k < 2 { sum } else { base };
            let exponent = raw.constant(f64::from(k) * 0.75 - 1.1);
            results.push(raw.real(Op::Binary(Pow, of, exponent)));
        }
        results.push(raw.real(Op::Unary(Ln, base)));
        let count = results.len();
        let id = module.add(raw.returns(&results));
        let (u, v) = sites();
        let values = [&u[..], &v].concat();
        let (paired, pairs) = run(&module, id, &values, Output::Store, false);
        let (_, single) = run(&module, id, &values, Output::Store, true);
        assert!(paired);
        // NaN is NaN, whatever its bits.
        let shown = |values: &[f64]| values.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>();
        assert_eq!(shown(&pairs), shown(&single));
        for (i, point) in pairs.chunks_exact(count).enumerate() {
            let arguments = [CAPTURES[0], CAPTURES[1], u[i], v[i]];
            let interpreted = interpret::run_real(&module, id, &arguments, interpret::Limits::default()).unwrap();
            assert_eq!(shown(point), shown(&interpreted), "at {arguments:?}");
        }
    }
}
