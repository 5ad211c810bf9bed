//! The cup against a second implementation, written from the formulas of the language's first page.

use crate::common::{Random, example};
use gml_compiler::program::{Order, Sites};

type Point = [f64; 3];

fn add(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn scaled(a: Point, s: f64) -> Point {
    a.map(|x| x * s)
}

/// Rotation by alpha about x, then beta about y, then gamma about z, then the base point.
fn pose(x: &[f64], p: Point) -> Point {
    let turn = |p: Point, axis: usize, angle: f64| {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut q = p;
        q[i] = p[i] * angle.cos() - p[j] * angle.sin();
        q[j] = p[i] * angle.sin() + p[j] * angle.cos();
        q
    };
    add([x[0], x[1], x[2]], turn(turn(turn(p, 0, x[3]), 1, x[4]), 2, x[5]))
}

/// The handle's centre line by Bernstein polynomials, with its derivative, in radius and height.
fn handle(x: &[f64], t: f64) -> ([f64; 2], [f64; 2]) {
    let (shape, r, h) = (x[6], x[7], x[8]);
    let outer = |t: f64| t.powf(3.0 + shape);
    let [h1, h2a, h2b, h3a, h3b, h4] = [9, 10, 11, 12, 13, 14].map(|i| x[i]);
    let p = [[r * h1, h * outer(h1)], [r * h2a, h * h2b], [r * h3a, h * h3b], [r * h4, h * outer(h4)]];
    let s = 1.0 - t;
    let b = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
    let d = [-3.0 * s * s, 3.0 * s * s - 6.0 * s * t, 6.0 * s * t - 3.0 * t * t, 3.0 * t * t];
    let sum = |w: [f64; 4]| [0, 1].map(|c| (0..4).map(|i| w[i] * p[i][c]).sum::<f64>());
    (sum(b), sum(d))
}

fn surface(x: &[f64], part: &str, u: f64, v: f64) -> Point {
    let (shape, r, h) = (x[6], x[7], x[8]);
    let inner = |t: f64| 1.0 / 25.0 + (t + 0.1).powf(2.0 + shape);
    let rim = (24.0f64 / 25.0).powf(1.0 / (2.0 + shape)) - 0.1;
    let a = u * std::f64::consts::TAU;
    let around = |radius: f64, height: f64| [radius * a.cos(), radius * a.sin(), height];
    let p = match part {
        "outside" => around(r * v, h * v.powf(3.0 + shape)),
        "inside" => around(r * rim * (1.0 - v), h * inner(rim * (1.0 - v))),
        "lip" => around(r * (1.0 + (rim - 1.0) * v), h),
        _ => {
            let (c, d) = handle(x, v);
            let length = d[0].hypot(d[1]);
            // The curve lies in y = 0: its normals are y, and the vector perpendicular to y and to the tangent.
            let (b, along) = ([0.0, 1.0, 0.0], [d[0] / length, 0.0, d[1] / length]);
            let n = [along[2], 0.0, -along[0]];
            add([c[0], 0.0, c[1]], add(scaled(n, 5.0 * a.cos()), scaled(b, 5.0 * a.sin())))
        }
    };
    pose(x, p)
}

#[test]
fn the_cup_is_what_its_formulas_say() {
    let program = example("cup/cup");
    let mut random = Random(1);
    for _ in 0..20 {
        let x = random.parameters(&program);
        let instance = program.instantiate(&x).unwrap();
        let (u, v): (Vec<f64>, Vec<f64>) = (0..100).map(|_| (random.next(), random.next())).unzip();
        for (patch, part) in program.parts().iter().enumerate() {
            let mut out = vec![0.0; 300];
            instance.evaluate(patch, Sites::Scattered(&u, &v), Order::Points, &mut out).unwrap();
            for i in 0..100 {
                let expected = surface(&x, &part.name, u[i], v[i]);
                for c in 0..3 {
                    // A few rounding errors of numbers of some hundred millimetres.
                    let error = (out[3 * i + c] - expected[c]).abs();
                    assert!(error < 1e-12 * 300.0, "{} at {}, {}: {error}", part.name, u[i], v[i]);
                }
            }
        }
    }
}
