//! The special points of differentiation in whole programs, forward and in reverse: a tangent that is zero stays zero,
//! and any other is reported with its place in the source. (Rules of single operations:
//! compiler/src/diff/tests/special.rs.)

use crate::common::program;
use gml_compiler::program::{Order, Program, Sites};

/// A model whose height is an expression of a parameter `a` and of `u`.
fn height(expression: &str) -> Program {
    let text = format!(
        "model m {{\n  param a: real = 0; param b: real = 2\n  part p = |u, v| (u * 1mm, v * 1mm, 1mm * ({expression}))\n}}\n"
    );
    program("m.gml", &text)
}

/// The derivatives of the height with respect to a and b at u, v = 0.5, from the Jacobian at the point and on a grid,
/// and from the pullback; or the error message.
fn slopes(program: &Program, a: f64, u: f64) -> [Result<[f64; 2], String>; 3] {
    let instance = program.instantiate(&[a, 2.0]).unwrap_or_else(|e| panic!("{}", e.message));
    let active = program.parts()[0].active.clone();
    let jacobian = |sites: Sites<'_>| {
        let mut dense = vec![0.0; 3 * active.len()];
        instance.evaluate(0, sites, Order::Jacobian, &mut dense).map(|()| {
            let mut slopes = [0.0; 2];
            active.iter().zip(dense.chunks_exact(3)).for_each(|(p, d)| slopes[*p as usize] = d[2]);
            slopes
        })
    };
    let mut back = [0.0; 2];
    let order = Order::Pullback(&[[0.0, 0.0, 1.0]]);
    let reverse = instance.evaluate(0, Sites::Scattered(&[u], &[0.5]), order, &mut back).map(|()| back);
    let (batch, grid) = (jacobian(Sites::Scattered(&[u], &[0.5])), jacobian(Sites::Grid(&[u], &[0.5])));
    [batch, grid, reverse].map(|r| r.map_err(|e| e.message))
}

#[track_caller]
fn equal(expression: &str, a: f64, u: f64, expected: [f64; 2]) {
    for found in slopes(&height(expression), a, u) {
        assert_eq!(found.as_ref(), Ok(&expected), "{expression} at a = {a}, u = {u}");
    }
}

#[track_caller]
fn reported(expression: &str, a: f64, u: f64, place: &str) {
    for found in slopes(&height(expression), a, u) {
        let message = found.expect_err(expression);
        assert!(message.contains("the derivative of") && message.contains(place), "{expression}: {message}");
        assert!(message.starts_with("m.gml:3:"), "{expression}: {message}");
    }
}

#[test]
fn kinks_have_the_slope_between() {
    equal("abs(a)", 0.0, 0.5, [0.0, 0.0]);
    equal("max(a, -a)", 0.0, 0.5, [0.0, 0.0]);
    equal("min(a, 3 * a)", 0.0, 0.5, [2.0, 0.0]);
    equal("max(a, b)", 2.0, 0.5, [0.5, 0.5]);
    equal("min(a * u, b * u)", 2.0, 0.5, [0.25, 0.25]);
}

#[test]
fn a_zero_tangent_stays_zero_at_a_pole() {
    equal("sqrt(a * a)", 0.0, 0.5, [0.0, 0.0]);
    equal("sqrt(a * u)", 1.0, 0.0, [0.0, 0.0]);
    equal("sqrt(a ^ 2 + (u * b) ^ 2)", 0.0, 0.0, [0.0, 0.0]);
    equal("b * asin(1 + a ^ 2 * u) / 1rad", 0.0, 0.0, [0.0, std::f64::consts::FRAC_PI_2]);
    equal("acos(-1 + a ^ 2) / 1rad + b", 0.0, 0.5, [0.0, 1.0]);
    equal("atan2(a ^ 2, a ^ 3 * b) / 1rad", 0.0, 0.5, [0.0, 0.0]);
}

#[test]
fn any_other_tangent_is_reported() {
    reported("sqrt(a * b)", 0.0, 0.5, "sqrt(a * b)");
    reported("sqrt(a * u)", 0.0, 0.5, "sqrt(a * u)");
    reported("asin(1 - a * u) / 1rad", 0.0, 0.5, "asin(1 - a * u)");
    reported("acos(1 - a) / 1rad", 0.0, 0.5, "acos(1 - a)");
    reported("asin(a * u - 1) / 1rad", 0.0, 0.5, "asin(a * u - 1)");
    reported("atan2(a * u, a * b) / 1rad", 0.0, 0.5, "atan2(a * u, a * b)");
    reported("(a * u) ^ 0.5 * b", 0.0, 0.5, "(a * u) ^ 0.5");
}

#[test]
fn powers_at_zero() {
    // The derivative with respect to the exponent is 0, that with respect to the base is 0 if the exponent is above 1.
    equal("a ^ b", 0.0, 0.5, [0.0, 0.0]);
    equal("(a * u) ^ b", 1.0, 0.0, [0.0, 0.0]);
    // An integer exponent has its own rule: negative bases have powers.
    equal("a ^ 3", -2.0, 0.5, [12.0, 0.0]);
    equal("a ^ 2", 0.0, 0.5, [0.0, 0.0]);
    equal("a ^ 1", 0.0, 0.5, [1.0, 0.0]);
    equal("a ^ 0 + b", 0.0, 0.5, [0.0, 1.0]);
}

#[test]
fn the_side_that_is_not_taken_is_not_touched() {
    equal("if a > 0 { sqrt(a) } else { b * a }", 0.0, 0.5, [2.0, 0.0]);
    equal("if u > 0 { ln(u * b) * a } else { a }", 3.0, 0.0, [1.0, 0.0]);
    equal("if a * u > 0 { b / (a * u) } else { b }", 0.0, 0.5, [0.0, 1.0]);
}

/// The value itself is not a number there: the message says so.
#[test]
fn a_quotient_by_zero_is_reported() {
    let program = height("b / (a * u)");
    let instance = program.instantiate(&[0.0, 2.0]).unwrap();
    let mut out = [0.0; 3];
    let message = instance.evaluate(0, Sites::Scattered(&[0.5], &[0.5]), Order::Points, &mut out).unwrap_err().message;
    assert!(message.contains("(b / (a * u))` is not a finite number"), "{message}");
    let message =
        instance.evaluate(0, Sites::Scattered(&[0.5], &[0.5]), Order::Jacobian, &mut [0.0; 6]).unwrap_err().message;
    assert!(message.starts_with("m.gml:3:") && message.contains("b / (a * u)"), "{message}");
}
