//! The special points, as LANGUAGE fixes them: a tangent that is zero stays zero, any other is not hidden.

use super::super::*;
use crate::ir::SizeLimits;
use crate::ir::tests::{function_of, run};
use crate::ir::{Binary, Compare, Unary};

type Make<'a> = &'a dyn Fn(&mut FunctionBuilder, &[Value]) -> Value;

/// The tangent of f(x, y) forward, and what the pullback of the adjoint 1 gives with the same directions.
fn forward(make: Make<'_>, at: [f64; 2], direction: [f64; 2]) -> f64 {
    let (mut module, f) = function_of(&["x", "y"], make);
    let id = tangent(&mut module, f, &[0, 1]).unwrap();
    run(&module, id, &[at, direction].concat())[1]
}

fn gradient(make: Make<'_>, at: [f64; 2], adjoint: f64) -> Vec<f64> {
    let (mut module, f) = function_of(&["x", "y"], make);
    let id = pullback(&mut module, f, &[0, 1], false).unwrap();
    run(&module, id, &[&at[..], &[adjoint]].concat())
}

#[test]
fn the_slope_of_abs_at_zero_is_zero() {
    let make: Make<'_> = &|b, p| b.unary(Unary::Abs, p[0]);
    assert_eq!(forward(make, [0.0, 0.0], [1.0, 0.0]), 0.0);
    assert_eq!(gradient(make, [0.0, 0.0], 1.0), [0.0, 0.0]);
    assert_eq!(gradient(make, [-2.0, 0.0], 1.0), [-1.0, 0.0]);
}

#[test]
fn ties_are_split_in_half() {
    for op in [Binary::Min, Binary::Max] {
        let make: Make<'_> = &|b, p| b.binary(op, p[0], p[1]);
        assert_eq!(forward(make, [2.0, 2.0], [1.0, 0.0]), 0.5);
        assert_eq!(forward(make, [2.0, 2.0], [3.0, 1.0]), 2.0);
        assert_eq!(gradient(make, [2.0, 2.0], 1.0), [0.5, 0.5]);
        let first = if op == Binary::Min { [1.0, 0.0] } else { [0.0, 1.0] };
        assert_eq!(gradient(make, [1.0, 2.0], 1.0), first);
    }
}

#[test]
fn at_a_pole_a_zero_tangent_is_zero_and_any_other_is_seen() {
    let poles: [(&str, Make<'_>, [f64; 2]); 8] = [
        ("sqrt", &|b, p| b.unary(Unary::Sqrt, p[0]), [0.0, 0.0]),
        ("ln", &|b, p| b.unary(Unary::Ln, p[0]), [0.0, 0.0]),
        ("asin", &|b, p| b.unary(Unary::Asin, p[0]), [1.0, 0.0]),
        ("asin below", &|b, p| b.unary(Unary::Asin, p[0]), [-1.0, 0.0]),
        ("acos", &|b, p| b.unary(Unary::Acos, p[0]), [1.0, 0.0]),
        ("atan2", &|b, p| b.binary(Binary::Atan2, p[0], p[1]), [0.0, 0.0]),
        ("division", &|b, p| b.div(p[1], p[0]), [0.0, 1.0]),
        ("power below 1", &|b, p| b.pow(p[0], p[1]), [0.0, 0.25]),
    ];
    for (name, make, at) in poles {
        assert_eq!(forward(make, at, [0.0, 0.0]), 0.0, "{name}");
        assert!(!forward(make, at, [1.0, 0.0]).is_finite(), "{name}: hidden");
        assert_eq!(gradient(make, at, 0.0), [0.0, 0.0], "{name} in reverse");
        assert!(!gradient(make, at, 1.0)[0].is_finite(), "{name}: hidden in reverse");
    }
}

#[test]
fn the_root_of_a_sum_of_squares_at_zero() {
    // |(x, 0)|: the tangent of x^2 is zero at 0, so that of the root is.
    let make: Make<'_> = &|b, p| {
        let (xx, yy) = (b.mul(p[0], p[0]), b.mul(p[1], p[1]));
        let square = b.add(xx, yy);
        b.unary(Unary::Sqrt, square)
    };
    assert_eq!(forward(make, [0.0, 0.0], [1.0, 2.0]), 0.0);
}

#[test]
fn powers_at_zero() {
    let make: Make<'_> = &|b, p| b.pow(p[0], p[1]);
    assert_eq!(forward(make, [0.0, 3.0], [0.0, 1.0]), 0.0, "by the exponent");
    assert_eq!(forward(make, [0.0, 3.0], [1.0, 1.0]), 0.0, "by both");
    assert_eq!(forward(make, [0.0, 1.0], [1.0, 0.0]), 1.0, "x^1");
    assert_eq!(gradient(make, [0.0, 2.5], 1.0), [0.0, 0.0]);
    for (n, slope) in [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)] {
        let whole: Make<'_> = &|b, p| {
            let n = b.real(n);
            b.pow(p[0], n)
        };
        assert_eq!(forward(whole, [0.0, 0.0], [1.0, 0.0]), slope, "x^{n} at 0");
    }
    let cube: Make<'_> = &|b, p| b.pow_int(p[0], 3);
    assert_eq!(forward(cube, [-2.0, 0.0], [1.0, 0.0]), 12.0, "of a negative base");
    let inverse: Make<'_> = &|b, p| b.pow_int(p[0], -2);
    assert_eq!(forward(inverse, [0.0, 0.0], [0.0, 0.0]), 0.0);
    assert!(!forward(inverse, [0.0, 0.0], [1.0, 0.0]).is_finite());
}

#[test]
fn steps_have_no_slope() {
    for op in [Unary::Floor, Unary::Ceil, Unary::Round, Unary::Sign, Unary::Stop] {
        let make: Make<'_> = &|b, p| b.unary(op, p[0]);
        let (mut module, f) = function_of(&["x", "y"], make);
        let (_, pattern) = jacobian(&mut module, f, &[0, 1]).unwrap();
        assert!(pattern.is_empty(), "{op:?}");
    }
}

#[test]
fn the_side_not_taken_is_not_touched() {
    // if x > 0 { x * ln(x) } else { x } at 0, where ln is -infinity: forward and back.
    let make: Make<'_> = &|b, p| {
        let zero = b.real(0.0);
        let c = b.compare(Compare::Gt, p[0], zero);
        let ln = b.unary(Unary::Ln, p[0]);
        let product = b.mul(ln, p[0]);
        b.select(c, product, p[0])
    };
    assert_eq!(forward(make, [0.0, 0.0], [1.0, 0.0]), 1.0);
    assert_eq!(gradient(make, [0.0, 0.0], 1.0), [1.0, 0.0]);
    assert_eq!(gradient(make, [1.0, 0.0], 1.0), [1.0, 0.0]);
    // The same with a pole behind a pole, and twice differentiated.
    let make: Make<'_> = &|b, p| {
        let zero = b.real(0.0);
        let c = b.compare(Compare::Gt, p[0], zero);
        let root = b.unary(Unary::Sqrt, p[0]);
        let quotient = b.div(p[1], root);
        b.select(c, quotient, p[1])
    };
    assert_eq!(gradient(make, [0.0, 3.0], 1.0), [0.0, 1.0]);
    let (mut module, f) = function_of(&["x", "y"], make);
    let back = pullback(&mut module, f, &[0, 1], false).unwrap();
    let second = tangent(&mut module, back, &[0, 1]).unwrap();
    let second = run(&module, second, &[0.0, 3.0, 1.0, 1.0, 1.0]);
    assert_eq!(second[2..], [0.0, 0.0], "the Hessian of y");
}

#[test]
fn a_guard_keeps_its_derivative() {
    let mut module = Module::default();
    let failure = module.fail(ir::Failure { span: Span::default(), message: "x is negative".to_owned() });
    let mut b = FunctionBuilder::new("f", vec![Parameter::real("x")]);
    let x = b.param(0);
    let zero = b.real(0.0);
    let c = b.compare(Compare::Le, zero, x);
    let x = b.guard(x, c, failure);
    let r = b.pow_int(x, 2);
    let f = module.add(b.finish([("r".to_owned(), r)]));
    let (id, _) = jacobian(&mut module, f, &[0]).unwrap();
    assert_eq!(run(&module, id, &[3.0]), [9.0, 6.0]);
    let failed = ir::interpret::run_real(&module, id, &[-1.0], ir::interpret::Limits::default());
    assert_eq!(failed, Err(ir::interpret::RunError::Failed(failure)));
}

#[test]
fn a_function_that_needs_its_own_derivative_is_an_error() {
    let mut module = Module::default();
    let f = module.reserve();
    let mut b = FunctionBuilder::new("f", vec![Parameter::real("x")]);
    let x = b.param(0);
    let one = b.real(1.0);
    let r = b.tangent(f, vec![x], vec![(0, one)], 1)[0];
    module.define(f, b.finish([("r".to_owned(), r)]));
    let mut b = FunctionBuilder::new("g", vec![Parameter::real("x")]);
    let r = b.call(f, vec![b.param(0)], &[Type::Real]);
    let g = module.add(b.finish([("r".to_owned(), r[0])]));
    assert!(matches!(expand(&mut module, &[g]), Err(DiffError::Recursive { .. })));
}

#[test]
fn a_long_loop_in_reverse_is_halved() {
    // s = (s + x) / 2 + 1 / (i + 1), n = 1000 turns known only at run time; against the tangent.
    let mut module = Module::default();
    let params = vec![Parameter::new("i", Type::Int), Parameter::real("s"), Parameter::real("x")];
    let mut b = FunctionBuilder::new("turn", params);
    let (half, one) = (b.real(0.5), b.real(1.0));
    let sin = b.unary(Unary::Sin, b.param(1));
    let sum = b.add(sin, b.param(2));
    let mean = b.mul(half, sum);
    let i = b.unary(Unary::ToReal, b.param(0));
    let i = b.add(i, one);
    let term = b.div(one, i);
    let s = b.add(mean, term);
    let turn = module.add(b.finish([("s".to_owned(), s)]));
    let mut b =
        FunctionBuilder::new("f", vec![Parameter::new("n", Type::Int), Parameter::real("s"), Parameter::real("x")]);
    let r = b.loop_(b.param(0), turn, vec![b.param(1)], vec![b.param(2)])[0];
    let f = module.add(b.finish([("r".to_owned(), r)]));
    let back = pullback(&mut module, f, &[1, 2], false).unwrap();
    let there = tangent(&mut module, f, &[1, 2]).unwrap();
    for n in [-1, 0, 1, 2, 3, 7, 8, 1000] {
        let back = crate::ir::tests::run_with(&module, back, n, &[0.3, 0.7, 1.0]);
        for (k, v) in [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
            let there = crate::ir::tests::run_with(&module, there, n, &[0.3, 0.7, v[0], v[1]])[1];
            assert!((there - back[k]).abs() <= 1e-13 * (1.0 + there.abs()), "{n} turns: {there}, {}", back[k]);
        }
    }
}

/// f(x, k) = if x < k { d/dx (x^3 k) } else { x }, differentiated again by x and by k: 6 x k and 3 x^2, or 1 and 0.
#[test]
fn a_derivative_inside_a_branch_is_expanded_and_differentiated() {
    let mut module = Module::default();
    let params = || vec![Parameter::real("x"), Parameter::real("k")];
    let mut b = FunctionBuilder::new("cube", params());
    let cube = b.pow_int(b.param(0), 3);
    let r = b.mul(cube, b.param(1));
    let cube = module.add(b.finish([("r".to_owned(), r)]));
    let mut b = FunctionBuilder::new("slope", params());
    let one = b.real(1.0);
    let r = b.tangent(cube, b.params(), vec![(0, one)], 1)[0];
    let then = module.add(b.finish([("r".to_owned(), r)]));
    let mut b = FunctionBuilder::new("itself", params());
    let x = b.param(0);
    // Long enough not to be made a selection.
    let mut r = x;
    for _ in 0..3 {
        let s = b.unary(Unary::Sinh, r);
        r = b.unary(Unary::Ln, s);
    }
    let otherwise = module.add(b.finish([("r".to_owned(), r)]));
    let mut b = FunctionBuilder::new("f", params());
    let c = b.compare(Compare::Lt, b.param(0), b.param(1));
    let r = b.if_(c, then, otherwise, b.params(), &[Type::Real])[0];
    let f = module.add(b.finish([("r".to_owned(), r)]));
    expand(&mut module, &[f]).unwrap();
    assert_eq!(run(&module, f, &[2.0, 5.0]), [60.0]);
    let (id, pattern) = jacobian(&mut module, f, &[0, 1]).unwrap();
    assert_eq!(pattern, [Entry { result: 0, param: 0 }, Entry { result: 0, param: 1 }]);
    assert_eq!(run(&module, id, &[2.0, 5.0]), [60.0, 60.0, 12.0]);
    assert_eq!(run(&module, id, &[6.0, 5.0])[2], 0.0);
}

/// Derivatives of ever higher order of sin(x) ln(x) grow; the limit on size ends that with an error.
#[test]
fn derivatives_without_end_meet_the_limit() {
    let mut module = Module::default();
    let mut b = FunctionBuilder::new("f0", vec![Parameter::real("x")]);
    let x = b.param(0);
    let (mut r, one) = (x, b.real(1.0));
    for _ in 0..12 {
        let s = b.unary(Unary::Sin, r);
        let t = b.add(s, one);
        let q = b.div(t, r);
        r = b.pow(q, x);
    }
    let mut f = module.add(b.finish([("r".to_owned(), r)]));
    for k in 1..60 {
        let mut b = FunctionBuilder::new(format!("f{k}"), vec![Parameter::real("x")]);
        let (x, one) = (b.param(0), b.real(1.0));
        let r = b.tangent(f, vec![x], vec![(0, one)], 1)[0];
        f = module.add(b.finish([("r".to_owned(), r)]));
    }
    module.limits = SizeLimits { nodes: 10_000, ..SizeLimits::default() };
    assert!(matches!(expand(&mut module, &[f]), Err(DiffError::Size(_))));
}
