//! Kernels against single calls.

use super::super::Stopped;
use super::*;
use crate::ir::{Binary, Compare, Failure, Unary};

/// (a, b, u, v) -> (a * sin(u) + pow(b, 2.5), guarded v - 1, u / v); the guard wants u < 0.75.
fn surface() -> (Module, FunctionId) {
    let mut module = Module::default();
    let failure = module.fail(Failure { span: Span::default(), message: "u is too large".to_owned() });
    let mut raw = Raw::new(&[Type::Real; 4]);
    let [a, b, u, v] = [0, 1, 2, 3].map(Value);
    let exponent = raw.constant(2.5);
    let uniform = raw.real(Op::Binary(Binary::Pow, b, exponent));
    let sin = raw.real(Op::Unary(Unary::Sin, u));
    let product = raw.real(Op::Binary(Binary::Mul, a, sin));
    let x = raw.real(Op::Binary(Binary::Add, product, uniform));
    let limit = raw.constant(0.75);
    let one = raw.constant(1.0);
    let holds = raw.node(Op::Compare(Compare::Lt, u, limit), Type::Bool);
    let guarded = raw.real(Op::Guard { value: v, condition: holds, failure });
    let y = raw.real(Op::Binary(Binary::Sub, guarded, one));
    let z = raw.real(Op::Binary(Binary::Div, u, v));
    let id = module.add(raw.returns(&[x, y, z]));
    (module, id)
}

fn run(
    module: &Module,
    shape: KernelShape,
    captures: &[f64],
    values: &[&[f64]],
    out: &mut [f64],
) -> Result<(), Stopped> {
    let code = compiled(module, &[shape], &[], OPTIONS).unwrap();
    let points = Points { count: values[0].len(), values: &values.concat() };
    code.run(0, captures, points, out, Limits { steps: 100, depth: 10 })
}

fn stored(function: FunctionId, captures: usize) -> KernelShape {
    KernelShape { function, captures, output: Output::Store }
}

fn grid(n: usize, end: f64) -> (Vec<f64>, Vec<f64>) {
    (0..n).map(|i| (end * i as f64 / n as f64, 0.25 + i as f64)).unzip()
}

#[test]
fn a_batch_is_its_points() {
    let (module, id) = surface();
    let (u, v) = grid(37, 0.7);
    let mut out = vec![0.0; 3 * u.len()];
    run(&module, stored(id, 2), &[1.5, 2.0], &[&u, &v], &mut out).unwrap();
    let native = Native::new(&module, id);
    for i in 0..u.len() {
        let single = native.code.call_reals(0, &[1.5, 2.0, u[i], v[i]], Limits::default()).unwrap();
        assert_eq!(out[3 * i..3 * i + 3], single[..]);
    }
}

#[test]
fn a_failure_names_its_point() {
    let (module, id) = surface();
    let (u, v) = grid(100, 1.0);
    let mut out = vec![0.0; 300];
    let stopped = run(&module, stored(id, 2), &[1.5, 2.0], &[&u, &v], &mut out).unwrap_err();
    assert_eq!(stopped.point, 75);
    assert_eq!(stopped.trap, Trap::Failure(crate::ir::FailureId(0)));
    assert_ne!(out[73 * 3], 0.0, "the points before this pair are there");
    assert_eq!(out[74 * 3..], [0.0; 78], "the others are not touched");
}

#[test]
fn an_empty_batch_does_nothing() {
    let (module, id) = surface();
    run(&module, stored(id, 2), &[f64::NAN; 2], &[&[], &[]], &mut []).unwrap();
}

#[test]
fn even_and_odd_points_are_summed_apart() {
    // (a, u, v, w0, w1, w2) -> (a * u * w0, v * w1 + w2)
    let mut raw = Raw::new(&[Type::Real; 6]);
    let au = raw.real(Op::Binary(Binary::Mul, Value(0), Value(1)));
    let first = raw.real(Op::Binary(Binary::Mul, au, Value(3)));
    let vw = raw.real(Op::Binary(Binary::Mul, Value(2), Value(4)));
    let second = raw.real(Op::Binary(Binary::Add, vw, Value(5)));
    let mut module = Module::default();
    let id = module.add(raw.returns(&[first, second]));
    for n in [1, 2, 49, 50] {
        let (u, v) = grid(n, 1.0);
        let w: [Vec<f64>; 3] =
            [|i| i as f64 * 0.1, |_| -0.3, |i| 1.0 / (i + 1) as f64].map(|w: fn(usize) -> f64| (0..n).map(w).collect());
        let shape = KernelShape { function: id, captures: 1, output: Output::Accumulate };
        let mut out = [10.0, 20.0];
        run(&module, shape, &[0.7], &[&u, &v, &w[0], &w[1], &w[2]], &mut out).unwrap();
        let mut sums = [[0.0; 2]; 2];
        for i in 0..n {
            sums[0][i % 2] += 0.7 * u[i] * w[0][i];
            sums[1][i % 2] += v[i] * w[1][i] + w[2][i];
        }
        assert_eq!(out, [10.0 + (sums[0][0] + sums[0][1]), 20.0 + (sums[1][0] + sums[1][1])]);
    }
}

#[test]
fn steps_are_counted_for_each_point() {
    // (u, v) -> a loop of 60 iterations at every point; 100 steps are allowed.
    let mut module = Module::default();
    let mut raw = Raw::new(&[Type::Int, Type::Real, Type::Real]);
    let sum = raw.real(Op::Binary(Binary::Add, Value(1), Value(2)));
    let body = module.add(raw.returns(&[sum]));
    let mut raw = Raw::new(&[Type::Real; 2]);
    let count = raw.int(60);
    let turns = Op::Loop { count, body, init: vec![Value(0)], invariant: vec![Value(1)] };
    let turns = raw.node(turns, Type::Multi);
    let result = raw.real(Op::Project(turns, 0));
    let id = module.add(raw.returns(&[result]));
    let mut out = [0.0; 10];
    run(&module, stored(id, 0), &[], &[&[1.0; 10], &[0.5; 10]], &mut out).unwrap();
    assert_eq!(out, [31.0; 10]);
}

#[test]
fn a_kernel_of_another_shape_is_refused() {
    let (module, id) = surface();
    assert_eq!(compiled(&module, &[stored(id, 5)], &[], OPTIONS).err(), Some(JitError::Shape("test".to_owned())));
}
