//! Branches, loops, calls, guards and the limits.

use super::*;
use crate::ir::{Binary, Compare, Failure, FailureId, Unary};

fn real(x: f64) -> Scalar {
    Scalar::Real(x)
}

#[test]
fn a_branch_runs_one_side_only() {
    // (c, x) -> if c { x + 1 } else { guard(x, false) }
    let mut module = Module::default();
    let failure = module.fail(Failure { span: Span::default(), message: "never".to_owned() });
    let mut raw = Raw::new(&[Type::Real]);
    let one = raw.constant(1.0);
    let sum = raw.real(Op::Binary(Binary::Add, Value(0), one));
    let then = module.add(raw.returns(&[sum]));
    let mut raw = Raw::new(&[Type::Real]);
    let no = raw.node(Op::Bool(false), Type::Bool);
    let guard = raw.real(Op::Guard { value: Value(0), condition: no, failure });
    let otherwise = module.add(raw.returns(&[guard]));
    let mut raw = Raw::new(&[Type::Bool, Type::Real]);
    let branch = Op::If { condition: Value(0), then, otherwise, args: vec![Value(1)] };
    let branch = raw.node(branch, Type::Multi);
    let result = raw.real(Op::Project(branch, 0));
    let id = module.add(raw.returns(&[result]));
    let native = Native::new(&module, id);
    assert_eq!(native.call(&[Scalar::Bool(true), real(2.0)], Limits::default()), Ok(vec![real(3.0)]));
    assert_eq!(native.call(&[Scalar::Bool(false), real(2.0)], Limits::default()), Err(Trap::Failure(FailureId(0))));
}

/// (n, x, y) -> n turns of (a, b) = (b + i, a * y), from (x, y).
fn loop_module() -> (Module, FunctionId) {
    let mut module = Module::default();
    let mut raw = Raw::new(&[Type::Int, Type::Real, Type::Real, Type::Real]);
    let index = raw.real(Op::Unary(Unary::ToReal, Value(0)));
    let first = raw.real(Op::Binary(Binary::Add, Value(2), index));
    let second = raw.real(Op::Binary(Binary::Mul, Value(1), Value(3)));
    let body = module.add(raw.returns(&[first, second]));
    let mut raw = Raw::new(&[Type::Int, Type::Real, Type::Real]);
    let turns = Op::Loop { count: Value(0), body, init: vec![Value(1), Value(2)], invariant: vec![Value(2)] };
    let turns = raw.node(turns, Type::Multi);
    let results = [0, 1].map(|k| raw.real(Op::Project(turns, k)));
    let id = module.add(raw.returns(&results));
    (module, id)
}

#[test]
fn loops_carry_values() {
    let (module, id) = loop_module();
    let native = Native::new(&module, id);
    for n in [i64::MIN, -1, 0, 1, 2, 7, 100] {
        let (mut a, mut b) = (0.5, 0.9);
        for i in 0..n {
            (a, b) = (b + i as f64, a * 0.9);
        }
        let got = native.call(&[Scalar::Int(n), real(0.5), real(0.9)], Limits::default());
        assert_eq!(got, Ok(vec![real(a), real(b)]));
    }
}

#[test]
fn loops_end_at_the_limit() {
    let (module, id) = loop_module();
    let native = Native::new(&module, id);
    let limits = Limits { steps: 100, depth: 10 };
    assert!(native.call(&[Scalar::Int(100), real(0.5), real(0.9)], limits).is_ok());
    for n in [101, i64::MAX] {
        assert_eq!(native.call(&[Scalar::Int(n), real(0.5), real(0.9)], limits), Err(Trap::Steps));
    }
}

/// (n, x) -> if n <= 0 { x } else { itself(n - 1, x) + `width` values that live over the call }.
fn recursion(width: usize) -> (Module, FunctionId) {
    let mut module = Module::default();
    let own = module.reserve();
    let mut raw = Raw::new(&[Type::Int, Type::Real]);
    let base = module.add({
        raw.int(0);
        raw.returns(&[Value(1)])
    });
    let mut raw = Raw::new(&[Type::Int, Type::Real]);
    let one = raw.int(1);
    let less = raw.node(Op::Binary(Binary::Sub, Value(0), one), Type::Int);
    let mut kept = Vec::new();
    for i in 0..width {
        let c = raw.constant(i as f64 + 0.5);
        // A host call stays where it is; arithmetic would be moved behind the call.
        let product = raw.real(Op::Binary(Binary::Mul, Value(1), c));
        let op = if width > 1 { Unary::Tanh } else { Unary::Stop };
        kept.push(raw.real(Op::Unary(op, product)));
    }
    let call = raw.node(Op::Call { function: own, args: vec![less, Value(1)] }, Type::Multi);
    let mut sum = raw.real(Op::Project(call, 0));
    for k in kept {
        sum = raw.real(Op::Binary(Binary::Add, sum, k));
    }
    let step = module.add(raw.returns(&[sum]));
    let mut raw = Raw::new(&[Type::Int, Type::Real]);
    let zero = raw.int(0);
    let ends = raw.node(Op::Compare(Compare::Le, Value(0), zero), Type::Bool);
    let branch = Op::If { condition: ends, then: base, otherwise: step, args: vec![Value(0), Value(1)] };
    let branch = raw.node(branch, Type::Multi);
    let result = raw.real(Op::Project(branch, 0));
    module.define(own, raw.returns(&[result]));
    (module, own)
}

#[test]
fn recursion_ends_at_the_depth() {
    let (module, id) = recursion(1);
    let native = Native::new(&module, id);
    let call = |n, limits| native.call(&[Scalar::Int(n), real(2.0)], limits);
    assert_eq!(call(10, Limits::default()), Ok(vec![real(12.0)]));
    assert_eq!(call(50, Limits { steps: 1000, depth: 50 }), Ok(vec![real(52.0)]));
    assert_eq!(call(51, Limits { steps: 1000, depth: 50 }), Err(Trap::Depth));
    assert_eq!(call(51, Limits { steps: 50, depth: 100 }), Err(Trap::Steps));
}

#[test]
fn recursion_ends_before_the_stack_does() {
    let (module, id) = recursion(400);
    let limits = Limits { steps: u32::MAX, depth: u32::MAX };
    // In a thread of the default size, and on whatever the test runs.
    let run = || Native::new(&module, id).call(&[Scalar::Int(1_000_000), real(2.0)], limits);
    assert_eq!(run(), Err(Trap::Depth));
    std::thread::scope(|s| assert_eq!(s.spawn(run).join().unwrap(), Err(Trap::Depth)));
}

#[test]
fn deep_nesting_and_shared_bodies_stay_small() {
    // f[i](c, x) = if c { f[i-1](c, x) } else { f[i-1](c, x) } + 1, 300 deep: 2^300 leaves if copied in place.
    let mut module = Module::default();
    let mut inner = module.add(Raw::new(&[Type::Bool, Type::Real]).returns(&[Value(1)]));
    for _ in 0..300 {
        let mut raw = Raw::new(&[Type::Bool, Type::Real]);
        let branch = Op::If { condition: Value(0), then: inner, otherwise: inner, args: vec![Value(0), Value(1)] };
        let branch = raw.node(branch, Type::Multi);
        let below = raw.real(Op::Project(branch, 0));
        let one = raw.constant(1.0);
        let sum = raw.real(Op::Binary(Binary::Add, below, one));
        inner = module.add(raw.returns(&[sum]));
    }
    let native = Native::new(&module, inner);
    assert_eq!(native.call(&[Scalar::Bool(true), real(0.5)], Limits::default()), Ok(vec![real(300.5)]));
}

#[test]
fn giants_are_refused() {
    let mut raw = Raw::new(&[Type::Real]);
    let mut x = Value(0);
    for _ in 0..1_000_001 {
        x = raw.real(Op::Binary(Binary::Add, x, x));
    }
    let mut module = Module::default();
    let id = module.add(raw.returns(&[x]));
    assert!(matches!(compiled(&module, &[], &[id], OPTIONS), Err(JitError::TooLarge(..))));
}

#[test]
fn large_frames_are_refused() {
    // 40,000 values that live over as many calls need more stack than a frame may have. (They would also keep the
    // backtracking register allocator busy for minutes.)
    let (module, id) = recursion(40_000);
    let refused = compiled(&module, &[], &[id], OPTIONS);
    assert!(matches!(refused, Err(JitError::TooLarge(_, "it needs too much stack"))));
}

#[test]
fn what_would_take_long_is_compiled_quickly() {
    // 10,000 values that live over as many calls: half a minute for the backtracking register allocator.
    let (module, id) = recursion(10_000);
    let native = Native::new(&module, id);
    assert_eq!(native.call(&[Scalar::Int(0), real(2.0)], Limits::default()), Ok(vec![real(2.0)]));
}
