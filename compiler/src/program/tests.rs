//! What programs are made of: parts that are alike share their functions, and nothing grows faster than the script.

mod trimmed;

use super::{Compilation, EmitStage, Options, Order, Program, Sites, compile};
use crate::ir::FunctionId;
use crate::jit::Limits;
use crate::source::{NoFiles, SourceFile};
use crate::workers::Workers;
use std::collections::BTreeSet;
use std::fmt::Write as _;

fn program(text: &str) -> Program {
    let script = SourceFile { name: "test.gml".to_owned(), text: text.to_owned() };
    match compile(script, &NoFiles, &Options::default()) {
        Ok(Compilation { program, .. }) => program,
        Err(failed) => panic!("{failed}"),
    }
}

/// Pegs in a row, and around a circle.
fn pegs(count: usize) -> String {
    format!(
        "use std.surface (cylinder)\nuse std.frame (translate)\nuse std.vector (polar)\n
         model pegs {{\n param r: length = 3mm; param h: length = 20mm; param ring: length = 60mm\n
         for i in 0..{count} {{\n
           part row = cylinder(r, h).translate((i * 10mm + 5mm, i * i * 1mm + 3mm, 0mm))\n
           part around = cylinder(r, h).translate(polar(ring, (i + 0.3) * 1turn / {count}, 0mm))\n
         }}\n}}"
    )
}

/// Each part is lowered for itself, with the loop that its function's values need; the prelude has that loop once.
#[test]
fn what_parts_have_in_common_loops_once() {
    let parts: String = (0..8).map(|i| format!("part p{i} = shape(a, {i}mm)\n")).collect();
    let shape = "fn shape(a: real, x: length) {
        let sums = {up: loop(a, 1000, |s, i| s + sin(s * 1rad)), down: loop(a, 1000, |s, i| s - sin(s * 1rad))}
        |u: real, v: real| (x + u * sums.up * 1mm, v * sums.down * 1mm, x)
    }";
    let text = format!("{shape}\nmodel m {{ param a: real = 1\n {parts} }}");
    let script = SourceFile { name: "test.gml".to_owned(), text };
    let options = Options { limits: Limits { steps: 3000, ..Limits::default() }, ..Options::default() };
    let Compilation { program, .. } = compile(script, &NoFiles, &options).unwrap_or_else(|failed| panic!("{failed}"));
    program.instantiate(&[1.0]).unwrap_or_else(|failed| panic!("{failed}"));
}

fn jacobians(program: &Program) -> usize {
    program.functions.parts.iter().map(|p| p.jacobian.function).collect::<BTreeSet<FunctionId>>().len()
}

/// Nodes of all functions that are compiled.
fn nodes(program: &Program) -> usize {
    program.functions.module.functions.iter().map(|f| f.nodes.len()).sum()
}

#[test]
fn parts_of_a_loop_are_compiled_once() {
    let [few, many] = [16, 64].map(|n| program(&pegs(n)));
    assert_eq!(many.parts().len(), 128);
    // A row of pegs, and the signs of sine and cosine.
    assert!(few.functions.bodies.len() <= 6, "{} bodies", few.functions.bodies.len());
    assert_eq!(few.functions.bodies.len(), many.functions.bodies.len());
    assert_eq!(jacobians(&few), jacobians(&many));
    assert!(nodes(&many) < 5 * nodes(&few), "{} nodes, of which a quarter took {}", nodes(&many), nodes(&few));
}

#[test]
fn merged_parts_keep_their_values() {
    let program = program(&pegs(7));
    let (r, h, ring) = (3.5, 21.0, 55.0);
    let instance = program.instantiate(&[r, h, ring]).expect("it exists");
    let (u, v) = (0.15f64, 0.6);
    let (sin, cos) = (u * std::f64::consts::TAU).sin_cos();
    for (k, part) in program.parts().iter().enumerate() {
        let i = (k / 2) as f64;
        let turn = (i + 0.3) * std::f64::consts::TAU / 7.0;
        let row = part.group == "row";
        let at = if row { [i * 10.0 + 5.0, i * i + 3.0] } else { [ring * turn.cos(), ring * turn.sin()] };
        let expected = [at[0] + r * cos, at[1] + r * sin, h * v];
        let mut point = [0.0; 3];
        instance.evaluate(k, Sites::Scattered(&[u], &[v]), Order::Points, &mut point).expect("it is finite");
        assert!(near(&point, &expected), "{}: {point:?} is not {expected:?}", part.name);

        let by = [[cos, sin, 0.0], [0.0, 0.0, v], [turn.cos(), turn.sin(), 0.0]];
        let active: &[u32] = if row { &[0, 1] } else { &[0, 1, 2] };
        assert_eq!(part.active, active);
        let mut jacobian = vec![0.0; 3 * active.len()];
        instance.evaluate(k, Sites::Scattered(&[u], &[v]), Order::Jacobian, &mut jacobian).expect("it is finite");
        assert!(near(&jacobian, &by[..active.len()].concat()), "{}: {jacobian:?}", part.name);

        let (w, mut gradient) = ([0.3, -0.7, 1.1], [0.0; 3]);
        instance.evaluate(k, Sites::Scattered(&[u], &[v]), Order::Pullback(&[w]), &mut gradient).expect("it is finite");
        let transposed = [0, 1, 2].map(|p| {
            let part = active.contains(&(p as u32));
            if part { (0..3).map(|c| w[c] * by[p][c]).sum() } else { 0.0 }
        });
        assert!(near(&gradient, &transposed), "{}: {gradient:?} is not {transposed:?}", part.name);

        let mut partials = [0.0; 9];
        instance.evaluate(k, Sites::Scattered(&[u], &[v]), Order::Partials, &mut partials).expect("it is finite");
        let around = std::f64::consts::TAU * r;
        assert!(near(&partials[3..6], &[-around * sin, around * cos, 0.0]), "{}: {partials:?}", part.name);
    }
}

/// Equal to rounding errors of a few operations on numbers below 100.
fn near(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
}

/// Parts that all differ, each with parameters of its own.
fn sections(count: usize) -> String {
    let mut text = String::from("use std.surface (revolve)\nuse std.frame (translate)\nmodel tower {\n");
    text.push_str("param x: length = 0mm\nparam y: length = 0mm\n");
    for k in 0..count {
        let (a, b) = (1 + k % 7, 2 + k % 11);
        let _ = writeln!(
            text,
            "param r{k}: length = 10mm\nparam s{k}: real = 0.5\n\
             require r{k} > 1mm, \"too thin\"\n\
             part p{k} = translate(revolve(|t| (r{k} * (1 + s{k} * sin(t ^ {a} * {b}.5 * 1turn)), {k} * 9mm + t * {b}mm)), (x, y, 0mm))"
        );
    }
    text.push('}');
    text
}

#[test]
fn functions_grow_with_the_script() {
    let [small, large] = [12, 48].map(|n| program(&sections(n)));
    // Twice as much for each part would be quadratic growth: if every part took every parameter, for instance.
    let each = |program: &Program, n: usize| nodes(program) as f64 / n as f64;
    let (small, large) = (each(&small, 12), each(&large, 48));
    assert!(large < 1.3 * small, "{small} nodes a part became {large}");
}

#[test]
fn derivatives_on_demand_are_made_once() {
    let program = program(&pegs(3));
    program.prepare().expect("they are small");
    let instance = program.instantiate(&program.defaults()).expect("it exists");
    let run = || {
        let mut out = [0.0; 18];
        instance.evaluate(0, Sites::Scattered(&[0.2], &[0.4]), Order::SecondPartials, &mut out).expect("it is finite");
        out
    };
    let expected = run();
    std::thread::scope(|scope| (0..4).for_each(|_| _ = scope.spawn(|| assert_eq!(run(), expected))));
}

/// A branch that a recursive function decides: both ways to its Jacobian rewrite that function, and both stay sound.
#[test]
fn a_recursive_function_in_a_condition() {
    let program = program(
        "fn halve(x: real) -> real = if x < 0.4 { abs({ let y = x; y }) } else { 0.3 + 0.5 * halve(0.5 * x) }
         model m { param a: real in -3..3 = 0.75
           part p = |u, v| (if not (v + v < halve(v)) { (1mm, 2mm, 0mm) * tanh(a) } else { (2mm, 2mm, 2mm) }) }",
    );
    let instance = program.instantiate(&[0.5]).unwrap();
    let slope = |v: f64| {
        let mut jacobian = [0.0; 3];
        instance.evaluate(0, Sites::Scattered(&[0.5], &[v]), Order::Jacobian, &mut jacobian).unwrap();
        jacobian
    };
    // halve(0.9) = 0.3 + 0.5 * halve(0.45) = 0.5625 < 1.8; halve(-0.5) = 0.5 > -1.
    let expected = 1.0 - 0.5f64.tanh().powi(2);
    assert!(slope(0.9).iter().zip([expected, 2.0 * expected, 0.0]).all(|(a, b)| (a - b).abs() < 1e-15));
    assert_eq!(slope(-0.5), [0.0; 3]);
}

/// Whoever does the work, and in whatever order, the functions and their machine code are the same.
#[test]
fn workers_change_nothing() {
    let mut text = String::from("model many {\n param r: length = 3mm\n");
    for k in 1..40 {
        let sides = |n: i32| (0..n).map(|i| format!("r * cos(u * {}turn)", i + 1)).collect::<Vec<_>>().join(" + ");
        let _ = writeln!(text, " part p{k} = |u, v| (({}) * v, r * sin(u * {k}turn), v * {k}mm)", sides(1 + k % 7));
    }
    text.push('}');
    let made = |workers| {
        let script = SourceFile { name: "many.gml".to_owned(), text: text.clone() };
        let options = Options { workers, ..Options::default() };
        let program = compile(script, &NoFiles, &options).unwrap_or_else(|e| panic!("{e}")).program;
        let mut out = Vec::new();
        let instance = program.instantiate(&[2.5]).expect("it exists");
        for patch in 0..program.parts().len() {
            let mut jacobian = [0.0; 3];
            instance
                .evaluate(patch, Sites::Scattered(&[0.2], &[0.7]), Order::Jacobian, &mut jacobian)
                .expect("it is finite");
            out.extend(jacobian);
        }
        (program.emit(EmitStage::Ir), out)
    };
    let (alone, values) = made(Workers::ONE);
    for count in [2, 5] {
        let (text, others) = made(Workers::many(count));
        assert!(text == alone, "the functions differ");
        assert_eq!(others, values);
    }
}

#[test]
fn tolerances_follow_the_parameters() {
    let program = program(
        "use std.surface (cylinder, disc)\nmodel can {\n param r: length = 20mm\n let fine = r / 100\n
         part side tolerance fine + 0.1mm = cylinder(r, 50mm)\n part top = disc(r)\n
         for i in 0..2 { part rib tolerance 0.5mm * (i + 1) = cylinder(r, 1mm) }\n
         part odd tolerance r - 30mm = disc(r)\n}",
    );
    assert_eq!(program.tolerances(&[40.0]), Ok(vec![Some(0.5), None, Some(0.5), Some(1.0), Some(10.0)]));
    let error = program.tolerances(&[20.0]).unwrap_err();
    assert_eq!(error.message, "test.gml:11:29: a tolerance must not be negative, but this is -10 mm (in part odd)");
}

const MEASURED: &str = "use std.surface (cylinder, disc)
fn hypotenuse(a: length, b: length) = sqrt(a ^ 2 + b ^ 2)
model can {
  input ribs: int = 3
  param r: length = 20mm
  param h: length = 50mm
  param turned: angle = 30deg
  let d = 2 * r
  part side = cylinder(r, h)
  part top = disc(r)
  /// Across.
  measure diameter tolerance +0.2/-0.1mm = d
  measure diagonal tolerance h / 100 = hypotenuse(diameter, h)
  measure slope = atan2(h, r) + turned
  measure volume = pi * r ^ 2 * h
  measure ratio = if h > r { h / r } else { r / h }
  for i in 0..ribs { measure rib = i * h / ribs }
  measure count = ribs
  measure root = sqrt(r - 20mm) * sqrt(1mm)
}";

/// The derivatives against finite differences, the values against formulas written here.
#[test]
fn measures_have_values_derivatives_and_limits() {
    let program = program(MEASURED);
    let declared: Vec<(&str, &str)> = program.measures().iter().map(|m| (m.name.as_str(), m.unit.as_str())).collect();
    let expected = [
        ("diameter", "mm"),
        ("diagonal", "mm"),
        ("slope", "rad"),
        ("volume", "mm^3"),
        ("ratio", ""),
        ("rib[0]", "mm"),
        ("rib[1]", "mm"),
        ("rib[2]", "mm"),
        ("count", ""),
        ("root", "mm"),
    ];
    assert_eq!(declared, expected);
    assert_eq!(program.measures()[0].doc, "Across.");
    let (r, h, turned) = (21.0f64, 47.0f64, 0.4f64);
    let at = |k: usize, x: &[f64]| program.measure(k, x, &[]).expect("it can be computed");
    let values: Vec<f64> = (0..expected.len()).map(|k| at(k, &[r, h, turned])).collect();
    let volume = std::f64::consts::PI * r * r * h;
    let formulas = [
        2.0 * r,
        (4.0 * r * r + h * h).sqrt(),
        (r / h).atan2(1.0).mul_add(-1.0, std::f64::consts::FRAC_PI_2) + turned,
        volume,
        h / r,
        0.0,
        h / 3.0,
        2.0 * h / 3.0,
        3.0,
        1.0,
    ];
    for ((value, formula), (name, _)) in values.iter().zip(formulas).zip(expected) {
        assert!((value - formula).abs() < 1e-12 * formula.abs().max(1.0), "{name}: {value}, not {formula}");
    }
    for x in [[21.0, 47.0, 0.4], [60.0, 33.0, -1.0]] {
        for (k, (name, _)) in expected.iter().enumerate() {
            let (value, gradient) = (at(k, &x), program.measure_gradient(k, &x, &[]).expect("it has one"));
            for (i, slope) in gradient.iter().enumerate() {
                let step = 1e-5 * x[i].abs();
                let [above, below] = [step, -step].map(|by| {
                    let mut moved = x;
                    moved[i] += by;
                    at(k, &moved)
                });
                let difference = (above - below) / (2.0 * step);
                let scale = difference.abs().max(1e-3 * value.abs() / x[i].abs()).max(1e-6);
                assert!((slope - difference).abs() < 1e-7 * scale, "{name} by {i}: {slope}, not {difference}");
            }
        }
    }
    assert_eq!(program.measure_gradient(0, &[r, h, turned], &[]), Ok(vec![2.0, 0.0, 0.0]));
    let limits: Vec<_> = (0..3).map(|k| program.measure_limits(k, &[r, h, turned])).collect();
    assert_eq!(limits, [Ok(Some([-0.1, 0.2])), Ok(Some([-0.47, 0.47])), Ok(None)]);
}

/// One measure that has no value, or no derivative, takes no other one with it.
#[test]
fn measures_that_cannot_be_computed_say_why() {
    let program = program(MEASURED);
    let error = |k: usize, x: &[f64]| program.measure(k, x, &[]).unwrap_err().message;
    let last = program.measures().len() - 1;
    assert_eq!(
        error(last, &[19.0, 50.0, 0.0]),
        "test.gml:19:3: the measure 'root' cannot be computed: its value is not finite (where r = 19mm, h = 50mm, turned = 0deg)"
    );
    // The value may exist where the derivative does not.
    assert_eq!(program.measure(last, &[20.0, 50.0, 0.0], &[]), Ok(0.0));
    let none = program.measure_gradient(last, &[20.0, 50.0, 0.0], &[]).unwrap_err().message;
    assert!(none.contains("derivative"), "{none}");
    assert!(program.measure(0, &[19.0, 50.0, 0.0], &[]).is_ok());
    let error = program.measure_limits(1, &[20.0, -1.0, 0.0]).unwrap_err();
    assert!(error.message.contains("its tolerance leaves nothing"), "{}", error.message);
}
