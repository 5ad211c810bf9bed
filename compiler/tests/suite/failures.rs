//! Messages for models that cannot be evaluated.

use crate::common::program;
use gml_compiler::program::{Limits, Options, Order, Program, Sites, compile};
use gml_compiler::source::{NoFiles, SourceFile};

/// The error message from instantiating the model and evaluating points of its first part.
fn message(program: &Program, x: &[f64], u: &[f64], v: &[f64]) -> String {
    let instance = match program.instantiate(x) {
        Ok(instance) => instance,
        Err(e) => return e.message,
    };
    let mut out = vec![0.0; 3 * u.len()];
    match instance.evaluate(0, Sites::Scattered(u, v), Order::Points, &mut out) {
        Ok(()) => panic!("{out:?} instead of a failure"),
        Err(e) => e.message,
    }
}

#[test]
fn a_requirement_names_its_place_and_parameters() {
    let script = "model m {\n  param a: real = 1\n  param b: real = 2\n  param c: real = 3\n  require a < b, \"a is too large\"\n  part p = |u, v| (a * 1mm, u * 1mm, c * v * 1mm)\n}\n";
    let program = program("m.gml", script);
    assert!(program.instantiate(&[1.0, 2.0, 3.0]).is_ok());
    insta::assert_snapshot!(message(&program, &[5.0, 2.0, 3.0], &[0.5], &[0.5]), @"m.gml:5:3: a is too large (where a = 5, b = 2)");
}

#[test]
fn of_several_requirements_the_first_that_is_not_met_is_named() {
    let function = "fn shape(a: real) {\n  require a > 0, \"first\"\n  require sqrt(a) > 1, \"second\"\n  |u: real, v: real| (a * 1mm, u * 1mm, v * 1mm)\n}\n";
    let program = program("m.gml", &format!("{function}model m {{\n  param a: real = 4\n  part p = shape(a)\n}}\n"));
    assert!(message(&program, &[-1.0], &[0.5], &[0.5]).starts_with("m.gml:2:3: first"));
    assert!(message(&program, &[0.5], &[0.5], &[0.5]).starts_with("m.gml:3:3: second"));
}

#[test]
fn a_value_that_is_not_finite_is_found_in_the_source() {
    let script = "model m {\n  param a: real = 1\n  part p = |u, v| (sqrt(u - a) * 1mm, u * 1mm, v * 1mm)\n}\n";
    let program = program("m.gml", script);
    insta::assert_snapshot!(message(&program, &[0.5], &[0.75, 0.25], &[0.5, 0.5]), @"m.gml:3:20: `sqrt(u - a)` is not a finite number (in part p; at u = 0.25, v = 0.5; where a = 0.5)");
    let script = "model m {\n  param a: real = 1\n  part p = |u, v| (ln(a) * 1mm, u * 1mm, v * 1mm)\n}\n";
    let program = crate::common::program("m.gml", script);
    insta::assert_snapshot!(message(&program, &[-1.0], &[0.75], &[0.5]), @"m.gml:3:20: `ln(a)` is not a finite number (in part p; at u = 0.75, v = 0.5; where a = -1)");
}

#[test]
fn derivatives_that_are_not_finite_are_found() {
    let script = "model m {\n  param a: real = 1\n  part p = |u, v| (sqrt(a * u) * 1mm, u * 1mm, v * 1mm)\n}\n";
    let program = program("m.gml", script);
    let instance = program.instantiate(&[1.0]).unwrap();
    let mut out = [0.0; 9];
    let error = instance.evaluate(0, Sites::Scattered(&[0.0], &[0.5]), Order::Partials, &mut out).unwrap_err();
    insta::assert_snapshot!(error.message, @"m.gml:3:20: the derivative of `sqrt(a * u)` is not finite (in part p; at u = 0, v = 0.5; where a = 1)");
    // The derivative with respect to the parameter is finite: the tangent of a * u is 0 there.
    let mut out = [1.0; 3];
    instance.evaluate(0, Sites::Scattered(&[0.0], &[0.5]), Order::Jacobian, &mut out).unwrap();
    assert_eq!(out, [0.0; 3]);
}

#[test]
fn whole_numbers_that_are_too_large_are_failures_with_a_place() {
    let at = |shape: &str, a: f64| {
        let script =
            format!("model m {{\n  param a: real = 1\n  part p = |u, v| ({shape} * 1mm, u * 1mm, v * 1mm)\n}}\n");
        message(&program("m.gml", &script), &[a], &[0.5], &[0.5])
    };
    for (shape, a, place, text) in [
        ("floor(stop(a))", 1e300, "m.gml:3:20: ", "this is no whole number of 64 bits"),
        ("floor(stop(1 / (a - 1)))", 1.0, "m.gml:3:20: ", "this is no whole number of 64 bits"),
        ("floor(stop(ln(a)))", -1.0, "m.gml:3:20: ", "this is no whole number of 64 bits"),
        ("(int(stop(a)) * int(stop(a)))", 1e10, "m.gml:3:20: ", "this whole number is too large"),
        ("(1 - int(stop(a)))", -(2f64.powi(63)), "m.gml:3:20: ", "this whole number is too large"),
        ("abs(int(stop(a)))", -(2f64.powi(63)), "m.gml:3:20: ", "this whole number is too large"),
        ("loop(int(stop(a)), 80, |n, i| n + n)", 1.0, "m.gml:3:", "this whole number is too large"),
    ] {
        let found = at(shape, a);
        assert!(found.starts_with(place) && found.contains(text), "{shape}: {found}");
    }
    // Where it is not needed, it does not fail.
    let script = "model m {\n  param a: real = 1e10\n  part p = |u, v| ((if a < 0 { int(stop(a)) * int(stop(a)) } else { 1 }) * 1mm, \
                  u * 1mm, v * 1mm)\n}\n";
    let program = program("m.gml", script);
    let mut point = [0.0; 3];
    let instance = program.instantiate(&[1e10]).unwrap();
    instance.evaluate(0, Sites::Scattered(&[0.5], &[0.5]), Order::Points, &mut point).unwrap();
    assert_eq!(point, [1.0, 0.5, 0.5]);
}

#[test]
fn recursion_without_end_is_stopped() {
    let script = "fn f(x: real) -> real = if x > 0 { f(x + 1) } else { x }\nmodel m {\n  param a: real = 1\n  part p = |u, v| (f(a + u) * 1mm, u * 1mm, v * 1mm)\n}\n";
    let program = program("m.gml", script);
    insta::assert_snapshot!(message(&program, &[1.0], &[0.5], &[0.5]), @"m.gml:1:25: calls are nested deeper than 1000 (see --limit depth), or than there is memory for (in part p of m.gml:4; at u = 0.5, v = 0.5; where a = 1)");
}

#[test]
fn the_number_of_steps_is_limited() {
    let script = "fn f(x: real) -> real = if x > 0 { f(x - 1) + f(x - 2) } else { x }\nmodel m {\n  param a: real = 100\n  part p = |u, v| (f(a + u) * 1mm, u * 1mm, v * 1mm)\n}\n";
    let script = SourceFile { name: "m.gml".to_owned(), text: script.to_owned() };
    let options = Options { limits: Limits { steps: 100_000, depth: 1000 }, ..Options::default() };
    let program = compile(script, &NoFiles, &options).unwrap_or_else(|e| panic!("{e}")).program;
    insta::assert_snapshot!(message(&program, &[100.0], &[0.5], &[0.5]), @"m.gml:1:28: the evaluation takes more than 100000 steps (see --limit steps) (in part p of m.gml:4; at u = 0.5, v = 0.5; where a = 100)");
}

#[test]
fn an_empty_model_has_no_parts() {
    let program = program("m.gml", "model m {\n  param a: real in 0..2 = 1\n}\n");
    assert!(program.parts().is_empty());
    assert!(program.instantiate(&[1.0]).is_ok());
    assert_eq!(program.bounds(&[1.0]), [(0.0, 2.0)]);
}

#[test]
fn a_file_without_a_model_says_so() {
    let script = SourceFile { name: "m.gml".to_owned(), text: "fn f(x: real) -> real = x\n".to_owned() };
    let Err(failed) = compile(script, &NoFiles, &Options::default()) else { panic!("there is no model") };
    assert_eq!(failed.to_string(), "m.gml:1:1: the file has no model");
}
