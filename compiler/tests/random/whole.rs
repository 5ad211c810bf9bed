//! Single operations of whole numbers at their ends, and of what is not a number: every evaluator has the value, or
//! fails where there is none.

use crate::common;
use crate::ways::{Failed, ways};
use gml_compiler::program::{Order, Sites};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};

/// The value of an operation for numbers a and b, by the rules of the language.
type Rule = fn(f64, f64) -> Option<i64>;

fn whole(x: f64) -> Option<i64> {
    (x >= -(2f64.powi(63)) && x < 2f64.powi(63)).then_some(x as i64)
}

/// Of the whole numbers of both.
fn ints(a: f64, b: f64) -> Option<(i64, i64)> {
    Some((whole(a)?, whole(b)?))
}

fn remainder(a: i64, b: i64) -> Option<i64> {
    let r = a.checked_rem(b).or((b == -1).then_some(0))?;
    Some(if r != 0 && (r < 0) != (b < 0) { r + b } else { r })
}

const OPERATIONS: [(&str, Rule); 29] = [
    ("int(a)", |a, _| whole(a)),
    ("floor(a)", |a, _| whole(a.floor())),
    ("ceil(a)", |a, _| whole(a.ceil())),
    ("round(a)", |a, _| whole(a.round())),
    ("-int(a)", |a, _| whole(a)?.checked_neg()),
    ("abs(int(a))", |a, _| whole(a)?.checked_abs()),
    ("int(a) + int(b)", |a, b| ints(a, b).and_then(|(a, b)| a.checked_add(b))),
    ("int(a) - int(b)", |a, b| ints(a, b).and_then(|(a, b)| a.checked_sub(b))),
    ("int(a) * int(b)", |a, b| ints(a, b).and_then(|(a, b)| a.checked_mul(b))),
    ("int(a) % int(b)", |a, b| ints(a, b).and_then(|(a, b)| remainder(a, b))),
    ("min(int(a), int(b))", |a, b| ints(a, b).map(|(a, b)| a.min(b))),
    ("max([int(a), int(b), 5])", |a, b| ints(a, b).map(|(a, b)| a.max(b).max(5))),
    ("sum([int(a), int(b), 3])", |a, b| ints(a, b).and_then(|(a, b)| a.checked_add(b)?.checked_add(3))),
    ("sum([9223372036854775807, int(a)])", |a, _| whole(a)?.checked_add(i64::MAX)),
    ("sum(for i in 0..3 { int(a) + i })", |a, _| {
        let a = whole(a)?;
        a.checked_add(a.checked_add(1)?)?.checked_add(a.checked_add(2)?)
    }),
    ("fold(int(a), 0..3, |s, i| s + int(b))", |a, b| {
        ints(a, b).and_then(|(a, b)| a.checked_add(b)?.checked_add(b)?.checked_add(b))
    }),
    ("loop(int(a), 3, |s, i| s * int(b))", |a, b| {
        ints(a, b).and_then(|(a, b)| a.checked_mul(b)?.checked_mul(b)?.checked_mul(b))
    }),
    // The whole range of a loop is near the end of the whole numbers.
    ("fold(0, int(a)..int(a) + 3, |s, i| s + i % 7)", |a, _| {
        let a = whole(a)?;
        a.checked_add(3)?;
        Some((0..3).map(|i| (a + i).rem_euclid(7)).sum())
    }),
    ("(-1) ^ int(a)", |a, _| Some(1 - 2 * (whole(a)? % 2).abs())),
    ("int(sign(a))", |a, _| if a.is_nan() { None } else { Some(i64::from(a > 0.0) - i64::from(a < 0.0)) }),
    ("int(sign(exp(a)))", |a, _| if a.is_nan() { None } else { Some(i64::from(a.exp() > 0.0)) }),
    ("if (a) == (a) { 1 } else { 2 }", |a, _| Some(if a.is_nan() { 2 } else { 1 })),
    ("if (a) != (a) { 1 } else { 2 }", |a, _| Some(if a.is_nan() { 1 } else { 2 })),
    ("if (a) <= (a) { 1 } else { 2 }", |a, _| Some(if a.is_nan() { 2 } else { 1 })),
    ("if not (a) >= (a) { 1 } else { 2 }", |a, _| Some(if a.is_nan() { 1 } else { 2 })),
    ("if not ((a) < (b)) { 1 } else { 2 }", |a, b| Some(if a < b { 2 } else { 1 })),
    ("if min((a), (b)) <= (b) { 1 } else { 2 }", |a, b| Some(if a.is_nan() || b.is_nan() { 2 } else { 1 })),
    ("if sqrt(a) == sqrt(a) { 1 } else { 2 }", |a, _| Some(if a.sqrt().is_nan() { 2 } else { 1 })),
    ("if abs(a) >= 0 { 1 } else { 2 }", |a, _| Some(if a.is_nan() { 2 } else { 1 })),
];

fn check(values: &[(f64, f64)]) {
    for (operation, rule) in OPERATIONS {
        for (way, found, k) in ways(operation, values) {
            let (a, b) = values[k];
            let expected = rule(a, b).map(|value| value as f64);
            match (&found, expected) {
                (Ok(found), Some(expected)) => assert_eq!(*found, expected, "{way}: {operation} of {a:e}, {b:e}"),
                (Err(Failed { .. }), None) => {}
                _ => panic!("{way}: {operation} of {a:e}, {b:e} is {found:?}, not {expected:?}"),
            }
        }
    }
}

#[test]
fn evaluators_agree_on_whole_numbers_at_their_ends() {
    let end = 2f64.powi(63);
    let mut values = Vec::new();
    for a in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300, end, -end, end - 1024.0, -end - 2048.0] {
        values.extend([-1.0, 2.0, 1024.0, -end, f64::NAN].map(|b| (a, b)));
    }
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]);
    let mut runner = TestRunner::new_with_rng(proptest::test_runner::Config::default(), rng);
    let number = (0.0..1.0_f64, 0..66_i32, any::<bool>()).prop_map(|(x, bits, minus)| {
        let x = ((1.0 + x) * 2f64.powi(bits)).trunc() + if bits < 40 { 0.5 } else { 0.0 };
        if minus { -x } else { x }
    });
    let pairs = prop::collection::vec((number.clone(), number), 40);
    values.extend(pairs.new_tree(&mut runner).expect("pairs").current());
    check(&values);
}

/// What is the same at all points, in a row or in a column is handed to the points, and keeps all of its digits.
#[test]
fn whole_numbers_that_are_handed_to_points_are_exact() {
    let point =
        |uniform: &str, varying: &str| format!("(real(({uniform} - {varying}) % 1000) * 1mm, u * 1mm, v * 1mm)");
    let large = |of: &str| format!("(int(stop({of} * 9007199254740992)) + 9007199254740993)");
    let uniform = point(&large("a"), "int(stop(9 * u * v))");
    let of_row = point(&large("v"), "int(stop(9 * u + 9 * v))");
    let of_column = point(&large("u"), "int(stop(9 * u + 9 * v))");
    let part = |k: usize, point: &str| format!("  part p{k} = |u, v| {point}\n");
    let parts: String = [uniform, of_row, of_column].iter().enumerate().map(|(k, point)| part(k, point)).collect();
    let program = common::program("whole.gml", &format!("model m {{\n  param a: real = 0.5\n{parts}}}\n"));
    let instance = program.instantiate(&[0.5]).expect("parameters");
    let (us, vs) = ([0.25, 0.5, 0.75], [0.5, 1.0]);
    let scaled = |x: f64| (x * 2f64.powi(53)) as i64 + (1 << 53) + 1;
    let expected = |part: usize, u: f64, v: f64| {
        let (x, less) = [(0.5, 9.0 * u * v), (v, 9.0 * u + 9.0 * v), (u, 9.0 * u + 9.0 * v)][part];
        ((scaled(x) - less as i64) % 1000) as f64
    };
    for part in 0..3 {
        let mut points = [0.0; 18];
        instance.evaluate(part, Sites::Grid(&us, &vs), Order::Points, &mut points).expect("points");
        let (all_u, all_v) = Sites::Grid(&us, &vs).expanded();
        for ((u, v), point) in all_u.iter().zip(&all_v).zip(points.chunks(3)) {
            let mut single = [0.0; 3];
            instance.evaluate(part, Sites::Scattered(&[*u], &[*v]), Order::Points, &mut single).expect("a point");
            assert_eq!([point[0], single[0]], [expected(part, *u, *v); 2], "part {part} at {u}, {v}");
        }
    }
}
