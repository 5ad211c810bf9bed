//! Scripts, lowered, run by the interpreter and compared with the same formulas in Rust.

use super::lower;
use crate::check::CheckOptions;
use crate::check::typed::Model;
use crate::diagnostic::Severity;
use crate::ir::interpret::{Limits, RunError, run, run_real};
use crate::ir::scalar::Scalar;
use crate::ir::validate::validate;
use crate::ir::{FunctionId, LoweredModel, Op};
use crate::program::check;
use crate::source::{NoFiles, Sources};
use std::collections::BTreeMap;

fn typed(text: &str) -> Model {
    let mut sources = Sources::default();
    let main = sources.add("test.gml", text);
    let (model, diagnostics) = check(&mut sources, &NoFiles, main, &BTreeMap::new(), &CheckOptions::default());
    assert!(diagnostics.iter().all(|d| d.severity == Severity::Warning), "{diagnostics:?} in {text}");
    model.expect("a model")
}

fn lowered(text: &str) -> LoweredModel {
    let lowered = lower(&typed(text)).expect("a model that is not too large");
    validate(&lowered.module).expect("valid functions");
    lowered
}

/// A model of real parameters a and b, with these declarations and a part whose point is the expression's value of
/// u and v (three reals).
fn surface(declarations: &str, point: &str) -> LoweredModel {
    lowered(&format!(
        "model m {{\nparam a: real = 1; param b: real = 1\n{declarations}\n\
         part p = |u, v| {{ let q = {point}\n q * 1mm }}\n}}"
    ))
}

fn at(model: &LoweredModel, args: [f64; 4]) -> Result<Vec<f64>, RunError> {
    let [a, b, u, v] = args;
    let surface = &model.parts[0].surface;
    run_real(&model.module, surface.function, &surface.arguments(&[a, b], &[u, v]), Limits::default())
}

/// The surface agrees with the formula at some points to rounding errors.
fn agrees(model: &LoweredModel, formula: impl Fn(f64, f64, f64, f64) -> [f64; 3]) {
    for args in [[1.0, 2.0, 0.0, 0.0], [0.5, -1.5, 0.25, 0.75], [-2.25, 3.5, 1.0, 0.125], [7.0, 0.0, 0.5, 1.0]] {
        let [a, b, u, v] = args;
        let expected = formula(a, b, u, v);
        let got = at(model, args).expect("it runs");
        for (x, y) in got.iter().zip(expected) {
            assert!((x - y).abs() <= 1e-12 * y.abs().max(1.0), "{got:?} is not {expected:?} at {args:?}");
        }
    }
}

/// Whether an operation occurs in the part's function or one that it reaches.
fn occurs(model: &LoweredModel, wanted: impl Fn(&Op) -> bool) -> bool {
    let (mut open, mut seen) = (vec![model.parts[0].surface.function], Vec::new());
    while let Some(id) = open.pop() {
        if seen.contains(&id) {
            continue;
        }
        seen.push(id);
        for node in &model.module.function(id).nodes {
            if wanted(&node.op) {
                return true;
            }
            open.extend(node.op.functions());
        }
    }
    false
}

fn failure(model: &LoweredModel, args: [f64; 4]) -> String {
    match at(model, args) {
        Err(RunError::Failed(id)) => model.module.failures[id.0 as usize].message.clone(),
        other => panic!("expected a failure, not {other:?}"),
    }
}

#[test]
fn tuples_and_operators() {
    let model = surface(
        "let p = (a, b, a * b)\nlet q = (p + (1, 2, 3)) * b - p / 2",
        "(q.x + u, -q.y * v, q.z % 3 + (u - 2) ^ 3 + 2 ^ v)",
    );
    agrees(&model, |a, b, u, v| {
        let q = [(a + 1.0) * b - a / 2.0, (b + 2.0) * b - b / 2.0, (a * b + 3.0) * b - a * b / 2.0];
        [q[0] + u, -q[1] * v, q[2].rem_euclid(3.0) + (u - 2.0).powi(3) + 2f64.powf(v)]
    });
}

#[test]
fn functions_closures_and_records() {
    let model = surface(
        "fn line(p, q) = |t| p + (q - p) * t\n\
         let lines = [line((a, b), (b, a)), line((0.0, 1.0), (a, a))]\n\
         let r = {first: lines[0], factor: 2.0 * a}",
        "((r.first)(u).x * r.factor, lines[1](v).y, lines[0](u).y)",
    );
    agrees(&model, |a, b, u, v| [(a + (b - a) * u) * 2.0 * a, 1.0 + (a - 1.0) * v, b + (a - b) * u]);
}

#[test]
fn a_side_that_may_fail_is_run_only_where_taken() {
    let model = surface("", "(if a > 0 { sqrt(a) } else { 0.0 }, if b > 0 { u } else { -v }, 0.0)");
    assert!(occurs(&model, |op| matches!(op, Op::If { .. })), "the square root is not cheap");
    assert!(occurs(&model, |op| matches!(op, Op::Select(..))), "a parameter and a negation are");
    agrees(&model, |a, b, u, v| [a.max(0.0).sqrt(), if b > 0.0 { u } else { -v }, 0.0]);
}

#[test]
fn sides_see_what_is_outside() {
    let model = surface(
        "let k = 3.0\nlet p = (a, b)",
        "(if u > 0.5 { let q = p * k\n sqrt(abs(q.x + q.y)) } else { sqrt(abs(p.x)) / (1 + v) }, 0.0, 0.0)",
    );
    agrees(&model, |a, b, u, v| {
        [if u > 0.5 { (3.0 * (a + b)).abs().sqrt() } else { a.abs().sqrt() / (1.0 + v) }, 0.0, 0.0]
    });
}

#[test]
fn long_folds_are_loops() {
    let model =
        surface("", "(fold(a, 5..1005, |acc, i| acc + b * u * i), fold((0.0, 1.0), 0..200, |(x, y), i| (y, x)).x, v)");
    assert!(occurs(&model, |op| matches!(op, Op::Loop { .. })), "a thousand turns are not written out");
    agrees(&model, |a, b, u, v| {
        let sum: f64 = (5..1005).map(|i| b * u * f64::from(i)).sum();
        [a + sum, 0.0, v]
    });
}

#[test]
fn folds_of_run_time_bounds() {
    let model = surface("let n = floor(stop(a))", "(fold(0.0, -1..n, |acc, i| acc + i), 0.0, 0.0)");
    agrees(&model, |a, _, _, _| {
        let n = a.floor() as i32;
        [(-1..n).map(f64::from).sum(), 0.0, 0.0]
    });
}

#[test]
fn indices_of_run_time() {
    let model = surface(
        "let xs = [(1.0, a), (2.0, b), (3.0, a * b), (4.0, 0.0), (5.0, 1.0)]\nlet n = floor(stop(b))",
        "(xs[n].x, xs[n].y, xs[2].y)",
    );
    for (b, expected) in [(0.0, [1.0, 7.0, 0.0]), (1.5, [2.0, 1.5, 10.5]), (4.0, [5.0, 1.0, 28.0])] {
        assert_eq!(at(&model, [7.0, b, 0.0, 0.0]), Ok(expected.to_vec()));
    }
    for b in [-0.5, 5.0, 1e18] {
        assert!(failure(&model, [7.0, b, 0.0, 0.0]).starts_with("index out of range"), "at {b}");
    }
    for b in [1e300, f64::NEG_INFINITY, f64::NAN] {
        assert!(failure(&model, [7.0, b, 0.0, 0.0]).starts_with("this is no whole number"), "at {b}");
    }
}

#[test]
fn recursion_of_run_time() {
    let text = "fn steps(x: real) -> real = if x < 1 { x } else { 1 + steps(x / 2) }\n\
                model m { param a: real = 1; param b: real = 1\n part p = |u, v| (steps(abs(a)) * 1mm, 0mm, 0mm) }";
    agrees(&lowered(text), |a, _, _, _| {
        let (mut x, mut n) = (a.abs(), 0.0);
        while x >= 1.0 {
            (x, n) = (x / 2.0, n + 1.0);
        }
        [x + n, 0.0, 0.0]
    });
}

#[test]
fn remainders_of_whole_numbers() {
    let model = surface("let n = floor(stop(a)); let d = floor(stop(b))", "(real(n % d), real(n % 3), real(-n % 3))");
    assert_eq!(at(&model, [7.0, -4.0, 0.0, 0.0]), Ok(vec![-1.0, 1.0, 2.0]));
    assert!(failure(&model, [7.0, 0.5, 0.0, 0.0]).contains("division by zero"));
}

#[test]
fn bounds_may_name_earlier_parameters() {
    let text = "model m {\n param a: length in 1mm..10mm = 4mm\n let half = a / 2\n param b: length in half..2 * a = 3mm\n \
         param c: real = 0\n part p = |u, v| (a * u, b * v, a * c)\n}";
    let model = lowered(text);
    let bounds = run_real(&model.module, model.bounds, &[6.0, 4.0, 0.0], Limits::default());
    assert_eq!(bounds, Ok(vec![1.0, 10.0, 3.0, 12.0, f64::NEG_INFINITY, f64::INFINITY]));
    let declared = typed(text).params.into_iter().map(|p| p.declared);
    let declared: Vec<_> = declared.map(|p| (p.name, p.default, p.lower, p.upper)).collect();
    let expected = [("a", 4.0, 1.0, 10.0), ("b", 3.0, 2.0, 8.0), ("c", 0.0, f64::NEG_INFINITY, f64::INFINITY)];
    assert_eq!(declared, expected.map(|(name, default, lower, upper)| (name.to_owned(), default, lower, upper)));
}

#[test]
fn requirements() {
    let model = lowered(
        "fn root(x: real) -> real { require x >= 0, \"no root of a negative number\"\n sqrt(x) }\n\
         model m {\n param a: real = 1\n let k = a + 1\n require k > 1, \"first\"\n require a < 5, \"second\"\n \
         part p = |u, v| (root(a - u) * 1mm, 0mm, 0mm)\n}",
    );
    let holds = |id: FunctionId, a: f64| run(&model.module, id, &[Scalar::Real(a)], Limits::default());
    let outcome = |a| model.requires.iter().map(|r| holds(r.condition.function, a)).collect::<Result<Vec<_>, _>>();
    assert_eq!(model.requires.iter().map(|r| r.message.as_str()).collect::<Vec<_>>(), ["first", "second"]);
    assert_eq!(outcome(1.0), Ok(vec![vec![Scalar::Bool(true)], vec![Scalar::Bool(true)]]));
    assert_eq!(outcome(-3.0), Ok(vec![vec![Scalar::Bool(false)], vec![Scalar::Bool(true)]]));
    assert_eq!(outcome(6.0), Ok(vec![vec![Scalar::Bool(true)], vec![Scalar::Bool(false)]]));
    let surface = model.parts[0].surface.function;
    let part = |a: f64, u: f64| run_real(&model.module, surface, &[a, u, 0.0], Limits::default());
    assert_eq!(part(4.25, 0.25), Ok(vec![2.0, 0.0, 0.0]));
    let Err(RunError::Failed(id)) = part(0.5, 1.0) else { panic!("the requirement is not met") };
    assert_eq!(model.module.failures[id.0 as usize].message, "no root of a negative number");
}

#[test]
fn parts_compute_only_what_they_need() {
    let model = lowered(
        "model m {\n param a: real = 1\n let unused = fold(0.0, 0..1000, |acc, i| acc + a * i)\n let used = a + 1\n \
         part p tolerance 0.5mm * a = |u, v| (used * 1mm, 0mm, 0mm)\n}",
    );
    assert!(!occurs(&model, |op| matches!(op, Op::Loop { .. })));
    let tolerance = model.parts[0].tolerance.expect("a tolerance");
    assert_eq!(run_real(&model.module, tolerance, &[3.0], Limits::default()), Ok(vec![1.5]));
}

#[test]
fn of_records_and_arrays_only_what_is_used_is_computed() {
    let model = lowered(
        "fn both(x: real) = { used: x + 1, costly: fold(0.0, 0..1000, |acc, i| acc + x * i) }\n\
         fn several(x: real) = for i in 0..4 { let pair = both(x * i)\n pair }\n\
         model m {\n param a: real = 1\n let all = { first: several(a), rest: several(a + 1) }\n \
         let (left, right) = (all.first, all.rest)\n \
         part p = |u, v| (right[2].used * 1mm, left[1].used * 1mm, 0mm)\n}",
    );
    assert!(!occurs(&model, |op| matches!(op, Op::Loop { .. })));
    let surface = model.parts[0].surface.function;
    let point = run_real(&model.module, surface, &[3.0, 0.0, 0.0], Limits::default());
    assert_eq!(point, Ok(vec![9.0, 4.0, 0.0]));
}

#[test]
fn calls_that_unfold_without_end_are_lowered_all_the_same() {
    // Each function asks the one before for two components, twice.
    let mut functions = "fn f0(x: real) = { a: x, b: 2 * x }\n".to_owned();
    for k in 1..=40 {
        let before = k - 1;
        functions += &format!(
            "fn f{k}(x: real) = {{ a: f{before}(x).b - f{before}(x).a, b: f{before}(x).a + f{before}(x).b / 2 }}\n"
        );
    }
    let model = lowered(&format!(
        "{functions}model m {{ param a: real = 1\n let last = f40(a)\n part p = |u, v| (last.a * 1mm, 0mm, 0mm) }}"
    ));
    let (mut a, mut b) = (1.5, 3.0);
    for _ in 0..40 {
        (a, b) = (b - a, a + b / 2.0);
    }
    let point = at(&model, [1.5, 0.0, 0.0, 0.0]).expect("it runs")[0];
    assert!((point - a).abs() <= 1e-9 * a.abs(), "{point} is not {a}");
}

#[test]
fn too_large_a_model_is_refused() {
    let text = "model m { param a: real = 1\n let xs = for i in 0..2000 { a * i }\n \
                let ys = for i in 0..2000 { xs[floor(stop(a)) + i] }\n part p = |u, v| (sum(ys) * 1mm, 0mm, 0mm) }";
    let mut sources = Sources::default();
    let main = sources.add("test.gml", text);
    let (model, diagnostics) = check(&mut sources, &NoFiles, main, &BTreeMap::new(), &CheckOptions::default());
    assert_eq!(diagnostics, []);
    let error = lower(&model.expect("a model")).expect_err("four million selections are too many");
    assert!(error.to_string().contains("more than 2000000 operations in all"), "{error}");
    let told = format!("{:?}", error.diagnostic());
    assert!(told.contains("the limit 'operations' is 800000 (5/2 of it before"), "{told}");
    assert!(told.contains("--limit operations=1600000"), "{told}");
}
