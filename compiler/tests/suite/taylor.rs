//! Taylor remainders of all examples and all curves and surfaces of the library: |S(x + h d) - S(x) - h J d| falls with
//! the square of h; with an error of any size in J it would fall linearly. (If the function is linear along d, the
//! remainder consists of rounding errors only.)

use crate::common::{Random, example, examples, model, scale};
use gml_compiler::program::{Order, Program, Sites};
use std::path::Path;

const POINTS: usize = 8;

/// Number of parts that are tested of models with many parts, which are much alike.
const PARTS: usize = 8;

/// Number of steps, each half of the one before; the first is a hundredth of the parameters' size.
const STEPS: i32 = 14;

/// Least slope of the remainder over the step on logarithmic scales. It tends to 2 as the step goes to 0; with large
/// steps higher orders change it a little.
const SLOPE: f64 = 1.8;

fn points(program: &Program, x: &[f64], patch: usize, [u, v]: [&[f64]; 2]) -> Option<Vec<f64>> {
    let mut out = vec![0.0; 3 * u.len()];
    let instance = program.instantiate(x).ok()?;
    instance.evaluate(patch, Sites::Scattered(u, v), Order::Points, &mut out).ok().map(|()| out)
}

/// The remainders at all steps at which the model exists, and the size of the coordinates.
fn remainders(
    program: &Program,
    x: &[f64],
    direction: &[f64],
    patch: usize,
    uv: [&[f64]; 2],
) -> (Vec<(f64, f64)>, f64) {
    let instance = program.instantiate(x).unwrap();
    let active = &program.parts()[patch].active;
    let mut jacobian = vec![0.0; 3 * active.len() * POINTS];
    instance.evaluate(patch, Sites::Scattered(uv[0], uv[1]), Order::Jacobian, &mut jacobian).unwrap();
    let at = points(program, x, patch, uv).unwrap();
    let derivative = |i: usize| -> f64 {
        let entries = &jacobian[3 * active.len() * (i / 3)..];
        active.iter().enumerate().map(|(k, p)| entries[3 * k + i % 3] * direction[*p as usize]).sum()
    };
    let size = at.iter().fold(1.0f64, |m, p| m.max(p.abs()));
    let remainder = |h: f64| {
        let moved: Vec<f64> = x.iter().zip(direction).map(|(x, d)| x + h * d).collect();
        let there = points(program, &moved, patch, uv)?;
        let off = |i: usize| (there[i] - at[i] - h * derivative(i)).abs();
        Some((h, (0..at.len()).map(off).fold(0.0, f64::max)))
    };
    ((0..STEPS).filter_map(|k| remainder(0.01 * 0.5f64.powi(k))).collect(), size)
}

/// Tests a number of parts of a model; returns how many have a remainder above rounding errors.
fn check(name: &str, program: &Program, parts: usize, random: &mut Random) -> usize {
    let mut compared = 0;
    let x = random.parameters(program);
    let direction: Vec<f64> =
        (0..x.len()).map(|i| random.between(-1.0, 1.0) * scale(program, i, &x).min(10.0)).collect();
    let step = program.parts().len().div_ceil(parts).max(1);
    for patch in (0..program.parts().len()).step_by(step) {
        let (u, v): (Vec<f64>, Vec<f64>) = (0..POINTS).map(|_| (random.next(), random.between(0.05, 0.95))).unzip();
        let (all, size) = remainders(program, &x, &direction, patch, [&u, &v]);
        // Remainders far above rounding errors, which are some 1e-16 of the coordinates and of their terms.
        let clear: Vec<&(f64, f64)> = all.iter().filter(|(_, r)| *r > 1e-10 * size).collect();
        let Some([(h, r), (k, s)]) = clear.len().checked_sub(4).map(|i| [clear[i], clear[i + 3]]) else {
            continue;
        };
        let slope = (r / s).log2() / (h / k).log2();
        let part = &program.parts()[patch].name;
        assert!(slope > SLOPE, "{name}, {part}: the remainder falls with the power {slope:.2} of the step: {all:?}");
        compared += 1;
    }
    compared
}

#[test]
fn remainders_are_of_second_order() {
    let mut random = Random(23);
    let compared: usize = examples().iter().map(|name| check(name, &example(name), PARTS, &mut random)).sum();
    assert!(compared > 20, "only {compared} parts were not linear");
}

#[test]
fn so_are_those_of_the_library() {
    let program = model("library");
    let compared: usize = (0..3).map(|seed| check("library", &program, usize::MAX, &mut Random(seed))).sum();
    // The remainder of planes, patches and the like is zero.
    assert!(compared > 150, "only {compared} parts were not linear");
}

#[test]
fn so_are_those_of_derivatives_of_any_order() {
    let program = model("orders");
    let compared: usize = (0..6).map(|seed| check("orders", &program, usize::MAX, &mut Random(seed))).sum();
    assert!(compared >= 40, "only {compared} of 48 parts were not linear");
}

/// The model contains everything that the library has: add a new curve or surface of the library to it.
#[test]
fn the_model_of_the_library_is_complete() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |path: &str| std::fs::read_to_string(folder.join(path)).expect("a file of the repository");
    let model = read("tests/models/library.gml");
    let modules = [
        "curve", "surface", "sweep", "patch", "spline", "offset", "path", "polyline", "repeat", "frame", "thread",
        "gear", "edge", "fillet",
    ];
    for module in modules {
        let text = read(&format!("../stdlib/{module}.gml"));
        let functions = text.lines().filter_map(|l| l.strip_prefix("fn ")?.split('(').next());
        for name in functions.filter(|name| !name.starts_with('_') && *name != "unturned") {
            assert!(model.contains(&format!("{name}(")), "{name} of std.{module} is not tested");
        }
    }
}
