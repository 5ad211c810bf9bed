//! How often and how fast the cup is found: `GMLC_TEST_DATA=... cargo bench --bench fit -- [STARTS]`.
//!
//! Two tables of success over random starts, on a scan of 66,191 points (cup/cup_scan.ply of the test data):
//!
//! - near: the pose is 20 degrees and 20 mm off, every shape parameter 20 % off, each in a random direction;
//! - nothing: the scan is turned at random and lies anywhere, and the shape parameters begin anywhere in their bounds;
//! - defaults: as `nothing`, but beginning with the script's own defaults, as a user does who says nothing.
//!
//! A fit counts where its objective is that of the best one known (to 0.2 %) and the shape parameters are the same. Then the
//! time of one objective with its gradient over all points.

use cpu_time::ProcessTime;
use gml_compiler::program::{Options, Program, Quantity, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use gml_runtime::fit::{FitOptions, FitResult, ObjectiveFunction, fit};
use gml_runtime::progress::Silent;
use gml_runtime::scan::{self, ReadOptions, Scan};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// The cup's pose: x, y, z, alpha, beta, gamma.
const POSE: usize = 6;

fn main() {
    let Ok(data) = std::env::var("GMLC_TEST_DATA") else {
        println!("skipped: GMLC_TEST_DATA is not set");
        return;
    };
    let numbers: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let starts = numbers.first().copied().unwrap_or(20);
    let first = numbers.get(1).copied().unwrap_or(0);
    let program = cup();
    let path = format!("{data}/cup/cup_scan.ply");
    let scan = scan::read(Path::new(&path), &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let best = fit(&program, &scan, &FitOptions::default(), &Silent).unwrap_or_else(|e| panic!("{e}"));
    println!("best known: objective {:.6}, sigma {:.3} mm, {:.2} s", best.objective, best.sigma, seconds(&best));
    evaluation(&program, &scan, &best);
    for kind in [Kind::Near, Kind::Nothing, Kind::Defaults] {
        table(&program, &scan, &best, kind, first..first + starts);
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Near,
    Nothing,
    Defaults,
}

fn cup() -> Program {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/cup/cup.gml");
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let script = SourceFile { name: path.into(), text };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
}

fn seconds(result: &FitResult) -> f64 {
    result.seconds.values().sum()
}

/// The least time of some evaluations of the objective and its gradient.
fn evaluation(program: &Program, scan: &Scan, best: &FitResult) {
    let x: Vec<f64> = best.parameters.iter().map(|p| p.value).collect();
    for sigma in [best.sigma, 2.0, 10.0] {
        let function = ObjectiveFunction::new(program, scan, &x, sigma).unwrap_or_else(|e| panic!("{e}"));
        let mut least = f64::INFINITY;
        let cpu = ProcessTime::now();
        for _ in 0..20 {
            let clock = Instant::now();
            let _ = std::hint::black_box(function.value_and_gradient(&x));
            least = least.min(clock.elapsed().as_secs_f64());
        }
        let cpu = cpu.elapsed().as_secs_f64() / 20.0;
        println!(
            "objective and gradient, sigma {sigma:.2} mm: {:.1} ms at the least, {:.1} ms of processor time",
            least * 1e3,
            cpu * 1e3
        );
    }
}

fn table(program: &Program, scan: &Scan, best: &FitResult, kind: Kind, starts: std::ops::Range<usize>) {
    let (mut found, mut wall, mut busy, mut count) = (0, Vec::new(), Vec::new(), 0);
    let mut stages: BTreeMap<String, f64> = BTreeMap::new();
    for start in starts {
        let mut random = ChaCha8Rng::seed_from_u64(start as u64);
        let (scan, options) = match kind {
            Kind::Near => (scan.clone(), near(program, best, &mut random)),
            _ => (turned(scan, &mut random), anywhere(program, kind, &mut random)),
        };
        let cpu = ProcessTime::now();
        let result = fit(program, &scan, &options, &Silent).unwrap_or_else(|e| panic!("{e}"));
        busy.push(cpu.elapsed().as_secs_f64());
        wall.push(seconds(&result));
        count += 1;
        for (stage, t) in &result.seconds {
            *stages.entry(stage.clone()).or_default() += t;
        }
        let off = differences(&result, best);
        if off.is_empty() && result.objective < 1.002 * best.objective {
            found += 1;
        } else {
            println!(
                "  {kind:?} {start}: objective {:.4}, inliers {:.3}, {}",
                result.objective,
                result.inliers,
                off.join(", ")
            );
        }
    }
    let shares: Vec<String> = stages.iter().map(|(stage, t)| format!("{stage} {:.3}", t / count as f64)).collect();
    println!("          seconds: {}", shares.join(", "));
    println!(
        "{:9} {found:3} of {count:3}   median {:.2} s   processor {:.2} s   most {:.2} s",
        format!("{kind:?}").to_lowercase(),
        median(&mut wall),
        median(&mut busy),
        wall.iter().fold(0.0f64, |a, b| a.max(*b)),
    );
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The shape parameters that differ from the best fit's.
fn differences(result: &FitResult, best: &FitResult) -> Vec<String> {
    let pairs = result.parameters.iter().zip(&best.parameters).skip(POSE);
    pairs
        .filter(|(a, b)| (a.value - b.value).abs() > if b.quantity == Quantity::Length { 0.1 } else { 0.02 })
        .map(|(a, b)| format!("{} {:.3} for {:.3}", a.name, a.value, b.value))
        .collect()
}

fn near(program: &Program, best: &FitResult, random: &mut ChaCha8Rng) -> FitOptions {
    let value = |i: usize| best.parameters[i].value;
    let mut options = FitOptions::default();
    let mut set = |i: usize, x: f64| {
        let p = &program.parameters()[i];
        options.start.insert(p.name.clone(), x.clamp(p.lower, p.upper));
    };
    let shift = unit(random);
    for i in 0..3 {
        set(i, value(i) + 20.0 * shift[i]);
    }
    let angles = multiply(&about(unit(random), 20f64.to_radians()), &euler(value(3), value(4), value(5)));
    set(3, angles[2][1].atan2(angles[2][2]));
    set(4, (-angles[2][0]).asin());
    set(5, angles[1][0].atan2(angles[0][0]));
    for i in POSE..best.parameters.len() {
        set(i, value(i) * if random.random() { 1.2 } else { 0.8 });
    }
    options
}

fn anywhere(program: &Program, kind: Kind, random: &mut ChaCha8Rng) -> FitOptions {
    let mut options = FitOptions::default();
    if kind == Kind::Nothing {
        for p in &program.parameters()[POSE..] {
            options.start.insert(p.name.clone(), random.random_range(p.lower..p.upper));
        }
    }
    options
}

type Matrix = [[f64; 3]; 3];

/// The scan turned evenly at random and shifted.
fn turned(scan: &Scan, random: &mut ChaCha8Rng) -> Scan {
    let mut scan = scan.clone();
    // Half of a turn's angles are not as likely as others: the density goes with the squared sine of half the angle.
    let angle = loop {
        let angle: f64 = random.random_range(0.0..std::f64::consts::TAU);
        if random.random::<f64>() < (angle / 2.0).sin().powi(2) {
            break angle;
        }
    };
    let turn = about(unit(random), angle);
    let shift = [0; 3].map(|_| random.random_range(-300.0..300.0));
    for p in &mut scan.mesh.positions {
        let q = apply(&turn, *p);
        *p = [q[0] + shift[0], q[1] + shift[1], q[2] + shift[2]];
    }
    for n in &mut scan.mesh.normals {
        *n = apply(&turn, *n);
    }
    scan
}

fn unit(random: &mut ChaCha8Rng) -> [f64; 3] {
    loop {
        let v = [0; 3].map(|_| random.random_range(-1.0..1.0));
        let length = v.iter().map(|c: &f64| c * c).sum::<f64>().sqrt();
        if length > 0.1 && length < 1.0 {
            return v.map(|c| c / length);
        }
    }
}

/// The rotation about a unit axis (Rodrigues).
fn about([x, y, z]: [f64; 3], angle: f64) -> Matrix {
    let (s, c) = angle.sin_cos();
    let t = 1.0 - c;
    [
        [c + t * x * x, t * x * y - s * z, t * x * z + s * y],
        [t * x * y + s * z, c + t * y * y, t * y * z - s * x],
        [t * x * z - s * y, t * y * z + s * x, c + t * z * z],
    ]
}

/// About x, then y, then z.
fn euler(alpha: f64, beta: f64, gamma: f64) -> Matrix {
    let turn = |axis, angle| about(axis, angle);
    multiply(&turn([0.0, 0.0, 1.0], gamma), &multiply(&turn([0.0, 1.0, 0.0], beta), &turn([1.0, 0.0, 0.0], alpha)))
}

fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn apply(m: &Matrix, p: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| (0..3).map(|k| m[i][k] * p[k]).sum())
}
