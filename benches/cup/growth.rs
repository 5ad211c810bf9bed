//! How M and its gradient grow at scattered points: with the points, and with the parameters.

use gml_compiler::program::{Instance, Options, Order, Program, Sites, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use std::fmt::Write as _;
use std::time::Instant;

/// A patch of control points, all coordinates of which are parameters.
fn patch(function: &str, rows: usize, columns: usize) -> Program {
    let mut text = format!("use std.patch ({function})\nmodel patch {{\n");
    let name = |i: usize, j: usize, c: char| format!("p{i}_{j}{c}");
    for (i, j) in (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j))) {
        for (c, value) in [('x', j as f64), ('y', i as f64), ('z', ((i * 7 + j * 3) % 5) as f64)] {
            _ = writeln!(text, "  param {}: length = {value}mm", name(i, j, c));
        }
    }
    let point = |i, j| format!("({}, {}, {})", name(i, j, 'x'), name(i, j, 'y'), name(i, j, 'z'));
    let row = |i| format!("[{}]", (0..columns).map(|j| point(i, j)).collect::<Vec<_>>().join(", "));
    let all = (0..rows).map(row).collect::<Vec<_>>().join(",\n    ");
    _ = writeln!(text, "  part surface = {function}([{all}])\n}}");
    let script = SourceFile { name: "patch.gml".to_owned(), text };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
}

/// Least microseconds of some runs.
fn least(mut run: impl FnMut()) -> f64 {
    let begin = Instant::now();
    let mut least = f64::INFINITY;
    for turn in 0.. {
        let start = Instant::now();
        run();
        least = least.min(start.elapsed().as_secs_f64() * 1e6);
        if turn >= 2 && begin.elapsed().as_secs_f64() > 0.5 {
            break;
        }
    }
    least
}

fn row(name: &str, program: &Program, side: usize) {
    let even: Vec<f64> = (0..side).map(|i| i as f64 / (side - 1) as f64).collect();
    let (u, v) = Sites::Grid(&even, &even).expanded();
    let (sites, n) = (Sites::Scattered(&u, &v), side * side);
    let (mut out, w) = (vec![0.0; 3 * n], vec![[0.3, -0.7, 0.2]; n]);
    let x = program.defaults();
    let instance = || -> Instance<'_> { program.instantiate(&x).unwrap_or_else(|e| panic!("{}", e.message)) };
    let m = least(|| instance().evaluate(0, sites, Order::Points, &mut out).expect("points"));
    let mut gradient = vec![0.0; x.len()];
    let g = least(|| instance().evaluate(0, sites, Order::Pullback(&w), &mut gradient).expect("a gradient"));
    println!("{name:24}{:10}{n:10}{:10.2}{:10.2}{:10.2}", x.len(), 1e3 * m / n as f64, 1e3 * g / n as f64, g / m);
}

/// Prints nanoseconds a point.
pub(crate) fn table(cup: &Program) {
    println!("\n{:24}{:>10}{:>10}{:>10}{:>10}{:>10}", "ns a point", "params", "points", "M", "gradient", "ratio");
    for side in [100, 320, 1000] {
        row("cup, outside", cup, side);
    }
    for (rows, columns) in [(4, 4), (9, 9), (18, 19)] {
        row("Bezier patch", &patch("bezier_patch", rows, columns), 100);
    }
    for (rows, columns) in [(6, 6), (18, 19)] {
        row("B-spline patch", &patch("bspline_patch", rows, columns), 100);
    }
}
