//! Vectors, and the evaluations of models that the tests of the library use.
#![allow(unreachable_pub, reason = "it is a module of a test")]

use crate::common::{Random, program};
use gml_compiler::program::{Instance, Order, Program, Sites};

pub type Point = [f64; 3];

pub fn add(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub fn scaled(a: Point, k: f64) -> Point {
    a.map(|x| x * k)
}

pub fn sub(a: Point, b: Point) -> Point {
    add(a, scaled(b, -1.0))
}

pub fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub fn norm(a: Point) -> f64 {
    dot(a, a).sqrt()
}

pub fn unit(a: Point) -> Point {
    scaled(a, 1.0 / norm(a))
}

/// A model with these statements, at its defaults.
pub fn model(statements: &str) -> Program {
    program("library.gml", &format!("model m {{\n{statements}\n}}\n"))
}

pub fn defaults(program: &Program) -> Instance<'_> {
    let x: Vec<f64> = program.parameters().iter().map(|p| p.default).collect();
    program.instantiate(&x).unwrap()
}

/// Points of a part with their partial derivatives in u and v.
pub fn partials(instance: &Instance<'_>, part: usize, u: &[f64], v: &[f64]) -> Vec<[Point; 3]> {
    let mut out = vec![0.0; 9 * u.len()];
    instance.evaluate(part, Sites::Scattered(u, v), Order::Partials, &mut out).unwrap();
    let triple = |k: &[f64]| [k[0], k[1], k[2]];
    out.chunks_exact(9).map(|c| [triple(&c[..3]), triple(&c[3..6]), triple(&c[6..])]).collect()
}

pub fn points(instance: &Instance<'_>, part: usize, u: &[f64], v: &[f64]) -> Vec<Point> {
    let mut out = vec![0.0; 3 * u.len()];
    instance.evaluate(part, Sites::Scattered(u, v), Order::Points, &mut out).unwrap();
    out.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()
}

/// The points of a curve, which is written as a function `|t| ...`: a surface that does not change with v.
pub fn curve(expression: &str, t: &[f64]) -> Vec<[Point; 2]> {
    let program = model(&format!("let c = spatial({expression})\npart p = |u, v| c(u)"));
    let found = partials(&defaults(&program), 0, t, &vec![0.5; t.len()]);
    found.into_iter().map(|[p, du, _]| [p, du]).collect()
}

pub fn parameters(random: &mut Random, n: usize) -> Vec<f64> {
    (0..n).map(|_| random.next()).chain([0.0, 0.25, 0.5, 1.0]).collect()
}

pub fn random_points(random: &mut Random, n: usize) -> Vec<Point> {
    (0..n).map(|_| [0; 3].map(|_| random.between(-10.0, 10.0))).collect()
}

pub fn written(points: &[Point]) -> String {
    let list: Vec<String> = points.iter().map(|p| format!("({}mm, {}mm, {}mm)", p[0], p[1], p[2])).collect();
    format!("[{}]", list.join(", "))
}

#[track_caller]
pub fn close(a: Point, b: Point, tolerance: f64) {
    assert!(norm(sub(a, b)) < tolerance, "{a:?} instead of {b:?}");
}

/// Gauss and Legendre's rule with n nodes over 0..1, by Newton's method on the polynomial.
pub fn gauss(n: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (mut p, mut before) = (1.0, 0.0);
            for k in 0..n {
                let k = k as f64;
                (p, before) = (((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0), p);
            }
            slope = n as f64 * (x * p - before) / (x * x - 1.0);
            x -= p / slope;
        }
        (0.5 - 0.5 * x, 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(node).collect()
}
