//! Tests of the builder and the passes.

use super::reals;
use crate::ir::interpret::{self, Limits, RunError};
use crate::ir::scalar::Scalar;
use crate::ir::size::{SizeError, SizeLimits};
use crate::ir::*;
use crate::source::Span;

fn single(make: impl FnOnce(&mut FunctionBuilder, &[Value]) -> Value) -> String {
    let mut b = FunctionBuilder::new("f", reals(&["x", "y", "z"]));
    let params = b.params();
    let result = make(&mut b, &params);
    let mut module = Module::default();
    let f = module.add(b.finish([("f".to_owned(), result)]));
    validate(&module).unwrap();
    print::gml(&module, f).trim_start_matches("fn f(x: real, y: real, z: real) -> real = ").trim_end().to_owned()
}

#[test]
fn construction_simplifies() {
    let check = |expected: &str, make: &dyn Fn(&mut FunctionBuilder, &[Value]) -> Value| {
        assert_eq!(single(|b, p| make(b, p)), expected);
    };
    check("x", &|b, p| {
        let zero = b.real(0.0);
        b.add(zero, p[0])
    });
    check("3 * x^2", &|b, p| {
        let three = b.real(3.0);
        let square = b.mul(p[0], p[0]);
        b.mul(square, three)
    });
    check("0", &|b, p| b.sub(p[0], p[0]));
    check("x - y", &|b, p| {
        let minus = b.neg(p[1]);
        b.add(minus, p[0])
    });
    check("x - 2 * y", &|b, p| {
        let minus = b.real(-2.0);
        let term = b.mul(minus, p[1]);
        b.add(term, p[0])
    });
    check("x^(y + 2)", &|b, p| {
        let (three, one) = (b.real(3.0), b.real(1.0));
        let exponent = b.add(three, p[1]);
        let exponent = b.sub(exponent, one);
        b.pow(p[0], exponent)
    });
    check("x^3", &|b, p| {
        let three = b.real(3.0);
        b.pow(p[0], three)
    });
    check("sqrt(x)", &|b, p| {
        let half = b.real(0.5);
        b.pow(p[0], half)
    });
    check("-x / y^2", &|b, p| {
        let q = b.div(p[0], p[1]);
        let q = b.div(q, p[1]);
        b.neg(q)
    });
    check("x * (y + z)", &|b, p| {
        let sum = b.add(p[1], p[2]);
        b.mul(sum, p[0])
    });
    check("1", &|b, p| {
        let (s, c) = (b.unary(Unary::Sin, p[0]), b.unary(Unary::Cos, p[0]));
        let (s, c) = (b.mul(s, s), b.mul(c, c));
        b.add(s, c)
    });
    check("x / y", &|b, p| {
        let one = b.real(1.0);
        let inverse = b.div(one, p[1]);
        b.mul(p[0], inverse)
    });
    check("if x < y { x } else { y }", &|b, p| {
        let c = b.compare(Compare::Gt, p[1], p[0]);
        b.select(c, p[0], p[1])
    });
    check("x / (y^2 + 1)", &|b, p| {
        let one = b.real(1.0);
        let square = b.mul(p[1], p[1]);
        let positive = b.add(one, square);
        b.binary(Binary::DivOrZero, p[0], positive)
    });
    check("1 / 0", &|b, p| {
        let (zero, one) = (b.sub(p[0], p[0]), b.real(1.0));
        b.div(one, zero)
    });
}

#[test]
fn a_loop_is_hoisted_and_pruned() {
    // s = 0, t = 0; for i in 0..n { s += sin(x) * y; t += s; w = w }
    let mut module = Module::default();
    let types = [("i", Type::Int), ("s", Type::Real), ("t", Type::Real), ("w", Type::Real), ("x", Type::Real)];
    let mut b = FunctionBuilder::new("turn", types.map(|(n, t)| Parameter::new(n, t)).to_vec());
    let p = b.params();
    let sin = b.unary(Unary::Sin, p[4]);
    let term = b.mul(sin, p[3]);
    let s = b.add(p[1], term);
    let t = b.add(p[2], s);
    let turn = module.add(b.finish([("s".into(), s), ("t".into(), t), ("w".into(), p[3])]));
    let mut b = FunctionBuilder::new("f", vec![Parameter::new("n", Type::Int), Parameter::real("x")]);
    let p = b.params();
    let (zero, two) = (b.real(0.0), b.real(2.0));
    let results = b.loop_(p[0], turn, vec![zero, zero, two], vec![p[1]]);
    let f = module.add(b.finish([("s".into(), results[0]), ("w".into(), results[2])]));
    validate(&module).unwrap();
    let args = [Scalar::Int(4), Scalar::Real(0.3)];
    let before = interpret::run(&module, f, &args, Limits::default()).unwrap();
    simplify(&mut module, &[f]);
    assert_eq!(
        print::gml(&module, f),
        "fn f(n: int, x: real) -> (real, real) {\n  let s1 = 2 * sin(x)\n  \
         let s4 = fold(0, 0..n, |s2, s3| {\n    s2 + s1\n  })\n  (\n    s: s4,\n    w: 2,\n  )\n}\n"
    );
    let body = module.functions.last().unwrap();
    assert_eq!(body.params.len(), 3, "the product is computed before the loop:\n{body}");
    assert_eq!(interpret::run(&module, f, &args, Limits::default()).unwrap(), before);
}

#[test]
fn recursion_is_bounded_and_calls_are_inlined() {
    // fact(n) = if n <= 1 { 1 } else { n * fact(n - 1) }
    let mut module = Module::default();
    let int = || vec![Parameter::new("n", Type::Int)];
    let fact = module.reserve();
    let mut b = FunctionBuilder::new("one", int());
    let one = b.int(1);
    let then = module.add(b.finish([("r".into(), one)]));
    let mut b = FunctionBuilder::new("more", int());
    let n = b.param(0);
    let one = b.int(1);
    let less = b.sub(n, one);
    let rest = b.call(fact, vec![less], &[Type::Int])[0];
    let product = b.mul(n, rest);
    let otherwise = module.add(b.finish([("r".into(), product)]));
    let mut b = FunctionBuilder::new("fact", int());
    let n = b.param(0);
    let one = b.int(1);
    let c = b.compare(Compare::Le, n, one);
    let r = b.if_(c, then, otherwise, vec![n], &[Type::Int]);
    module.define(fact, b.finish([("r".into(), r[0])]));
    let mut b = FunctionBuilder::new("twice", int());
    let n = b.param(0);
    let r = b.call(fact, vec![n], &[Type::Int])[0];
    let sum = b.add(r, r);
    let twice = module.add(b.finish([("r".into(), sum)]));
    let mut b = FunctionBuilder::new("root", int());
    let n = b.param(0);
    let r = b.call(twice, vec![n], &[Type::Int])[0];
    let root = module.add(b.finish([("r".into(), r)]));
    inline(&mut module, &[root]).unwrap();
    simplify(&mut module, &[root]);
    let calls = module.function(root).nodes.iter().filter(|n| matches!(n.op, Op::Call { .. })).count();
    assert_eq!(calls, 1, "only the recursive call is left");
    let run = |n| interpret::run(&module, root, &[Scalar::Int(n)], Limits::default());
    assert_eq!(run(5), Ok(vec![Scalar::Int(240)]));
    assert!(matches!(run(1 << 40), Err(RunError::Depth(_))));
    let few = Limits { steps: 20, ..Limits::default() };
    assert!(matches!(interpret::run(&module, root, &[Scalar::Int(50)], few), Err(RunError::Steps(_))));
    let few = Limits { memory: 30, ..Limits::default() };
    assert!(matches!(interpret::run(&module, root, &[Scalar::Int(50)], few), Err(RunError::Memory(_))));
}

#[test]
fn inlining_stops_at_the_limit() {
    // f0(x) = sin(x) + x; f(k+1)(x) = f(k)(f(k)(x)) + f(k)(x + 1): grows threefold each.
    let mut module = Module::default();
    let mut b = FunctionBuilder::new("f0", reals(&["x"]));
    let x = b.param(0);
    let s = b.unary(Unary::Sin, x);
    let r = b.add(s, x);
    let mut f = module.add(b.finish([("r".into(), r)]));
    for k in 1..40 {
        let mut b = FunctionBuilder::new(format!("f{k}"), reals(&["x"]));
        b.set_span(Span { start: k, ..Span::default() });
        let x = b.param(0);
        let once = b.call(f, vec![x], &[Type::Real])[0];
        let twice = b.call(f, vec![once], &[Type::Real])[0];
        let one = b.real(1.0);
        let next = b.add(x, one);
        let other = b.call(f, vec![next], &[Type::Real])[0];
        let r = b.add(twice, other);
        f = module.add(b.finish([("r".into(), r)]));
    }
    module.limits = SizeLimits { nodes: 10_000, ..SizeLimits::default() };
    let error = inline(&mut module, &[f]).unwrap_err();
    assert!(matches!(error, SizeError::TooLarge { .. }), "{error}");
    validate(&module).unwrap();
}

#[test]
fn a_non_finite_result_is_traced_to_its_origin() {
    // In the second turn of the loop, ln(x - 1) of x = 1 is -infinity; the arm that is not selected is no fault.
    let mut module = Module::default();
    let at = |start| Span { start, ..Span::default() };
    let mut b = FunctionBuilder::new("turn", vec![Parameter::new("i", Type::Int), Parameter::real("x")]);
    let p = b.params();
    let one = b.real(1.0);
    let less = b.sub(p[1], one);
    b.set_span(at(7));
    let ln = b.unary(Unary::Ln, less);
    b.set_span(at(8));
    let i = b.unary(Unary::ToReal, p[0]);
    let r = b.add(ln, i);
    let turn = module.add(b.finish([("x".into(), r)]));
    let mut b = FunctionBuilder::new("f", reals(&["x", "y"]));
    let p = b.params();
    let n = b.int(2);
    b.set_span(at(1));
    let inverse = {
        let one = b.real(1.0);
        b.div(one, p[1])
    };
    b.set_span(at(2));
    let c = b.compare(Compare::Lt, p[0], inverse);
    let x = b.select(c, inverse, p[0]);
    b.set_span(at(3));
    let r = b.loop_(n, turn, vec![x], vec![])[0];
    let three = b.real(3.0);
    let r = b.add(r, three);
    let f = module.add(b.finish([("r".into(), r)]));
    let find = |x: f64, y: f64| {
        let args = [Scalar::Real(x), Scalar::Real(y)];
        interpret::non_finite(&module, f, &args, Limits::default(), None).unwrap().map(|s| s.start)
    };
    let e = std::f64::consts::E;
    assert_eq!(find(20.0, 1.0), None);
    assert_eq!(find(1.0 + e, 1.0), Some(7), "ln(0) in the second turn");
    assert_eq!(find(1.0, 0.0), Some(1), "1 / 0 is selected");
    assert_eq!(find(20.0, -0.0), None, "-infinity is not");
}

#[test]
fn malformed_functions_are_rejected() {
    use validate::Problem;
    let node = |op, ty| Node { op, ty, span: Span::default() };
    let real = |x: f64| node(Op::Real(x.to_bits()), Type::Real);
    let param = || node(Op::Param(0), Type::Real);
    let check = |nodes: Vec<Node>, results: Vec<u32>| {
        let names = results.iter().map(|r| r.to_string()).collect();
        let results = results.into_iter().map(Value).collect();
        let function = Function { name: "f".into(), params: reals(&["x"]), nodes, results, result_names: names };
        let module = Module { functions: vec![function], ..Module::default() };
        validate(&module).map_err(|e| e.problem)
    };
    let (v0, v1, f0) = (Value(0), Value(1), FunctionId(0));
    assert_eq!(check(vec![param(), real(1.0)], vec![1]), Ok(()));
    assert_eq!(check(vec![real(1.0)], vec![0]), Err(Problem::Parameters));
    assert_eq!(check(vec![], vec![]), Err(Problem::Parameters));
    assert_eq!(check(vec![param(), param()], vec![0]), Err(Problem::Parameters));
    assert_eq!(check(vec![param(), node(Op::Unary(Unary::Sin, v1), Type::Real)], vec![0]), Err(Problem::Order));
    assert_eq!(check(vec![param()], vec![3]), Err(Problem::Results));
    assert_eq!(check(vec![param(), node(Op::Unary(Unary::Not, v0), Type::Bool)], vec![1]), Err(Problem::Types));
    assert_eq!(check(vec![param(), node(Op::Compare(Compare::Lt, v0, v0), Type::Real)], vec![1]), Err(Problem::Types));
    let call = |function, args: Vec<Value>| node(Op::Call { function, args }, Type::Multi);
    assert_eq!(check(vec![param(), call(FunctionId(9), vec![v0])], vec![0]), Err(Problem::Reference));
    assert_eq!(check(vec![param(), call(f0, vec![])], vec![0]), Err(Problem::Signature));
    assert_eq!(check(vec![param(), call(f0, vec![v0])], vec![0]), Ok(()));
    assert_eq!(check(vec![param(), call(f0, vec![v0])], vec![1]), Err(Problem::Results));
    let third = node(Op::Project(v1, 3), Type::Real);
    assert_eq!(check(vec![param(), call(f0, vec![v0]), third], vec![2]), Err(Problem::Reference));
    assert_eq!(check(vec![param(), node(Op::Project(v0, 0), Type::Real)], vec![1]), Err(Problem::Types));
    let truth = node(Op::Bool(true), Type::Bool);
    let itself = node(Op::If { condition: v1, then: f0, otherwise: f0, args: vec![v0] }, Type::Multi);
    assert_eq!(check(vec![param(), truth.clone(), itself], vec![0]), Err(Problem::Recursion));
    let guard = node(Op::Guard { value: v0, condition: v1, failure: FailureId(0) }, Type::Real);
    assert_eq!(check(vec![param(), truth, guard], vec![2]), Err(Problem::Reference));
    let seeds = vec![(0, v0), (0, v0)];
    let tangent = node(Op::Tangent { function: f0, args: vec![v0], seeds }, Type::Multi);
    assert_eq!(check(vec![param(), tangent], vec![0]), Err(Problem::Signature));
}
