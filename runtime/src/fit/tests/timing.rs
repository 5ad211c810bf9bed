//! How long one objective takes:
//! `GMLC_TEST_DATA=... cargo test --release -p gml-runtime objective_takes -- --ignored --nocapture`.

use super::cup::load;
use super::shapes::beginning_at;
use crate::fit::monitor::Monitor;
use crate::fit::problem::Problem;
use crate::fit::problem::isometry::Isometry;
use crate::fit::problem::level::Level;
use crate::fit::problem::loss::Loss;
use crate::fit::problem::objective::{Objective, Order, foot_cache};
use crate::fit::tuning::CHORD;
use crate::fit::{FitOptions, fit};
use crate::progress::Silent;
use gml_compiler::program::{Options, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use std::time::Instant;

#[test]
#[ignore = "prints times and checks nothing"]
fn how_long_one_objective_takes() {
    let Ok(data) = std::env::var("GMLC_TEST_DATA") else {
        println!("skipped: GMLC_TEST_DATA is not set");
        return;
    };
    let name = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/cup/cup.gml").to_owned();
    let text = std::fs::read_to_string(&name).unwrap();
    let program = compile(SourceFile { name, text }, &NoFiles, &Options::default()).unwrap().program;
    let scan = load(&format!("{data}/cup/cup_scan.ply"));
    let best = fit(&program, &scan, &FitOptions::default(), &Silent).unwrap();
    let x: Vec<f64> = best.parameters.iter().map(|p| p.value).collect();
    let (options, monitor) = (FitOptions { no_pose: true, ..beginning_at(&program, &x) }, Monitor::default());
    let problem = Problem::new(&program, &scan, &options, &monitor).unwrap();
    let level = problem.start_level().unwrap();
    let at = level.space.estimate(&x, Isometry::IDENTITY);
    let level = Level::new(&problem, level.space, &at, CHORD).unwrap();
    for sigma in [best.sigma, 2.0, 10.0] {
        let cache = Some(foot_cache(&problem.points, sigma));
        let objective = Objective { cache, ..level.objective(&problem.points, Loss::welsch(sigma)) };
        for order in [Order::Value, Order::Gradient, Order::Normal] {
            let seconds = || {
                let clock = Instant::now();
                objective.evaluate(&at, order).unwrap();
                clock.elapsed().as_secs_f64()
            };
            let least = (0..20).map(|_| seconds()).fold(f64::INFINITY, f64::min);
            println!("{order:?}, sigma {sigma:.2} mm: {:.1} ms", 1e3 * least);
        }
    }
}
