//! Kernels against single calls.

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
    uniforms: &[f64],
    points: Points<'_>,
    out: &mut [f64],
) -> Result<(), super::super::Stopped> {
    let mut compiler = Compiler::new(module, OPTIONS).unwrap();
    let kernel = compiler.kernel(shape).unwrap();
    compiler.finish().unwrap().run(kernel, uniforms, points, out, Limits { steps: 100, depth: 10 })
}

fn grid(n: usize, end: f64) -> (Vec<f64>, Vec<f64>) {
    (0..n).map(|i| (end * i as f64 / n as f64, 0.25 + i as f64)).unzip()
}

#[test]
fn a_batch_is_its_points() {
    let (module, id) = surface();
    let (u, v) = grid(37, 0.7);
    let shape = KernelShape { function: id, uniforms: 2, weights: 0, output: Output::Store };
    let mut out = vec![0.0; 3 * u.len()];
    run(&module, shape, &[1.5, 2.0], Points { u: &u, v: &v, w: &[] }, &mut out).unwrap();
    let native = Native::new(&module, id);
    for i in 0..u.len() {
        let single = native.code.call_reals(native.routine, &[1.5, 2.0, u[i], v[i]], Limits::default()).unwrap();
        assert_eq!(out[3 * i..3 * i + 3], single[..]);
    }
}

#[test]
fn a_failure_names_its_point() {
    let (module, id) = surface();
    let (u, v) = grid(100, 1.0);
    let shape = KernelShape { function: id, uniforms: 2, weights: 0, output: Output::Store };
    let mut out = vec![0.0; 300];
    let stopped = run(&module, shape, &[1.5, 2.0], Points { u: &u, v: &v, w: &[] }, &mut out).unwrap_err();
    assert_eq!(stopped.point, 75);
    assert_eq!(stopped.stop, Stop::Failure(crate::ir::FailureId(0)));
    assert_ne!(out[74 * 3], 0.0, "the points before are there");
    assert_eq!(out[75 * 3..], [0.0; 75], "the others are not touched");
}

#[test]
fn an_empty_batch_does_nothing() {
    let (module, id) = surface();
    let shape = KernelShape { function: id, uniforms: 2, weights: 0, output: Output::Store };
    run(&module, shape, &[f64::NAN; 2], Points { u: &[], v: &[], w: &[] }, &mut []).unwrap();
}

#[test]
fn accumulation_adds_in_order() {
    // (a, u, v, w0, w1, w2) -> (a * u * w0, v * w1 + w2)
    let mut raw = Raw::new(&[Type::Real; 6]);
    let au = raw.real(Op::Binary(Binary::Mul, Value(0), Value(1)));
    let first = raw.real(Op::Binary(Binary::Mul, au, Value(3)));
    let vw = raw.real(Op::Binary(Binary::Mul, Value(2), Value(4)));
    let second = raw.real(Op::Binary(Binary::Add, vw, Value(5)));
    let mut module = Module::default();
    let id = module.add(raw.returns(&[first, second]));
    let (u, v) = grid(50, 1.0);
    let w: Vec<[f64; 3]> = (0..50).map(|i| [f64::from(i) * 0.1, -0.3, 1.0 / f64::from(i + 1)]).collect();
    let shape = KernelShape { function: id, uniforms: 1, weights: 3, output: Output::Accumulate };
    let mut out = [10.0, 20.0];
    run(&module, shape, &[0.7], Points { u: &u, v: &v, w: w.as_flattened() }, &mut out).unwrap();
    let mut expected = [10.0, 20.0];
    for i in 0..50 {
        expected[0] += 0.7 * u[i] * w[i][0];
        expected[1] += v[i] * w[i][1] + w[i][2];
    }
    assert_eq!(out, expected);
}

#[test]
fn steps_are_counted_for_each_point() {
    // (u, v) -> a loop of 60 turns at every point; 100 steps are allowed.
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
    let shape = KernelShape { function: id, uniforms: 0, weights: 0, output: Output::Store };
    let mut out = [0.0; 10];
    run(&module, shape, &[], Points { u: &[1.0; 10], v: &[0.5; 10], w: &[] }, &mut out).unwrap();
    assert_eq!(out, [31.0; 10]);
}

#[test]
fn a_kernel_of_another_shape_is_refused() {
    let (module, id) = surface();
    let mut compiler = Compiler::new(&module, OPTIONS).unwrap();
    let shape = KernelShape { function: id, uniforms: 3, weights: 0, output: Output::Store };
    assert_eq!(compiler.kernel(shape), Err(JitError::Shape("test".to_owned())));
}

#[test]
fn equal_kernels_are_one() {
    let (mut module, id) = surface();
    let mut twin = module.function(id).clone();
    twin.name = "twin".to_owned();
    let twin = module.add(twin);
    let mut compiler = Compiler::new(&module, OPTIONS).unwrap();
    let mut kernel =
        |function, uniforms, output| compiler.kernel(KernelShape { function, uniforms, weights: 0, output }).unwrap();
    let one = kernel(id, 2, Output::Store);
    assert_eq!(one, kernel(twin, 2, Output::Store));
    assert_ne!(one, kernel(twin, 2, Output::Accumulate));
}
