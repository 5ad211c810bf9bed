//! The cup of the test data (66,191 points, cup/cup_scan.ply) from random starts:
//!
//! - near: the pose is 20 degrees and 20 mm off, every shape parameter 20 % off, each in a random direction;
//! - nothing: the scan is turned at random and lies anywhere, and the shape parameters begin anywhere in their bounds;
//! - defaults: as `nothing`, but beginning with the script's own defaults, as a user does who says nothing.
//!
//! Where GMLC_PEER_PYTHON names a Python with numpy, scipy and open3d, benches/peers/fit_scipy.py fits from the same
//! near starts.
//!
//! A fit counts where its objective is that of the best one known (to 0.2 %) and the shape parameters are the same.

use crate::matrix::{about, euler, multiply, turn, unit};
use crate::{median, program, seconds};
use cpu_time::ProcessTime;
use gml_compiler::program::{Program, Quantity};
use gml_runtime::fit::{FitOptions, FitResult, fit};
use gml_runtime::progress::Silent;
use gml_runtime::scan::{self, Scan, Unit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

/// The cup's pose: x, y, z, alpha, beta, gamma.
const POSE: usize = 6;

/// Prints the tables: of the kinds of starts that are wanted, or of all.
pub(crate) fn run(data: &str, starts: usize, first: usize, wanted: &[String]) {
    let program = program("examples/cup/cup.gml", BTreeMap::new());
    let path = format!("{data}/cup/cup_scan.ply");
    let scan = scan::read(Path::new(&path), &Unit::Mm.into(), &Silent).unwrap_or_else(|e| panic!("{e}"));
    let best = fit(&program, &scan, &FitOptions::default(), &Silent).unwrap_or_else(|e| panic!("{e}"));
    println!("best known: objective {:.6}, sigma {:.3} mm, {:.2} s", best.objective, best.sigma, seconds(&best));
    for kind in [Kind::Near, Kind::Nothing, Kind::Defaults] {
        if !wanted.is_empty() && !wanted.contains(&kind.name()) {
            continue;
        }
        let ours = table(&program, &scan, &best, kind, first..first + starts);
        if kind == Kind::Near {
            peer(&program, &path, &best, first..first + starts, ours);
        }
    }
}

/// The same near starts in Python, if there is one that can; `ours` is our median time.
fn peer(program: &Program, scan: &str, best: &FitResult, starts: std::ops::Range<usize>, ours: f64) {
    let Ok(python) = std::env::var("GMLC_PEER_PYTHON") else { return };
    let start = |start: usize| {
        let options = near(program, best, &mut ChaCha8Rng::seed_from_u64(start as u64));
        let values = program.parameters().iter().map(|p| options.start[&p.name].to_string());
        values.collect::<Vec<_>>().join(" ")
    };
    let lines = starts.map(start).collect::<Vec<_>>().join("\n");
    let script = format!("{}/benches/peers/fit_scipy.py", env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new(&python);
    command.arg(script).arg(scan).arg(best.sigma.to_string()).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().unwrap_or_else(|e| panic!("{python}: {e}"));
    let mut input = child.stdin.take().expect("a pipe");
    input.write_all(lines.as_bytes()).unwrap_or_else(|e| panic!("{python}: {e}"));
    drop(input);
    let output = child.wait_with_output().unwrap_or_else(|e| panic!("{python}: {e}"));
    let (mut times, mut found) = (Vec::new(), 0);
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        let numbers: Vec<f64> = line.split_whitespace().filter_map(|w| w.parse().ok()).collect();
        let same = |i: usize| {
            let (a, b) = (numbers[i + 2], &best.parameters[i]);
            // Open3D's distances are to facets, and take no heed of normals.
            (a - b.value).abs() < if b.quantity == Quantity::Length { 0.5 } else { 0.05 }
        };
        times.push(numbers[0]);
        found += usize::from((POSE..best.parameters.len()).all(same));
    }
    let (count, theirs) = (times.len(), median(&mut times));
    println!("SciPy and Open3D: {found} of {count}   median {theirs:.2} s, {:.1} times ours", theirs / ours);
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Near,
    Nothing,
    Defaults,
}

impl Kind {
    fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }
}

fn table(program: &Program, scan: &Scan, best: &FitResult, kind: Kind, starts: std::ops::Range<usize>) -> f64 {
    let (mut found, mut wall, mut busy, mut count) = (0, Vec::new(), Vec::new(), 0);
    let mut stages: BTreeMap<String, f64> = BTreeMap::new();
    for start in starts {
        let mut random = ChaCha8Rng::seed_from_u64(start as u64);
        let (scan, options) = match kind {
            Kind::Near => (scan.clone(), near(program, best, &mut random)),
            _ => (turn(scan, &mut random), anywhere(program, kind, &mut random)),
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
    let middle = median(&mut wall);
    println!(
        "{:9} {found:3} of {count:3}   median {middle:.2} s   processor {:.2} s   most {:.2} s",
        kind.name(),
        median(&mut busy),
        wall.iter().fold(0.0f64, |a, b| a.max(*b)),
    );
    middle
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
