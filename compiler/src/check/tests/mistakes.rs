//! What the checker says to mistakes: each script with its diagnostics, reviewed as snapshots.

use super::support::diagnosed;
use std::fmt::Write;

fn shown(scripts: &[&str]) -> String {
    let mut out = String::new();
    for script in scripts {
        for line in script.lines() {
            let _ = writeln!(out, "    {line}");
        }
        let _ = writeln!(out, "{}", diagnosed(script));
    }
    out
}

/// Expressions, as the value of a function without parameters.
fn expressions(list: &[&str]) -> String {
    let scripts: Vec<String> = list.iter().map(|e| format!("fn f() = {e}")).collect();
    let scripts: Vec<&str> = scripts.iter().map(String::as_str).collect();
    shown(&scripts)
}

#[test]
fn dimensions() {
    insta::assert_snapshot!(expressions(&[
        "3mm + 4",
        "4 - 3mm",
        "2 * 3mm + 1.5",
        "sin(30)",
        "cos(2 * 3)",
        "cos(3mm)",
        "45deg + 30",
        "exp(3mm)",
        "2 ^ 3mm",
        "(3mm) ^ sin(1rad)",
        "3mm < 4",
        "3mm % 2",
        "(1mm, 2mm) + (1, 2)",
        "(1mm, 2mm, 0) + (1mm, 2mm, 3mm)",
        "(1, 2) + (1, 2, 3)",
        "min(3mm, 4)",
        "atan2(1mm, 2)",
        "[1mm, 2]",
        "if sin(1rad) > 0 { 3mm } else { 0 }",
        "(1e200m) ^ 2000",
        "mix(1mm, 2, 0.5)",
        "norm((1mm, 2mm, 3))",
    ]));
}

#[test]
fn values_of_the_wrong_kind() {
    insta::assert_snapshot!(expressions(&[
        "true + 1",
        "not 3",
        "if 3 { 1 } else { 2 }",
        "if sin(1rad) > 0 { 1 }",
        "(1, 2) * (3, 4)",
        "1 / (3, 4)",
        "-[1, 2]",
        "[1, 2] + [3, 4]",
        "3(4)",
        "(1, 2).z",
        "{width: 3mm, height: 4mm}.widht",
        "[1, 2, 3][3]",
        "[1, 2, 3][0.5]",
        "3[0]",
        "for i in 5 { i }",
        "for i in 0..5.5 { i }",
        "for i in 0..floor(sin(1rad)) { i }",
        "len(3)",
        "3mm'",
        "(|a, b| a + b)'",
        "(|a, b| a + b)'c(1, 2)",
        "(|t| t > 1)'(0.5)",
        "if sin(1rad) > 0 { |t| t } else { |t| 2 * t }",
        "{ let a = 1 }",
        "{ let (a, b) = (1, 2, 3); a }",
        "{ let (a, b) = 1; a }",
        "7 % 0",
        "2 ^ 100 * 3",
        "\"text\" + 1",
        "for i in 0..1000000 { i }",
        "fold(0mm, 0..floor(100 * sin(1rad)), |a, i| a * 2mm)",
    ]));
}

#[test]
fn names_and_calls() {
    insta::assert_snapshot!(shown(&[
        "fn f() = bezeir([1, 2])",
        "fn f() = q7x + 1",
        "fn double(x) = 2 * x\nfn f() = double(1, 2)",
        "fn double(x) = 2 * x\nfn f() = double()",
        "fn box(width, height) = width * height\nfn f() = box(width: 1, hieght: 2)",
        "fn box(width, height) = width * height\nfn f() = box(1, width: 2)",
        "fn f(x: lenght) = x",
        "fn f(x: float) = x",
        "fn f(x: real^2) = x\nfn g() = f(1)",
        "fn half(x: length) -> length = x / 2\nfn f() = half(3)",
        "fn half(x: real) -> length = x / 2\nfn f() = half(3)",
        "fn at(s: surface) = s(0, 0)\nfn f() = at(|t| (t, t, t))",
        "fn at(s: surface) = s(0, 0)\nfn f() = at(|u, v| (u, v, 0))",
        "use std.curves (bezier)",
        "use std.curve (bezeir)",
        "use curve (bezier)",
        "use \"other.gml\" (knob)\nfn f() = knob(1)",
        "use std.curve\nfn f() = curve.bezeir([1, 2])",
        "fn f() = 1\nfn f() = 2",
        "fn f() = sqrt(1, 2)",
        "fn f() = fold(init: 1, xs: 0..3, g: |a, b| a)",
        "fn f() = 3.foo()",
        "let a = b + 1\nlet b = a + 1\nfn f() = a",
        "fn f(n: int) = if n == 0 { 1 } else { n * f(n - 1) }\nfn g(x: real) = f(floor(x))",
        "fn f(n: int) = f(n + 1)\nfn g() = f(0)",
        "param x: length = 3mm",
        "deriv f(x; dx) { dx }",
        "fn inner(x) = x + 1mm\nfn outer(x) = inner(2 * x)\nfn f() = outer(3)",
        "fn f() = { let a = 3mm + 1; let b = 2 + 1mm; a + b }",
    ]));
}

/// The items of a model that has a part.
fn models(list: &[&str]) -> String {
    let scripts: Vec<String> = list.iter().map(|items| format!("model m {{\n  {items}\n}}")).collect();
    let scripts: Vec<&str> = scripts.iter().map(String::as_str).collect();
    shown(&scripts)
}

#[test]
fn measures() {
    insta::assert_snapshot!(models(&[
        "param r: length = 10mm\n  part p = sphere(r)\n  measure d tolerance +0.2/-0.1mm = 2 * r\n  measure a = pi * d ^ 2 / 4",
        "part p = sphere(1mm)\n  measure d = (1mm, 2mm)",
        "part p = sphere(1mm)\n  measure d = p",
        "part p = sphere(1mm)\n  measure d = q",
        "param r: length = 10mm\n  measure r = 2 * r\n  part p = sphere(1mm * r / 1mm)",
        "part p = sphere(1mm)\n  measure p = 1mm\n  measure d = 2mm\n  measure d = 3mm",
        "part p = sphere(1mm)\n  measure d tolerance 2deg = 3mm",
        "part p = sphere(1mm)\n  measure d tolerance +0.2/-0.1 = 3mm",
        "part p = sphere(1mm)\n  measure d tolerance -0.2mm = 3mm",
        "part p = sphere(1mm)\n  measure d tolerance +0.1/+0.2mm = 3mm",
        "part p = sphere(1mm)\n  measure d tolerance +0.2mm = 3mm",
        "part p = sphere(1mm)\n  measure d tolerance 0.2/-0.1mm = 3mm",
        "param r: length = 10mm\n  part p = sphere(r)\n  measure d tolerance +(r - 12mm)/-1mm = 2 * r",
        "param r: length = 10mm\n  part p = sphere(r)\n  measure d tolerance sqrt(r - 12mm) * sqrt(1mm) = 2 * r",
        "param r: length = 10mm\n  part p = sphere(r)\n  measure n = floor(r / 1mm)",
        "part p = sphere(1mm)\n  measure d = 3mm tolerance 0.1mm",
        "part p = sphere(1mm)\n  measure d of q = 3mm\n  measure e of pp = 3mm",
        "part p = {a: sphere(1mm), b: sphere(2mm)}\n  measure d of p = 3mm\n  measure e of p.a, p.b = 3mm",
        "for i in 0..2 { part p = sphere(1mm); measure d of p tolerance 1mm = 2mm }\n  measure e of p[1], p[2] = 3mm",
        "part p = sphere(1mm)\n  measure \"d\" = 3mm",
        "part p = sphere(1mm)\n  mesure d = 3mm",
        "part p = sphere(1mm)\n  fn f() { measure d = 3mm; d }\n  measure e = f()",
    ]));
}

#[test]
fn models_and_parts() {
    insta::assert_snapshot!(models(&[
        "param r: length in 10mm..20mm = 30mm\n  part p = sphere(r)",
        "param r: length in 20mm..10mm = 15mm\n  part p = sphere(r)",
        "param a: length = 1mm\n  param r: length in 0mm..2 * a = 3mm\n  part p = sphere(r)",
        "param r: length in 1..20 = 10mm\n  part p = sphere(r)",
        "param r: length = 10\n  part p = sphere(r)",
        "param r: length\n  part p = sphere(r)",
        "param n: int = 3\n  part p = sphere(n * 1mm)",
        "param a: length = b\n  param b: length = 3mm\n  part p = sphere(a + b)",
        "param r: length = 10mm\n  param q: length = 10mm\n  part p = sphere(r)",
        "param r: length = 10mm\n  param r: length = 10mm\n  part p = sphere(r)",
        "param r: length = 10mm",
        "part p = line((0mm, 0mm), (1mm, 1mm))",
        "part p = |u, v| (u, v, 0)",
        "part p = |u, v| (u * 1mm, v * 1mm)",
        "part p = 3mm",
        "part p = sphere(1mm)\n  part p = sphere(2mm)",
        "param r: length = 10mm\n  if r > 5mm { part p = sphere(r) }",
        "for i in 0..3 { param r: length = 10mm }",
        "input n: int in 1..4 = 7\n  part p = sphere(n * 1mm)",
        "param r: length = 10mm\n  part p = sphere(floor(r / 1mm) * 1mm)",
        "param r: length = 10mm\n  part p = for i in 0..floor(r / 1mm) { sphere(i * 1mm) }",
        "part p = sphere(q)\n  let q = 3mm",
        "param r: length = 10mm\n  part p = revolve(|t| (r, 2 * t))",
        "part p = sphere(1mm)\n  part q = cylinder(3mm)",
        "param r: length = 10mm\n  require r, \"no\"\n  part p = sphere(r)",
        "part p = tube(|t| (t * 1mm, t * 2), radius: 1mm)",
        "part p = m()",
    ]));
}
