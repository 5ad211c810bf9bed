//! Derivatives of the examples against central differences.

use crate::common::{Random, deviation, scale};
use gml_compiler::program::{Instance, Order, Program, Sites};

/// Number of points at which each patch is evaluated.
const POINTS: usize = 12;

/// Number of parameter vectors for each model; fewer for models with many parts, which are much alike.
const VECTORS: usize = 20;
const LEAST_VECTORS: usize = 4;

/// Tolerance of the derivatives, relative to the largest one of the patch with respect to the same parameter.
const TOLERANCE: f64 = 1e-7;

fn points(instance: &Instance<'_>, patch: usize, u: &[f64], v: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; 3 * u.len()];
    instance.evaluate(patch, Sites::Scattered(u, v), Order::Points, &mut out).unwrap();
    out
}

fn vectors(program: &Program) -> usize {
    (VECTORS * 10 / program.parts().len().max(1)).clamp(LEAST_VECTORS, VECTORS)
}

fn check_parameters(program: &Program, random: &mut Random) {
    for _ in 0..vectors(program) {
        let x = random.parameters(program);
        let instance = program.instantiate(&x).unwrap();
        let (u, v): (Vec<f64>, Vec<f64>) = (0..POINTS).map(|_| (random.next(), random.between(0.02, 0.98))).unzip();
        let w: Vec<[f64; 3]> = (0..POINTS).map(|_| [0; 3].map(|_| random.between(-1.0, 1.0))).collect();
        for (patch, part) in program.parts().iter().enumerate() {
            let active = part.active.len();
            let mut jacobian = vec![0.0; 3 * active * POINTS];
            instance.evaluate(patch, Sites::Scattered(&u, &v), Order::Jacobian, &mut jacobian).unwrap();
            let mut gradient = vec![0.0; x.len()];
            instance.evaluate(patch, Sites::Scattered(&u, &v), Order::Pullback(&w), &mut gradient).unwrap();
            for param in 0..x.len() {
                let position = part.active.iter().position(|a| *a as usize == param);
                let derivative: Vec<f64> = match position {
                    Some(a) => (0..POINTS)
                        .flat_map(|i| (0..3).map(move |c| (i, c)))
                        .map(|(i, c)| jacobian[(i * active + a) * 3 + c])
                        .collect(),
                    None => vec![0.0; 3 * POINTS],
                };
                let at = |h: f64| {
                    let mut x = x.clone();
                    x[param] += h;
                    let instance = program.instantiate(&x).ok()?;
                    Some(points(&instance, patch, &u, &v))
                };
                let name = &program.parameters()[param].name;
                let error = deviation(&derivative, scale(program, param, &x), at);
                assert!(error < TOLERANCE, "d {} / d {name}: {error:e} at {x:?}", part.name);

                let product: f64 = derivative.iter().zip(w.as_flattened()).map(|(d, w)| d * w).sum();
                let size: f64 = derivative.iter().zip(w.as_flattened()).map(|(d, w)| (d * w).abs()).sum();
                // The pullback computes the same sum in another order, by other formulas.
                let error = (gradient[param] - product).abs();
                assert!(error <= 1e-12 * size.max(1.0), "pullback of {} to {name}: {error:e} at {x:?}", part.name);
            }
        }
    }
}

fn check_partials(program: &Program, random: &mut Random) {
    for _ in 0..vectors(program) {
        let x = random.parameters(program);
        let instance = program.instantiate(&x).unwrap();
        let (u, v): (Vec<f64>, Vec<f64>) =
            (0..POINTS).map(|_| (random.between(0.05, 0.95), random.between(0.05, 0.95))).unzip();
        for (patch, part) in program.parts().iter().enumerate() {
            let mut all = vec![0.0; 18 * POINTS];
            instance.evaluate(patch, Sites::Scattered(&u, &v), Order::SecondPartials, &mut all).unwrap();
            let partials = |u: &[f64], v: &[f64]| {
                let mut out = vec![0.0; 9 * POINTS];
                instance.evaluate(patch, Sites::Scattered(u, v), Order::Partials, &mut out).unwrap();
                out
            };
            let moved = |a: &[f64], h: f64| -> Vec<f64> { a.iter().map(|a| a + h).collect() };
            let column = |data: &[f64], width: usize, from: usize| -> Vec<f64> {
                data.chunks_exact(width).flat_map(|p| p[from..from + 3].to_vec()).collect()
            };
            // To rounding: what the derivatives share with the point may be computed in another order.
            for (a, b) in column(&all, 18, 0).iter().zip(points(&instance, patch, &u, &v)) {
                assert!((a - b).abs() <= 1e-15 * b.abs().max(1.0), "points of {}: {a} {b}", part.name);
            }
            let first = partials(&u, &v);
            for from in [0, 3, 6] {
                for (a, b) in column(&all, 18, from).iter().zip(column(&first, 9, from)) {
                    assert!((a - b).abs() <= 1e-11 * b.abs().max(1.0), "first partials of {}: {a} {b}", part.name);
                }
            }
            let by_u = |from: usize| {
                let (partials, column, moved) = (&partials, &column, &moved);
                let (u, v) = (&u, &v);
                move |h: f64| Some(column(&partials(&moved(u, h), v), 9, from))
            };
            let by_v = |from: usize| {
                let (partials, column, moved) = (&partials, &column, &moved);
                let (u, v) = (&u, &v);
                move |h: f64| Some(column(&partials(u, &moved(v, h)), 9, from))
            };
            let errors = [
                ("du", deviation(&column(&all, 18, 3), 1.0, by_u(0))),
                ("dv", deviation(&column(&all, 18, 6), 1.0, by_v(0))),
                ("duu", deviation(&column(&all, 18, 9), 1.0, by_u(3))),
                ("duv", deviation(&column(&all, 18, 12), 1.0, by_v(3))),
                ("dvv", deviation(&column(&all, 18, 15), 1.0, by_v(6))),
            ];
            for (name, error) in errors {
                assert!(error < TOLERANCE, "{name} of {}: {error:e} at {x:?}", part.name);
            }
        }
    }
}

/// Derivatives of bounds with respect to every parameter, if they depend on any.
fn check_bounds(program: &Program, random: &mut Random) {
    let finite = |x: &[f64]| -> Vec<f64> {
        let both = program.bounds(x).into_iter().flat_map(|(low, high)| [low, high]);
        both.map(|bound| if bound.is_finite() { bound } else { 0.0 }).collect()
    };
    for _ in 0..VECTORS {
        let x = random.parameters(program);
        let jacobian = program.bounds_jacobian(&x);
        for (by, parameter) in program.parameters().iter().enumerate() {
            let mut derivative = vec![0.0; 2 * x.len()];
            let mut dependent = vec![false; x.len()];
            for d in jacobian.iter().filter(|d| d.by == by) {
                derivative[2 * d.parameter..][..2].copy_from_slice(&[d.lower, d.upper]);
                dependent[d.parameter] = true;
            }
            let at = |h: f64| {
                let mut x = x.clone();
                x[by] += h;
                Some(finite(&x))
            };
            let error = deviation(&derivative, scale(program, by, &x), at);
            assert!(error < TOLERANCE, "bounds by {}: {error:e} at {x:?}", parameter.name);
            let (before, after) = (finite(&x), at(0.37 * scale(program, by, &x)).unwrap());
            for (i, dependent) in dependent.into_iter().enumerate() {
                assert!(
                    dependent || before[2 * i..][..2] == after[2 * i..][..2],
                    "{} moves bounds {i}",
                    parameter.name
                );
            }
        }
    }
}

#[test]
fn derivatives_of_bounds() {
    let program = crate::common::program(
        "bounds.gml",
        "fn half(x: length) -> length = x / 2
         model m {
           param a: length in 10mm..50mm = 30mm
           param n: real in 1.5..6.5 = 3
           let wall = if a > 20mm { a / 10 } else { 2mm }
           param b: length in max(wall, 1mm)..half(a) = 5mm
           param c: angle in -asin(b / a)..180deg * (b / a) = 0.1rad
           param d: length in 0mm..fold(1mm, 0..3, |s, i| s + b ^ 2 / a) = 1mm
           param e: length in -floor(stop(n)) * 1mm..100mm = 1mm
           param f: length = 1mm
           part p = |u, v| (u * b + d, v * a, e + f * sin(c) * n)
         }",
    );
    check_bounds(&program, &mut Random(11));
    let dependences: Vec<(usize, usize)> =
        program.bounds_jacobian(&program.defaults()).iter().map(|d| (d.parameter, d.by)).collect();
    // The bound of e depends on n in steps: the derivative is 0.
    assert_eq!(dependences, [(2, 0), (3, 0), (3, 2), (4, 0), (4, 2), (5, 1)]);
    let can = crate::common::example("can/can");
    check_bounds(&can, &mut Random(12));
    let name = |i: usize| can.parameters()[i].name.clone();
    let of_can: Vec<[String; 2]> =
        can.bounds_jacobian(&can.defaults()).iter().map(|d| [name(d.parameter), name(d.by)]).collect();
    assert_eq!(of_can, [["neck_radius", "body_radius"], ["stand_radius", "body_radius"]]);
}

/// Every part of every example, with respect to every parameter.
#[test]
fn derivatives_of_every_example() {
    let names = crate::common::examples();
    assert!(names.len() >= 11, "{names:?}");
    std::thread::scope(|scope| {
        for half in 0..2 {
            let names = &names;
            scope.spawn(move || {
                for (_, name) in names.iter().enumerate().filter(|(k, _)| k % 2 == half) {
                    eprintln!("{name}");
                    let program = crate::common::example(name);
                    // By the name, so that another example does not move these places: on the bend of a profile
                    // second differences have no limit.
                    let seed = name.bytes().fold(7, |seed: u64, byte| seed * 31 % 65_521 + u64::from(byte));
                    check_parameters(&program, &mut Random(seed));
                    check_partials(&program, &mut Random(seed + 1));
                }
            });
        }
    });
}

/// Surfaces that contain derivatives of first to third order, through loops, folds, recursion, branches and closures.
#[test]
fn derivatives_of_derivatives() {
    let program = crate::common::model("orders");
    check_parameters(&program, &mut Random(7));
}
