//! Evaluation on grids against evaluation point by point, for all examples.

use crate::common::{Random, example, examples, model, program};
use gml_compiler::program::{Instance, Order, Program, Sites};

/// Numbers of columns and rows: even, odd, and one.
const SIZES: [(usize, usize); 4] = [(6, 4), (7, 3), (1, 2), (2, 1)];

/// Number of parts that are evaluated of models with many parts, which are much alike.
const PARTS: usize = 12;

fn every_point(u: &[f64], v: &[f64]) -> (Vec<f64>, Vec<f64>) {
    v.iter().flat_map(|v| u.iter().map(move |u| (*u, *v))).unzip()
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}

/// Points, partials and Jacobian come from the same operations in both ways: they are equal to the bit.
fn check_stored(instance: &Instance<'_>, program: &Program, patch: usize, [u, v]: [&[f64]; 2]) {
    let name = format!("{} of {}, {} by {}", program.parts()[patch].name, program.name(), u.len(), v.len());
    let (all_u, all_v) = every_point(u, v);
    let n = all_u.len();
    let (mut grid, mut batch) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
    instance.evaluate(patch, Sites::Grid(u, v), Order::Points, &mut grid).unwrap();
    instance.evaluate(patch, Sites::Scattered(&all_u, &all_v), Order::Points, &mut batch).unwrap();
    assert_eq!(bits(&grid), bits(&batch), "points: {name}");

    let (mut grid, mut batch) = (vec![0.0; 9 * n], vec![0.0; 9 * n]);
    instance.evaluate(patch, Sites::Grid(u, v), Order::Partials, &mut grid).unwrap();
    instance.evaluate(patch, Sites::Scattered(&all_u, &all_v), Order::Partials, &mut batch).unwrap();
    assert_eq!(bits(&grid), bits(&batch), "partials: {name}");

    let active = program.parts()[patch].active.len();
    let (mut grid, mut batch) = (vec![0.0; 3 * active * n], vec![0.0; 3 * active * n]);
    instance.evaluate(patch, Sites::Grid(u, v), Order::Jacobian, &mut grid).unwrap();
    instance.evaluate(patch, Sites::Scattered(&all_u, &all_v), Order::Jacobian, &mut batch).unwrap();
    assert_eq!(bits(&grid), bits(&batch), "Jacobian: {name}");

    let (mut grid, mut batch) = (vec![0.0; 18 * n], vec![0.0; 18 * n]);
    instance.evaluate(patch, Sites::Grid(u, v), Order::SecondPartials, &mut grid).unwrap();
    instance.evaluate(patch, Sites::Scattered(&all_u, &all_v), Order::SecondPartials, &mut batch).unwrap();
    assert_eq!(bits(&grid), bits(&batch), "second partials: {name}");
}

/// A pullback is the transpose of the Jacobian with sums in another order: equal but for rounding.
fn check_pullback(instance: &Instance<'_>, program: &Program, patch: usize, [u, v]: [&[f64]; 2], random: &mut Random) {
    let (all_u, all_v) = every_point(u, v);
    let w: Vec<[f64; 3]> = all_u.iter().map(|_| [0; 3].map(|_| random.between(-1.0, 1.0))).collect();
    let n = program.parameters().len();
    let (mut grid, mut batch) = (vec![0.0; n], vec![0.0; n]);
    instance.evaluate(patch, Sites::Grid(u, v), Order::Pullback(&w), &mut grid).unwrap();
    instance.evaluate(patch, Sites::Scattered(&all_u, &all_v), Order::Pullback(&w), &mut batch).unwrap();
    assert_eq!(bits(&grid), bits(&batch), "pullback of {}", program.parts()[patch].name);
    // The transpose of the Jacobian, and the size of the terms of each sum.
    let active = &program.parts()[patch].active;
    let mut jacobian = vec![0.0; 3 * active.len() * w.len()];
    instance.evaluate(patch, Sites::Scattered(&all_u, &all_v), Order::Jacobian, &mut jacobian).unwrap();
    let (mut product, mut size) = (vec![0.0; n], vec![0.0; n]);
    for (point, w) in jacobian.chunks_exact(3 * active.len().max(1)).zip(&w) {
        for (entries, param) in point.chunks_exact(3).zip(active) {
            for (entry, w) in entries.iter().zip(w) {
                product[*param as usize] += entry * w;
                size[*param as usize] += (entry * w).abs();
            }
        }
    }
    let most = size.iter().fold(1e-300f64, |m, s| m.max(*s));
    for (param, parameter) in program.parameters().iter().enumerate() {
        // Terms that cancel between captures may be larger than the result.
        let tolerance = 1e-12 * size[param].max(1e-3 * most).max(1e-3);
        let error = (batch[param] - product[param]).abs();
        let (part, name) = (&program.parts()[patch].name, &parameter.name);
        assert!(error <= tolerance, "pullback of {part} to {name} against the Jacobian: {error:e}, {tolerance:e}");
    }
}

fn check(program: &Program, random: &mut Random, parts: usize, sizes: &[(usize, usize)]) {
    let x = random.parameters(program);
    let instance = program.instantiate(&x).unwrap();
    let step = program.parts().len().div_ceil(parts).max(1);
    for patch in (0..program.parts().len()).step_by(step) {
        for (columns, rows) in sizes.iter().copied() {
            let u: Vec<f64> = (0..columns).map(|_| random.next()).collect();
            let v: Vec<f64> = (0..rows).map(|_| random.between(0.02, 0.98)).collect();
            check_stored(&instance, program, patch, [&u, &v]);
            check_pullback(&instance, program, patch, [&u, &v], random);
        }
    }
}

#[test]
fn grids_are_their_points() {
    let mut random = Random(11);
    for name in examples() {
        check(&example(&name), &mut random, PARTS, &SIZES);
    }
}

/// The same for every curve and surface of the library and for derivatives of up to third order; here the pullback
/// agrees with the transpose of the tangent to 1e-12.
#[test]
fn grids_of_the_library_are_their_points() {
    for name in ["library", "orders"] {
        check(&model(name), &mut Random(5), usize::MAX, &SIZES[..2]);
    }
}

/// Surfaces whose inner stage has branches, comparisons, loops and elementary functions of both u and v.
#[test]
fn nothing_need_be_separable() {
    let text = "
model mixed {
  param a: length = 3mm; param b: real = 0.5; param n: real = 2.5
  fn wave(u: real, v: real) = a * sin(u * v * 1rad + b * 1rad)
  part calls = |u: real, v: real| (a * u, a * v, wave(u, v))
  part compares = |u: real, v: real| (a * u, a * v, if u < v { a * u * b } else { a * v * v * n })
  part extremes = |u: real, v: real| (a * min(u, v * b), a * max(u * n, v), a * abs(u - v))
  part roots = |u: real, v: real| (a * u, a * v, a * sqrt(u * u + v * v + b * b))
  part columns = |u: real, v: real| (a * cos(u * b * 1rad), a * exp(u * n), a * u)
  part flat = |u: real, v: real| (a * v, a * 2, a * v * v)
  part powers = |u: real, v: real| (a * (u + v + b) ^ n, a * u, a * v)
}
";
    let program = program("mixed.gml", text);
    for seed in 0..4 {
        check(&program, &mut Random(seed), PARTS, &SIZES);
    }
}

#[test]
fn a_failure_on_a_grid_is_that_of_its_point() {
    let text = "
model broken {
  param a: length = 3mm
  part p = |u: real, v: real| (a * u, a * v, a * ln(v - 0.5 + 0 * u))
}
";
    let program = program("broken.gml", text);
    let instance = program.instantiate(&[3.0]).unwrap();
    let (u, v) = ([0.1, 0.2, 0.3], [0.9, 0.25]);
    let (all_u, all_v) = every_point(&u, &v);
    let mut out = vec![0.0; 18];
    let expected = instance.evaluate(0, Sites::Scattered(&all_u, &all_v), Order::Points, &mut out).unwrap_err();
    assert_eq!(instance.evaluate(0, Sites::Grid(&u, &v), Order::Points, &mut out).unwrap_err(), expected);
    assert!(expected.message.contains("v = 0.25"), "{expected}");
    let w = vec![[1.0; 3]; 6];
    let expected = instance.evaluate(0, Sites::Scattered(&all_u, &all_v), Order::Pullback(&w), &mut [0.0]).unwrap_err();
    assert_eq!(instance.evaluate(0, Sites::Grid(&u, &v), Order::Pullback(&w), &mut [0.0]).unwrap_err(), expected);
}

#[test]
fn an_empty_grid_has_no_points() {
    let program = example("cup/cup");
    let instance = program.instantiate(&program.defaults()).unwrap();
    instance.evaluate(0, Sites::Grid(&[], &[0.5]), Order::Points, &mut []).unwrap();
    instance.evaluate(0, Sites::Grid(&[0.5], &[]), Order::Jacobian, &mut []).unwrap();
    instance.evaluate(0, Sites::Grid(&[], &[]), Order::Pullback(&[]), &mut [0.0; 15]).unwrap();
}
