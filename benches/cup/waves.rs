//! Elementary functions of both u and v: two at once on a grid, one after the other point by point, and C with its
//! library.

use super::by_turns;
use super::c::Peers;
use gml_compiler::program::{Options, Order, Program, Sites, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use std::hint::black_box;

/// The height of a surface, as benches/peers/waves.c has it by this index.
const HEIGHTS: [(&str, &str); 4] = [
    ("sine", "a * sin((k * u * v + b) * 1rad)"),
    ("sine and cosine", "a * sin((k * u * v + b) * 1rad) * (1 + cos((k * u * v + b) * 1rad))"),
    ("power", "a * (u + v + b) ^ n"),
    ("exponential", "a * exp(-k * u * v)"),
];

/// Values of a, b, k and n.
const X: [f64; 4] = [3.0, 0.3, 5.0, 2.5];

const SIDE: usize = 128;

fn surface(height: &str) -> Program {
    let text = format!(
        "model wave {{ param a: length = 3mm; param b: real = 0.3; param k: real = 5; param n: real = 2.5
           part wave = |u, v| (60mm * u, 60mm * v, {height}) }}"
    );
    let script = SourceFile { name: "wave.gml".to_owned(), text };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
}

/// Prints nanoseconds a point.
pub(crate) fn table(c: &Peers) {
    println!("\n{:24}{:>10}{:>10}{:>10}{:>10}{:>10}", "ns a point", "grid", "points", "C", "g / p", "g / C");
    let even: Vec<f64> = (0..SIDE).map(|i| i as f64 / (SIDE - 1) as f64).collect();
    let (all_u, all_v): (Vec<f64>, Vec<f64>) = even.iter().flat_map(|v| even.iter().map(move |u| (*u, *v))).unzip();
    for (kind, (name, height)) in HEIGHTS.into_iter().enumerate() {
        let program = surface(height);
        let [mut grid, mut points, mut theirs] = [(); 3].map(|()| vec![0.0; 3 * SIDE * SIDE]);
        let instance = || program.instantiate(black_box(&X)).unwrap_or_else(|e| panic!("{}", e.message));
        let ours = by_turns(
            || instance().evaluate(0, Sites::Grid(&even, &even), Order::Points, &mut grid).expect("points"),
            || instance().evaluate(0, Sites::Scattered(&all_u, &all_v), Order::Points, &mut points).expect("points"),
        );
        assert_eq!(grid, points, "the same bits");
        let [again, by_c] = by_turns(
            || instance().evaluate(0, Sites::Grid(&even, &even), Order::Points, &mut grid).expect("points"),
            || c.wave(black_box(&X), kind, [&even, &even], &mut theirs),
        );
        let worst = grid.iter().zip(&theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-13, "{name} differs from C by {worst:e}");
        let [on_grid, by_points, by_c] = [ours[0].min(again), ours[1], by_c].map(|us| 1e3 * us / (SIDE * SIDE) as f64);
        let (p, c) = (on_grid / by_points, on_grid / by_c);
        println!("{name:24}{on_grid:10.2}{by_points:10.2}{by_c:10.2}{p:10.2}{c:10.2}");
    }
}
