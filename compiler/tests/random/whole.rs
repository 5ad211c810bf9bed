//! Whole numbers that are too large, and numbers of which there is no whole one: the constants of the checker, the
//! interpreter of sessions, that of lowered functions and native code agree on the value, or all fail.

use crate::common;
use crate::oracle::Oracle;
use gml_compiler::program::{Order, Sites};
use gml_compiler::session::{Options, Session};
use gml_compiler::source::NoFiles;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

const OPERATIONS: [&str; 10] = [
    "int(a)",
    "floor(a)",
    "ceil(a)",
    "round(a)",
    "-int(a)",
    "abs(int(a))",
    "int(a) + int(b)",
    "int(a) - int(b)",
    "int(a) * int(b)",
    "int(a) % int(b)",
];

/// The value by the rules of the language.
fn expected(operation: &str, a: f64, b: f64) -> Option<f64> {
    let whole = |x: f64| (x >= -(2f64.powi(63)) && x < 2f64.powi(63)).then_some(x as i64);
    let value = match operation {
        "int(a)" => whole(a)?,
        "floor(a)" => whole(a.floor())?,
        "ceil(a)" => whole(a.ceil())?,
        "round(a)" => whole(a.round())?,
        "-int(a)" => whole(a)?.checked_neg()?,
        "abs(int(a))" => whole(a)?.checked_abs()?,
        "int(a) + int(b)" => whole(a)?.checked_add(whole(b)?)?,
        "int(a) - int(b)" => whole(a)?.checked_sub(whole(b)?)?,
        "int(a) * int(b)" => whole(a)?.checked_mul(whole(b)?)?,
        _ => {
            let (a, b) = (whole(a)?, whole(b)?);
            let r = a.checked_rem(b).or((b == -1).then_some(0))?;
            if r != 0 && (r < 0) != (b < 0) { r + b } else { r }
        }
    };
    Some(value as f64)
}

/// A number as a script has it.
fn literal(x: f64) -> String {
    match x {
        x if x.is_nan() => "(0.0 / 0.0)".to_owned(),
        x if x.is_infinite() => format!("({}1.0 / 0.0)", if x < 0.0 { "-" } else { "" }),
        // Debug has a point in every number.
        x => format!("({x:?})"),
    }
}

fn check(a: f64, b: f64) {
    let params = "  param a: real = 1\n  param b: real = 1\n";
    for operation in OPERATIONS {
        let expected = expected(operation, a, b);
        let agrees = |way: &str, found: Result<f64, String>| match (&found, expected) {
            (Ok(found), Some(expected)) => assert_eq!(*found, expected, "{way}: {operation} of {a:e}, {b:e}"),
            (Err(_), None) => {}
            _ => panic!("{way}: {operation} of {a:e}, {b:e} is {found:?}, not {expected:?}"),
        };
        let stopped = operation.replace("(a)", "(stop(a))").replace("(b)", "(stop(b))");
        let text = format!("model m {{\n{params}  part p = |u, v| (real({stopped}) * 1mm, u * 1mm, v * 1mm)\n}}\n");
        let oracle = Oracle::new(&text).unwrap_or_else(|e| panic!("{e}"));
        agrees("interpreter", oracle.point(0, &[a, b], [0.5, 0.5]).map(|p| p[0]));
        let program = common::program("whole.gml", &text);
        let mut point = [0.0; 3];
        let native = program.instantiate(&[a, b]).map_err(|e| e.message).and_then(|instance| {
            let sites = Sites::Scattered(&[0.5], &[0.5]);
            instance.evaluate(0, sites, Order::Points, &mut point).map_err(|e| e.message)
        });
        agrees("native code", native.map(|()| point[0]));
        let known = operation.replace("(a)", &literal(a)).replace("(b)", &literal(b));
        let called = format!("(|a: real, b: real| {operation})({}, {})", literal(a), literal(b));
        for text in [known, called] {
            let mut session = Session::new(Options::default());
            let answers = session.enter(&text, &NoFiles).map_err(|e| e.to_string());
            let value = |text: String| text.parse().map_err(|_| text);
            let shown = |answers: Vec<gml_compiler::session::Answer>| {
                answers.last().and_then(|a| a.value.as_ref()).map_or(Err(String::new()), |v| value(v.to_string()))
            };
            agrees(&text, answers.and_then(shown).map(|x: i64| x as f64));
        }
    }
}

#[test]
fn evaluators_agree_on_whole_numbers_at_their_ends() {
    let end = 2f64.powi(63);
    for a in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300, end, -end, end - 1024.0, -end - 2048.0] {
        for b in [-1.0, 2.0, 1024.0, -end] {
            check(a, b);
        }
    }
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]);
    let mut runner =
        TestRunner::new_with_rng(Config { failure_persistence: None, cases: 40, ..Config::default() }, rng);
    let number = (0.0..1.0_f64, 0..66_i32, any::<bool>());
    let of = |(x, bits, minus): (f64, i32, bool)| {
        let x = ((1.0 + x) * 2f64.powi(bits)).trunc() + if bits < 40 { 0.5 } else { 0.0 };
        if minus { -x } else { x }
    };
    runner
        .run(&(number.clone(), number), |(a, b)| {
            check(of(a), of(b));
            Ok(())
        })
        .unwrap_or_else(|e| panic!("{e}"));
}
