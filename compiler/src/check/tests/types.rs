//! Types of expressions, in the user's words.

use super::support::{check_text, rendered};
use crate::check::print;
use crate::check::typed::LocalId;
use crate::program::constants;

/// The type of an expression, as the typed tree's printer writes it.
fn type_of(expression: &str) -> String {
    let script = format!("model m {{\n  let it = {expression}\n  part p = |u, v| (u * 1mm, v * 1mm, 0mm)\n}}");
    let (model, sources, diagnostics) = check_text(&script);
    let Some(model) = model else { panic!("{expression}: {}", rendered(&sources, &diagnostics)) };
    let text = print(&model);
    match text.lines().find_map(|l| l.trim().strip_prefix("let it#")) {
        Some(line) => {
            let (_, rest) = line.split_once(": ").expect("a type");
            rest.split(" = ").next().expect("a type").trim_end().to_owned()
        }
        None => "known".to_owned(),
    }
}

#[test]
fn dimensions_follow_the_operators() {
    for (expression, wanted) in [
        ("3mm", "length"),
        ("3mm * 2", "length"),
        ("3mm * 2mm", "length^2"),
        ("3mm / 2mm", "real"),
        ("1 / 2mm", "length^-1"),
        ("(2mm) ^ 3", "length^3"),
        ("(2mm) ^ -1", "length^-1"),
        ("(2mm) ^ 0.5", "length^(1/2)"),
        ("(2mm) ^ (2/3)", "length^(2/3)"),
        ("sqrt(2mm * 3mm)", "length"),
        ("30deg", "angle"),
        ("2 * pi * 0.5", "angle"),
        ("30deg * 0.1", "angle"),
        ("30deg / 2", "angle"),
        ("30deg / 10deg", "real"),
        ("30deg * 10deg", "real"),
        ("30deg * 3mm", "length"),
        ("3mm / 10deg", "length"),
        ("30deg + 0.5 * tan(1rad)", "real"),
        ("30deg ^ 2", "real"),
        ("sin(30deg)", "real"),
        ("asin(0.5)", "angle"),
        ("atan2(1mm, 2mm)", "angle"),
        ("7 / 2", "real"),
        ("7 + 0.5", "real"),
        ("1e3", "real"),
        ("30deg % 1turn", "angle"),
        ("abs(-3mm)", "length"),
        ("sign(-3mm)", "real"),
        ("max(1mm, 2mm, 3mm)", "length"),
        ("min([1mm, 2mm, 3mm])", "length"),
        ("if sin(1rad) > 0 { 1 } else { 0.5 }", "real"),
        ("if sin(1rad) > 0 { 1 } else { 2 }", "int"),
        ("sin(1rad) > 0 and true", "bool"),
    ] {
        assert_eq!(type_of(expression), wanted, "{expression}");
    }
}

#[test]
fn vectors_and_arrays() {
    for (expression, wanted) in [
        ("(1mm, 2mm, 3mm)", "(length, length, length)"),
        ("(1mm, 2mm) + (3mm, 4mm)", "(length, length)"),
        ("(1, 2) * 3mm", "(length, length)"),
        ("3mm * (1, 2)", "(length, length)"),
        ("(1mm, 2mm) / 2mm", "(real, real)"),
        ("-(1mm, 2mm)", "(length, length)"),
        ("dot((1mm, 2mm), (3mm, 4mm))", "length^2"),
        ("norm((1mm, 2mm))", "length"),
        ("normalize((1mm, 2mm, 3mm))", "(real, real, real)"),
        ("cross((1, 0, 0), (0mm, 1mm, 0mm))", "(length, length, length)"),
        ("[1, 2.5, 3]", "[real; 3]"),
        ("for i in 0..4 { i * 1mm }", "[length; 4]"),
        ("for i in 0..0 { i }", "[real; 0]"),
        ("sum([1mm, 2mm])", "length"),
        ("fold(1mm, [2, 3, 4], |a, x| a * x)", "length"),
        ("fold(1mm, [2mm, 3mm], |a, x| a * x)", "length^3"),
        ("{a: 1mm, b: 2deg}", "{a: length, b: angle}"),
        ("{a: 1mm, b: 2deg}.b", "angle"),
        ("[1mm, 2mm, 3mm][floor(2 * sin(1rad))]", "length"),
        ("bezier([(0mm, 1mm), (2mm, 3mm), (4mm, 5mm)])(0.5)", "(length, length)"),
    ] {
        assert_eq!(type_of(expression), wanted, "{expression}");
    }
}

#[test]
fn derivatives_divide_dimensions() {
    for (expression, wanted) in [
        ("(|t| t * t * 1mm)'(0.5)", "length"),
        ("(|x| x * x)'(2mm)", "length"),
        ("(|x| x * x)''(2mm)", "real"),
        ("(|x| x * x * x)'''(2mm)", "real"),
        ("(|a| sin(a))'(30deg)", "real"),
        ("sin'(30deg)", "real"),
        ("(|t| (t * 1mm, 2mm, 3mm))'(1)", "(length, length, length)"),
        ("(|t| (t, 0))'(1)", "(real, real)"),
        ("sphere(3mm)'u(0.1, 0.2)", "(length, length, length)"),
        ("(|a, b| (a * 1mm, b * 1mm, 0mm))'v(0.1, 0.2)", "(length, length, length)"),
        ("(|a, b| a * b * 1mm)'b(0.1, 0.2)", "length"),
    ] {
        assert_eq!(type_of(expression), wanted, "{expression}");
    }
}

#[test]
fn what_is_known_stays_known() {
    for expression in [
        "3 + 4 * 2",
        "7 % 4",
        "2 ^ 10",
        "len([1, 2, 3])",
        "fold(0, 0..10, |a, i| a + i)",
        "{ fn fib(n) = if n < 2 { n } else { fib(n - 1) + fib(n - 2) }; fib(20) }",
        "if len([1, 2]) == 2 { 3 } else { 4mm }",
        "3 > 2 and not false",
        "floor(7 / 2)",
        "arity(|u, v| u)",
        "max(3, 4, 5)",
    ] {
        assert_eq!(type_of(expression), "known", "{expression}");
    }
}

/// The value bound to `it`.
#[test]
fn values_agree_with_arithmetic_by_hand() {
    for (expression, wanted) in [
        ("1in + 2cm + 0.1m", 25.4 + 20.0 + 100.0),
        ("180deg + 0rad", std::f64::consts::PI),
        ("-2 ^ 2 + 0.0", -4.0),
        ("2 ^ 3 ^ 2 + 0.0", 512.0),
        ("-7.5 % 2", 0.5),
        ("sum(for i in 0..100 { i * 0.5 })", 2475.0),
        ("fold(0.0, 0..1000, |a, i| a + i)", 499_500.0),
        ("fold(0.0, 0..int(99.5 + 0 * sin(1rad)), |a, i| a + i)", 4851.0),
        ("{ fn half(x: real) -> real = if x < 1 { x } else { half(x / 2) }; half(100) }", 100.0 / 128.0),
        ("{ fn add(a, b = 2 * a) = a + b; add(1.5) + add(1.5, 1) + add(b: 1, a: 0.5) }", 4.5 + 2.5 + 1.5),
        ("{ let (a, (b, c)) = (1.5, (2, 3)); a + b * c }", 7.5),
        ("(|(a, b), c| a * b + c)((2, 3), 0.5)", 6.5),
        ("{ let f = |x| |y| x - y; f(3)(1.5) }", 1.5),
        ("{x: 1.5, f: |a| a * 2}.f(4) + 0.5", 8.5),
        ("(3, 4).norm()", 5.0),
        ("[5, 6, 7][int(1.5 + 0 * sin(1rad))] + 0.5", 6.5),
        ("bezier([0, 1, 4])(0.5) + 0.0", 1.5),
        ("dot(turned((1, 0, 0), (0, 0, 1), 90deg), (0, 1, 0))", 1.0),
        ("axis_angle((0, 0, 2), 90deg)((1, 2, 3)).x", -2.0),
        ("smoothstep(2mm, 4mm, 3mm)", 0.5),
        ("clamp(7, 0.5, 2)", 2.0),
        ("sum(steps(0, 3, 4)) + 0.0", 6.0),
    ] {
        let script = format!("model m {{\n  let it = {expression}\n  part p = sphere(1mm)\n}}");
        let (model, sources, diagnostics) = check_text(&script);
        let Some(model) = model else { panic!("{expression}: {}", rendered(&sources, &diagnostics)) };
        let it = model.locals.iter().position(|l| l.name == "it").expect("the name is bound");
        let value = constants(&model, &[LocalId(it as u32)])[0].clone().expect("a value");
        // Rounding of a few operations.
        assert!((value - wanted).abs() <= 1e-12 * wanted.abs().max(1.0), "{expression}: {value}, not {wanted}");
    }
}
